#include "analyze/registration_error.h"

#include <cmath>

#include "base/result.h"
#include "mesh/closest.h"
#include "mesh/sample_surface.h"
#include "mesh/thickness.h"
#include "mesh/triangle_bvh.h"

namespace polymorph {

ThicknessSamples sample_thickness(const Mesh& surface, std::size_t count) {
  const std::vector<SurfaceSample> surface_samples = sample_surface(surface, count);
  const std::vector<double> thickness = measure_wall_thicknesses(
      surface, build_triangle_bvh(surface.positions, surface.triangles), surface_samples);
  ThicknessSamples samples;
  for (std::size_t i = 0; i < surface_samples.size(); ++i) {
    if (std::isinf(thickness[i])) continue;
    samples.points.push_back(surface_samples[i].point);
    samples.half_thickness.push_back(thickness[i] / 2);
  }
  return samples;
}

std::optional<double> missed_fraction(const ThicknessSamples& samples,
                                      const std::vector<Vec3>& moved, const Mesh& other,
                                      double scale) {
  PM_CHECK(moved.size() == samples.points.size());
  if (moved.empty() || other.triangles.empty()) return std::nullopt;
  const std::vector<ClosestPoint> closest = ClosestPointQuery(other).closest(moved);
  double missed = 0;
  for (std::size_t i = 0; i < moved.size(); ++i)
    if (static_cast<double>(closest[i].distance) > scale * samples.half_thickness[i]) ++missed;
  return missed / static_cast<double>(moved.size());
}

}  // namespace polymorph
