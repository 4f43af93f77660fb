// Prepared scene: everything that the frames of a scene are made from.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "assets/loaded_scene.h"
#include "assets/memory_estimate.h"
#include "base/box.h"
#include "base/input_recorder.h"
#include "base/result.h"
#include "kernels/engine.h"
#include "leg/leg.h"
#include "leg/weighted_surface.h"
#include "morph/timeline.h"
#include "render/render.h"
#include "scene/scene.h"

namespace polymorph {

struct ActorPoses;  // sequence/prepare/actor_poses.h

/// Properties of an actor that follow from the scene and its models, before its objects are made.
struct ActorOutline {
  std::string name;
  Timeline timeline;
  LegSettings settings;                          ///< settings of its objects and legs
  std::vector<std::string> label_names;          ///< labels of all its objects, without repetition
  Box box;                                       ///< box around all its objects
  std::shared_ptr<const MeshSequence> sequence;  ///< meshes that it plays; null: it morphs
  std::size_t first_object = 0;  ///< index of its first object in chain_objects(scene)
  /// The actor whose objects and legs it shares (assets/alike_actors.h): its own index, unless an
  /// earlier actor is alike.
  std::size_t shared_actor = 0;
  Vec3 offset;  ///< offset from the objects and legs of that actor to this actor in the scene
};

/// The objects of an actor.
using ObjectList = std::vector<std::shared_ptr<const PreparedObject>>;

/// An actor with its objects and legs.
struct PreparedActor : ActorOutline {
  /// The chain's objects, then the objects of balls in flight (make_flight_object()), one per leg
  /// that is left before its end. If the actor plays a mesh sequence, its object has only the
  /// outermost points of all meshes.
  ObjectList objects;
  /// The legs, with each mesh sequence in its reference pose (MeshSequence::reference). leg_at()
  /// (sequence/prepare/actor_poses.h) makes the legs of a frame.
  std::vector<std::shared_ptr<const Leg>> legs;
  /// Space of all legs if the actor mixes three objects or more; else null.
  std::shared_ptr<const ShapeSpace> space;
  std::shared_ptr<ActorPoses> poses;  ///< poses of mesh sequences in a morph; null: there are none
};

/// Hashes of a mesh of a sequence.
struct MeshHashes {
  std::string content;  ///< hash of the mesh and its velocities
  std::string fit;      ///< hash of all meshes from which its balls in a morph are derived
};

/// Components of frame_hash() (sequence/prepare/film_settings.h).
struct SequenceHashes {
  std::string scene;               ///< content_hash() (assets/content_hash.h)
  std::string inputs;              ///< inputs_hash() (assets/content_hash.h)
  std::optional<Framing> framing;  ///< framing of a moving camera, if it depends on the models only
  std::string camera_poses;  ///< hash of the camera poses that decide a moving camera's framing
  /// Hash of the box of all objects, of the sequences' transforms and of a static camera; empty
  /// without mesh sequences.
  std::string placement;
  std::string aovs;  ///< image.aovs of the scene, even if a run leaves layers out
  /// [actor][object][mesh]; empty if no actor has a mesh sequence. The list of an object that is no
  /// mesh sequence is empty.
  std::vector<std::vector<std::vector<MeshHashes>>> meshes;
};

/// Fitting of balls. kMake: fits that are not in the cache are made. kCached: objects without a
/// cached fit get unfitted balls instead.
enum class Fits : std::uint8_t { kMake, kCached };

/// Sharing of objects and legs. kAlike: alike actors share them (assets/alike_actors.h). kNone:
/// each actor has its own.
enum class Sharing : std::uint8_t { kAlike, kNone };

/// A scene that is ready to render.
struct PreparedScene {
  Scene scene;
  SequenceHashes hashes;
  int frame_count = 0;  ///< frame_count() (morph/timeline.h)
  std::vector<PreparedActor> actors;
  Box box;                                   ///< box around all objects
  Camera camera;                             ///< camera of the first frame
  std::optional<Framing> framing;            ///< set if the camera moves
  std::shared_ptr<const Image> environment;  ///< null: none
  std::vector<std::string> warnings;         ///< one text per warning, to be logged
  MemoryEstimate memory;
  std::vector<ReadFile> inputs;  ///< files that were read to prepare the scene
  std::string provenance;        ///< encode_provenance(); empty: none
};

}  // namespace polymorph
