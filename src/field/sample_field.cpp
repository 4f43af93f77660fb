#include "field/sample_field.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <optional>
#include <span>
#include <utility>

#include "base/activity.h"
#include "base/box.h"
#include "base/morton.h"
#include "field/extract_surface.h"
#include "kernels/field_kinds.h"
#include "kernels/linear.h"

namespace polymorph {
namespace {

/// Input, results and progress of sampling many points.
struct Sampling {
  Engine& engine;
  const BallSet& balls;
  const std::vector<Vec3>& points;
  const ExtractSettings& settings;
  const std::string& name;
  std::vector<float> values;
  std::size_t done = 0;  ///< number of points sampled so far
};

/// Samples the field of `balls`, which may be a subset of all balls, at a run of points, given by
/// their indices.
Status sample_run(Sampling& sampling, const BallSet& balls, std::span<const std::uint32_t> run) {
  const std::size_t count = sampling.points.size();
  std::optional<Activity> activity;
  if (run.size() < count)
    activity.emplace(fmt::format("{}: {} %", sampling.name, 100 * sampling.done / count));
  std::vector<Vec3> points;
  for (const std::uint32_t point : run) points.push_back(sampling.points[point]);
  std::vector<float> values;
  PM_TRY_STATUS(to_status(sampling.engine.sample(balls, points, sampling.settings, values)));
  for (std::size_t i = 0; i < run.size(); ++i) sampling.values[run[i]] = values[i];
  sampling.done += run.size();
  return Ok{};
}

/// Returns the squared radius of each round ball's support, beyond which the ball adds exactly 0;
/// it is enlarged a little because of rounding.
std::vector<double> squared_support_radii(const BallSet& balls, const ExtractSettings& settings) {
  std::vector<double> squared_radii;
  visit(settings.field, [&](auto field) {
    for (const Ball& ball : balls) {
      // field.end() is the q = a d^2 beyond which the ball adds nothing (kernels/field_kinds.h).
      const auto end = static_cast<double>(field.end(ball, settings.cutoff * settings.iso));
      squared_radii.push_back((1.01 * end + 0.01) / static_cast<double>(ball.a));
    }
  });
  return squared_radii;
}

/// Samples a run of points that are close to each other: halves the run until it is short, and
/// keeps those of the balls `candidates` that reach the box of each half. The other balls add 0,
/// and the order of the sum stays.
Status sample_near(Sampling& sampling, const std::vector<double>& squared_radii,
                   std::vector<std::uint32_t> candidates, std::span<const std::uint32_t> run) {
  constexpr std::size_t kMaxRun = 512;
  Box box;
  for (const std::uint32_t point : run) box = extend(box, sampling.points[point]);
  std::erase_if(candidates, [&](std::uint32_t ball) {
    const Vec3 center = sampling.balls[ball].center;
    const Vec3d outside(max(max(box.low - center, center - box.high), Vec3{}));
    return dot(outside, outside) > squared_radii[ball];
  });
  if (run.size() > kMaxRun) {
    const std::size_t half = run.size() / 2;
    PM_TRY_STATUS(sample_near(sampling, squared_radii, candidates, run.first(half)));
    return sample_near(sampling, squared_radii, std::move(candidates), run.subspan(half));
  }
  std::vector<Ball> balls;
  for (const std::uint32_t ball : candidates) balls.push_back(sampling.balls[ball]);
  return sample_run(sampling, std::move(balls), run);
}

/// Tests whether the support of every ball is a sphere.
bool have_round_support(const BallSet& balls, FieldKind kind) {
  return visit(kind, [](auto field) { return decltype(field)::kCompactSupport; }) &&
         std::all_of(balls.begin(), balls.end(), is_round);
}

}  // namespace

std::size_t points_per_second(std::size_t balls) {
  // Pairs of a ball and a point that are evaluated in a second.
  constexpr std::size_t kPairsPerSecond = std::size_t{1} << 31;
  // Keeps the number above 0 for more balls than the engine accepts; 2^20 balls, its maximum, give
  // 2048 points.
  constexpr std::size_t kMinPoints = 1024;
  return std::max(kPairsPerSecond / std::max<std::size_t>(balls, 1), kMinPoints);
}

Result<std::vector<float>> sample_field(Engine& engine, const BallSet& balls,
                                        const std::vector<Vec3>& points,
                                        const ExtractSettings& settings, const std::string& name) {
  // Pairs of a ball and a point that take a 32nd of a second at the rate of points_per_second().
  // Only above this number are the balls near each point searched.
  constexpr std::size_t kMinPairs = std::size_t{1} << 26;
  Sampling sampling = {engine, balls, points, settings, name, std::vector<float>(points.size())};
  std::vector<std::uint32_t> order(points.size());
  std::iota(order.begin(), order.end(), 0u);
  if (balls.size() * points.size() > kMinPairs && have_round_support(balls, settings.field)) {
    std::vector<float> no_values;
    // Checks all balls, because the runs below may leave out a bad one.
    PM_TRY_STATUS(to_status(engine.sample(balls, /*points=*/{}, settings, no_values)));
    // In Morton order, consecutive points are close to each other.
    order = sort_by_morton_key(points, bounding_box(points));
    std::vector<std::uint32_t> all(balls.size());
    std::iota(all.begin(), all.end(), 0u);
    PM_TRY_STATUS(
        sample_near(sampling, squared_support_radii(balls, settings), std::move(all), order));
    return std::move(sampling.values);
  }
  const std::span<const std::uint32_t> all(order);
  const std::size_t run_size = points_per_second(balls.size());
  for (std::size_t begin = 0; begin < points.size(); begin += run_size)
    PM_TRY_STATUS(
        sample_run(sampling, balls, all.subspan(begin, std::min(run_size, points.size() - begin))));
  return std::move(sampling.values);
}

}  // namespace polymorph
