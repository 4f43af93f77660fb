// Affine transforms of points and models.
#pragma once

#include <optional>

#include "model/model.h"

namespace polymorph {

/// Row-major 3x4 matrix (M | t): p' = M p + t.
struct Transform {
  float m[3][4] = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}};
};
/// Transforms a point.
Vec3 apply(const Transform& t, Vec3 p);
/// Returns the transform that applies `first`, then `second`.
Transform compose(const Transform& second, const Transform& first);
/// Computes the inverse; nothing if the determinant is 0.
std::optional<Transform> inverse(const Transform& t);
/// Makes the transform that scales, then rotates by `degrees` about x, then y, then z (fixed axes),
/// then translates.
Transform make_transform(Vec3 translate, Vec3 degrees, Vec3 scale);

/// Transforms points, and normals by the inverse transpose; a mirroring transform also flips the
/// triangles, so that they still face outward.
Model transformed(const Model& model, const Transform& t);

}  // namespace polymorph
