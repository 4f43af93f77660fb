// Affine transforms of points and models.
#pragma once

#include "model/model.h"

namespace polymorph {

/// Row-major 3x4: p' = M p + t.
struct Transform {
  float m[3][4] = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}};
};
Vec3 apply(const Transform& t, Vec3 p);
/// `second` after `first`.
Transform compose(const Transform& second, const Transform& first);
/// Scale, then rotate by `degrees` about x, then y, then z (fixed axes), then translate.
Transform make_transform(Vec3 translate, Vec3 degrees, Vec3 scale);

/// Moves points, and normals by the inverse transpose; a mirroring transform also turns triangles
/// around, so that outside stays outside.
Model transformed(const Model& model, const Transform& t);

}  // namespace polymorph
