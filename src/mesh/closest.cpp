#include "mesh/closest.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "base/parallel.h"
#include "kernels/linear.h"
#include "kernels/simd_math.h"
#include "mesh/triangle_bvh.h"
#include "mesh/vertex_clustering.h"

namespace polymorph {
namespace {

/// Parameter in [0, 1] of the point of an edge that is closest to p: `along` is the dot product of
/// the edge and p, seen from the edge's start.
double edge_parameter(double along, double length2) {
  return length2 > 0 ? std::clamp(along / length2, 0.0, 1.0) : 0.0;
}

/// Weights of the closest point on the three edges, for triangles too thin to have a plane.
TriangleWeights weights_on_edges(Vec3d ap, Vec3d ab, Vec3d ac) {
  const Vec3d bp = ap - ab, bc = ac - ab;
  const double t = edge_parameter(dot(ab, ap), dot(ab, ab)),
               u = edge_parameter(dot(ac, ap), dot(ac, ac)),
               v = edge_parameter(dot(bc, bp), dot(bc, bc));
  const Vec3d rt = ap - ab * t, ru = ap - ac * u, rv = bp - bc * v;
  const double dt = dot(rt, rt), du = dot(ru, ru), dv = dot(rv, rv);
  if (dt <= du && dt <= dv) return {1 - t, t, 0};
  if (du <= dv) return {1 - u, 0, u};
  return {0, 1 - v, v};
}

/// Weights by Voronoi regions of the corners, the edges and the face (Ericson, Real-Time Collision
/// Detection, 5.1.5). Needs double precision: with floats, points far from a small triangle land
/// anywhere on it.
TriangleWeights weights_on_triangle(Vec3d ap, Vec3d ab, Vec3d ac) {
  const double d1 = dot(ab, ap), d2 = dot(ac, ap);
  if (d1 <= 0 && d2 <= 0) return {1, 0, 0};
  const double bb = dot(ab, ab), bc = dot(ab, ac), cc = dot(ac, ac);
  if (bb * cc - bc * bc <= 1e-12 * bb * cc) return weights_on_edges(ap, ab, ac);
  const double d3 = d1 - bb, d4 = d2 - bc;
  if (d3 >= 0 && d4 <= d3) return {0, 1, 0};
  const double d5 = d1 - bc, d6 = d2 - cc;
  if (d6 >= 0 && d5 <= d6) return {0, 0, 1};
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) {
    const double t = edge_parameter(d1, bb);
    return {1 - t, t, 0};
  }
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) {
    const double t = edge_parameter(d2, cc);
    return {1 - t, 0, t};
  }
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 >= d3 && d5 >= d6) {
    const double t = edge_parameter(d4 - d3, (d4 - d3) + (d5 - d6));
    return {0, 1 - t, t};
  }
  const double sum = va + vb + vc;
  return {1 - vb / sum - vc / sum, vb / sum, vc / sum};
}

struct Best {
  double distance2;
  std::uint32_t slot = TriangleBvh::kNone;      // TriangleBvh::corners
  std::uint32_t triangle = TriangleBvh::kNone;  // original index
  TriangleWeights weights = {};                 // of the closest point
};

struct StackEntry {
  float distance2;
  std::uint32_t child, count;
};

/// The triangles of a leaf as structure of arrays, in single precision. One vectorized pass decides
/// which of them need a test in double precision.
struct Leaf {
  static constexpr int kWidth = TriangleBvh::kLeafTriangles;
  float a[3][kWidth], ab[3][kWidth], ac[3][kWidth];
  float u[3][kWidth], v[3][kWidth];  ///< weight of b = u . ap, of c = v . ap, within the plane

  explicit Leaf(const TriangleBvh::Corners* corners) {
    for (int k = 0; k < kWidth; ++k) {
      const Vec3d p(corners[k].p[0]), e = Vec3d(corners[k].p[1]) - p,
                                      f = Vec3d(corners[k].p[2]) - p;
      const Vec3d n = cross(e, f);
      const double n2 = dot(n, n);
      // Without area the weights stay 0, which counts as outside: only the edges are tested.
      const Vec3d to_b = n2 > 0 ? cross(f, n) * (1 / n2) : Vec3d{},
                  to_c = n2 > 0 ? cross(n, e) * (1 / n2) : Vec3d{};
      set(a, k, p);
      set(ab, k, e);
      set(ac, k, f);
      set(u, k, to_b);
      set(v, k, to_c);
    }
  }

  /// Bit k is set if, within the accuracy of floats, triangle k is no further from p than the
  /// square root of `limit`.
  unsigned candidates(Vec3 p, float limit) const {
    float excess[kWidth];
    for (int k = 0; k < kWidth; ++k) {
      const float x = p.x - a[0][k], y = p.y - a[1][k], z = p.z - a[2][k];
      const float bx = ab[0][k], by = ab[1][k], bz = ab[2][k];
      const float cx = ac[0][k], cy = ac[1][k], cz = ac[2][k];
      const float pp = x * x + y * y + z * z, bb = bx * bx + by * by + bz * bz,
                  cc = cx * cx + cy * cy + cz * cz, bc = bx * cx + by * cy + bz * cz;
      const float pb = x * bx + y * by + z * bz, pc = x * cx + y * cy + z * cz;
      // The squared distance of the point with weights (1 - s - t, s, t).
      const auto distance2 = [=](float s, float t) {
        const float rx = x - s * bx - t * cx, ry = y - s * by - t * cy, rz = z - s * bz - t * cz;
        return rx * rx + ry * ry + rz * rz;
      };
      const auto ratio = [](float along, float total) {
        return min(max(along / max(total, 1e-37f), 0.0f), 1.0f);
      };
      const float on_bc = ratio(pc - pb + bb - bc, bb - 2 * bc + cc);
      const float on_edges = min(min(distance2(ratio(pb, bb), 0), distance2(0, ratio(pc, cc))),
                                 distance2(1 - on_bc, on_bc));
      const float s = x * u[0][k] + y * u[1][k] + z * u[2][k];
      const float t = x * v[0][k] + y * v[1][k] + z * v[2][k];
      const float on_face = min(min(s, t), 1 - s - t) > 0 ? distance2(s, t) : on_edges;
      excess[k] = min(on_edges, on_face) - 4e-6f * (pp + bb + cc);
    }
    unsigned bits = 0;
    for (int k = 0; k < kWidth; ++k) bits |= (excess[k] > limit ? 0u : 1u) << k;
    return bits;
  }

 private:
  static void set(float (&to)[3][kWidth], int k, Vec3d from) {
    to[0][k] = static_cast<float>(from.x);
    to[1][k] = static_cast<float>(from.y);
    to[2][k] = static_cast<float>(from.z);
  }
};

std::vector<Triangle> select_triangles(MeshView mesh, std::span<const std::uint32_t> faces) {
  std::vector<Triangle> selected;
  for (const std::uint32_t face : faces) selected.push_back(mesh.triangles[face]);
  return selected;
}

}  // namespace

TriangleWeights closest_on_triangle(Vec3 p, Vec3 a, Vec3 b, Vec3 c) {
  return weights_on_triangle(Vec3d(p) - Vec3d(a), Vec3d(b) - Vec3d(a), Vec3d(c) - Vec3d(a));
}

struct ClosestPointQuery::Tree {
  TriangleBvh bvh;
  std::vector<Leaf> leaves;

  void try_leaf(Vec3 from, const StackEntry& next, float limit, Best& best) const {
    unsigned bits = leaves[next.child / TriangleBvh::kLeafTriangles].candidates(from, limit) &
                    ((1u << next.count) - 1);
    for (; bits != 0; bits &= bits - 1) {
      const std::uint32_t slot = next.child + static_cast<std::uint32_t>(std::countr_zero(bits));
      const TriangleBvh::Corners& corners = bvh.corners[slot];
      const Vec3d a(corners.p[0]), ap = Vec3d(from) - a, ab = Vec3d(corners.p[1]) - a,
                                   ac = Vec3d(corners.p[2]) - a;
      const TriangleWeights w = weights_on_triangle(ap, ab, ac);
      const Vec3d r = ap - ab * w.b - ac * w.c;
      const double distance2 = dot(r, r);
      const std::uint32_t triangle = bvh.triangles[slot];
      if (distance2 < best.distance2 || (distance2 == best.distance2 && triangle < best.triangle))
        best = {distance2, slot, triangle, w};
    }
  }
};

ClosestPointQuery::ClosestPointQuery(MeshView mesh) : tree_(std::make_unique<Tree>()) {
  tree_->bvh = build_split_bvh(mesh.points, mesh.triangles);
  // Thousands of long triangles that are strewn or share a point are all about as close as the
  // closest one. Those of a coarse surface have boxes that overlap little, and are not split.
  const std::vector<std::uint32_t> thinned =
      tree_->bvh.is_split ? thin_long_triangles(mesh) : std::vector<std::uint32_t>();
  if (!thinned.empty()) tree_->bvh = build_split_bvh(mesh.points, select_triangles(mesh, thinned));
  const std::vector<TriangleBvh::Corners>& corners = tree_->bvh.corners;
  tree_->leaves.reserve(corners.size() / TriangleBvh::kLeafTriangles);
  for (std::size_t slot = 0; slot < corners.size(); slot += TriangleBvh::kLeafTriangles)
    tree_->leaves.emplace_back(&corners[slot]);
  for (std::uint32_t& triangle : tree_->bvh.triangles)
    if (triangle < thinned.size()) triangle = thinned[triangle];
}
ClosestPointQuery::ClosestPointQuery(MeshView mesh, std::span<const std::uint32_t> faces)
    : ClosestPointQuery(MeshView(mesh.points, select_triangles(mesh, faces))) {
  for (std::uint32_t& triangle : tree_->bvh.triangles)
    if (triangle < faces.size()) triangle = faces[triangle];
}
ClosestPointQuery::~ClosestPointQuery() = default;
ClosestPointQuery::ClosestPointQuery(ClosestPointQuery&&) noexcept = default;
ClosestPointQuery& ClosestPointQuery::operator=(ClosestPointQuery&&) noexcept = default;

ClosestPoint ClosestPointQuery::closest(Vec3 from, float max_distance) const {
  const TriangleBvh& bvh = tree_->bvh;
  Best best{static_cast<double>(max_distance) * static_cast<double>(max_distance)};
  // Distances to boxes are rounded; this slack keeps triangles that are as close as the best one.
  // Thousands of split triangles may share their closest point, and any of them will do.
  const double slack = tree_->bvh.is_split ? 1 - 1e-4 : 1 + 1e-6;
  const auto bound = [&] { return static_cast<float>(best.distance2 * slack); };
  StackEntry stack[TriangleBvh::kStackSize];
  int stack_size = 0;
  if (!bvh.nodes.empty()) stack[stack_size++] = {0, 0, 0};
  while (stack_size > 0) {
    const StackEntry next = stack[--stack_size];
    const float limit = bound();
    if (next.distance2 > limit) continue;
    if (next.count > 0) {
      tree_->try_leaf(from, next, limit, best);
      continue;
    }
    const TriangleBvh::Node& node = bvh.nodes[next.child];
    float distance2[TriangleBvh::kWidth];
    for (int k = 0; k < TriangleBvh::kWidth; ++k) {
      const float x = max(max(node.low[0][k] - from.x, from.x - node.high[0][k]), 0);
      const float y = max(max(node.low[1][k] - from.y, from.y - node.high[1][k]), 0);
      const float z = max(max(node.low[2][k] - from.z, from.z - node.high[2][k]), 0);
      distance2[k] = x * x + y * y + z * z;
    }
    unsigned bits = 0;
    for (int k = 0; k < TriangleBvh::kWidth; ++k)
      bits |= (distance2[k] <= limit && node.child[k] != TriangleBvh::kNone ? 1u : 0u) << k;
    const int first = stack_size;
    for (; bits != 0; bits &= bits - 1) {
      const int k = std::countr_zero(bits);
      // Keep the stack sorted, the nearest child on top.
      int top = stack_size++;
      for (; top > first && stack[top - 1].distance2 < distance2[k]; --top)
        stack[top] = stack[top - 1];
      stack[top] = {distance2[k], node.child[k], node.count[k]};
    }
  }
  if (best.slot == TriangleBvh::kNone) return {from, max_distance, ClosestPoint::kNoTriangle};
  const TriangleBvh::Corners& corners = bvh.corners[best.slot];
  const Vec3d a(corners.p[0]), b(corners.p[1]), c(corners.p[2]);
  const TriangleWeights& w = best.weights;
  return {to_float(a + (b - a) * w.b + (c - a) * w.c),
          static_cast<float>(std::sqrt(best.distance2)), best.triangle};
}

ClosestPoint ClosestPointQuery::closest(Vec3 from, Vec3 neighbour,
                                        const ClosestPoint& neighbour_hit,
                                        float max_distance) const {
  // The neighbour's closest point bounds the distance. Split triangles are excluded: there any of
  // several equally close points may be returned, and the bound would change which.
  constexpr float kRounding = 1.0001f;
  if (tree_->bvh.is_split || neighbour_hit.triangle == ClosestPoint::kNoTriangle)
    return closest(from, max_distance);
  ClosestPoint hit =
      closest(from, min(max_distance, kRounding * length(from - neighbour_hit.point)));
  // The neighbour's closest point is rounded: next to the surface it may be closer than the
  // surface.
  if (hit.triangle == ClosestPoint::kNoTriangle)
    hit = closest(
        from, min(max_distance, kRounding * (neighbour_hit.distance + length(from - neighbour))));
  if (hit.triangle == ClosestPoint::kNoTriangle) hit.distance = max_distance;
  return hit;
}

std::vector<ClosestPoint> ClosestPointQuery::closest(std::span<const Vec3> from,
                                                     float max_distance) const {
  std::vector<ClosestPoint> hits(from.size());
  // Consecutive points are usually close to each other.
  parallel_ranges(
      static_cast<std::int64_t>(from.size()), 256, [&](std::int64_t begin, std::int64_t end) {
        for (auto k = static_cast<std::size_t>(begin); k < static_cast<std::size_t>(end); ++k)
          hits[k] = k > static_cast<std::size_t>(begin)
                        ? closest(from[k], from[k - 1], hits[k - 1], max_distance)
                        : closest(from[k], max_distance);
      });
  return hits;
}

TriangleWeights weights_at(MeshView mesh, const ClosestPoint& hit) {
  const Triangle& t = mesh.triangles[hit.triangle];
  return closest_on_triangle(hit.point, mesh.points[t.v[0]], mesh.points[t.v[1]],
                             mesh.points[t.v[2]]);
}

Vec3 interpolate_normal(MeshView mesh, std::span<const Vec3> corner_normals,
                        const ClosestPoint& hit) {
  const TriangleWeights w = weights_at(mesh, hit);
  const std::size_t c = 3 * std::size_t{hit.triangle};
  return corner_normals[c] * static_cast<float>(w.a) +
         corner_normals[c + 1] * static_cast<float>(w.b) +
         corner_normals[c + 2] * static_cast<float>(w.c);
}

}  // namespace polymorph
