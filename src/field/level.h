// Iso level and ball strength: the level at which the surface encloses a given volume.
#pragma once

#include <optional>
#include <vector>

#include "base/box.h"
#include "base/result.h"
#include "kernels/engine.h"

namespace polymorph {

/// The iso at which the surface encloses `volume`, found on meshes of cells of edge `cell`, to 0.2
/// % of the volume; where cells are too coarse for that, the level that came nearest. `start` is
/// tried first. Errors as extract_surface().
Result<float> iso_for_volume(Engine& engine, const BallSet& balls, float cell,
                             const ExtractSettings& settings, double volume, float start = 1);

/// A surface between two objects, and the level at which it lies.
struct LevelSurface {
  Mesh mesh;
  float level = 0;  ///< scene units
};
/// Which volume a surface between two objects is to enclose.
struct VolumeGoal {
  double volume = 0;
  float cell = 0;   ///< edge of the cells whose surface is to enclose it
  float limit = 0;  ///< no level is further from 0
  /// The level, nearly, where it is known; else it is searched for on larger cells first.
  std::optional<float> near;
  double tolerance = 0.002;  ///< share of the volume
};
/// The surface between two objects moved to the level at which it encloses the goal's volume, on
/// cells of edge `cell` over `box`. Cells larger than the goal's add what their facets lose. Where
/// the volume cannot be had by a level within the limit, the surface at that limit. Errors as
/// extract_surface().
Result<LevelSurface> surface_of_volume(Engine& engine, MorphSurface between, const Box& box,
                                       float cell, const ExtractSettings& settings,
                                       const VolumeGoal& goal);

/// Balls whose surface at iso = 1 is that of `balls` at `iso`.
std::vector<Ball> rescaled(std::vector<Ball> balls, FieldKind kind, float iso);

/// Balls on their way from nothing (growth 0: no surface) to themselves (1). Gaussian: the level
/// falls from the field's maximum to 1; inverse-square: visible radii grow linearly.
std::vector<Ball> grown(std::vector<Ball> balls, FieldKind kind, float growth, float field_maximum);

/// The largest field value at the balls' own centres.
Result<float> field_maximum(Engine& engine, const BallSet& balls, const ExtractSettings& settings);

/// Gaussian balls with strengths chosen so that the field is nearly the same at every centre: the
/// middle of a handle then stands as firm as the middle of the body, and smooth (small) blobbiness
/// does not melt thin parts away. A few damped multiplicative steps; balls that already reach the
/// field's plateau are left alone.
Result<std::vector<Ball>> evened(Engine& engine, std::vector<Ball> balls,
                                 const ExtractSettings& settings);

}  // namespace polymorph
