// Balls to surface: the standard case (1032 balls on a torus, as many as the report's torus at R =
// 5), and from one torus to another, on each backend. Compare base and head on one machine; the
// passes are counters in milliseconds.
#include <benchmark/benchmark.h>

#include <cmath>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "kernels/distance_field.h"
#include "kernels/engine.h"
#include "kernels/regression.h"

namespace polymorph {
namespace {

/// Balls spread evenly over a torus (R = 1, r = 0.4), radii within 15 % of their spacing.
std::vector<Ball> torus_balls(int count, FieldKind field) {
  std::mt19937 random(1);
  const auto unit = [&random] { return static_cast<float>(random() >> 8) * 0x1p-24f; };
  constexpr float kTurn = 6.2831853f, kMinor = 0.4f;
  const float spacing = std::sqrt(kTurn * kTurn * kMinor / static_cast<float>(count));
  std::vector<Ball> balls;
  while (balls.size() < static_cast<std::size_t>(count)) {
    const float around = kTurn * unit(), tube = kTurn * unit();
    const float distance = 1 + kMinor * std::cos(tube);
    if (unit() * (1 + kMinor) > distance) continue;  // area grows with the distance from the axis
    const float radius = spacing * (0.85f + 0.3f * unit());
    Ball ball;
    ball.center = {distance * std::cos(around), distance * std::sin(around),
                   kMinor * std::sin(tube)};
    ball.a = 4 / (radius * radius);
    ball.w = field == FieldKind::kGaussian ? 4 : 0.12f * radius * radius;
    balls.push_back(ball);
  }
  return balls;
}

enum class Backend { kCpu, kBaseline, kCuda };

/// Null, and the benchmark skipped, where the backend does not answer.
std::unique_ptr<Engine> engine_for(benchmark::State& state, Backend backend) {
  EngineStatus status;
  auto engine = backend == Backend::kCuda  ? make_cuda_engine(0, status)
                : backend == Backend::kCpu ? make_cpu_engine()
                                           : make_cpu_engine(CpuIsa::kBaseline);
  if (engine == nullptr) state.SkipWithError(status.message.c_str());
  return engine;
}

void extract(benchmark::State& state, Backend backend, FieldKind field, int points) {
  EngineStatus status;
  const auto engine = engine_for(state, backend);
  if (engine == nullptr) return;
  const std::vector<Ball> balls = torus_balls(1032, field);
  const Grid grid = {
      {-1.9f, -1.9f, -1.9f}, 3.8f / static_cast<float>(points - 1), {points, points, points}};
  ExtractSettings settings;
  settings.field = field;
  Mesh mesh;
  for (auto _ : state) {
    status = engine->extract(balls, grid, settings, mesh);
    if (status.code != EngineCode::kOk) {
      state.SkipWithError(status.message.c_str());
      return;
    }
  }
  state.counters["vertices"] = static_cast<double>(mesh.positions.size());
  settings.time_passes = true;
  (void)engine->extract(balls, grid, settings, mesh);
  for (const PassTime& pass : engine->pass_times()) {
    state.counters[std::string(pass.name) + "_ms"] = 1e3 * pass.seconds;
  }
}

std::shared_ptr<const DistanceGrid> torus_distances(float large, float small) {
  auto out = std::make_shared<DistanceGrid>();
  out->grid = {{-2, -2, -2}, 4.0f / 199, {200, 200, 200}};
  for (int z = 0; z < 200; ++z)
    for (int y = 0; y < 200; ++y)
      for (int x = 0; x < 200; ++x) {
        const Vec3 p = grid_point(out->grid, {x, y, z});
        const float ring = std::hypot(p.x, p.y) - large;
        out->values.push_back(small - std::hypot(ring, p.z));
      }
  out->lipschitz = 1.2f;
  return out;
}

/// From one torus to another by a map of `samples` balls: the map's nodes (regress) and one
/// surface.
void extract_between(benchmark::State& state, Backend backend, int samples, int points) {
  EngineStatus status;
  const auto engine = engine_for(state, backend);
  if (engine == nullptr) return;
  Regression map;
  map.maps = 2;
  // The diagonal is 4: a spacing of 4 % of it, as morph/smooth_map.cpp has it.
  map.lattice = {{-2.2f, -2.2f, -2.2f}, 0.16f, {28, 28, 28}};
  for (const Ball& ball : torus_balls(samples, FieldKind::kGaussian)) {
    map.samples.push_back({ball.center, 1, 0.22f});
    BallAttribute carried;
    carried.value[0] = 0.1f * ball.center.y, carried.value[3] = 0.5f;
    map.values.push_back(carried);
    map.values.push_back(carried);
  }
  // Half way, where both objects' distances are read with and without detail.
  const auto first = torus_distances(1, 0.4f), second = torus_distances(0.9f, 0.5f);
  MorphSurface surface = {nullptr, first, second, 1, 1, 0, 0, first, second};
  const Grid grid = {
      {-1.9f, -1.9f, -1.9f}, 3.8f / static_cast<float>(points - 1), {points, points, points}};
  Mesh mesh;
  ExtractSettings settings;
  for (auto _ : state) {
    surface.map = std::make_shared<const Regression>(map);  // a frame's own
    status = engine->extract(surface, grid, settings, mesh);
    if (status.code != EngineCode::kOk) {
      state.SkipWithError(status.message.c_str());
      return;
    }
  }
  state.counters["vertices"] = static_cast<double>(mesh.positions.size());
  state.counters["memory_MB"] = static_cast<double>(engine->memory_used()) * 1e-6;
  settings.time_passes = true;
  surface.map = std::make_shared<const Regression>(map);
  (void)engine->extract(surface, grid, settings, mesh);
  for (const PassTime& pass : engine->pass_times()) {
    state.counters[std::string(pass.name) + "_ms"] = 1e3 * pass.seconds;
  }
}

void add_between(const char* name, Backend backend, int samples, int points) {
  benchmark::RegisterBenchmark(name, extract_between, backend, samples, points)
      ->Unit(benchmark::kMillisecond)
      ->MeasureProcessCPUTime()
      ->UseRealTime();
}

void add(const char* name, Backend backend, FieldKind field, int points) {
  benchmark::RegisterBenchmark(name, extract, backend, field, points)
      ->Unit(benchmark::kMillisecond)
      ->MeasureProcessCPUTime()
      ->UseRealTime();
}

}  // namespace
}  // namespace polymorph

int main(int argc, char** argv) {
  using polymorph::Backend;
  using polymorph::FieldKind;
  polymorph::add("cpu/gaussian/128", Backend::kCpu, FieldKind::kGaussian, 128);
  polymorph::add("cpu/gaussian/256", Backend::kCpu, FieldKind::kGaussian, 256);
  polymorph::add("cpu/gaussian/1024", Backend::kCpu, FieldKind::kGaussian, 1024);
  polymorph::add("baseline/gaussian/256", Backend::kBaseline, FieldKind::kGaussian, 256);
  polymorph::add("baseline/gaussian/1024", Backend::kBaseline, FieldKind::kGaussian, 1024);
  polymorph::add("cpu/inverse_square/96", Backend::kCpu, FieldKind::kInverseSquare, 96);
  polymorph::add("cuda/gaussian/128", Backend::kCuda, FieldKind::kGaussian, 128);
  polymorph::add("cuda/gaussian/256", Backend::kCuda, FieldKind::kGaussian, 256);
  polymorph::add("cuda/inverse_square/96", Backend::kCuda, FieldKind::kInverseSquare, 96);
  polymorph::add_between("cpu/between/128", Backend::kCpu, 500, 128);
  polymorph::add_between("cpu/between/256", Backend::kCpu, 500, 256);
  polymorph::add_between("cpu/between/256/4096", Backend::kCpu, 4096, 256);
  polymorph::add_between("cpu/between/1024", Backend::kCpu, 500, 1024);
  polymorph::add_between("baseline/between/256", Backend::kBaseline, 500, 256);
  polymorph::add_between("cuda/between/128", Backend::kCuda, 500, 128);
  polymorph::add_between("cuda/between/256", Backend::kCuda, 500, 256);
  polymorph::add_between("cuda/between/256/4096", Backend::kCuda, 4096, 256);
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
