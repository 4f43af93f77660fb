#include "surface/level.h"

#include <algorithm>
#include <cmath>

#include "surface/grid.h"
#include "surface/mesh_check.h"

namespace polymorph {
namespace {

Result<std::vector<float>> field_at_centers(SurfaceExtractor& extractor,
                                            const std::vector<Ball>& balls,
                                            const ExtractSettings& settings) {
  std::vector<Vec3> centers;
  for (const Ball& ball : balls) centers.push_back(ball.center);
  std::vector<float> values;
  PM_TRY_STATUS(to_status(extractor.sample(balls, centers, settings, values)));
  return values;
}

}  // namespace

Result<float> iso_for_volume(SurfaceExtractor& extractor, const std::vector<Ball>& balls,
                             float cell, const ExtractSettings& settings, double volume,
                             float start) {
  PM_CHECK(volume > 0 && start > 0);
  // Volume falls as iso rises; both are searched for in logarithms, where the relation is nearly
  // straight.
  double low = std::log(1e-6), high = std::log(1e6);
  double x = std::log(start), previous_x = 0, previous_y = 0;
  for (int step = 0; step < 24; ++step) {
    ExtractSettings at = settings;
    at.iso = static_cast<float>(std::exp(x));
    PM_TRY(const Mesh mesh, extract_surface(extractor, balls, cell, at));
    const double found = volume_of(mesh);
    if (std::abs(found - volume) <= 0.002 * volume) return at.iso;
    (found > volume ? low : high) = x;
    // An empty surface has no logarithm: a finite stand-in that still says "far too little".
    const double y = std::log(std::max(found, 1e-3 * volume) / volume);
    double next = step == 0 ? x + y : x - y * (x - previous_x) / (y - previous_y);
    previous_x = x;
    previous_y = y;
    if (!(next > low && next < high))
      next = low > std::log(2e-6) && high < std::log(5e5) ? (low + high) / 2
                                                          : x + std::clamp(y, -1.5, 1.5);
    if (!(next > low && next < high)) next = (low + high) / 2;
    x = next;
  }
  return static_cast<float>(std::exp(x));
}

std::vector<Ball> rescaled(std::vector<Ball> balls, FieldKind kind, float iso) {
  const float shift = std::log(iso);
  for (Ball& ball : balls) ball.w = kind == FieldKind::kGaussian ? ball.w - shift : ball.w / iso;
  return balls;
}

std::vector<Ball> grown(std::vector<Ball> balls, FieldKind kind, float growth, float maximum) {
  if (growth >= 1) return balls;
  if (growth <= 0) return {};
  if (kind == FieldKind::kGaussian)
    return rescaled(std::move(balls), kind, std::pow(std::max(maximum, 1.0f), 1 - growth));
  for (Ball& ball : balls) ball.w *= growth * growth;
  return balls;
}

Result<float> field_maximum(SurfaceExtractor& extractor, const std::vector<Ball>& balls,
                            const ExtractSettings& settings) {
  PM_TRY(const std::vector<float> values, field_at_centers(extractor, balls, settings));
  return values.empty() ? 0.0f : *std::max_element(values.begin(), values.end());
}

Result<std::vector<Ball>> evened(SurfaceExtractor& extractor, std::vector<Ball> balls,
                                 const ExtractSettings& settings) {
  PM_CHECK(settings.field == FieldKind::kGaussian);
  // Three steps bring thin parts to within a tenth of the plateau; more would only sharpen the
  // cells' steps.
  constexpr int kSteps = 3;
  constexpr float kDamping = 0.7f;
  for (int step = 0; step < kSteps; ++step) {
    PM_TRY(const std::vector<float> values, field_at_centers(extractor, balls, settings));
    std::vector<float> sorted = values;
    std::sort(sorted.begin(), sorted.end());
    const float plateau = sorted[sorted.size() * 9 / 10];
    for (std::size_t i = 0; i < balls.size(); ++i)
      balls[i].w += kDamping * std::log(plateau / std::max(values[i], 1e-6f * plateau));
  }
  return balls;
}

}  // namespace polymorph
