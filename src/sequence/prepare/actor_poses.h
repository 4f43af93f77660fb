// Poses of mesh sequences in a morph. A pose is an object with the shape of one mesh of its
// sequence. The legs are planned for the reference poses (MeshSequence::reference); each frame has
// legs between the poses that its objects then have. Poses are made on demand, and the most
// recently used ones are kept.
#pragma once

#include <filesystem>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "base/result.h"
#include "kernels/engine.h"
#include "leg/leg.h"
#include "sequence/prepare/prepare_objects.h"
#include "sequence/prepare/prepared_scene.h"
#include "spheres/carry_balls.h"

namespace polymorph {

/// An object's balls and landmarks in a pose.
struct PoseFit {
  CarriedBalls balls;
  std::map<std::string, Vec3> landmarks;
};

/// An object of a morph that may be a mesh sequence. If it is not, all members are empty.
struct MovingObject {
  std::shared_ptr<const MeshSequence> sequence;     ///< null: the object is no mesh sequence
  ObjectSettings settings;                          ///< settings of the object in the scene
  std::vector<Vec3> outermost;                      ///< outermost points of all meshes
  std::shared_ptr<const PreparedObject> reference;  ///< the object in its reference pose
  /// bind_balls() (spheres/carry_balls.h) of the reference: the points that each ball moves with.
  std::vector<std::vector<BoundPoint>> bound;
  /// Edges of the reference's triangles, ascending, each as (lower vertex << 32 | higher vertex).
  std::vector<std::uint64_t> edges;
  LegKinds kinds;  ///< kinds of the legs that begin or end at the object
};

/// Inputs from which the poses of an actor are made, and a cache of the last poses.
struct ActorPoses {
  Scene scene;
  std::filesystem::path cache;           ///< folder of cache files; empty: none
  LegSettings settings;                  ///< ActorOutline::settings
  std::vector<std::string> label_names;  ///< ActorOutline::label_names
  std::vector<MovingObject> objects;     ///< one per object of the chain

  /// A pose in the cache.
  struct CachedPose {
    std::size_t object = 0;  ///< index in `objects`
    int mesh = 0;            ///< index in MeshSequence::files
    std::shared_ptr<const PreparedObject> pose;
  };
  std::mutex mutex;              ///< guards `cached` and `fits`
  std::list<CachedPose> cached;  ///< most recently used first
  /// [object][mesh]: fits of meshes whose vertices do not correspond to the reference's.
  std::vector<std::vector<std::optional<PoseFit>>> fits;
};

/// Sets up the poses of an actor; null if none of its objects is a mesh sequence in a morph.
/// `chain`: chain_objects(scene); `prepared`: one per object of the actor. The outermost points are
/// moved out of `loaded`.
std::shared_ptr<ActorPoses> make_poses(const Preparation& preparation, const ActorOutline& outline,
                                       std::span<const ChainObject> chain,
                                       const ObjectList& prepared, LoadedScene& loaded);

/// Returns an object of the actor's chain in its pose at a frame. Errors: kInput if its mesh cannot
/// be shown or has no balls; the engine's.
Result<std::shared_ptr<const PreparedObject>> object_at(const PreparedActor& actor, int object,
                                                        int frame, Engine& engine);

/// Returns a leg of the actor between the poses that the leg's objects have at a frame. Errors: as
/// object_at().
Result<std::shared_ptr<const Leg>> leg_at(const PreparedActor& actor, int leg, int frame,
                                          Engine& engine);

/// Returns the leg of a moment. An end that the moment does not show is in its reference pose.
/// Errors: as object_at().
Result<std::shared_ptr<const Leg>> leg_at(const PreparedActor& actor, const MorphState& moment,
                                          Engine& engine);

/// Returns the mesh sequence of an object of the actor's morph; null if it is none.
const MeshSequence* moving_sequence(const PreparedActor& actor, int object);

/// Tests whether an end of the leg is a mesh sequence.
bool has_moving_end(const PreparedActor& actor, int leg);

}  // namespace polymorph
