#include "field/sample_field.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <optional>
#include <span>
#include <tuple>
#include <utility>

#include "base/activity.h"
#include "base/box.h"
#include "base/morton.h"
#include "field/extract_surface.h"
#include "kernels/field_kinds.h"
#include "kernels/linear.h"

namespace polymorph {
namespace {

/// Sampling of many points, with an activity that says how much of it is done.
struct Sampling {
  Engine& engine;
  const BallSet& balls;
  const std::vector<Vec3>& points;
  const ExtractSettings& settings;
  const std::string& name;
  std::vector<float> values;
  std::size_t done = 0;
};

/// Samples a run of points, given by their indices, of a field of some of the balls.
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

/// Squared distances from which round balls add exactly 0, a little too large for rounding.
std::vector<double> squared_reaches(const BallSet& balls, const ExtractSettings& settings) {
  std::vector<double> reaches;
  visit(settings.field, [&](auto field) {
    for (const Ball& ball : balls) {
      const auto end = static_cast<double>(field.end(ball, settings.cutoff * settings.iso));
      reaches.push_back((1.01 * end + 0.01) / static_cast<double>(ball.a));
    }
  });
  return reaches;
}

/// Samples points that follow each other in space: halves them until they are few, of the balls
/// that reach their box. The others add nothing, and the sum's order stays.
Status sample_near(Sampling& sampling, const std::vector<double>& reaches,
                   std::vector<std::uint32_t> near, std::span<const std::uint32_t> run) {
  constexpr std::size_t kRun = 512;
  Box box;
  for (const std::uint32_t point : run) box = extend(box, sampling.points[point]);
  std::erase_if(near, [&](std::uint32_t ball) {
    const Vec3 center = sampling.balls[ball].center;
    const Vec3d outside(max(max(box.low - center, center - box.high), Vec3{}));
    return dot(outside, outside) > reaches[ball];
  });
  if (run.size() > kRun) {
    const std::size_t half = run.size() / 2;
    PM_TRY_STATUS(sample_near(sampling, reaches, near, run.first(half)));
    return sample_near(sampling, reaches, std::move(near), run.subspan(half));
  }
  std::vector<Ball> balls;
  for (const std::uint32_t ball : near) balls.push_back(sampling.balls[ball]);
  return sample_run(sampling, std::move(balls), run);
}

/// Tests that all balls end at one distance in all directions.
bool have_round_ends(const BallSet& balls, FieldKind kind) {
  return visit(kind, [](auto field) { return decltype(field)::kCompactSupport; }) &&
         std::all_of(balls.begin(), balls.end(), is_round);
}

}  // namespace

std::size_t sampled_at_once(std::size_t balls) {
  constexpr std::size_t kPairs = std::size_t{1} << 31, kMin = 1024;
  return std::max(kPairs / std::max<std::size_t>(balls, 1), kMin);
}

Result<std::vector<float>> sample_field(Engine& engine, const BallSet& balls,
                                        const std::vector<Vec3>& points,
                                        const ExtractSettings& settings, const std::string& name) {
  constexpr std::size_t kMinPairs = std::size_t{1} << 26;  // a tenth of a second
  Sampling sampling = {engine, balls, points, settings, name, std::vector<float>(points.size())};
  std::vector<std::uint32_t> order(points.size());
  std::iota(order.begin(), order.end(), 0u);
  if (balls.size() * points.size() > kMinPairs && have_round_ends(balls, settings.field)) {
    std::vector<float> none;
    PM_TRY_STATUS(to_status(engine.sample(balls, {}, settings, none)));  // are the balls sound?
    const Box box = box_of(points);
    std::vector<std::uint64_t> keys;
    for (const Vec3& point : points) keys.push_back(morton_key(point, box));
    std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
      return std::tie(keys[a], a) < std::tie(keys[b], b);
    });
    std::vector<std::uint32_t> all(balls.size());
    std::iota(all.begin(), all.end(), 0u);
    PM_TRY_STATUS(sample_near(sampling, squared_reaches(balls, settings), std::move(all), order));
    return std::move(sampling.values);
  }
  const std::span<const std::uint32_t> all(order);
  const std::size_t part = sampled_at_once(balls.size());
  for (std::size_t begin = 0; begin < points.size(); begin += part)
    PM_TRY_STATUS(
        sample_run(sampling, balls, all.subspan(begin, std::min(part, points.size() - begin))));
  return std::move(sampling.values);
}

}  // namespace polymorph
