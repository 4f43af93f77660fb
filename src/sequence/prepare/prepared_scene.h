// Prepared scene: everything that the frames of a scene are made from.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/box.h"
#include "base/input_recorder.h"
#include "base/result.h"
#include "kernels/engine.h"
#include "leg/leg.h"
#include "leg/weighted_surface.h"
#include "morph/timeline.h"
#include "render/render.h"
#include "scene/scene.h"
#include "sequence/prepare/loaded_scene.h"
#include "sequence/prepare/memory_estimate.h"

namespace polymorph {

struct ActorPoses;  // sequence/prepare/actor_poses.h

/// An actor as its models alone decide it.
struct ActorOutline {
  std::string name;
  Timeline timeline;
  LegSettings settings;                          ///< settings of its objects and legs
  std::vector<std::string> label_names;          ///< labels of all its objects, each name once
  Box box;                                       ///< box around all its objects
  std::shared_ptr<const MeshSequence> sequence;  ///< meshes that it plays; null: it morphs
};

/// The objects of an actor.
using ObjectList = std::vector<std::shared_ptr<const PreparedObject>>;

/// One chain, in its place in the world.
struct PreparedActor : ActorOutline {
  /// Offset from its objects and legs to its own place: zero, but where it shares those of another
  /// actor (sequence/prepare/alike_actors.h).
  Vec3 offset;
  /// The chain's, then balls in flight, with which legs were left. The object of a mesh sequence
  /// has its outermost points alone.
  ObjectList objects;
  /// The legs; where mesh sequences move through them, between the objects' reference poses.
  std::vector<std::shared_ptr<const Leg>> legs;
  /// Space in which three objects or more are mixed, of all legs; null: there are no such.
  std::shared_ptr<const ShapeSpace> space;
  std::shared_ptr<ActorPoses> poses;  ///< poses of the objects that move; null: none does
};

/// Hashes of a mesh of a sequence.
struct MeshHashes {
  std::string content;  ///< hash of the mesh and its velocities
  std::string fit;      ///< hash of all meshes that its balls in a morph come from
};

/// Parts of the hashes of a sequence's frames (film_settings.h).
struct SequenceHashes {
  std::string scene;               ///< content_hash()
  std::string inputs;              ///< inputs_hash()
  std::optional<Framing> framing;  ///< framing of a moving camera, if the models alone decide it
  std::string poses;               ///< hash of what a moving camera's framing takes from its poses
  /// Hash of the box of all objects and of the camera, if that stands still; empty without mesh
  /// sequences.
  std::string stage;
  std::string aovs;  ///< image.aovs of the scene, also where a run leaves layers out
  /// For each object of each actor those of its meshes; empty where no actor has one.
  std::vector<std::vector<std::vector<MeshHashes>>> meshes;
};

/// kCached: an object whose fit is not in the cache gets the balls of its spheres instead.
enum class Fits : std::uint8_t { kMake, kCached };

/// kAlike: actors that differ in nothing but their places share objects and legs.
enum class Sharing : std::uint8_t { kAlike, kNone };

struct PreparedScene {
  Scene scene;
  SequenceHashes hashes;
  int frame_count = 0;
  std::vector<PreparedActor> actors;
  Box box;                         ///< box around all objects
  Camera camera;                   ///< camera of the first frame
  std::optional<Framing> framing;  ///< set where the camera moves
  std::shared_ptr<const Image> environment;
  std::vector<std::string> warnings;
  MemoryEstimate memory;
  std::vector<ReadFile> inputs;  ///< files that were read for it
  std::string provenance;        ///< encode_provenance(); empty: none
};

}  // namespace polymorph
