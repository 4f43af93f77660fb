// Mesh normals, volume, area and affine transforms.
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

/// Unit normal of each triangle (zero for a degenerate one).
std::vector<Vec3> face_normals(const Model& model);
/// Area- and angle-weighted mean of the adjacent face normals, one per point (report 5.1.1).
std::vector<Vec3> point_normals(const Model& model);

/// The angle between faces from which an edge is shown sharp: a cube's 90 stays, a 12-sided
/// cylinder's 30 does not.
inline constexpr float kCreaseDegrees = 50;
/// 3 * triangles: the weighted mean, as in point_normals(), of those faces around the point that
/// are reached without crossing a sharp, open or non-manifold edge. Unit, also at degenerate
/// triangles.
std::vector<Vec3> creased_normals(const Model& model, float crease_degrees = kCreaseDegrees);

/// Signed volume (positive when oriented outward) and area, summed in double.
double volume_of(const Model& model);
double area_of(const Model& model);

}  // namespace polymorph
