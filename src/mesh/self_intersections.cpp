#include "mesh/self_intersections.h"

#include <algorithm>
#include <vector>

#include "base/parallel.h"
#include "kernels/linear.h"

namespace polymorph {
namespace {

/// Six times the signed volume of a tetrahedron; exactly 0 if rounding could have decided its sign.
double signed_volume(Vec3d a, Vec3d b, Vec3d c, Vec3d p) {
  const Vec3d ab = b - a, ac = c - a, ap = p - a;
  const double volume = dot(cross(ab, ac), ap);
  const double size = length(ab) * length(ac) * length(ap);
  return std::abs(volume) > 1e-10 * size ? volume : 0;
}

/// Tests whether an edge of triangle s passes through the interior of t, with its ends strictly on
/// opposite sides. `sides`: signed volumes of the corners of s with t.
bool pierces(const Vec3d (&s)[3], const double (&sides)[3], const Vec3d (&t)[3]) {
  for (int k = 0; k < 3; ++k) {
    const int next = (k + 1) % 3;
    if (!(sides[k] * sides[next] < 0)) continue;
    // The edge's line passes through t if all edges of t run around it in the same direction.
    const double x = signed_volume(s[k], s[next], t[0], t[1]),
                 y = signed_volume(s[k], s[next], t[1], t[2]),
                 z = signed_volume(s[k], s[next], t[2], t[0]);
    if ((x > 0 && y > 0 && z > 0) || (x < 0 && y < 0 && z < 0)) return true;
  }
  return false;
}

bool have_common_corner(const Triangle& a, const Triangle& b) {
  for (const std::uint32_t i : a.v)
    for (const std::uint32_t j : b.v)
      if (i == j) return true;
  return false;
}

bool cross_properly(MeshView mesh, const Triangle& s, const Triangle& t) {
  const auto corners = [&](const Triangle& from, Vec3d(&to)[3]) {
    for (int k = 0; k < 3; ++k) to[k] = Vec3d(mesh.points[from.v[k]]);
  };
  Vec3d a[3], b[3];
  corners(s, a);
  corners(t, b);
  double sides_a[3], sides_b[3];
  // The plane of t rejects nearly all pairs.
  for (int k = 0; k < 3; ++k) sides_a[k] = signed_volume(b[0], b[1], b[2], a[k]);
  if ((sides_a[0] > 0 && sides_a[1] > 0 && sides_a[2] > 0) ||
      (sides_a[0] < 0 && sides_a[1] < 0 && sides_a[2] < 0))
    return false;
  for (int k = 0; k < 3; ++k) sides_b[k] = signed_volume(a[0], a[1], a[2], b[k]);
  return pierces(a, sides_a, b) || pierces(b, sides_b, a);
}

/// Triangles that cross one triangle.
struct Crossings {
  std::vector<std::uint32_t> triangles;  ///< ascending; only those of higher index
  std::size_t work = 0;                  ///< steps: one per box, kPairWork per pair
};
constexpr std::size_t kPairWork = 16;

/// Finds at most `max_pairs` triangles that cross triangle `t`.
Crossings find_crossings(MeshView mesh, const TriangleBvh& bvh, std::uint32_t t,
                         std::size_t max_pairs) {
  Crossings result;
  std::vector<std::uint32_t>& crossing = result.triangles;
  const Triangle& triangle = mesh.triangles[t];
  Box box;
  for (const std::uint32_t v : triangle.v) box = extend(box, mesh.points[v]);
  for_each_touching_leaf(
      bvh.nodes, box,
      [&] { return crossing.size() < max_pairs && result.work < SelfIntersections::kMaxWork; },
      [&](std::uint32_t first, std::uint32_t count) {
        result.work += count;
        for (std::uint32_t slot = first; slot < first + count; ++slot) {
          const std::uint32_t other = bvh.triangles[slot];
          if (other <= t || !bounds_touch(bvh.corners[slot], box) ||
              have_common_corner(triangle, mesh.triangles[other]))
            continue;
          result.work += kPairWork;
          if (cross_properly(mesh, triangle, mesh.triangles[other])) crossing.push_back(other);
        }
      });
  std::sort(crossing.begin(), crossing.end());
  return result;
}

}  // namespace

SelfIntersections count_self_intersections(MeshView mesh, const TriangleBvh& bvh,
                                           std::size_t max_pairs) {
  constexpr std::size_t kBatch = 1024;  // small, because work_left is updated only between batches
  std::size_t work_left = (std::size_t{1} << 26) + 128 * mesh.triangles.size();
  SelfIntersections result;
  // Batches have a fixed size, so that the result does not depend on the number of threads.
  for (std::size_t begin = 0; begin < mesh.triangles.size() && !result.stopped; begin += kBatch) {
    const std::size_t count = std::min(kBatch, mesh.triangles.size() - begin);
    std::vector<Crossings> crossings(count);
    parallel_for(
        static_cast<std::int64_t>(count),
        [&](std::int64_t i) {
          const auto k = static_cast<std::size_t>(i);
          crossings[k] =
              find_crossings(mesh, bvh, static_cast<std::uint32_t>(begin + k), max_pairs);
        },
        /*grain=*/16);
    for (std::size_t k = 0; k < count && !result.stopped; ++k) {
      work_left -= std::min(work_left, crossings[k].work);
      result.crowded = result.crowded || crossings[k].work >= SelfIntersections::kMaxWork;
      if (crossings[k].triangles.empty()) continue;
      if (result.pairs == 0) {
        result.first[0] = static_cast<std::uint32_t>(begin + k);
        result.first[1] = crossings[k].triangles.front();
      }
      result.pairs = std::min(max_pairs, result.pairs + crossings[k].triangles.size());
      result.stopped = result.pairs == max_pairs;
    }
    if (work_left == 0 && begin + count < mesh.triangles.size())
      result.crowded = result.stopped = true;
  }
  result.stopped = result.stopped || result.crowded;
  return result;
}

}  // namespace polymorph
