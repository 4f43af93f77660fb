#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>

#include "base/file.h"
#include "base/json.h"
#include "base/log.h"
#include "base/parallel.h"
#include "base/random.h"
#include "base/stopwatch.h"
#include "cli/command_line.h"
#include "field/balls_io.h"
#include "field/extract_surface.h"
#include "kernels/field_kinds.h"
#include "mesh/mesh_check.h"
#include "render/ray_bench.h"
#include "render/render.h"
#include "sequence/run/device.h"
#include "sequence/run/render_sequence.h"

namespace polymorph {
namespace {

struct BenchOptions {
  std::string what = "all", field = "gaussian";
  std::filesystem::path ball_file;
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
    const Vec3 center{static_cast<float>(ring * std::cos(u)),
                      static_cast<float>(kMinor * std::sin(v)),
                      static_cast<float>(ring * std::sin(u))};
    const Ball ball = visit(kind, [&](auto field) {
      const float constant = field.kCompactSupport ? 1 : 0.02f;
      return field.of_sphere(center, radius, {.blobbiness = 2, .blob_constant = constant});
    });
    balls.push_back(ball);
  }
  return balls;
}

struct Timing {
  double low = 0, median = 0, high = 0;
};

double median_of(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}
Timing timing_of(const std::vector<double>& seconds) {
  const auto [low, high] = std::minmax_element(seconds.begin(), seconds.end());
  return {*low, median_of(seconds), *high};
}

template <class F>
Result<Timing> time_it(int repeats, const F& run) {
  std::vector<double> seconds;
  for (int i = 0; i <= repeats; ++i) {
    const Stopwatch stopwatch;
    PM_TRY_STATUS(run());
    const double s = stopwatch.seconds();
    if (i > 0) seconds.push_back(s);  // the first warms up
  }
  return timing_of(seconds);
}

JsonValue report_row(const BenchOptions& options, const std::string& name, const Timing& t,
                     const std::string& note) {
  if (!options.json.enabled)
    print_data("{:<28} {:>9.2f} ms  ({:.2f} - {:.2f})  {}\n", name, t.median * 1e3, t.low * 1e3,
               t.high * 1e3, note);
  return {{"name", name},
          {"median_ms", t.median * 1e3},
          {"min_ms", t.low * 1e3},
          {"max_ms", t.high * 1e3},
          {"note", note}};
}

FieldKind field_named(const std::string& name) {
  for (const FieldKind kind : kFieldKinds)
    if (field_name(kind) == name) return kind;
  return FieldKind::kGaussian;
}

/// n points along each axis over [-1.9, 1.9]^3.
Grid bench_grid(int n) {
  return {{-1.9f, -1.9f, -1.9f}, 3.8f / static_cast<float>(n - 1), {n, n, n}};
}

Result<BallFile> bench_balls(const BenchOptions& options) {
  if (!options.ball_file.empty()) return read_balls(options.ball_file);
  const FieldKind kind = field_named(options.field);
  return BallFile{kind, torus_balls(options.balls, kind)};
}

Status extract_once(Engine& engine, const BallSet& balls, const Grid& grid,
                    const ExtractSettings& settings, Mesh& mesh) {
  return to_status(engine.extract(balls, grid, settings, mesh));
}

/// Times a frame's colours: eight values of each ball, carried to the surface's vertices.
Status bench_carry(const BenchOptions& options, const std::string& name, const BallSet& balls,
                   const ExtractSettings& settings, Engine& engine, const Mesh& mesh,
                   JsonValue& rows) {
  std::vector<BallAttribute> carried(2 * balls.size());
  for (std::size_t i = 0; i < carried.size(); ++i) carried[i].value[0] = static_cast<float>(i);
  std::vector<AttributeValues> values;
  PM_TRY(const Timing timing, time_it(options.repeats, [&] {
           return to_status(engine.interpolate(balls, carried, mesh.positions, settings, values));
         }));
  const double bytes = static_cast<double>(mesh.positions.size()) * (12 + 32);
  auto row = report_row(options, name + ", carry", timing,
                        fmt::format("8 values to {} vertices", mesh.positions.size()));
  for (const PassTime& pass : engine.pass_times()) {
    if (!options.json.enabled) print_data("  {:<26} {:>9.3f} ms\n", pass.name, pass.seconds * 1e3);
    row["passes_ms"][pass.name] = pass.seconds * 1e3;
  }
  row["floor_ms"] = bytes / 1e10 * 1e3;
  if (!options.json.enabled)
    print_data("  in and out {:.1f} MB: {:.3f} ms at 10 GB/s\n", bytes * 1e-6, bytes / 1e7);
  rows.push_back(std::move(row));
  return Ok{};
}

Status bench_surface(const BenchOptions& options, const std::string& device, Engine& engine,
                     Mesh& mesh, JsonValue& rows) {
  PM_TRY(const BallFile file, bench_balls(options));
  const BallSet balls = file.balls;
  ExtractSettings settings;
  settings.field = file.kind;
  Box box;
  for (const Ball& ball : balls) box = extend(box, ball.center);
  Grid grid = bench_grid(options.grid);
  if (!options.ball_file.empty()) {
    box = surface_bounds(balls.balls(), settings);
    const Vec3 size = box.high - box.low;
    PM_TRY(grid, fit_grid(box, std::max({size.x, size.y, size.z}) /
                                   static_cast<float>(options.grid - 1)));
  }
  PM_TRY_STATUS(extract_once(engine, balls, grid, settings, mesh));
  const std::string note =
      fmt::format("{} balls, {} triangles", balls.size(), mesh.triangles.size());
  // What must be written at least: the mesh, once.
  const double bytes = static_cast<double>(mesh.positions.size() * 24 + mesh.triangles.size() * 12);
  const auto measure = [&](const std::string& name, double speed,
                           const char* speed_name) -> Status {
    Mesh other;
    Mesh& target = settings.download ? mesh : other;
    std::map<std::string, std::vector<double>> passes;
    std::vector<std::string> order;
    PM_TRY(const Timing timing, time_it(options.repeats, [&]() -> Status {
             PM_TRY_STATUS(extract_once(engine, balls, grid, settings, target));
             for (const PassTime& pass : engine.pass_times()) {
               if (!passes.contains(pass.name)) order.push_back(pass.name);
               passes[pass.name].push_back(pass.seconds);
             }
             return Ok{};
           }));
    auto row = report_row(options, name, timing, note);
    for (const std::string& pass : order) {
      const double ms = median_of(passes[pass]) * 1e3;
      if (!options.json.enabled) print_data("  {:<26} {:>9.3f} ms\n", pass, ms);
      row["passes_ms"][pass] = ms;
    }
    row["floor_ms"] = bytes / speed * 1e3;
    row["memory_bytes"] = engine.memory_used();
    if (!options.json.enabled)
      print_data("  mesh {:.1f} MB: {:.3f} ms at {}; buffers {:.0f} MB\n", bytes * 1e-6,
                 bytes / speed * 1e3, speed_name, static_cast<double>(engine.memory_used()) * 1e-6);
    rows.push_back(std::move(row));
    return Ok{};
  };
  const std::string name = fmt::format("surface {} {}^3", field_name(file.kind), options.grid);
  if (device == "cpu") {
    PM_TRY_STATUS(measure(name, 1e10, "10 GB/s"));
  } else {
    settings.download = false;
    PM_TRY_STATUS(measure(name + ", kept there", 4.3e12, "4.3 TB/s"));
    settings.download = true;
    PM_TRY_STATUS(measure(name, 5e10, "50 GB/s"));
  }
  return bench_carry(options, name, balls, settings, engine, mesh, rows);
}

/// The report's Table 6.7: frames per second over skin and influence resolution, here with the
/// influence in whole cells; and what the interpolation costs in accuracy.
Status bench_table(const BenchOptions& options, Engine& engine, JsonValue& rows) {
  PM_TRY(const BallFile file, bench_balls(options));
  const BallSet balls = file.balls;
  ExtractSettings settings;
  settings.field = file.kind;
  if (!options.json.enabled)
    print_data("surfaces a second (and volume off by, %)\n{:>6} {:>16} {:>16} {:>16} {:>16}\n",
               "skin", "influence 10", "20", "30", "40");
  for (int skin = 10; skin <= 100; skin += 10) {
    const Grid grid = bench_grid(skin + 1);
    settings.sample_stride = 1;
    Mesh mesh;
    PM_TRY_STATUS(extract_once(engine, balls, grid, settings, mesh));
    const double exact = volume_of(mesh);
    std::string text = fmt::format("{:>6}", skin);
    for (int resolution = 10; resolution <= 40; resolution += 10) {
      settings.sample_stride = std::max(1, (skin + resolution / 2) / resolution);
      PM_TRY(const Timing timing, time_it(options.repeats, [&] {
               return extract_once(engine, balls, grid, settings, mesh);
             }));
      const double volume_error = exact > 0 ? 100 * (volume_of(mesh) / exact - 1) : 0;
      text += fmt::format(" {:>8.0f} {:>7.1f}", 1 / timing.median, volume_error);
      rows.push_back({{"name", "table 6.7"},
                      {"skin", skin},
                      {"influence", resolution},
                      {"cells_apart", settings.sample_stride},
                      {"per_second", 1 / timing.median},
                      {"volume_off_percent", volume_error}});
    }
    if (!options.json.enabled) print_data("{}\n", text);
  }
  return Ok{};
}

/// The report's Graph 6.1: the same surfaces on the CPU and on the GPU, where there is one.
Status bench_graph(const BenchOptions& options, JsonValue& rows) {
  PM_TRY(const BallFile file, bench_balls(options));
  const BallSet balls = file.balls;
  ExtractSettings settings;
  settings.field = file.kind;
  EngineStatus status;
  const auto cpu = make_cpu_engine();
  const auto cuda = make_cuda_engine(0, status);
  if (!options.json.enabled)
    print_data("{:>6} {:>12} {:>12}\n", "skin", "cpu ms", cuda ? "cuda ms" : "cuda: none here");
  for (int skin = 10; skin <= 100; skin += 10) {
    JsonValue row{{"name", "graph 6.1"}, {"skin", skin}};
    std::string text = fmt::format("{:>6}", skin);
    for (Engine* engine : {cpu.get(), cuda.get()}) {
      if (engine == nullptr) continue;
      Mesh mesh;
      PM_TRY(const Timing timing, time_it(options.repeats, [&] {
               return extract_once(*engine, balls, bench_grid(skin + 1), settings, mesh);
             }));
      row[engine == cpu.get() ? "cpu_ms" : "cuda_ms"] = timing.median * 1e3;
      text += fmt::format(" {:>12.3f}", timing.median * 1e3);
    }
    if (!options.json.enabled) print_data("{}\n", text);
    rows.push_back(std::move(row));
  }
  return Ok{};
}

Status bench_render(const BenchOptions& options, const Mesh& mesh, JsonValue& rows) {
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
  const double paths = static_cast<double>(stats.paths) * 1e-6;
  rows.push_back(report_row(
      options, fmt::format("render {}x{} {} spp", options.width, options.height, options.samples),
      timing,
      fmt::format("{:.2f} M paths/s, {:.1f} M rays/s, build {:.1f} ms", paths / stats.trace_seconds,
                  static_cast<double>(stats.rays) * 1e-6 / stats.trace_seconds,
                  stats.build_seconds * 1e3)));
  PM_TRY(const std::vector<RayLoop> loops,
         measure_rays(scene, options.width, options.height, options.repeats));
  for (const RayLoop& loop : loops) {
    const Timing t = timing_of(loop.seconds);
    rows.push_back(report_row(
        options, loop.name, t,
        fmt::format("{:.1f} M rays/s", static_cast<double>(loop.rays) * 1e-6 / t.median)));
  }
  // The share of the bare loop's rate in the same turn; the median of the turns.
  const auto ratio = [&](std::size_t own, std::size_t bare) {
    std::vector<double> ratios;
    for (std::size_t i = 0; i < loops[own].seconds.size(); ++i)
      ratios.push_back(loops[bare].seconds[i] / loops[own].seconds[i]);
    return median_of(ratios);
  };
  const double camera = ratio(2, 1), scattered = ratio(4, 3);
  if (!options.json.enabled)
    print_data(
        "  camera rays at {:.0f} % of the bare packets' rate, scattered rays at {:.0f} % of "
        "the bare ones'\n",
        100 * camera, 100 * scattered);
  rows.push_back({{"name", "share of bare rates"}, {"camera", camera}, {"scattered", scattered}});
  PM_TRY(const std::vector<BuildQuality> builds, measure_builds(scene));
  for (const BuildQuality& build : builds) {
    if (!options.json.enabled)
      print_data("  BVH quality {:<8} {:>8.1f} ms to build, {:>8.1f} ms per million rays\n",
                 build.name, build.build_seconds * 1e3, build.trace_seconds * 1e3);
    rows.push_back({{"name", fmt::format("bvh {}", build.name)},
                    {"build_ms", build.build_seconds * 1e3},
                    {"million_rays_ms", build.trace_seconds * 1e3}});
  }
  return Ok{};
}

Result<int> run_bench(const CommandLine& line, const BenchOptions& options) {
  std::string device;
  PM_TRY(const auto engine, make_engine(line.common.device, device, line.common.max_memory));
  if (!options.json.enabled)
    print_data("device {}, {} threads, median of {} runs (min - max)\n", device, thread_count(),
               options.repeats);
  auto rows = JsonValue::array();
  Mesh mesh;
  const bool all = options.what == "all";
  if (options.what != "report") PM_TRY_STATUS(bench_surface(options, device, *engine, mesh, rows));
  if (all || options.what == "report") {
    PM_TRY_STATUS(bench_table(options, *engine, rows));
    PM_TRY_STATUS(bench_graph(options, rows));
  }
  if (all || options.what == "render") PM_TRY_STATUS(bench_render(options, mesh, rows));
  if (options.json.enabled) {
    const JsonValue json{{"device", device}, {"threads", thread_count()}, {"rows", rows}};
    PM_TRY_STATUS(write_json(options.json, json));
  }
  return 0;
}

}  // namespace

void add_bench(CommandLine& line) {
  auto options = std::make_shared<BenchOptions>();
  Command command = add_command(line, "bench", "Measure this machine on a standard case.",
                                "  polymorph bench\n  polymorph bench surface --grid 256 "
                                "--device cuda\n  polymorph bench render --spp 64 --json",
                                "  0 measured   2 usage   5 device or memory");
  command
      .add_option(
          "what", options->what,
          "surface, report (its Table 6.7 and Graph 6.1), render (which needs a surface first) or "
          "all")
      .choices({"surface", "report", "render", "all"})
      .type_name("WHAT")
      .group("Main");
  command.add_option("--torus", options->balls, "balls on the torus (1032)")
      .range(1, 1000000)
      .type_name("N")
      .group("Main");
  command.add_option("--balls", options->ball_file, "balls from a JSON file instead of the torus")
      .type_name("FILE")
      .group("Main");
  command.add_option("--grid", options->grid, "grid points along an axis (128)")
      .range(8, 4096)
      .type_name("N")
      .group("Main");
  std::vector<std::string> fields;
  for (const FieldKind kind : kFieldKinds) fields.emplace_back(field_name(kind));
  command
      .add_option("--field", options->field,
                  fmt::format("of the balls: {} (gaussian)", fmt::join(fields, ", ")))
      .choices(fields)
      .type_name("FIELD")
      .group("Main");
  command.add_option("--spp", options->samples, "samples per pixel (16)")
      .range(1, 65536)
      .type_name("N")
      .group("Main");
  command.add_option("--repeats", options->repeats, "runs after the first (7)")
      .range(1, 1000)
      .type_name("N")
      .group("Main");
  add_json(command, options->json);
  set_action(line, command, [&line, options] { return run_bench(line, *options); });
}

}  // namespace polymorph
