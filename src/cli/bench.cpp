#include <algorithm>
#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>

#include "base/log.h"
#include "base/parallel.h"
#include "base/random.h"
#include "cli/command_line.h"
#include "morph/plan.h"
#include "render/render.h"
#include "scene/json_text.h"
#include "sequence/render_sequence.h"

namespace polymorph {
namespace {

struct BenchOptions {
  std::string what = "all", field = "gaussian";
  int balls = 1032, grid = 128, repeats = 7, width = 640, height = 480, samples = 16;
  JsonOutput json;
};

/// The standard case: n points spread evenly over a torus (R 1, r 0.4), spacing s = sqrt(area / n),
/// radii s (0.85 .. 1.15).
std::vector<Ball> torus_balls(int n, FieldKind kind) {
  constexpr double kPi = 3.14159265358979323846, kMajor = 1, kMinor = 0.4;
  const double spacing = std::sqrt(4 * kPi * kPi * kMajor * kMinor / n);
  std::vector<Ball> balls;
  for (int i = 0; i < n; ++i) {
    // A rank-1 lattice: even without rows.
    const double u = 2 * kPi * i / n, v = 2 * kPi * std::fmod(i * 0.6180339887498949, 1.0);
    const double ring = kMajor + kMinor * std::cos(v);
    const auto radius = static_cast<float>(
        spacing *
        (0.85 + 0.3 * static_cast<double>(random_float(1, 0, static_cast<std::uint64_t>(i)))));
    Ball ball;
    ball.center = {static_cast<float>(ring * std::cos(u)), static_cast<float>(kMinor * std::sin(v)),
                   static_cast<float>(ring * std::sin(u))};
    const float blobbiness = 2;
    ball.a = kind == FieldKind::kGaussian ? blobbiness / (radius * radius) : 1;
    ball.w = kind == FieldKind::kGaussian ? blobbiness : 0.02f * radius * radius;
    balls.push_back(ball);
  }
  return balls;
}

struct Timing {
  double low = 0, median = 0, high = 0;
};

template <class F>
Result<Timing> time_it(int repeats, const F& run) {
  std::vector<double> seconds;
  for (int i = 0; i <= repeats; ++i) {
    const auto start = std::chrono::steady_clock::now();
    PM_TRY_STATUS(run());
    const double s =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    if (i > 0) seconds.push_back(s);  // the first warms up
  }
  std::sort(seconds.begin(), seconds.end());
  return Timing{seconds.front(), seconds[seconds.size() / 2], seconds.back()};
}

nlohmann::ordered_json report_row(const BenchOptions& options, const std::string& name,
                                  const Timing& t, const std::string& note) {
  if (!options.json.wanted)
    print_data("{:<28} {:>9.2f} ms  ({:.2f} - {:.2f})  {}\n", name, t.median * 1e3, t.low * 1e3,
               t.high * 1e3, note);
  return {{"name", name},
          {"median_ms", t.median * 1e3},
          {"min_ms", t.low * 1e3},
          {"max_ms", t.high * 1e3},
          {"note", note}};
}

Status bench_surface(const BenchOptions& options, SurfaceExtractor& extractor, Mesh& mesh,
                     nlohmann::ordered_json& rows) {
  ExtractSettings settings;
  settings.field = options.field == "gaussian" ? FieldKind::kGaussian : FieldKind::kInverseSquare;
  const std::vector<Ball> balls = torus_balls(options.balls, settings.field);
  const float cell = 3.8f / static_cast<float>(options.grid - 1);
  const Grid grid{{-1.9f, -1.9f, -1.9f}, cell, {options.grid, options.grid, options.grid}};
  ExtractStatus status;
  PM_TRY(const Timing timing, time_it(options.repeats, [&]() -> Status {
           status = extractor.extract(balls, grid, settings, mesh);
           if (status.code != ExtractCode::kOk) return Error{ErrorCode::kResource, status.message};
           return Ok{};
         }));
  rows.push_back(
      report_row(options, fmt::format("surface {} {}^3", options.field, options.grid), timing,
                 fmt::format("{} balls, {} triangles", balls.size(), mesh.triangles.size())));
  // The floor: the mesh must at least be written once.
  const double bytes = static_cast<double>(mesh.positions.size() * 24 + mesh.triangles.size() * 12);
  for (const PassTime& pass : extractor.pass_times())
    if (!options.json.wanted) print_data("  {:<26} {:>9.2f} ms\n", pass.name, pass.seconds * 1e3);
  if (!options.json.wanted)
    print_data("  mesh {:.1f} MB; writing it at 10 GB/s takes {:.2f} ms\n", bytes * 1e-6,
               bytes / 1e10 * 1e3);
  return Ok{};
}

Status bench_render(const BenchOptions& options, const Mesh& mesh, nlohmann::ordered_json& rows) {
  PM_TRY(Renderer renderer, Renderer::create());
  RenderScene scene;
  RenderMesh surface;
  surface.positions = mesh.positions;
  surface.triangles = mesh.triangles;
  surface.vertex_normals = mesh.normals;
  surface.look = 1;
  surface.id = 2;
  scene.meshes.push_back(surface);
  scene.bounds = box_of(mesh.positions);
  scene.camera = make_camera(CameraSettings{}, scene.bounds, options.width, options.height);
  scene.ground.height = scene.bounds.low.y;
  RenderSettings settings;
  settings.image.width = options.width;
  settings.image.height = options.height;
  settings.image.samples = options.samples;
  Renderer::Stats stats;
  PM_TRY(const Timing timing, time_it(std::min(options.repeats, 3), [&]() -> Status {
           PM_TRY(const Image image, renderer.render(scene, settings));
           stats = renderer.stats();
           return Ok{};
         }));
  rows.push_back(report_row(
      options, fmt::format("render {}x{} {} spp", options.width, options.height, options.samples),
      timing,
      fmt::format("{:.1f} M rays, {:.1f} M rays/s, build {:.1f} ms",
                  static_cast<double>(stats.rays) * 1e-6,
                  static_cast<double>(stats.rays) * 1e-6 / stats.trace_seconds,
                  stats.build_seconds * 1e3)));
  return Ok{};
}

Result<int> run_bench(const CommandLine& line, const BenchOptions& options) {
  std::string device;
  PM_TRY(const auto extractor, make_extractor(line.common.device, device));
  if (!options.json.wanted)
    print_data("device {}, {} threads, median of {} runs (min - max)\n", device, thread_count(),
               options.repeats);
  auto rows = nlohmann::ordered_json::array();
  Mesh mesh;
  PM_TRY_STATUS(bench_surface(options, *extractor, mesh, rows));
  if (options.what != "surface") PM_TRY_STATUS(bench_render(options, mesh, rows));
  if (options.json.wanted) {
    const nlohmann::ordered_json json{
        {"version", PM_VERSION}, {"device", device}, {"threads", thread_count()}, {"rows", rows}};
    PM_TRY_STATUS(write_json(options.json, dump_json(json)));
  }
  return 0;
}

}  // namespace

void add_bench(CommandLine& line) {
  auto options = std::make_shared<BenchOptions>();
  CLI::App* command = add_command(line, "bench", "Measure this machine on a standard case.",
                                  "  polymorph bench\n  polymorph bench surface --grid 256 "
                                  "--device cuda\n  polymorph bench render --spp 64 --json",
                                  "  0 measured   2 usage   5 device or memory");
  command->add_option("what", options->what, "surface, render (which needs a surface first) or all")
      ->check(CLI::IsMember({"surface", "render", "all"}))
      ->type_name("WHAT")
      ->group("Main");
  command->add_option("--torus", options->balls, "balls on the torus (1032)")
      ->check(CLI::Range(1, 1000000))
      ->type_name("N")
      ->group("Main");
  command->add_option("--grid", options->grid, "grid points along an axis (128)")
      ->check(CLI::Range(8, 2048))
      ->type_name("N")
      ->group("Main");
  command->add_option("--field", options->field, "gaussian or inverse_square")
      ->check(CLI::IsMember({"gaussian", "inverse_square"}))
      ->type_name("FIELD")
      ->group("Main");
  command->add_option("--spp", options->samples, "samples a pixel (16)")
      ->check(CLI::Range(1, 65536))
      ->type_name("N")
      ->group("Main");
  command->add_option("--repeats", options->repeats, "runs after the first (7)")
      ->check(CLI::Range(1, 1000))
      ->type_name("N")
      ->group("Main");
  add_json(command, options->json);
  command->callback(
      [&line, options] { line.action = [&line, options] { return run_bench(line, *options); }; });
}

}  // namespace polymorph
