// Mesh projection onto the balls' surface, which moves a model's own mesh (Gilbert 2010, 2.2).
#pragma once

#include <span>
#include <vector>

#include "kernels/types.h"
#include "mesh/inside.h"
#include "model/model.h"

namespace polymorph {

/// Targets of a mesh's vertices. Its triangles, texture coordinates and materials stay the same.
struct Projection {
  std::vector<Vec3> points;   ///< one per model point, where the field is 1 if it arrives
  std::vector<Vec3> normals;  ///< unit normals, outward: the field's, or the model's if it stays
  double arrived = 0;         ///< share of the visible area whose triangles arrive, [0, 1]
};

/// Projects each point of the model to where the field is 1: along the point's normal, by at most
/// 0.05 of the model's diagonal, or else along the field's gradient. Points inside the solid, where
/// parts overlap, stay; triangles without such points are visible. A triangle arrives if its
/// corners and its centroid end at most 0.005 of the model's diagonal from the surface.
Projection project_model(const Model& model, const InsideTest& inside, std::span<const Ball> balls,
                         FieldKind kind);

/// A model's points and normals while it is projected.
struct MovingMesh {
  std::vector<Vec3> points;
  std::vector<Vec3> corner_normals;  ///< 3 per triangle
};
/// Interpolates between the model (`progress` 0) and its projection (1).
MovingMesh projected_mesh(const Model& model, const Projection& projection, float progress);

}  // namespace polymorph
