#include "model/transform.h"

#include <cmath>
#include <numbers>
#include <utility>

#include "base/exact_math.h"
#include "kernels/linear.h"

namespace polymorph {
namespace {

double determinant(const Transform& t) {
  const Vec3d x(t.m[0][0], t.m[0][1], t.m[0][2]), y(t.m[1][0], t.m[1][1], t.m[1][2]),
      z(t.m[2][0], t.m[2][1], t.m[2][2]);
  return dot(x, cross(y, z));
}

}  // namespace

Vec3 apply(const Transform& t, Vec3 p) {
  Vec3 q;
  float* result[3] = {&q.x, &q.y, &q.z};
  for (int i = 0; i < 3; ++i)
    *result[i] = t.m[i][0] * p.x + t.m[i][1] * p.y + t.m[i][2] * p.z + t.m[i][3];
  return q;
}

Transform compose(const Transform& second, const Transform& first) {
  Transform result;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 4; ++j) {
      double sum = j == 3 ? static_cast<double>(second.m[i][3]) : 0.0;
      for (int k = 0; k < 3; ++k)
        sum += static_cast<double>(second.m[i][k]) * static_cast<double>(first.m[k][j]);
      result.m[i][j] = static_cast<float>(sum);
    }
  return result;
}

std::optional<Transform> inverse(const Transform& t) {
  const double det = determinant(t);
  if (det == 0) return std::nullopt;
  const Vec3d row[3] = {{t.m[0][0], t.m[0][1], t.m[0][2]},
                        {t.m[1][0], t.m[1][1], t.m[1][2]},
                        {t.m[2][0], t.m[2][1], t.m[2][2]}};
  // The inverse is the adjugate divided by the determinant.
  const Vec3d column[3] = {cross(row[1], row[2]) * (1 / det), cross(row[2], row[0]) * (1 / det),
                           cross(row[0], row[1]) * (1 / det)};
  const Vec3d translation(t.m[0][3], t.m[1][3], t.m[2][3]);
  const auto set_row = [&](double Vec3d::*axis, float(&out)[4]) {
    out[0] = static_cast<float>(column[0].*axis);
    out[1] = static_cast<float>(column[1].*axis);
    out[2] = static_cast<float>(column[2].*axis);
    out[3] =
        static_cast<float>(-(column[0].*axis * translation.x + column[1].*axis * translation.y +
                             column[2].*axis * translation.z));
  };
  Transform result;
  set_row(&Vec3d::x, result.m[0]);
  set_row(&Vec3d::y, result.m[1]);
  set_row(&Vec3d::z, result.m[2]);
  return result;
}

Transform make_transform(Vec3 translate, Vec3 degrees, Vec3 scale) {
  // The sine is exact at multiples of 90 degrees, so that rotated boxes stay axis-aligned.
  const auto sine = [](double angle) {
    const double reduced = std::remainder(angle, 360.0);
    if (reduced == 0 || std::abs(reduced) == 180) return 0.0;
    if (std::abs(reduced) == 90) return reduced > 0 ? 1.0 : -1.0;
    return exact::sin(reduced * std::numbers::pi / 180);
  };
  const auto cosine = [&](double angle) { return sine(angle + 90); };
  const double dx = degrees.x, dy = degrees.y, dz = degrees.z;
  const double sx = sine(dx), cx = cosine(dx), sy = sine(dy), cy = cosine(dy), sz = sine(dz),
               cz = cosine(dz);
  // The product Rz Ry Rx of the rotations about the axes.
  const double r[3][3] = {{cz * cy, cz * sy * sx - sz * cx, cz * sy * cx + sz * sx},
                          {sz * cy, sz * sy * sx + cz * cx, sz * sy * cx - cz * sx},
                          {-sy, cy * sx, cy * cx}};
  const double s[3] = {scale.x, scale.y, scale.z};
  const float translation[3] = {translate.x, translate.y, translate.z};
  Transform t;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) t.m[i][j] = static_cast<float>(r[i][j] * s[j]);
    t.m[i][3] = translation[i];
  }
  return t;
}

Model transformed(const Model& model, const Transform& t) {
  Model result = model;
  for (Vec3& p : result.points) p = apply(t, p);
  // The cofactor matrix is the inverse transpose times the determinant. It needs no division, so it
  // also serves transforms that flatten.
  const Vec3d row[3] = {{t.m[0][0], t.m[0][1], t.m[0][2]},
                        {t.m[1][0], t.m[1][1], t.m[1][2]},
                        {t.m[2][0], t.m[2][1], t.m[2][2]}};
  const Vec3d cofactor[3] = {cross(row[1], row[2]), cross(row[2], row[0]), cross(row[0], row[1])};
  const bool is_mirroring = determinant(t) < 0;
  const double sign = is_mirroring ? -1 : 1;
  for (Vec3& n : result.corner_normals) {
    const Vec3d m(n);
    n = to_float(
        normalized(Vec3d(dot(cofactor[0], m), dot(cofactor[1], m), dot(cofactor[2], m)) * sign));
  }
  if (!is_mirroring) return result;
  for (std::size_t i = 0; i < result.triangles.size(); ++i) {
    std::swap(result.triangles[i].v[1], result.triangles[i].v[2]);
    if (!result.corner_normals.empty())
      std::swap(result.corner_normals[3 * i + 1], result.corner_normals[3 * i + 2]);
    if (!result.corner_uvs.empty())
      std::swap(result.corner_uvs[3 * i + 1], result.corner_uvs[3 * i + 2]);
  }
  return result;
}

}  // namespace polymorph
