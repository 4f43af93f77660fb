// Boundary blend: interpolates between the distance fields of a model and of its balls' surface
// (docs/method.md, Boundary).
#pragma once

#include <memory>
#include <vector>

#include "base/result.h"
#include "kernels/engine.h"
#include "model/model.h"
#include "model/query/closest.h"
#include "model/query/inside.h"

namespace polymorph {

/// Signed distances (inside positive) to the model and to the balls' surface, at the grid points of
/// the bricks of 8^3 cells that some blend's surface can pass through.
struct BlendBrick {
  static constexpr int kCells = 8, kPoints = kCells + 1;
  Int3 at;                          ///< in bricks from the grid's origin
  std::vector<float> model, balls;  ///< kPoints^3 each, x fastest
};
struct BlendField {
  Vec3 origin;
  float cell = 0;
  Int3 size;                        ///< in bricks
  std::vector<BlendBrick> bricks;   ///< by z, y, x
  std::vector<std::int32_t> index;  ///< of each brick of the grid, -1 = none
  Mesh surface;                     ///< the balls'
  std::shared_ptr<const ClosestPointQuery> to_surface;
};

/// `to_model` answers for `model`; `surface` is that of the balls, field = 1, on cells of `cell`.
/// Whole bricks are left out by what a distance at their middle says, so memory grows with the
/// surface. Errors: as Engine::sample().
Result<BlendField> make_blend_field(const Model& model, const InsideTest& inside,
                                    const ClosestPointQuery& to_model,
                                    const std::vector<Ball>& balls, Mesh surface, float cell,
                                    const ExtractSettings& settings, Engine& engine);

/// The surface (1 - progress) model + progress balls = 0. 0 is the model as the grid shows it, 1
/// the balls' surface; closed and manifold. Normals are those of the nearest points of both, mixed
/// likewise.
Mesh blend_surface(const BlendField& field, const Model& model, const ClosestPointQuery& to_model,
                   float progress);

}  // namespace polymorph
