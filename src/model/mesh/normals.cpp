#include "model/mesh/normals.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "base/disjoint_sets.h"
#include "base/exact_math.h"
#include "kernels/linear.h"
#include "model/mesh/edges.h"

namespace polymorph {
namespace {

Vec3d point(const Model& model, std::size_t triangle, std::size_t k) {
  return Vec3d(model.points[model.triangles[triangle].v[k]]);
}

/// Twice the area, along the normal.
Vec3d area_vector(const Model& model, std::size_t t) {
  const Vec3d a = point(model, t, 0);
  return cross(point(model, t, 1) - a, point(model, t, 2) - a);
}

double angle_at(const Model& model, std::size_t t, std::size_t k) {
  const Vec3d a = point(model, t, k);
  const Vec3d b = point(model, t, (k + 1) % 3) - a, c = point(model, t, (k + 2) % 3) - a;
  return exact::atan2(length(cross(b, c)), dot(b, c));
}

/// Sums of area x angle x normal over corners, by the slot that `slot_of(triangle, k)` says.
template <class F>
std::vector<Vec3d> weighted_sums(const Model& model, std::size_t slots, const F& slot_of) {
  std::vector<Vec3d> sums(slots);
  for (std::size_t t = 0; t < model.triangles.size(); ++t) {
    const Vec3d area = area_vector(model, t);
    for (std::size_t k = 0; k < 3; ++k) {
      Vec3d& sum = sums[slot_of(t, k)];
      sum = sum + area * angle_at(model, t, k);
    }
  }
  return sums;
}

double determinant(const Transform& t) {
  const Vec3d x(t.m[0][0], t.m[0][1], t.m[0][2]), y(t.m[1][0], t.m[1][1], t.m[1][2]),
      z(t.m[2][0], t.m[2][1], t.m[2][2]);
  return dot(x, cross(y, z));
}

}  // namespace

Vec3 apply(const Transform& t, Vec3 p) {
  Vec3 q;
  float* out[3] = {&q.x, &q.y, &q.z};
  for (int i = 0; i < 3; ++i)
    *out[i] = t.m[i][0] * p.x + t.m[i][1] * p.y + t.m[i][2] * p.z + t.m[i][3];
  return q;
}

Transform compose(const Transform& second, const Transform& first) {
  Transform out;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 4; ++j) {
      double sum = j == 3 ? static_cast<double>(second.m[i][3]) : 0.0;
      for (int k = 0; k < 3; ++k)
        sum += static_cast<double>(second.m[i][k]) * static_cast<double>(first.m[k][j]);
      out.m[i][j] = static_cast<float>(sum);
    }
  return out;
}

Transform make_transform(Vec3 translate, Vec3 degrees, Vec3 scale) {
  // Exact at quarter turns, so that turned boxes stay axis-aligned.
  const auto sine = [](double angle) {
    const double turn = std::remainder(angle, 360.0);
    if (turn == 0 || std::abs(turn) == 180) return 0.0;
    if (std::abs(turn) == 90) return turn > 0 ? 1.0 : -1.0;
    return exact::sin(turn * std::numbers::pi / 180);
  };
  const auto cosine = [&](double angle) { return sine(angle + 90); };
  const double dx = degrees.x, dy = degrees.y, dz = degrees.z;
  const double sx = sine(dx), cx = cosine(dx), sy = sine(dy), cy = cosine(dy), sz = sine(dz),
               cz = cosine(dz);
  // Rz Ry Rx
  const double r[3][3] = {{cz * cy, cz * sy * sx - sz * cx, cz * sy * cx + sz * sx},
                          {sz * cy, sz * sy * sx + cz * cx, sz * sy * cx - cz * sx},
                          {-sy, cy * sx, cy * cx}};
  const double s[3] = {scale.x, scale.y, scale.z};
  const float move[3] = {translate.x, translate.y, translate.z};
  Transform t;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) t.m[i][j] = static_cast<float>(r[i][j] * s[j]);
    t.m[i][3] = move[i];
  }
  return t;
}

Model transformed(const Model& model, const Transform& t) {
  Model out = model;
  for (Vec3& p : out.points) p = apply(t, p);
  // Cofactors are the inverse transpose times the determinant: no division, so flat scales survive
  // too.
  const Vec3d row[3] = {{t.m[0][0], t.m[0][1], t.m[0][2]},
                        {t.m[1][0], t.m[1][1], t.m[1][2]},
                        {t.m[2][0], t.m[2][1], t.m[2][2]}};
  const Vec3d cofactor[3] = {cross(row[1], row[2]), cross(row[2], row[0]), cross(row[0], row[1])};
  const bool mirrors = determinant(t) < 0;
  const double sign = mirrors ? -1 : 1;
  for (Vec3& n : out.corner_normals) {
    const Vec3d m(n);
    n = to_float(
        normalized(Vec3d(dot(cofactor[0], m), dot(cofactor[1], m), dot(cofactor[2], m)) * sign));
  }
  if (!mirrors) return out;
  for (std::size_t i = 0; i < out.triangles.size(); ++i) {
    std::swap(out.triangles[i].v[1], out.triangles[i].v[2]);
    if (!out.corner_normals.empty())
      std::swap(out.corner_normals[3 * i + 1], out.corner_normals[3 * i + 2]);
    if (!out.corner_uvs.empty()) std::swap(out.corner_uvs[3 * i + 1], out.corner_uvs[3 * i + 2]);
  }
  return out;
}

std::vector<Vec3> face_normals(const Model& model) {
  std::vector<Vec3> normals(model.triangles.size());
  for (std::size_t t = 0; t < normals.size(); ++t)
    normals[t] = to_float(normalized(area_vector(model, t)));
  return normals;
}

std::vector<Vec3> point_normals(const Model& model) {
  const auto sums = weighted_sums(model, model.points.size(), [&](std::size_t t, std::size_t k) {
    return model.triangles[t].v[k];
  });
  std::vector<Vec3> normals(sums.size());
  for (std::size_t i = 0; i < sums.size(); ++i) normals[i] = to_float(normalized(sums[i]));
  return normals;
}

std::vector<Vec3> creased_normals(const Model& model, float crease_degrees) {
  const std::vector<Vec3> faces = face_normals(model);
  const double min_cosine =
      exact::cos(static_cast<double>(crease_degrees) * std::numbers::pi / 180);
  DisjointSets smooth(model.triangles.size() * 3);
  const std::vector<EdgeUse> uses = sorted_edge_uses(model.triangles);
  for_each_edge(uses, [&](std::size_t first, std::size_t last) {
    if (last - first != 2 || uses[first].forward == uses[first + 1].forward) return;
    const EdgeUse &a = uses[first], &b = uses[first + 1];
    if (dot(faces[a.corner / 3], faces[b.corner / 3]) < min_cosine) return;
    smooth.join(low_corner(a), low_corner(b));
    smooth.join(high_corner(a), high_corner(b));
  });
  const auto set_of = [&](std::size_t t, std::size_t k) {
    return smooth.find(static_cast<std::uint32_t>(3 * t + k));
  };
  const std::vector<Vec3d> sums = weighted_sums(model, model.triangles.size() * 3, set_of);
  std::vector<Vec3> normals(sums.size());
  std::vector<Vec3> fallback;
  for (std::size_t t = 0; t < model.triangles.size(); ++t)
    for (std::size_t k = 0; k < 3; ++k) {
      Vec3 n = to_float(normalized(sums[set_of(t, k)]));
      if (n == Vec3{}) {
        if (fallback.empty()) fallback = point_normals(model);
        n = fallback[model.triangles[t].v[k]];
      }
      normals[3 * t + k] = n == Vec3{} ? Vec3{0, 1, 0} : n;
    }
  return normals;
}

double volume_of(const Model& model) {
  if (model.points.empty()) return 0;
  const Vec3d origin(model.box().center());  // keeps the terms small for models far from the origin
  double sum = 0;
  for (std::size_t t = 0; t < model.triangles.size(); ++t)
    sum += dot(point(model, t, 0) - origin,
               cross(point(model, t, 1) - origin, point(model, t, 2) - origin));
  return sum / 6;
}

double area_of(const Model& model) {
  double sum = 0;
  for (std::size_t t = 0; t < model.triangles.size(); ++t) sum += length(area_vector(model, t));
  return sum / 2;
}

}  // namespace polymorph
