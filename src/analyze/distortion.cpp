#include "analyze/distortion.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "base/result.h"
#include "kernels/linear.h"

namespace polymorph {
namespace {

/// Dot products of two sides of a triangle (the metric tensor), and twice its area, which is the
/// square root of the tensor's determinant.
struct TriangleMetric {
  double aa = 0, ab = 0, bb = 0, twice_area = 0;
};
TriangleMetric measure_triangle(MeshView mesh, const Triangle& t) {
  const Vec3d p(mesh.points[t.v[0]]);
  const Vec3d a = Vec3d(mesh.points[t.v[1]]) - p, b = Vec3d(mesh.points[t.v[2]]) - p;
  return {dot(a, a), dot(a, b), dot(b, b), length(cross(a, b))};
}

/// Returns the quotient K of the singular values of the map between two triangles.
double compute_dilatation(const TriangleMetric& before, const TriangleMetric& after) {
  constexpr double kMaxDilatation = 100;
  const double area_product = before.twice_area * after.twice_area;
  if (!(area_product > 0)) return kMaxDilatation;
  // The mean of K and 1 / K is trace(M) / (2 sqrt(det(M))), where M is the inverse of the first
  // metric tensor times the second. K is mean + sqrt(mean^2 - 1).
  const double mean =
      (before.bb * after.aa - 2 * before.ab * after.ab + before.aa * after.bb) / (2 * area_product);
  const double excess = std::max(mean * mean - 1, 0.0);
  return std::clamp(mean + std::sqrt(excess), 1.0, kMaxDilatation);
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

double conformal_distortion(MeshView before, MeshView after) {
  PM_CHECK(corresponds(before, after));
  std::vector<TriangleMetric> before_metrics, after_metrics;
  double before_area = 0, after_area = 0;
  for (std::size_t t = 0; t < before.triangles.size(); ++t) {
    before_metrics.push_back(measure_triangle(before, before.triangles[t]));
    after_metrics.push_back(measure_triangle(after, before.triangles[t]));
    before_area += before_metrics.back().twice_area;
    after_area += after_metrics.back().twice_area;
  }
  if (!(before_area > 0 && after_area > 0)) return 0;
  double sum = 0;
  for (std::size_t t = 0; t < before_metrics.size(); ++t)
    sum += compute_dilatation(before_metrics[t], after_metrics[t]) *
           (before_metrics[t].twice_area / before_area + after_metrics[t].twice_area / after_area) /
           2;
  return sum;
}

}  // namespace polymorph
