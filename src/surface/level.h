// Iso level and ball strength: the level at which the surface encloses a given volume.
#pragma once

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
/// The surface between two objects moved to the level at which it encloses `volume`, to 0.2 % of
/// it: on cells of edge `cell` over `box`. Where the volume cannot be had by a level within `limit`
/// of 0, the surface at that limit. Errors as extract_surface().
Result<LevelSurface> surface_of_volume(Engine& engine, MorphSurface between, const Box& box,
                                       float cell, const ExtractSettings& settings, double volume,
                                       float limit);

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
