#include "mesh/normals.h"

#include <numbers>

#include "base/disjoint_sets.h"
#include "base/exact_math.h"
#include "kernels/linear.h"
#include "mesh/edges.h"

namespace polymorph {
namespace {

Vec3d point(MeshView mesh, std::size_t triangle, std::size_t k) {
  return Vec3d(mesh.points[mesh.triangles[triangle].v[k]]);
}

/// A vector along the triangle's normal whose length is twice the area.
Vec3d doubled_area_vector(MeshView mesh, std::size_t t) {
  const Vec3d a = point(mesh, t, 0);
  return cross(point(mesh, t, 1) - a, point(mesh, t, 2) - a);
}

double angle_at(MeshView mesh, std::size_t t, std::size_t k) {
  const Vec3d a = point(mesh, t, k);
  const Vec3d b = point(mesh, t, (k + 1) % 3) - a, c = point(mesh, t, (k + 2) % 3) - a;
  return exact::atan2(length(cross(b, c)), dot(b, c));
}

/// Sums area * angle * normal of each corner k of each triangle into the slot `slot_at(triangle,
/// k)`.
template <class F>
std::vector<Vec3d> weighted_sums(MeshView mesh, std::size_t slots, const F& slot_at) {
  std::vector<Vec3d> sums(slots);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Vec3d area = doubled_area_vector(mesh, t);
    for (std::size_t k = 0; k < 3; ++k) {
      Vec3d& sum = sums[slot_at(t, k)];
      sum = sum + area * angle_at(mesh, t, k);
    }
  }
  return sums;
}

}  // namespace

std::vector<Vec3> face_normals(MeshView mesh) {
  std::vector<Vec3> normals(mesh.triangles.size());
  for (std::size_t t = 0; t < normals.size(); ++t)
    normals[t] = to_float(normalized(doubled_area_vector(mesh, t)));
  return normals;
}

std::vector<Vec3> point_normals(MeshView mesh) {
  const auto sums = weighted_sums(mesh, mesh.points.size(), [&](std::size_t t, std::size_t k) {
    return mesh.triangles[t].v[k];
  });
  std::vector<Vec3> normals(sums.size());
  for (std::size_t i = 0; i < sums.size(); ++i) normals[i] = to_float(normalized(sums[i]));
  return normals;
}

std::vector<Vec3> creased_normals(MeshView mesh, float crease_degrees) {
  const std::vector<Vec3> faces = face_normals(mesh);
  const double min_cosine =
      exact::cos(static_cast<double>(crease_degrees) * std::numbers::pi / 180);
  DisjointSets smoothing_groups(mesh.triangles.size() * 3);
  const std::vector<EdgeUse> uses = sorted_edge_uses(mesh.triangles);
  for_each_edge(uses, [&](std::size_t first, std::size_t last) {
    if (last - first != 2 || uses[first].forward == uses[first + 1].forward) return;
    const EdgeUse &a = uses[first], &b = uses[first + 1];
    if (dot(faces[a.corner / 3], faces[b.corner / 3]) < min_cosine) return;
    smoothing_groups.join(low_corner(a), low_corner(b));
    smoothing_groups.join(high_corner(a), high_corner(b));
  });
  const auto group_at = [&](std::size_t t, std::size_t k) {
    return smoothing_groups.find(static_cast<std::uint32_t>(3 * t + k));
  };
  const std::vector<Vec3d> sums = weighted_sums(mesh, mesh.triangles.size() * 3, group_at);
  std::vector<Vec3> normals(sums.size());
  std::vector<Vec3> fallback;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    for (std::size_t k = 0; k < 3; ++k) {
      Vec3 n = to_float(normalized(sums[group_at(t, k)]));
      if (n == Vec3{}) {
        if (fallback.empty()) fallback = point_normals(mesh);
        n = fallback[mesh.triangles[t].v[k]];
      }
      normals[3 * t + k] = n == Vec3{} ? Vec3{0, 1, 0} : n;  // any unit vector will do
    }
  return normals;
}

double volume_of(MeshView mesh) {
  if (mesh.points.empty()) return 0;
  const Vec3d origin(mesh.box().center());  // keeps the terms small for models far from the origin
  double sum = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    sum += dot(point(mesh, t, 0) - origin,
               cross(point(mesh, t, 1) - origin, point(mesh, t, 2) - origin));
  return sum / 6;
}

double area_of(MeshView mesh) {
  double sum = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    sum += length(doubled_area_vector(mesh, t));
  return sum / 2;
}

}  // namespace polymorph
