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
  Mesh surface;  ///< the balls'
  std::shared_ptr<const ClosestPointQuery> to_surface;
};

/// `to_model` answers for `model`; `surface` is that of the balls, field = 1. The grid has cells of
/// `cell`, or the smallest of which 256 go along its longest side, whichever are larger. Errors: as
/// Engine::sample().
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
