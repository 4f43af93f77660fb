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

/// Signed distances (inside positive) to the model and to the balls' surface at the points of one
/// grid, cut off a few cells away.
struct BlendField {
  std::shared_ptr<const DistanceGrid> model, balls;
  Mesh surface;  ///< surface of the balls
  std::shared_ptr<const ClosestPointQuery> to_surface;
};

/// Measures both distances on a grid around both surfaces. `to_model` finds closest points of
/// `model`; `surface` is where the balls' field is 1. The cells are `cell` wide, but at least 1/256
/// of the longest side of the box. Errors: as Engine::sample().
Result<BlendField> make_blend_field(const Model& model, const InsideTest& inside,
                                    const ClosestPointQuery& to_model, const BallSet& balls,
                                    Mesh surface, float cell, const ExtractSettings& settings,
                                    Engine& engine);

/// The surface (1 - progress) model + progress balls = 0. 0 is the model as the grid shows it, 1
/// the balls' surface; closed and manifold. Normals are those of the nearest points of both, mixed
/// likewise. Errors: as Engine::extract().
Result<Mesh> blend_surface(const BlendField& field, const Model& model,
                           const ClosestPointQuery& to_model, float progress,
                           const ExtractSettings& settings, Engine& engine);

}  // namespace polymorph
