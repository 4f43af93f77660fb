// Surface of a leg made of distances: the map to both objects, the field between them and the level
// that keeps the volume.
#pragma once

#include <optional>
#include <vector>

#include "leg/leg.h"

namespace polymorph {

/// Shares of the objects' size: no further may the level go for the volume's sake, and up to where
/// distances count nearly as they are.
inline constexpr float kFurthestLevel = 0.08f, kLinearRange = 0.06f;

/// The map to both objects when the leg's balls are `balls`.
FrameMap distance_map(const Leg& leg, float time, const BallSet& balls);

/// Says whether a level keeps the leg's volume. Walls have none: their volume means little.
bool keeps_volume(const Leg& leg);

/// The level that keeps the volume at an eased time, nearly: cubics through the leg's levels
/// (Catmull-Rom). None where there are too few.
std::optional<float> level_at(const std::vector<float>& levels, float u);

/// Settings of the search for a surface and its level.
struct LevelSearch {
  float cell = 0;  ///< edge of the cells
  ExtractSettings extract;
  std::optional<float> near;  ///< level to begin at; none: found on larger cells first
  double tolerance = 0.002;   ///< share of the volume, as the leg's own cells show it
};
/// Sets mesh and field of `surface`, whose state is set. Errors: kResource.
Status extract_between(const Leg& leg, const LevelSearch& search, Engine& engine,
                       LegSurface& surface);

/// Evaluates a surface's field at points, bit for bit as the engine does. Errors: the engine's.
Result<std::vector<float>> sample_distances(const MorphSurface& field,
                                            const std::vector<Vec3>& points, Engine& engine);

}  // namespace polymorph
