// The exact decision whether a ray hits a triangle of a mesh, edges and corners included.
#pragma once

#include "render/rays/intersect_triangle.h"
#include "render/rays/ray.h"

namespace polymorph {

/// A mesh that is traced. `Mesh` has the geometry of a RenderMesh, `Indices` is an array.
template <class Mesh, class Indices>
struct TracedMeshOf {
  const Mesh* mesh = nullptr;
  float shutter = 0;
  double margin2 = 0;  ///< square of the maximum error of Embree's floats, in units of length
  double clear = 0;    ///< beyond this distance (EdgeSides::at) no edge of the mesh is near
  /// The triangles around vertex v are fans[fan_begin[v]] ... fans[fan_begin[v + 1] - 1].
  Indices fan_begin, fans;

  PM_HD bool moves() const { return shutter > 0 && !mesh->displacement.empty(); }
  /// Position of a vertex at a time of the shutter, [0, 1].
  PM_HD Vec3 at(std::uint32_t vertex, float time) const {
    const Vec3 p = mesh->positions[vertex];
    return moves() ? p + mesh->displacement[vertex] * (shutter * (time - 0.5f)) : p;
  }
};

template <class Traced>
PM_HD [[gnu::always_inline]] inline EdgeSides compute_sides(const Traced& traced, const Triangle& t,
                                                            const Ray& ray, Vec3d direction) {
  return {ray.origin, direction, traced.at(t.v[0], ray.time), traced.at(t.v[1], ray.time),
          traced.at(t.v[2], ray.time)};
}

/// The corner of `t` that is vertex v, or -1.
PM_HD inline int find_corner(const Triangle& t, std::uint32_t v) {
  for (int k = 0; k < 3; ++k)
    if (t.v[k] == v) return k;
  return -1;
}

/// The triangles around edges and corners of a mesh, for exact decisions about rays near them.
template <class Traced>
class EdgeNeighborhood {
 public:
  PM_HD EdgeNeighborhood(const Traced& traced, const Ray& ray)
      : traced_(traced), ray_(ray), d_(ray.direction) {}

  /// Calls f(triangle) for those around the corners of edges of `triangle` that the ray passes
  /// closely.
  template <class F>
  PM_HD void for_each_near(std::uint32_t triangle, const EdgeSides& sides, const F& f) const {
    const Triangle& t = traced_.mesh->triangles[triangle];
    for (int k = 0; k < 3; ++k)
      if (sides.near((k + 1) % 3, traced_.margin2) || sides.near((k + 2) % 3, traced_.margin2))
        for (std::uint32_t i = traced_.fan_begin[t.v[k]]; i < traced_.fan_begin[t.v[k] + 1]; ++i)
          f(traced_.fans[i]);
  }

  /// Tests whether there is mesh on the other side of every edge that the ray passes closely,
  /// beginning with a triangle that contains the ray.
  PM_HD_CALL bool is_covered(std::uint32_t triangle, const EdgeSides& sides) const {
    const Triangle& t = traced_.mesh->triangles[triangle];
    for (int k = 0; k < 3; ++k) {
      const bool left = sides.near((k + 1) % 3, traced_.margin2);
      const bool right = sides.near((k + 2) % 3, traced_.margin2);
      // An edge is tested from its first corner, a corner with all of its edges.
      if (left && right ? !is_corner_covered(t.v[k])
                        : right && !is_edge_covered(t.v[k], t.v[(k + 1) % 3], sides.sum > 0))
        return false;
    }
    return true;
  }

 private:
  /// Tests whether there is a triangle beyond the edge from v to w of a triangle that faces
  /// `front`.
  PM_HD bool is_edge_covered(std::uint32_t v, std::uint32_t w, bool front) const {
    for (std::uint32_t i = traced_.fan_begin[v]; i < traced_.fan_begin[v + 1]; ++i) {
      const Triangle& t = traced_.mesh->triangles[traced_.fans[i]];
      const int a = find_corner(t, v), b = find_corner(t, w);
      if (b < 0) continue;
      const bool along = b == (a + 1) % 3;
      const double sum = compute_sides(traced_, t, ray_, d_).sum;
      // Its projection along the ray lies on the other side of the edge.
      if (along ? (front ? sum < 0 : sum > 0) : (front ? sum > 0 : sum < 0)) return true;
    }
    return false;
  }
  PM_HD bool is_corner_covered(std::uint32_t v) const {
    for (std::uint32_t i = traced_.fan_begin[v]; i < traced_.fan_begin[v + 1]; ++i) {
      const Triangle& t = traced_.mesh->triangles[traced_.fans[i]];
      const EdgeSides sides = compute_sides(traced_, t, ray_, d_);
      const int k = find_corner(t, v);
      if (sides.near((k + 2) % 3, traced_.margin2) &&
          !is_edge_covered(v, t.v[(k + 1) % 3], sides.sum > 0))
        return false;
      if (sides.near((k + 1) % 3, traced_.margin2) &&
          !is_edge_covered(v, t.v[(k + 2) % 3], sides.sum < 0))
        return false;
    }
    return true;
  }

  const Traced& traced_;
  const Ray& ray_;
  Vec3d d_;
};

/// Tests whether the line of a ray hits a triangle of the mesh, and computes the intersection. The
/// line passes through the interior; where it passes an edge or corner so closely that floats
/// cannot decide the side, there must be mesh on the other side too. So a mesh ends about a
/// millionth of the stage's size inside its outline, where Embree finds it with any instruction
/// set, and there are no gaps between triangles.
template <class Traced>
PM_HD bool intersects_triangle(const Traced& traced, std::uint32_t triangle, const Ray& ray,
                               TriangleIntersection& intersection) {
  const Vec3d d(ray.direction);
  const EdgeSides sides = compute_sides(traced, traced.mesh->triangles[triangle], ray, d);
  if (!sides.inside()) return false;
  if (sides.closest() <= traced.clear && sides.near_any(traced.margin2) &&
      !EdgeNeighborhood(traced, ray).is_covered(triangle, sides))
    return false;
  intersection = compute_intersection(sides, d);
  return true;
}

}  // namespace polymorph
