// Surface of a leg made of distances: map to both objects, field, and level that keeps the volume.
#pragma once

#include <optional>
#include <vector>

#include "leg/leg.h"

namespace polymorph {

/// Fractions of the objects' size: the maximum magnitude of the level that keeps the volume, and
/// the distance up to which the compression of distances (kernels/morph_field.h) is nearly linear.
inline constexpr float kMaxLevel = 0.08f, kLinearRange = 0.06f;

/// Computes the map to both objects at `time`, when the leg's balls are `balls`.
FrameMap distance_map(const Leg& leg, float time, const BallSet& balls);

/// Tests whether the level keeps the leg's volume. Not so for shells: their volume means little.
bool keeps_volume(const Leg& leg);

/// Interpolates the leg's levels at the eased time u by Catmull-Rom cubics: an estimate of the
/// level that keeps the volume. Empty if there are fewer than three levels.
std::optional<float> level_at(const std::vector<float>& levels, float u);

/// Settings of the search for a surface and its level.
struct LevelSearch {
  float cell = 0;  ///< edge of the cells
  ExtractSettings extract;
  std::optional<float> near;  ///< start of the search; empty: first searched for on larger cells
  double tolerance = 0.002;   ///< relative to the volume, measured on the leg's own cells
};
/// Extracts a leg's surface: sets `mesh` and `field` of `surface`, whose state is set. Errors:
/// kResource.
Status extract_between(const Leg& leg, const LevelSearch& search, Engine& engine,
                       LegSurface& surface);

/// Evaluates a surface's field at points, bit for bit as the engine does. Errors: the engine's.
Result<std::vector<float>> sample_distances(const MorphSurface& field,
                                            const std::vector<Vec3>& points, Engine& engine);

}  // namespace polymorph
