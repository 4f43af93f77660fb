// Mesh projection onto the balls' surface: the boundary stage that moves a model's own mesh (report
// requirement 2.2).
#pragma once

#include <span>
#include <vector>

#include "kernels/types.h"
#include "mesh/inside.h"
#include "model/model.h"

namespace polymorph {

/// The places that a mesh's vertices go to. Its triangles, texture coordinates and materials stay
/// what they are.
struct Projection {
  std::vector<Vec3> points;   ///< one per model point, on the surface field = 1
  std::vector<Vec3> normals;  ///< the field's there, outward, unit
  double arrived = 0;         ///< share of the visible area that lies on the surface then, [0, 1]
};

/// Moves each point along its normal, by at most 5 % of the model's diagonal, to where the field is
/// 1; else down the field's gradient. Points within the solid (parts that overlap) stay. A triangle
/// has arrived when its corners and its middle are within 0.5 % of the diagonal of the surface.
Projection project_model(const Model& model, const InsideTest& inside, std::span<const Ball> balls,
                         FieldKind kind);

/// The mesh on its way: `progress` 0 = the model itself, 1 = projected.
struct MovingMesh {
  std::vector<Vec3> points;
  std::vector<Vec3> corner_normals;  ///< 3 per triangle
};
MovingMesh projected_mesh(const Model& model, const Projection& projection, float progress);

}  // namespace polymorph
