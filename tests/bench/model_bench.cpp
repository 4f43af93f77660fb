// Queries a second on a torus of many triangles, all threads: closest points and the inside test.
#include <benchmark/benchmark.h>

#include <cmath>
#include <random>
#include <vector>

#include "mesh/closest.h"
#include "mesh/inside.h"
#include "model/model.h"

namespace polymorph {
namespace {

/// `count` triangles or a few more on a torus (ring 1, pipe 0.4); open: a tenth of the ring is
/// missing; thin: all along the pipe 16 long triangles a ring step.
enum class Kind { kClosed, kOpen, kThin };

Model torus(std::size_t count, Kind kind) {
  const int tube =
      kind == Kind::kThin ? 16 : static_cast<int>(std::sqrt(static_cast<double>(count) / 2 * 0.4));
  const int ring = static_cast<int>(count / 2) / tube + 1;
  Model model;
  for (int i = 0; i < ring; ++i)
    for (int j = 0; j < tube; ++j) {
      const double u = 2 * M_PI * i / ring, v = 2 * M_PI * j / tube;
      const double r = 1 + 0.4 * std::cos(v);
      model.points.push_back({static_cast<float>(r * std::cos(u)),
                              static_cast<float>(0.4 * std::sin(v)),
                              static_cast<float>(-r * std::sin(u))});
    }
  const int last = kind == Kind::kClosed ? ring : ring * 9 / 10;
  for (int i = 0; i < last; ++i)
    for (int j = 0; j < tube; ++j) {
      const auto at = [&](int a, int b) {
        return static_cast<std::uint32_t>((a % ring) * tube + b % tube);
      };
      model.triangles.push_back({{at(i, j), at(i + 1, j), at(i + 1, j + 1)}});
      model.triangles.push_back({{at(i, j), at(i + 1, j + 1), at(i, j + 1)}});
    }
  return model;
}

std::vector<Vec3> lattice(int n) {
  std::vector<Vec3> points;
  const auto at = [n](int i, float reach) {
    return reach * (2 * (static_cast<float>(i) + 0.5f) / static_cast<float>(n) - 1);
  };
  for (int z = 0; z < n; ++z)
    for (int y = 0; y < n; ++y)
      for (int x = 0; x < n; ++x) points.push_back({at(x, 1.5f), at(y, 0.5f), at(z, 1.5f)});
  return points;
}

/// Points as samples give them: within 1 % of the surface.
std::vector<Vec3> near_surface(std::size_t count) {
  std::mt19937 random(1);
  const auto unit = [&random] { return static_cast<float>(random() >> 8) * 0x1p-24f; };
  std::vector<Vec3> points(count);
  for (Vec3& p : points) {
    const float u = 6.2831853f * unit(), v = 6.2831853f * unit(), pipe = 0.39f + 0.02f * unit();
    const float r = 1 + pipe * std::cos(v);
    p = {r * std::cos(u), pipe * std::sin(v), -r * std::sin(u)};
  }
  return points;
}

void report(benchmark::State& state, std::size_t triangles, std::size_t queries) {
  state.counters["triangles"] = static_cast<double>(triangles);
  state.counters["queries/s"] =
      benchmark::Counter(static_cast<double>(queries) * static_cast<double>(state.iterations()),
                         benchmark::Counter::kIsRate);
}

void closest_lattice(benchmark::State& state) {
  const Model model = torus(static_cast<std::size_t>(state.range(0)), Kind::kClosed);
  const ClosestPointQuery query(model);
  const std::vector<Vec3> points = lattice(100);
  for (auto _ : state) benchmark::DoNotOptimize(query.closest(points));
  report(state, model.triangles.size(), points.size());
}

void closest_near(benchmark::State& state) {
  const Model model = torus(static_cast<std::size_t>(state.range(0)), Kind::kClosed);
  const ClosestPointQuery query(model);
  const std::vector<Vec3> points = near_surface(1'000'000);
  for (auto _ : state) benchmark::DoNotOptimize(query.closest(points));
  report(state, model.triangles.size(), points.size());
}

void build_closest(benchmark::State& state) {
  const Model model = torus(static_cast<std::size_t>(state.range(0)), Kind::kClosed);
  for (auto _ : state) benchmark::DoNotOptimize(ClosestPointQuery(model));
}

void build_inside(benchmark::State& state) {
  const Model model = torus(static_cast<std::size_t>(state.range(0)), Kind::kClosed);
  for (auto _ : state) benchmark::DoNotOptimize(InsideTest(model));
}

void inside(benchmark::State& state, Kind kind, InsideRule rule) {
  const Model model = torus(static_cast<std::size_t>(state.range(0)), kind);
  const InsideTest test(model, rule);
  const std::vector<Vec3> points = lattice(100);
  for (auto _ : state) benchmark::DoNotOptimize(test.inside(points));
  report(state, model.triangles.size(), points.size());
}

BENCHMARK(build_closest)->Arg(300'000)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(closest_lattice)->Arg(300'000)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(closest_near)->Arg(300'000)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(build_inside)->Arg(500'000)->Unit(benchmark::kMillisecond)->UseRealTime();
#define PM_INSIDE(name, kind, rule)           \
  BENCHMARK_CAPTURE(inside, name, kind, rule) \
      ->Arg(500'000)                          \
      ->Unit(benchmark::kMillisecond)         \
      ->UseRealTime()
PM_INSIDE(winding, Kind::kClosed, InsideRule::kWinding);
PM_INSIDE(winding_open, Kind::kOpen, InsideRule::kWinding);
PM_INSIDE(winding_thin_open, Kind::kThin, InsideRule::kWinding);
PM_INSIDE(parity, Kind::kClosed, InsideRule::kParity);

}  // namespace
}  // namespace polymorph

BENCHMARK_MAIN();
