// Boundary blend: the transition from a model to its balls' surface, by interpolation between the
// signed distances to both (docs/method.md, Boundary).
#pragma once

#include <memory>

#include "base/result.h"
#include "kernels/engine.h"
#include "mesh/closest.h"
#include "mesh/inside.h"
#include "model/model.h"

namespace polymorph {

/// Signed distances (inside positive) to the model and to the balls' surface on one grid, clamped
/// to six cells.
struct BlendField {
  std::shared_ptr<const DistanceGrid> model, balls;
  Mesh surface;                                         ///< surface of the balls
  std::shared_ptr<const ClosestPointQuery> to_surface;  ///< closest points of `surface`
};

/// Measures both distances on a grid around both surfaces. `inside`: test of `model`; `to_model`:
/// closest points of `model`; `surface`: the balls' surface, where their field is 1. The cells'
/// edge is `cell` or the longest side of the surfaces' box over kMaxDistanceCells
/// (field/distance_grid.h), whichever is larger. Errors: as Engine::sample().
Result<BlendField> make_blend_field(const Model& model, const InsideTest& inside,
                                    const ClosestPointQuery& to_model, const BallSet& balls,
                                    Mesh surface, float cell, const ExtractSettings& settings,
                                    Engine& engine);

/// Extracts the surface (1 - w) field.model + w field.balls = 0 with w = `progress`: 0 gives the
/// model as the grid resolves it, 1 the balls' surface. The mesh is closed and manifold. Its
/// normals mix, with the same weights, the normals at the nearest points of both surfaces. Errors:
/// as Engine::extract().
Result<Mesh> blend_surface(const BlendField& field, const Model& model,
                           const ClosestPointQuery& to_model, float progress,
                           const ExtractSettings& settings, Engine& engine);

}  // namespace polymorph
