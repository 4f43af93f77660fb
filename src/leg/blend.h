// Boundary blend: interpolates between the distance fields of a model and of its balls' surface
// (docs/method.md, Boundary).
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
  Mesh surface;  ///< surface of the balls
  std::shared_ptr<const ClosestPointQuery> to_surface;
};

/// Measures both distances on a grid around both surfaces. `to_model`: closest points of `model`;
/// `surface`: the balls' surface, where their field is 1. The cells' edge is `cell`, but at least
/// 1/256 of the longest side of the box. Errors: as Engine::sample().
Result<BlendField> make_blend_field(const Model& model, const InsideTest& inside,
                                    const ClosestPointQuery& to_model, const BallSet& balls,
                                    Mesh surface, float cell, const ExtractSettings& settings,
                                    Engine& engine);

/// Extracts the surface (1 - w) model + w balls = 0 with w = `progress`: 0 gives the model as the
/// grid resolves it, 1 the balls' surface. It is closed and manifold. Its normals mix those of the
/// nearest points of both surfaces with the same weights. Errors: as Engine::extract().
Result<Mesh> blend_surface(const BlendField& field, const Model& model,
                           const ClosestPointQuery& to_model, float progress,
                           const ExtractSettings& settings, Engine& engine);

}  // namespace polymorph
