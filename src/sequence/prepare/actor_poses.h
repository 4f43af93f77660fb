// Poses of an actor's objects that are mesh sequences: each frame of its morph has the legs between
// the poses of that moment, made when they are asked for.
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

/// An object of a morph that is a mesh sequence.
struct MovingObject {
  std::shared_ptr<const MeshSequence> sequence;  ///< null: it stands still
  ObjectSettings settings;
  std::vector<Vec3> outermost;  ///< outermost points of all its meshes
  std::shared_ptr<const PreparedObject> reference;
  std::vector<std::vector<BoundPoint>> bound;  ///< bind_balls() of the reference
  std::vector<std::uint64_t> edges;            ///< list_edges() of the reference
  LegKinds kinds;
};

/// Parts that the poses of an actor are made from, and the last poses that were made.
struct ActorPoses {
  Scene scene;
  std::filesystem::path cache;
  LegSettings settings;
  std::vector<std::string> label_names;
  std::vector<MovingObject> objects;  ///< one per object of the chain

  /// One of the poses that are kept.
  struct Kept {
    std::size_t object = 0;
    int mesh = 0;
    std::shared_ptr<const PreparedObject> pose;
  };
  std::mutex mutex;
  std::list<Kept> kept;  ///< the one that was asked for last first
  /// Per object and mesh: fits of meshes whose vertices are others than the reference's.
  std::vector<std::vector<std::optional<PoseFit>>> fits;
};

/// Poses of the actor's objects, complete already; null where none moves. The outermost points are
/// moved out of `loaded`, where the actor's first object is `first`.
std::shared_ptr<ActorPoses> make_poses(const Preparation& preparation, const ActorOutline& outline,
                                       std::span<const ChainObject> objects,
                                       const ObjectList& prepared, std::size_t first,
                                       LoadedScene& loaded);

/// An object of the actor's chain as it is at a frame. Errors: kInput where its mesh cannot be
/// shown or has no balls; the engine's.
Result<std::shared_ptr<const PreparedObject>> object_at(const PreparedActor& actor, int object,
                                                        int frame, Engine& engine);

/// A leg of the actor between its objects as they are at a frame. Errors: those of object_at().
Result<std::shared_ptr<const Leg>> leg_at(const PreparedActor& actor, int leg, int frame,
                                          Engine& engine);

/// The leg of a moment, where an end that the moment does not show is in its reference pose.
Result<std::shared_ptr<const Leg>> leg_at(const PreparedActor& actor, const MorphState& moment,
                                          Engine& engine);

/// The sequence of an object of the actor's morph; null: it stands still.
const MeshSequence* moving_sequence(const PreparedActor& actor, int object);

/// Tests whether an end of the leg moves.
bool has_moving_end(const PreparedActor& actor, int leg);

}  // namespace polymorph
