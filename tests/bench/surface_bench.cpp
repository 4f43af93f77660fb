// Balls to surface: the standard case (1032 balls on a torus, as many as the report's torus at R =
// 5) on each backend. Compare base and head on one machine; the passes are counters in
// milliseconds.
#include <benchmark/benchmark.h>

#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "kernels/extract_surface.h"

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

void extract(benchmark::State& state, Backend backend, FieldKind field, int points) {
  ExtractStatus status;
  const auto extractor =
      backend == Backend::kCpu ? make_cpu_extractor() : make_cuda_extractor(0, status);
  if (extractor == nullptr) {
    state.SkipWithError(status.message.c_str());
    return;
  }
  const std::vector<Ball> balls = torus_balls(1032, field);
  const Grid grid = {
      {-1.9f, -1.9f, -1.9f}, 3.8f / static_cast<float>(points - 1), {points, points, points}};
  ExtractSettings settings;
  settings.field = field;
  Mesh mesh;
  for (auto _ : state) {
    status = extractor->extract(balls, grid, settings, mesh);
    if (status.code != ExtractCode::kOk) {
      state.SkipWithError(status.message.c_str());
      return;
    }
  }
  state.counters["vertices"] = static_cast<double>(mesh.positions.size());
  for (const PassTime& pass : extractor->pass_times()) {
    state.counters[std::string(pass.name) + "_ms"] = 1e3 * pass.seconds;
  }
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
  polymorph::add("cpu/inverse_square/96", Backend::kCpu, FieldKind::kInverseSquare, 96);
  polymorph::add("cuda/gaussian/128", Backend::kCuda, FieldKind::kGaussian, 128);
  polymorph::add("cuda/gaussian/256", Backend::kCuda, FieldKind::kGaussian, 256);
  polymorph::add("cuda/inverse_square/96", Backend::kCuda, FieldKind::kInverseSquare, 96);
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
