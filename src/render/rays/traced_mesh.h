// Exact ray-mesh intersection tests that leave no gaps at edges and corners.
#pragma once

#include "render/rays/intersect_triangle.h"
#include "render/rays/ray.h"

namespace polymorph {

/// A mesh prepared for tracing. `Mesh` has the members of RenderMesh for geometry; `Indices` is an
/// array type.
template <class Mesh, class Indices>
struct TracedMeshOf {
  const Mesh* mesh = nullptr;
  float shutter = 0;   ///< time that the shutter is open, in frames
  double margin2 = 0;  ///< square of the maximum error of Embree's floats, in scene units squared
  double near_limit = 0;  ///< no edge is near if the edge functions all exceed this in magnitude
  /// The triangles around vertex v are fans[fan_begin[v]] ... fans[fan_begin[v + 1] - 1].
  Indices fan_begin, fans;

  PM_HD bool moves() const { return shutter > 0 && !mesh->displacement.empty(); }
  /// Position of a vertex at a time while the shutter is open, [0, 1].
  PM_HD Vec3 at(std::uint32_t vertex, float time) const {
    const Vec3 p = mesh->positions[vertex];
    return moves() ? p + mesh->displacement[vertex] * (shutter * (time - 0.5f)) : p;
  }
};

template <class Traced>
PM_HD [[gnu::always_inline]] inline EdgeFunctions compute_edge_functions(const Traced& traced,
                                                                         const Triangle& t,
                                                                         const Ray& ray,
                                                                         Vec3d direction) {
  return {ray.origin, direction, traced.at(t.v[0], ray.time), traced.at(t.v[1], ray.time),
          traced.at(t.v[2], ray.time)};
}

/// Returns the corner of `t` at vertex v, or -1.
PM_HD inline int find_corner(const Triangle& t, std::uint32_t v) {
  for (int k = 0; k < 3; ++k)
    if (t.v[k] == v) return k;
  return -1;
}

/// Neighbouring triangles at edges and corners, for exact tests of rays that pass close to them.
template <class Traced>
class EdgeNeighborhood {
 public:
  PM_HD EdgeNeighborhood(const Traced& traced, const Ray& ray)
      : traced_(traced), ray_(ray), d_(ray.direction) {}

  /// Calls f(other) for all triangles, `triangle` included, that share a corner with an edge of
  /// `triangle` close to the ray; for some of them more than once.
  template <class F>
  PM_HD void for_each_near(std::uint32_t triangle, const EdgeFunctions& edges, const F& f) const {
    const Triangle& t = traced_.mesh->triangles[triangle];
    // Edge i is opposite to corner i, so the edges at corner k are k + 1 and k + 2.
    for (int k = 0; k < 3; ++k)
      if (edges.near((k + 1) % 3, traced_.margin2) || edges.near((k + 2) % 3, traced_.margin2))
        for (std::uint32_t i = traced_.fan_begin[t.v[k]]; i < traced_.fan_begin[t.v[k] + 1]; ++i)
          f(traced_.fans[i]);
  }

  /// Tests whether the mesh continues beyond every edge close to the ray. The ray must hit
  /// `triangle`.
  PM_HD_CALL bool is_covered(std::uint32_t triangle, const EdgeFunctions& edges) const {
    const Triangle& t = traced_.mesh->triangles[triangle];
    // At corner k, edge k + 1 ends and edge k + 2 begins.
    for (int k = 0; k < 3; ++k) {
      const bool near_incoming = edges.near((k + 1) % 3, traced_.margin2);
      const bool near_outgoing = edges.near((k + 2) % 3, traced_.margin2);
      // If the ray is close to both edges at a corner, all edges of the corner are tested.
      // Otherwise an edge is tested at its first corner.
      if (near_incoming && near_outgoing
              ? !is_corner_covered(t.v[k])
              : near_outgoing && !is_edge_covered(t.v[k], t.v[(k + 1) % 3], edges.sum > 0))
        return false;
    }
    return true;
  }

 private:
  /// Tests whether another triangle lies beyond the edge from v to w of a triangle. `front`: the
  /// triangle's EdgeFunctions::sum is positive.
  PM_HD bool is_edge_covered(std::uint32_t v, std::uint32_t w, bool front) const {
    for (std::uint32_t i = traced_.fan_begin[v]; i < traced_.fan_begin[v + 1]; ++i) {
      const Triangle& t = traced_.mesh->triangles[traced_.fans[i]];
      const int a = find_corner(t, v), b = find_corner(t, w);
      if (b < 0) continue;
      const bool is_same_direction = b == (a + 1) % 3;
      const double sum = compute_edge_functions(traced_, t, ray_, d_).sum;
      // Seen along the ray, `t` lies on the other side of the edge.
      if (is_same_direction ? (front ? sum < 0 : sum > 0) : (front ? sum > 0 : sum < 0))
        return true;
    }
    return false;
  }
  /// Tests whether other triangles lie beyond all edges close to the ray that meet at vertex v.
  PM_HD bool is_corner_covered(std::uint32_t v) const {
    for (std::uint32_t i = traced_.fan_begin[v]; i < traced_.fan_begin[v + 1]; ++i) {
      const Triangle& t = traced_.mesh->triangles[traced_.fans[i]];
      const EdgeFunctions edges = compute_edge_functions(traced_, t, ray_, d_);
      const int k = find_corner(t, v);
      if (edges.near((k + 2) % 3, traced_.margin2) &&
          !is_edge_covered(v, t.v[(k + 1) % 3], edges.sum > 0))
        return false;
      // The edge that ends at v is given in reverse, so the triangle's facing is reversed too.
      if (edges.near((k + 1) % 3, traced_.margin2) &&
          !is_edge_covered(v, t.v[(k + 2) % 3], edges.sum < 0))
        return false;
    }
    return true;
  }

  const Traced& traced_;
  const Ray& ray_;
  Vec3d d_;
};

/// Tests whether the line of a ray hits a triangle of the mesh, and computes the intersection if
/// so. It is a hit if the line passes through the triangle and if, wherever the line passes an edge
/// or corner so closely that floats cannot decide the side, the mesh continues beyond it. So a
/// mesh's outline shrinks by about a millionth of the scene's size, to where Embree finds the mesh
/// with any instruction set, and there are no gaps between triangles.
template <class Traced>
PM_HD bool intersects_triangle(const Traced& traced, std::uint32_t triangle, const Ray& ray,
                               TriangleIntersection& intersection) {
  const Vec3d d(ray.direction);
  const EdgeFunctions edges =
      compute_edge_functions(traced, traced.mesh->triangles[triangle], ray, d);
  if (!edges.inside()) return false;
  if (edges.closest() <= traced.near_limit && edges.near_any(traced.margin2) &&
      !EdgeNeighborhood(traced, ray).is_covered(triangle, edges))
    return false;
  intersection = compute_intersection(edges, d);
  return true;
}

}  // namespace polymorph
