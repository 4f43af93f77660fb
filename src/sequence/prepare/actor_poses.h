// Poses of mesh sequences in a morph. Each frame has legs between its own poses of the objects;
// poses are made on demand and the last few are kept.
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

/// An object of a morph that may be a mesh sequence. If it is none, all members are empty.
struct MovingObject {
  std::shared_ptr<const MeshSequence> sequence;  ///< null: the object is no mesh sequence
  ObjectSettings settings;
  std::vector<Vec3> outermost;  ///< outermost points of all its meshes
  std::shared_ptr<const PreparedObject> reference;
  std::vector<std::vector<BoundPoint>> bound;  ///< bind_balls() of the reference
  std::vector<std::uint64_t> edges;            ///< list_edges() of the reference
  LegKinds kinds;
};

/// Inputs from which the poses of an actor are made, and a cache of the last poses.
struct ActorPoses {
  Scene scene;
  std::filesystem::path cache;
  LegSettings settings;
  std::vector<std::string> label_names;
  std::vector<MovingObject> objects;  ///< one per object of the chain

  /// A pose in the cache.
  struct CachedPose {
    std::size_t object = 0;
    int mesh = 0;
    std::shared_ptr<const PreparedObject> pose;
  };
  std::mutex mutex;
  std::list<CachedPose> cached;  ///< most recently used first
  /// Indexed by object and mesh: fits of meshes whose vertices do not correspond to the
  /// reference's.
  std::vector<std::vector<std::optional<PoseFit>>> fits;
};

/// Sets up the poses of an actor whose objects are `prepared`; null if none is a mesh sequence in a
/// morph. Moves the outermost points out of `loaded`, where the actor's first object has the index
/// `first`.
std::shared_ptr<ActorPoses> make_poses(const Preparation& preparation, const ActorOutline& outline,
                                       std::span<const ChainObject> objects,
                                       const ObjectList& prepared, std::size_t first,
                                       LoadedScene& loaded);

/// Returns an object of the actor's chain in its pose at a frame. Errors: kInput if its mesh cannot
/// be shown or has no balls; the engine's.
Result<std::shared_ptr<const PreparedObject>> object_at(const PreparedActor& actor, int object,
                                                        int frame, Engine& engine);

/// Returns a leg of the actor between the poses of its objects at a frame. Errors: as object_at().
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
