#include "mesh/self_intersections.h"

#include <algorithm>
#include <vector>

#include "base/parallel.h"
#include "kernels/linear.h"

namespace polymorph {
namespace {

/// Six times the volume of the tetrahedron; exactly 0 where rounding could have made its sign.
double side_of(Vec3d a, Vec3d b, Vec3d c, Vec3d p) {
  const Vec3d ab = b - a, ac = c - a, ap = p - a;
  const double volume = dot(cross(ab, ac), ap);
  const double size = length(ab) * length(ac) * length(ap);
  return std::abs(volume) > 1e-10 * size ? volume : 0;
}

/// An edge of triangle s, whose corners have these sides of triangle t's plane, passes through the
/// inside of t, its ends strictly on either side.
bool pierces(const Vec3d (&s)[3], const double (&sides)[3], const Vec3d (&t)[3]) {
  for (int k = 0; k < 3; ++k) {
    const int next = (k + 1) % 3;
    if (!(sides[k] * sides[next] < 0)) continue;
    const double x = side_of(s[k], s[next], t[0], t[1]), y = side_of(s[k], s[next], t[1], t[2]),
                 z = side_of(s[k], s[next], t[2], t[0]);
    if ((x > 0 && y > 0 && z > 0) || (x < 0 && y < 0 && z < 0)) return true;
  }
  return false;
}

bool share_a_point(const Triangle& a, const Triangle& b) {
  for (const std::uint32_t i : a.v)
    for (const std::uint32_t j : b.v)
      if (i == j) return true;
  return false;
}

bool cross_properly(MeshView mesh, const Triangle& s, const Triangle& t) {
  const auto corners = [&](const Triangle& from, Vec3d(&to)[3]) {
    for (int k = 0; k < 3; ++k) to[k] = Vec3d(mesh.points[from.v[k]]);
  };
  // Nearly all pairs end at the first plane.
  Vec3d a[3], b[3];
  corners(s, a);
  corners(t, b);
  double of_a[3], of_b[3];
  for (int k = 0; k < 3; ++k) of_a[k] = side_of(b[0], b[1], b[2], a[k]);
  if ((of_a[0] > 0 && of_a[1] > 0 && of_a[2] > 0) || (of_a[0] < 0 && of_a[1] < 0 && of_a[2] < 0))
    return false;
  for (int k = 0; k < 3; ++k) of_b[k] = side_of(a[0], a[1], a[2], b[k]);
  return pierces(a, of_a, b) || pierces(b, of_b, a);
}

bool boxes_touch(const Box& box, const TriangleBvh::Corners& c) {
  const Vec3 low = min(c.p[0], min(c.p[1], c.p[2])), high = max(c.p[0], max(c.p[1], c.p[2]));
  return box.low.x <= high.x && box.high.x >= low.x && box.low.y <= high.y && box.high.y >= low.y &&
         box.low.z <= high.z && box.high.z >= low.z;
}

/// What was found around one triangle.
struct Crossings {
  std::vector<std::uint32_t> triangles;  ///< those above it that cross it, ascending
  std::size_t work = 0;                  ///< one per box, kPairWork per pair
};
constexpr std::size_t kPairWork = 16;

/// At most `max_pairs` of them.
Crossings crossing(MeshView mesh, const TriangleBvh& bvh, std::uint32_t t, std::size_t max_pairs) {
  Crossings result;
  std::vector<std::uint32_t>& found = result.triangles;
  const Triangle& triangle = mesh.triangles[t];
  Box box;
  for (const std::uint32_t v : triangle.v) box = extend(box, mesh.points[v]);
  std::uint32_t stack[TriangleBvh::kStackSize];
  int waiting = 0;
  stack[waiting++] = 0;
  while (waiting > 0 && found.size() < max_pairs && result.work < SelfIntersections::kMaxWork) {
    const TriangleBvh::Node& node = bvh.nodes[stack[--waiting]];
    const unsigned touching = children_touching(node, box);
    for (int k = 0; k < TriangleBvh::kWidth; ++k) {
      if (!(touching >> k & 1)) continue;
      if (node.count[k] == 0) {
        stack[waiting++] = node.child[k];
        continue;
      }
      result.work += node.count[k];
      for (std::uint32_t slot = node.child[k]; slot < node.child[k] + node.count[k]; ++slot) {
        const std::uint32_t other = bvh.triangles[slot];
        if (other <= t || !boxes_touch(box, bvh.corners[slot]) ||
            share_a_point(triangle, mesh.triangles[other]))
          continue;
        result.work += kPairWork;
        if (cross_properly(mesh, triangle, mesh.triangles[other])) found.push_back(other);
      }
    }
  }
  std::sort(found.begin(), found.end());
  return result;
}

}  // namespace

SelfIntersections count_self_intersections(MeshView mesh, const TriangleBvh& bvh,
                                           std::size_t max_pairs) {
  constexpr std::size_t kBatch = 1024;  // small, as what is left is known between them only
  std::size_t left = (std::size_t{1} << 26) + 128 * mesh.triangles.size();
  SelfIntersections result;
  // Batches of fixed size, so that where it stops does not depend on threads.
  for (std::size_t begin = 0; begin < mesh.triangles.size() && !result.stopped; begin += kBatch) {
    const std::size_t count = std::min(kBatch, mesh.triangles.size() - begin);
    std::vector<Crossings> found(count);
    parallel_for(
        static_cast<std::int64_t>(count),
        [&](std::int64_t i) {
          const auto k = static_cast<std::size_t>(i);
          found[k] = crossing(mesh, bvh, static_cast<std::uint32_t>(begin + k), max_pairs);
        },
        16);
    for (std::size_t k = 0; k < count && !result.stopped; ++k) {
      left -= std::min(left, found[k].work);
      result.crowded = result.crowded || found[k].work >= SelfIntersections::kMaxWork;
      if (found[k].triangles.empty()) continue;
      if (result.pairs == 0) {
        result.first[0] = static_cast<std::uint32_t>(begin + k);
        result.first[1] = found[k].triangles.front();
      }
      result.pairs = std::min(max_pairs, result.pairs + found[k].triangles.size());
      result.stopped = result.pairs == max_pairs;
    }
    if (left == 0 && begin + count < mesh.triangles.size()) result.crowded = result.stopped = true;
  }
  result.stopped = result.stopped || result.crowded;
  return result;
}

}  // namespace polymorph
