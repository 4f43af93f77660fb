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

/// The two surfaces of a blend.
struct BlendEnds {
  const Model& model;
  const InsideTest& inside;                           ///< test of `model`
  std::shared_ptr<const ClosestPointQuery> to_model;  ///< closest points of `model`
  BallSet balls;
  Mesh surface;  ///< surface of the balls, where their field is 1
};

/// Signed distances (inside positive) to the model and to the balls' surface on one grid, clamped
/// to six cells.
struct BlendField {
  std::shared_ptr<const DistanceGrid> model, balls;
  Mesh surface;  ///< surface of the balls
  /// Closest points of the model and of `surface`.
  std::shared_ptr<const ClosestPointQuery> to_model, to_surface;
};

/// Measures both distances on a grid around both surfaces. The cells' edge is `cell` or the longest
/// side of the surfaces' box over kMaxDistanceCells (field/distance_grid.h), whichever is larger.
/// Errors: as Engine::sample().
Result<BlendField> make_blend_field(BlendEnds ends, float cell, const ExtractSettings& settings,
                                    Engine& engine);

/// Extracts the surface (1 - w) field.model + w field.balls = 0 with w = `progress`: 0 gives the
/// model as the grid resolves it, 1 the balls' surface. The mesh is closed and manifold. Its
/// normals mix, with the same weights, the normals at the nearest points of both surfaces. Errors:
/// as Engine::extract().
Result<Mesh> blend_surface(const BlendField& field, const Model& model, float progress,
                           const ExtractSettings& settings, Engine& engine);

}  // namespace polymorph
