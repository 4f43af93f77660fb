// Surface of a leg between two objects at a time of its motion.
#pragma once

#include <optional>
#include <vector>

#include "base/result.h"
#include "kernels/engine.h"
#include "morph/motion.h"
#include "morph/pull_back.h"
#include "sequence/geometry/actor_geometry.h"

namespace polymorph {

/// The objects' size at an eased time, by which a smooth map measures.
float size_at(const PreparedActor& actor, const PreparedLeg& leg, float u);

/// The balls of a leg at `time` in [0, 1] of their motion, and their level; no surface yet.
Result<ActorGeometry> balls_on_way(const PreparedScene& prepared, const PreparedActor& actor,
                                   Engine& engine, int leg, float time);

/// The balls of a leg at `time` in [0, 1] of their motion, their level and their surface: what
/// shows in the volumetric stage. `moment` says only leg, time and u. `actor`: of `prepared`, of
/// which only the settings are needed. Errors: kResource.
Result<ActorGeometry> volume_at(const PreparedScene& prepared, const PreparedActor& actor,
                                Engine& engine, int leg, float time);

/// The least share of the volume that a part of a leg's surface may have; smaller ones are left
/// out.
double min_component_share_of(const PreparedActor& actor, const PreparedLeg& leg,
                              float min_component_share);

/// Does a leg that is made of distances have a level that keeps the volume? Walls have none: their
/// volume means little.
bool keeps_volume(const PreparedActor& actor, const PreparedLeg& leg);

/// The level that keeps the volume at an eased time, nearly: cubics through the leg's levels
/// (Catmull-Rom). None where the leg has no levels.
std::optional<float> level_at(const PreparedLeg& leg, float u);

/// The map of a leg that is made of distances, when its balls are `balls`.
FrameMap map_at(const PreparedActor& actor, const PreparedLeg& leg, float time,
                const BallSet& balls);

/// Where points of a leg's moving surface come from and go to; `map` is the map_at() of a leg that
/// is made of distances, and not looked at for others. Errors: the engine's.
Result<PullBack> pulled_back(const PreparedLeg& leg, float time, const BallSet& balls,
                             const FrameMap& map, const std::vector<Vec3>& points, Engine& engine);

/// How the points of a leg's surface go from `time` to `next`; `balls`: those at `time`. Errors:
/// the engine's.
Result<Flow> flow_on_leg(const PreparedActor& actor, const PreparedLeg& leg, float time, float next,
                         const BallSet& balls, const std::vector<Vec3>& points, Engine& engine);

/// The surface of a leg that is made of distances, and the field whose zero it is.
struct SurfaceBetween {
  Mesh mesh;
  MorphSurface field;
};
/// How the level that keeps a volume is searched for.
struct LevelSearch {
  std::optional<float> near;  ///< where to begin; none: at the leg's own levels
  double tolerance = 0.002;   ///< share of the volume, as the actor's own cells show it
};
/// On cells of edge `cell`: of `geometry` its map and of its moment time and u count. Errors:
/// kResource.
Result<SurfaceBetween> surface_between(const PreparedActor& actor, const PreparedLeg& leg,
                                       const ActorGeometry& geometry, float cell,
                                       const ExtractSettings& extract, Engine& engine,
                                       const LevelSearch& search = {});

}  // namespace polymorph
