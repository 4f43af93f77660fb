// Sampling grid of a field, and extraction of its surface.
#pragma once

#include <memory>
#include <vector>

#include "base/box.h"
#include "base/result.h"
#include "kernels/engine.h"
#include "scene/scene.h"

namespace polymorph {

/// Converts the engine's status to a Result: kInput for bad balls, kResource for devices and
/// memory.
Status to_status(const EngineStatus& status);

/// Returns a box around the surface on which the balls' field is settings.iso. It may be much
/// larger than the surface; it is empty if all balls are negligible.
Box surface_bounds(const std::vector<Ball>& balls, const ExtractSettings& settings);

/// Makes a grid of cubic cells over `box` with one empty cell around it, anchored at multiples of
/// `cell` in world coordinates, so that a static shape is sampled equally in every frame. Errors
/// (kResource): more than 2^40 points, or 65536 along an axis.
Result<Grid> fit_grid(const Box& box, float cell);

Box bounding_box(const Grid& grid);

/// Extracts the surface on which the balls' field is settings.iso, on cells of edge `cell`. The
/// mesh is empty if no ball is strong enough to have a surface. Errors: kResource (device or
/// memory), kInput (NaN in the balls).
Result<Mesh> extract_surface(Engine& engine, const BallSet& balls, float cell,
                             const ExtractSettings& settings);

/// Extracts the surface between two objects (kernels/morph_surface.h), within `box`, on cells of
/// edge `cell`. Errors: kResource.
Result<Mesh> extract_surface(Engine& engine, const MorphSurface& surface, const Box& box,
                             float cell, const ExtractSettings& settings);

/// Extracts the surface on which the signed distances `object` are 0, on cells of edge `cell`.
/// Errors: kResource.
Result<Mesh> extract_distances(Engine& engine, const std::shared_ptr<const DistanceGrid>& object,
                               float cell, const ExtractSettings& settings);

/// Interpolates attributes of the balls at points (Engine::interpolate). Errors: kResource; kInput
/// (NaN in the balls).
Result<std::vector<AttributeValues>> interpolate_attributes(
    Engine& engine, const BallSet& balls, FieldKind kind,
    const std::vector<BallAttribute>& attributes, const std::vector<Vec3>& points);

}  // namespace polymorph
