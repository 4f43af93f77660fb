// Plans and frames of N balls to N others: morph_bench [--benchmark_filter=...]. Report medians of
// --benchmark_repetitions=5.
#include <benchmark/benchmark.h>

#include <cmath>

#include "base/random.h"
#include "morph/cost.h"
#include "morph/features.h"
#include "morph/mass.h"
#include "morph/motion.h"
#include "morph/plan.h"

namespace polymorph {
namespace {

/// Balls through a torus: neighbours overlap as fitted ones do.
std::vector<Ball> torus_balls(std::int64_t count, std::uint64_t seed, float height) {
  std::vector<Ball> balls;
  const float radius = 1.2f / std::cbrt(static_cast<float>(count));
  for (std::int64_t i = 0; i < count; ++i) {
    const auto r = [&](std::uint64_t k) {
      return random_float(seed, k, static_cast<std::uint64_t>(i));
    };
    const float turn = 6.2831853f * r(0), tube = 0.4f * std::sqrt(r(1)), side = 6.2831853f * r(2);
    const float ring = 1 + tube * std::cos(side);
    balls.push_back({{ring * std::cos(turn), height * tube * std::sin(side), ring * std::sin(turn)},
                     4 / (radius * radius),
                     4});
  }
  return balls;
}

void plan(benchmark::State& state) {
  const auto from = torus_balls(state.range(0), 1, 1), to = torus_balls(state.range(0), 2, 2);
  std::size_t pairs = 0;
  for (auto _ : state)
    pairs = plan_morph({from, {}, {}, {}}, {to, {}, {}, {}}, FieldKind::kGaussian, {}).pairs.size();
  state.counters["pairs"] = static_cast<double>(pairs);
}
BENCHMARK(plan)->Arg(256)->Arg(1024)->Arg(4096)->Unit(benchmark::kMillisecond);

void masses(benchmark::State& state) {
  const auto balls = torus_balls(state.range(0), 1, 1);
  for (auto _ : state) benchmark::DoNotOptimize(ball_masses(balls, FieldKind::kGaussian));
}
BENCHMARK(masses)->Arg(256)->Arg(1024)->Arg(4096)->Unit(benchmark::kMillisecond);

void features(benchmark::State& state) {
  const auto balls = torus_balls(state.range(0), 1, 1);
  const std::vector<double> mass(balls.size(), 1.0 / static_cast<double>(balls.size()));
  for (auto _ : state) benchmark::DoNotOptimize(ball_features(balls, mass));
}
BENCHMARK(features)->Arg(256)->Arg(1024)->Arg(4096)->Unit(benchmark::kMillisecond);

/// The same as ellipsoids, as fits make them: 1 : 1.5 : 2, each another way round.
std::vector<Ball> squeezed(std::vector<Ball> balls) {
  constexpr float kMean = 0.48074985f;  // makes the determinant 1
  for (std::size_t i = 0; i < balls.size(); ++i) {
    const float x = kMean * (i % 3 == 0 ? 1.0f : i % 3 == 1 ? 4.0f : 2.25f);
    const float y = kMean * (i % 3 == 0 ? 4.0f : i % 3 == 1 ? 2.25f : 1.0f);
    balls[i].shape = {x, y, 1 / (x * y), 0, 0, 0};
  }
  return balls;
}

/// Round balls (0) or ellipsoids (1) moved along.
void frame(benchmark::State& state) {
  const auto side = [&](std::uint64_t seed, float height) {
    std::vector<Ball> balls = torus_balls(state.range(0), seed, height);
    return PlanSide{state.range(1) ? squeezed(std::move(balls)) : std::move(balls), {}, {}, {}};
  };
  const MorphPlan plan = plan_morph(side(1, 1), side(2, 2), FieldKind::kGaussian, {});
  for (auto _ : state) benchmark::DoNotOptimize(balls_at(plan, 0.4f));
  state.counters["pairs"] = static_cast<double>(plan.pairs.size());
}
BENCHMARK(frame)->ArgsProduct({{256, 1024, 4096}, {0, 1}})->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace polymorph

BENCHMARK_MAIN();
