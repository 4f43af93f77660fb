// Iso level and ball strength: the level at which the surface encloses a given volume.
#pragma once

#include <optional>
#include <vector>

#include "base/box.h"
#include "base/result.h"
#include "kernels/engine.h"

namespace polymorph {

/// The volume that a surface of balls is to enclose, and the settings of its measurement.
struct VolumeMeasure {
  double volume = 0;  ///< above 0
  float cell = 0;     ///< edge of the cells of the measured surface
  ExtractSettings extract = {};
};
/// Finds the iso value at which the surface encloses the volume, to 0.2 % of it; where cells are
/// too coarse for that, the best value found. `start` is tried first. Errors as extract_surface().
Result<float> iso_for_volume(Engine& engine, const BallSet& balls, const VolumeMeasure& measure,
                             float start = 1);

/// Estimate of the level at which a surface between two objects encloses a volume.
struct LevelEstimate {
  float level = 0;  ///< MorphSurface::level, scene units; higher levels enclose less
  /// Estimate of the volume that a higher level encloses less, divided by area x difference of the
  /// levels: 1 between solid objects, less where the level has little weight at thin limbs.
  double response = 1;
};
/// A surface between two objects and its level.
struct LevelSurface {
  Mesh mesh;
  float level = 0;         ///< MorphSurface::level
  LevelEstimate estimate;  ///< estimate of the level that encloses just the goal's volume
};
/// The volume that a surface between two objects is to enclose.
struct VolumeGoal {
  double volume = 0;  ///< above 0
  float cell = 0;     ///< edge of the cells on which the volume is measured
  float limit = 0;    ///< maximum magnitude of the level
};
/// Settings of a search for the level of a surface between two objects.
struct LevelSearch {
  float cell = 0;  ///< edge of the cells of the surface, scene units
  ExtractSettings extract;
  /// Estimate of the level; without one it is searched for on larger cells first.
  std::optional<LevelEstimate> near;
  double tolerance = 0.002;  ///< relative to the goal's volume
};
/// Moves the surface between two objects, which is inside `box`, to the level at which it encloses
/// the goal's volume. If its cells are larger than the goal's, an estimate of the volume lost to
/// their flat facets is added. If no level within the limit encloses the volume, returns the
/// surface at that limit. Errors as extract_surface().
Result<LevelSurface> surface_of_volume(Engine& engine, MorphSurface surface, const Box& box,
                                       const LevelSearch& search, const VolumeGoal& goal);

/// Rescales balls so that their surface at iso = 1 is the former one at `iso`.
std::vector<Ball> rescale_balls(std::vector<Ball> balls, FieldKind kind, float iso);

/// Scales balls for an object that appears: from no surface (growth 0) to the whole one (1).
/// Gaussian and Wyvill: the level falls from the field's maximum to 1; inverse-square: visible
/// radii grow linearly. `field_maximum`: result of find_field_maximum().
std::vector<Ball> grow_balls(std::vector<Ball> balls, FieldKind kind, float growth,
                             float field_maximum);

/// Computes the largest field value at the balls' own centres.
Result<float> find_field_maximum(Engine& engine, const BallSet& balls,
                                 const ExtractSettings& settings);

/// Adjusts the strengths of Gaussian balls so that the field is nearly equal at all centres. Then
/// thin parts are as robust as thick ones, and a smooth field (small blobbiness) does not dissolve
/// them. Takes a few damped multiplicative steps towards the plateau, the 90th percentile of the
/// field at centres. Balls with that value stay unchanged.
Result<std::vector<Ball>> equalize_field(Engine& engine, std::vector<Ball> balls,
                                         const ExtractSettings& settings);

}  // namespace polymorph
