#include "analyze/distortion.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "base/result.h"
#include "kernels/linear.h"

namespace polymorph {
namespace {

/// Two sides of a triangle: their dot products and twice its area.
struct Metric2 {
  double aa = 0, ab = 0, bb = 0, twice_area = 0;
};
Metric2 measure_triangle(MeshView mesh, const Triangle& t) {
  const Vec3d p(mesh.points[t.v[0]]);
  const Vec3d a = Vec3d(mesh.points[t.v[1]]) - p, b = Vec3d(mesh.points[t.v[2]]) - p;
  return {dot(a, a), dot(a, b), dot(b, b), length(cross(a, b))};
}

double dilatation(const Metric2& rest, const Metric2& now) {
  constexpr double kLargest = 100;
  const double areas = rest.twice_area * now.twice_area;
  if (!(areas > 0)) return kLargest;
  // The trace of rest^-1 now over twice the root of its determinant: (K + 1 / K) / 2.
  const double mean = (rest.bb * now.aa - 2 * rest.ab * now.ab + rest.aa * now.bb) / (2 * areas);
  const double excess = std::max(mean * mean - 1, 0.0);
  return std::clamp(mean + std::sqrt(excess), 1.0, kLargest);
}

}  // namespace

bool corresponds(MeshView a, MeshView b) {
  const auto corners = [](const Triangle& t) {
    std::array<std::uint32_t, 3> sorted{t.v[0], t.v[1], t.v[2]};
    std::sort(sorted.begin(), sorted.end());
    return sorted;
  };
  return a.points.size() == b.points.size() && a.triangles.size() == b.triangles.size() &&
         std::equal(a.triangles.begin(), a.triangles.end(), b.triangles.begin(),
                    [&](const Triangle& s, const Triangle& t) { return corners(s) == corners(t); });
}

double conformal_distortion(MeshView rest, MeshView now) {
  PM_CHECK(corresponds(rest, now));
  std::vector<Metric2> before, after;
  double rest_area = 0, now_area = 0;
  for (std::size_t t = 0; t < rest.triangles.size(); ++t) {
    before.push_back(measure_triangle(rest, rest.triangles[t]));
    after.push_back(measure_triangle(now, rest.triangles[t]));
    rest_area += before.back().twice_area;
    now_area += after.back().twice_area;
  }
  if (!(rest_area > 0 && now_area > 0)) return 0;
  double sum = 0;
  for (std::size_t t = 0; t < before.size(); ++t)
    sum += dilatation(before[t], after[t]) *
           (before[t].twice_area / rest_area + after[t].twice_area / now_area) / 2;
  return sum;
}

}  // namespace polymorph
