#include "analyze/facing_error.h"

#include <cmath>
#include <numbers>

#include "base/result.h"

namespace polymorph {

std::optional<double> rotation_about_vertical(const WeightedPairs& pairs, const Mat3& applied) {
  PM_CHECK(pairs.from.size() == pairs.to.size() &&
           (pairs.weights.empty() || pairs.weights.size() == pairs.from.size()));
  const auto weight = [&](std::size_t i) { return pairs.weights.empty() ? 1 : pairs.weights[i]; };
  Vec3d from_center, to_center;
  double sum = 0;
  for (std::size_t i = 0; i < pairs.from.size(); ++i) {
    from_center = from_center + pairs.from[i] * weight(i);
    to_center = to_center + pairs.to[i] * weight(i);
    sum += weight(i);
  }
  if (!(sum > 0)) return std::nullopt;
  from_center = from_center * (1 / sum), to_center = to_center * (1 / sum);
  // The best rotation R maximizes sum(w q . R p) = cosine * cos(angle) + sine * sin(angle).
  double cosine = 0, sine = 0, from_variance = 0, to_variance = 0;
  for (std::size_t i = 0; i < pairs.from.size(); ++i) {
    const Vec3d p = applied * (pairs.from[i] - from_center), q = pairs.to[i] - to_center;
    cosine += weight(i) * (q.x * p.x + q.z * p.z);
    sine += weight(i) * (q.x * p.z - q.z * p.x);
    from_variance += weight(i) * (p.x * p.x + p.z * p.z);
    to_variance += weight(i) * (q.x * q.x + q.z * q.z);
  }
  constexpr double kMinCorrelation = 0.1;
  const double deviation_product = std::sqrt(from_variance * to_variance);
  if (!(deviation_product > 0) || std::hypot(cosine, sine) < kMinCorrelation * deviation_product)
    return std::nullopt;
  return std::atan2(sine, cosine) * 180 / std::numbers::pi;
}

}  // namespace polymorph
