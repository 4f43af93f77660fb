#include "model/thickness.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "base/parallel.h"
#include "kernels/linear.h"
#include "model/normals.h"
#include "model/sample_surface.h"

namespace polymorph {
namespace {

constexpr double kManyBalls = 1500;
constexpr std::size_t kMaxMet = 16384;  // by one ray, of faces that lie upon each other

/// Distance along the ray at which it meets the triangle, or infinity (Moeller and Trumbore 1997,
/// in double precision; edges count).
double intersect(Vec3d origin, Vec3d direction, const TriangleBvh::Corners& c) {
  const Vec3d a(c.p[0]), ab = Vec3d(c.p[1]) - a, ac = Vec3d(c.p[2]) - a;
  const Vec3d p = cross(direction, ac);
  const double determinant = dot(ab, p);
  if (determinant == 0) return INFINITY;
  const Vec3d s = origin - a, q = cross(s, ab);
  const double u = dot(s, p) / determinant, v = dot(direction, q) / determinant;
  if (u < 0 || v < 0 || u + v > 1) return INFINITY;
  return dot(ac, q) / determinant;
}

/// The nearest hit beyond `from`, not on triangle `self`: its distance, and whether the ray leaves
/// there (meets a face from behind).
struct Hit {
  double distance = INFINITY;
  bool leaves = false;
};

Hit first_hit(const TriangleBvh& bvh, Vec3d origin, Vec3d direction, double from,
              std::uint32_t self) {
  Hit hit;
  std::size_t met = 0;
  std::uint32_t stack[TriangleBvh::kStackSize];
  int waiting = 0;
  if (!bvh.nodes.empty()) stack[waiting++] = 0;
  const double o[3] = {origin.x, origin.y, origin.z},
               d[3] = {direction.x, direction.y, direction.z};
  while (waiting > 0 && met < kMaxMet) {
    const TriangleBvh::Node& node = bvh.nodes[stack[--waiting]];
    for (int k = 0; k < TriangleBvh::kWidth; ++k) {
      if (node.child[k] == TriangleBvh::kNone) continue;
      double enter = from, leave = hit.distance;
      for (int axis = 0; axis < 3; ++axis) {
        const double low = static_cast<double>(node.low[axis][k]) - o[axis],
                     high = static_cast<double>(node.high[axis][k]) - o[axis];
        if (d[axis] == 0) {
          if (low > 0 || high < 0) leave = -1;
          continue;
        }
        const double x = low / d[axis], y = high / d[axis];
        enter = std::max(enter, std::min(x, y));
        leave = std::min(leave, std::max(x, y));
      }
      if (enter > leave * (1 + 1e-12)) continue;
      if (node.count[k] == 0) {
        stack[waiting++] = node.child[k];
        continue;
      }
      met += node.count[k];
      for (std::uint32_t slot = node.child[k]; slot < node.child[k] + node.count[k]; ++slot) {
        if (bvh.triangles[slot] == self) continue;
        const TriangleBvh::Corners& c = bvh.corners[slot];
        const double t = intersect(origin, direction, c);
        if (!(t > from) || !(t < hit.distance)) continue;
        const Vec3d n = cross(Vec3d(c.p[1]) - Vec3d(c.p[0]), Vec3d(c.p[2]) - Vec3d(c.p[0]));
        hit = {t, dot(n, direction) > 0};
      }
    }
  }
  return met < kMaxMet ? hit : Hit{};
}

}  // namespace

Thickness measure_thickness(const Model& model, const TriangleBvh& bvh, std::size_t samples) {
  const std::vector<SurfaceSample> from = sample_surface(model, samples);
  // Nearer than this is the next face around an edge, or a double of the same face.
  const double nearest = 1e-6 * static_cast<double>(model.box().diagonal());
  std::vector<double> lengths(from.size());
  parallel_for(
      static_cast<std::int64_t>(from.size()),
      [&](std::int64_t i) {
        const auto k = static_cast<std::size_t>(i);
        const Hit hit = first_hit(bvh, Vec3d(from[k].point), Vec3d(from[k].normal) * -1, nearest,
                                  from[k].triangle);
        lengths[k] = hit.leaves ? hit.distance : INFINITY;
      },
      64);
  Thickness result;
  std::erase_if(lengths, [](double length) { return std::isinf(length); });
  result.rays = lengths.size();
  if (!from.empty())
    result.open = 1 - static_cast<double>(lengths.size()) / static_cast<double>(from.size());
  if (lengths.empty()) return result;
  std::sort(lengths.begin(), lengths.end());
  const auto at = [&](double share) {
    return lengths[static_cast<std::size_t>(share * static_cast<double>(lengths.size() - 1))];
  };
  result.low = at(0.05);
  result.median = at(0.5);
  result.high = at(0.95);
  result.balls = area_of(model) / (result.median * result.median);
  return result;
}

bool is_thin(const Thickness& thickness) { return thickness.balls > kManyBalls; }

}  // namespace polymorph
