#include "morph/cost.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "base/exact_math.h"
#include "base/result.h"
#include "kernels/field_kinds.h"
#include "morph/farthest_points.h"
#include "morph/features.h"
#include "morph/plan.h"

namespace polymorph {
namespace {

/// Indices in CostSide::values of the first axis of the position and of the outward direction, and
/// the number of axes that rotate.
constexpr std::size_t kPosition = 0, kOutward = 3, kRotatingEnd = 6;

/// Squared distances of all balls of a side from ball `from`, by their positions.
std::vector<float> squared_distances(const CostSide& side, std::uint32_t from) {
  std::vector<float> sums(side.size(), 0);
  for (std::size_t axis = kPosition; axis < kPosition + 3; ++axis)
    for (std::size_t i = 0; i < sums.size(); ++i) {
      const float d = side.values[axis][i] - side.values[axis][from];
      sums[i] += d * d;
    }
  return sums;
}

}  // namespace

Normalization fit_normalization(const std::vector<Ball>& balls, std::span<const double> mass) {
  Normalization result;
  for (std::size_t i = 0; i < balls.size(); ++i)
    result.center = result.center + Vec3d(balls[i].center) * mass[i];
  double square = 0;
  for (std::size_t i = 0; i < balls.size(); ++i) {
    const Vec3d d = Vec3d(balls[i].center) - result.center;
    square += mass[i] * dot(d, d);
  }
  result.size = square > 0 ? std::sqrt(square) : 1;
  return result;
}

CostSide make_cost_side(const PlanSide& object, FieldKind kind, std::vector<double> mass,
                        const Normalization& normalization, const PlanSettings& settings) {
  const std::vector<Ball>& balls = object.balls;
  CostSide side;
  const std::size_t n = balls.size();
  const BallFeatures features = ball_features(balls, mass);
  const auto add_axis = [&](double weight, const auto& value) {
    std::vector<float> values(n);
    const double root = std::sqrt(weight);
    for (std::size_t i = 0; i < n; ++i) values[i] = static_cast<float>(root * value(i));
    side.values.push_back(std::move(values));
  };
  const auto normalized_center = [&](std::size_t i) {
    return (Vec3d(balls[i].center) - normalization.center) * (1 / normalization.size);
  };
  const auto size_weight = static_cast<double>(settings.weights.size);
  const auto feature_weight = static_cast<double>(settings.weights.feature);
  // The axes, in the order that CostSide::values gives.
  add_axis(1, [&](std::size_t i) { return normalized_center(i).x; });
  add_axis(1, [&](std::size_t i) { return normalized_center(i).y; });
  add_axis(1, [&](std::size_t i) { return normalized_center(i).z; });
  add_axis(feature_weight,
           [&](std::size_t i) { return static_cast<double>(features.outward[i].x); });
  add_axis(feature_weight,
           [&](std::size_t i) { return static_cast<double>(features.outward[i].y); });
  add_axis(feature_weight,
           [&](std::size_t i) { return static_cast<double>(features.outward[i].z); });
  // Sizes and distances are divided by the object's size, so a scaled copy has the same values.
  add_axis(size_weight, [&](std::size_t i) {
    const float radius = visit(kind, [&](auto field) { return field.radius(balls[i]); });
    return exact::log(static_cast<double>(radius) / normalization.size);
  });
  add_axis(feature_weight,
           [&](std::size_t i) { return static_cast<double>(features.distance[i]); });
  add_axis(feature_weight,
           [&](std::size_t i) { return static_cast<double>(features.linearity[i]); });
  add_axis(feature_weight,
           [&](std::size_t i) { return static_cast<double>(features.planarity[i]); });
  // What the user pins follows, so that the search for a rotation ignores it (it would hide what a
  // rotation gains), and plans by limbs keep it.
  side.first_pinned_axis = side.values.size();
  for (const Vec3& landmark : object.landmarks)
    add_axis(static_cast<double>(settings.weights.landmark), [&](std::size_t i) {
      return length(Vec3d(balls[i].center) - Vec3d(landmark)) / normalization.size;
    });
  side.mass = std::move(mass);
  side.labels = object.labels;
  side.labels.resize(n, kNoLabel);
  return side;
}

CostSide rotate_side(const CostSide& side, const Mat3& rotation) {
  CostSide result = side;
  for (const std::size_t first : {kPosition, kOutward})
    for (std::size_t i = 0; i < side.size(); ++i) {
      const Vec3d v = rotation * Vec3d(static_cast<double>(side.values[first][i]),
                                       static_cast<double>(side.values[first + 1][i]),
                                       static_cast<double>(side.values[first + 2][i]));
      result.values[first][i] = static_cast<float>(v.x);
      result.values[first + 1][i] = static_cast<float>(v.y);
      result.values[first + 2][i] = static_cast<float>(v.z);
    }
  static_assert(CostSide::kRotatingAxes == kRotatingEnd);
  return result;
}

void cost_row(const CostSide& a, const CostSide& b, float label_cost, std::uint32_t from,
              std::span<float> costs) {
  std::fill(costs.begin(), costs.end(), 0.0f);
  for (std::size_t axis = 0; axis < a.values.size(); ++axis) {
    const float x = a.values[axis][from];
    const float* y = b.values[axis].data();
    for (std::size_t j = 0; j < costs.size(); ++j) costs[j] += (x - y[j]) * (x - y[j]);
  }
  if (label_cost <= 0) return;
  for (std::size_t j = 0; j < costs.size(); ++j)
    if (a.labels[from] != b.labels[j]) costs[j] += label_cost;
}

CostSide coarsen_side(const CostSide& side, std::size_t count) {
  const std::size_t n = side.size();
  if (n <= count) return side;
  const auto heaviest = static_cast<std::uint32_t>(
      std::max_element(side.mass.begin(), side.mass.end()) - side.mass.begin());
  const auto sample = farthest_points(side.mass, count, heaviest, [&](std::uint32_t base) {
    return squared_distances(side, base);
  });
  const std::vector<std::uint32_t>& owner = sample.owner;
  CostSide result;
  result.mass = sample.weights;
  result.first_pinned_axis = side.first_pinned_axis;
  result.values.assign(side.values.size(), std::vector<float>(count, 0));
  std::vector<std::map<std::int32_t, double>> votes(count);  // per representative: masses by label
  for (std::size_t i = 0; i < n; ++i) votes[owner[i]][side.labels[i]] += side.mass[i];
  for (std::size_t axis = 0; axis < side.values.size(); ++axis)
    for (std::size_t i = 0; i < n; ++i)
      result.values[axis][owner[i]] +=
          static_cast<float>(side.mass[i] / result.mass[owner[i]]) * side.values[axis][i];
  // A representative that coincides with another may own no ball; masses must be positive.
  for (double& mass : result.mass) mass = std::max(mass, 1e-12);
  for (const auto& vote : votes) {
    std::int32_t best = kNoLabel;
    double largest = 0;
    for (const auto& [label, mass] : vote)
      if (mass > largest) largest = mass, best = label;
    result.labels.push_back(best);
  }
  return result;
}

}  // namespace polymorph
