// Sampling grid of a field, and extraction of its surface.
#pragma once

#include <memory>
#include <vector>

#include "base/box.h"
#include "base/result.h"
#include "kernels/engine.h"
#include "scene/scene.h"

namespace polymorph {

/// The engine's status as a Result: kInput for bad balls, kResource for devices and memory.
Status to_status(const EngineStatus& status);

/// A box that the surface field = iso of these balls cannot leave (it may be far from tight).
Box surface_bounds(const std::vector<Ball>& balls, const ExtractSettings& settings);

/// The grid of cubic cells over `box`, one free cell around it, anchored at multiples of `cell` in
/// world coordinates: a shape that stands still is sampled alike in every frame. Errors
/// (kResource): more than 2^40 points.
Result<Grid> fit_grid(const Box& box, float cell);

Box box_of(const Grid& grid);

/// The surface field = iso of the balls, on cells of edge `cell`. No balls or none visible: an
/// empty mesh. Errors: kResource (device or memory), kInput (NaN in the balls).
Result<Mesh> extract_surface(Engine& engine, const BallSet& balls, float cell,
                             const ExtractSettings& settings);

/// The surface between two objects, within `box`, on cells of edge `cell`. Errors: likewise.
Result<Mesh> extract_surface(Engine& engine, const MorphSurface& between, const Box& box,
                             float cell, const ExtractSettings& settings);

/// The surface of one object's distances, on cells of edge `cell`. Errors: as extract_surface().
Result<Mesh> extract_distances(Engine& engine, const std::shared_ptr<const DistanceGrid>& object,
                               float cell, const ExtractSettings& settings);

/// What the balls carry to points (Engine::interpolate). Errors: as extract_surface().
Result<std::vector<AttributeValues>> interpolate_attributes(
    Engine& engine, const BallSet& balls, FieldKind kind, const std::vector<BallAttribute>& carried,
    const std::vector<Vec3>& points);

}  // namespace polymorph
