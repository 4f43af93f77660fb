#include <cmath>
#include <map>

#include "base/random.h"
#include "bench/bench_run.h"
#include "device/device.h"
#include "field/balls_io.h"
#include "field/extract_surface.h"
#include "kernels/field_kinds.h"
#include "mesh/mesh_check.h"

namespace polymorph {
namespace {

/// Makes the balls of the standard case: n balls, evenly distributed over a torus with radii 1 and
/// 0.4. With the spacing s = sqrt(area / n), the balls' radii are random in [0.85 s, 1.15 s].
std::vector<Ball> torus_balls(int n, FieldKind kind) {
  constexpr double kPi = 3.14159265358979323846, kMajor = 1, kMinor = 0.4;
  const double spacing = std::sqrt(4 * kPi * kPi * kMajor * kMinor / n);
  std::vector<Ball> balls;
  for (int i = 0; i < n; ++i) {
    // The fractional part of the golden ratio makes a rank-1 lattice, which is evenly distributed
    // without forming rows.
    const double u = 2 * kPi * i / n, v = 2 * kPi * std::fmod(i * 0.6180339887498949, 1.0);
    const double ring = kMajor + kMinor * std::cos(v);
    const auto radius = static_cast<float>(
        spacing * (0.85 + 0.3 * static_cast<double>(random_float(/*seed=*/1, /*stream=*/0,
                                                                 static_cast<std::uint64_t>(i)))));
    const Vec3 center{static_cast<float>(ring * std::cos(u)),
                      static_cast<float>(kMinor * std::sin(v)),
                      static_cast<float>(ring * std::sin(u))};
    const Ball ball = visit(kind, [&](auto field) {
      // The values of all balls with infinite support add up everywhere, so each ball must be weak.
      const float constant = field.kCompactSupport ? 1 : 0.02f;
      return field.from_sphere(center, radius, {.blobbiness = 2, .blob_constant = constant});
    });
    balls.push_back(ball);
  }
  return balls;
}

/// Returns the field function of this name; Gaussian if there is none.
FieldKind find_field(const std::string& name) {
  for (const FieldKind kind : kFieldKinds)
    if (field_name(kind) == name) return kind;
  return FieldKind::kGaussian;
}

/// Returns the grid over [-1.9, 1.9]^3, which contains the torus's surface, with n points along
/// each axis.
Grid bench_grid(int n) {
  return {{-1.9f, -1.9f, -1.9f}, 3.8f / static_cast<float>(n - 1), {n, n, n}};
}

/// Returns the balls of the file, if one is given, else the balls on the torus.
Result<BallFile> bench_balls(const BenchSettings& settings) {
  if (!settings.ball_file.empty()) return read_balls(settings.ball_file);
  const FieldKind kind = find_field(settings.field);
  return BallFile{kind, torus_balls(settings.balls, kind)};
}

Status extract_once(Engine& engine, const BallSet& balls, const Grid& grid,
                    const ExtractSettings& settings, Mesh& mesh) {
  return to_status(engine.extract(balls, grid, settings, mesh));
}

/// Balls, and the surface that was extracted from them.
struct ExtractedBalls {
  const BallSet& balls;
  const ExtractSettings& settings;
  const Mesh& mesh;
};

/// Times the interpolation of a frame's colours: eight values per ball, at the surface's vertices.
Status bench_interpolation(Bench& bench, const std::string& name, const ExtractedBalls& surface,
                           Engine& engine) {
  const BallSet& balls = surface.balls;
  const Mesh& mesh = surface.mesh;
  std::vector<BallAttribute> attributes(2 * balls.size());  // two per ball, of four values each
  for (std::size_t i = 0; i < attributes.size(); ++i)
    attributes[i].value[0] = static_cast<float>(i);
  std::vector<AttributeValues> values;
  ExtractSettings settings = surface.settings;
  const auto interpolate = [&] {
    return to_status(engine.interpolate(balls, attributes, mesh.positions, settings, values));
  };
  PM_TRY(const Timing timing, time_runs(bench.settings.repeats, interpolate));
  settings.time_passes = true;
  PM_TRY_STATUS(interpolate());
  // Per vertex, 12 bytes of position are read and 32 bytes of values are written.
  const double bytes = static_cast<double>(mesh.positions.size()) * (12 + 32);
  auto row = print_row(bench, name + ", carry", timing,
                       fmt::format("8 values to {} vertices", mesh.positions.size()));
  for (const PassTime& pass : engine.pass_times()) {
    bench.print_line("  {:<26} {:>9.3f} ms\n", pass.name, pass.seconds * 1e3);
    row["passes_ms"][pass.name] = pass.seconds * 1e3;
  }
  // The time that moving these bytes once takes at 10 GB/s, the bandwidth of host memory.
  row["floor_ms"] = bytes / 1e10 * 1e3;
  bench.print_line("  in and out {:.1f} MB: {:.3f} ms at 10 GB/s\n", bytes * 1e-6, bytes / 1e7);
  bench.rows.push_back(std::move(row));
  return Ok{};
}

/// Measures the report's Table 6.7: surfaces per second, by skin resolution (cells of the surface's
/// grid along an axis) and influence resolution (intervals along an axis, each of a whole number of
/// cells, at whose ends the field is evaluated). Also measures the error of the volume that the
/// interpolation of the field between these points causes.
Status bench_table(Bench& bench, Engine& engine) {
  PM_TRY(const BallFile file, bench_balls(bench.settings));
  const BallSet balls = file.balls;
  ExtractSettings settings;
  settings.field = file.kind;
  bench.print_line("surfaces a second (and volume off by, %)\n{:>6} {:>16} {:>16} {:>16} {:>16}\n",
                   "skin", "influence 10", "20", "30", "40");
  for (int skin = 10; skin <= 100; skin += 10) {
    const Grid grid = bench_grid(skin + 1);
    settings.sample_stride = 1;
    Mesh mesh;
    PM_TRY_STATUS(extract_once(engine, balls, grid, settings, mesh));
    const double exact_volume = volume_of(mesh);
    std::string text = fmt::format("{:>6}", skin);
    for (int resolution = 10; resolution <= 40; resolution += 10) {
      settings.sample_stride = std::max(1, (skin + resolution / 2) / resolution);  // in cells
      PM_TRY(const Timing timing, time_runs(bench.settings.repeats, [&] {
               return extract_once(engine, balls, grid, settings, mesh);
             }));
      const double volume_error = exact_volume > 0 ? 100 * (volume_of(mesh) / exact_volume - 1) : 0;
      text += fmt::format(" {:>8.0f} {:>7.1f}", 1 / timing.median, volume_error);
      bench.rows.push_back({{"name", "table 6.7"},
                            {"skin", skin},
                            {"influence", resolution},
                            {"cells_apart", settings.sample_stride},
                            {"per_second", 1 / timing.median},
                            {"volume_off_percent", volume_error}});
    }
    bench.print_line("{}\n", text);
  }
  return Ok{};
}

/// Measures the report's Graph 6.1: the time of a surface by skin resolution, on the CPU and, if
/// there is one, on the GPU.
Status bench_graph(Bench& bench) {
  PM_TRY(const BallFile file, bench_balls(bench.settings));
  const BallSet balls = file.balls;
  ExtractSettings settings;
  settings.field = file.kind;
  EngineStatus status;
  const auto cpu = make_cpu_engine();
  const auto cuda = make_cuda_engine(/*device=*/0, status);
  bench.print_line("{:>6} {:>12} {:>12}\n", "skin", "cpu ms", cuda ? "cuda ms" : "cuda: none here");
  for (int skin = 10; skin <= 100; skin += 10) {
    JsonValue row{{"name", "graph 6.1"}, {"skin", skin}};
    std::string text = fmt::format("{:>6}", skin);
    for (Engine* engine : {cpu.get(), cuda.get()}) {
      if (engine == nullptr) continue;
      Mesh mesh;
      PM_TRY(const Timing timing, time_runs(bench.settings.repeats, [&] {
               return extract_once(*engine, balls, bench_grid(skin + 1), settings, mesh);
             }));
      row[engine == cpu.get() ? "cpu_ms" : "cuda_ms"] = timing.median * 1e3;
      text += fmt::format(" {:>12.3f}", timing.median * 1e3);
    }
    bench.print_line("{}\n", text);
    bench.rows.push_back(std::move(row));
  }
  return Ok{};
}

/// A rate of memory or of the bus, in bytes per second, with its text.
struct Bandwidth {
  double rate;
  const char* text;
};

/// A surface to measure.
struct SurfaceCase {
  Bench& bench;
  const std::string& device;
  Engine& engine;
  std::string name;   ///< name of the row
  std::string input;  ///< balls or pairs that make the surface, for the note
  ExtractSettings settings = {};
};

/// Times `extract(time_passes)`, which returns a Status, and then its passes, and adds a row.
/// `mesh`: what it extracts; `bandwidth`: that of the memory that receives the mesh.
template <class Extract>
Status measure_extraction(const SurfaceCase& surface, const std::string& name, const Mesh& mesh,
                          Bandwidth bandwidth, const Extract& extract) {
  Bench& bench = surface.bench;
  const Engine& engine = surface.engine;
  const std::string note = fmt::format("{}, {} triangles", surface.input, mesh.triangles.size());
  // A lower bound of the bytes to write: 24 per vertex (position and normal) and 12 per triangle.
  const double bytes = static_cast<double>(mesh.positions.size() * 24 + mesh.triangles.size() * 12);
  std::map<std::string, std::vector<double>> passes;
  std::vector<std::string> pass_order;
  // Not in the same calls, because a GPU takes longer while it measures its passes.
  PM_TRY(const Timing timing,
         time_runs(bench.settings.repeats, [&] { return extract(/*time_passes=*/false); }));
  for (int i = 0; i < bench.settings.repeats; ++i) {
    PM_TRY_STATUS(extract(/*time_passes=*/true));
    for (const PassTime& pass : engine.pass_times()) {
      if (!passes.contains(pass.name)) pass_order.push_back(pass.name);
      passes[pass.name].push_back(pass.seconds);
    }
  }
  auto row = print_row(bench, name, timing, note);
  for (const std::string& pass : pass_order) {
    const double ms = median_of(passes[pass]) * 1e3;
    bench.print_line("  {:<26} {:>9.3f} ms\n", pass, ms);
    row["passes_ms"][pass] = ms;
  }
  row["floor_ms"] = bytes / bandwidth.rate * 1e3;
  row["memory_bytes"] = engine.memory_used();
  bench.print_line("  mesh {:.1f} MB: {:.3f} ms at {}; buffers {:.0f} MB\n", bytes * 1e-6,
                   bytes / bandwidth.rate * 1e3, bandwidth.text,
                   static_cast<double>(engine.memory_used()) * 1e-6);
  bench.rows.push_back(std::move(row));
  return Ok{};
}

/// Measures a surface on the CPU, or on a GPU without and with the download of its mesh.
/// `extract(settings, mesh)` returns a Status. Stores the mesh.
template <class Extract>
Status measure_surface(const SurfaceCase& surface, Mesh& mesh, const Extract& extract) {
  ExtractSettings settings = surface.settings;
  PM_TRY_STATUS(extract(settings, mesh));
  // The bandwidths are those of host memory, device memory and the bus (docs/performance.md).
  const bool on_cpu = surface.device == "cpu";
  if (!on_cpu) {
    Mesh empty;  // without a download the engine returns no mesh
    settings.download = false;
    PM_TRY_STATUS(measure_extraction(surface, surface.name + ", kept there", mesh,
                                     {4.3e12, "4.3 TB/s"}, [&](bool time_passes) {
                                       settings.time_passes = time_passes;
                                       return extract(settings, empty);
                                     }));
  }
  const Bandwidth bandwidth = on_cpu ? Bandwidth{1e10, "10 GB/s"} : Bandwidth{5e10, "50 GB/s"};
  Mesh target;
  settings = surface.settings;
  return measure_extraction(surface, surface.name, mesh, bandwidth, [&](bool time_passes) {
    settings.time_passes = time_passes;
    return extract(settings, target);
  });
}

/// Computes the distances from a torus with these radii, on 129^3 points over [-2, 2]^3.
std::shared_ptr<const DistanceGrid> torus_distances(float major, float minor) {
  constexpr int kPoints = 129;
  auto distances = std::make_shared<DistanceGrid>();
  distances->grid = {{-2, -2, -2}, 4.0f / (kPoints - 1), {kPoints, kPoints, kPoints}};
  for (int z = 0; z < kPoints; ++z)
    for (int y = 0; y < kPoints; ++y)
      for (int x = 0; x < kPoints; ++x) {
        const Vec3 p = grid_point(distances->grid, {x, y, z});
        const float ring = std::hypot(p.x, p.z) - major;
        distances->values.push_back(minor - std::hypot(ring, p.y));
      }
  distances->lipschitz = 1.8f;  // at least sqrt 3, for trilinear interpolation
  return distances;
}

/// Times the surface half way between two tori, with the map to both of them, which each frame
/// makes anew. Has an engine of its own, so that other rows do not count its memory.
Status bench_between(Bench& bench, const std::string& device) {
  constexpr int kPairs = 500;
  std::string chosen;
  PM_TRY(const std::unique_ptr<Engine> engine,
         make_engine(device, chosen, bench.settings.max_memory));
  const auto from = torus_distances(1, 0.4f), to = torus_distances(0.9f, 0.5f);
  Regression map;
  map.maps = 2;
  map.lattice = {{-2.2f, -2.2f, -2.2f}, 0.16f, {28, 28, 28}};  // 4 % of the diagonal apart
  for (const Ball& ball : torus_balls(kPairs, FieldKind::kGaussian)) {
    map.samples.push_back({ball.center, /*mass=*/1, /*deviation=*/0.22f});
    BallAttribute attribute;
    attribute.value[0] = 0.1f * ball.center.y;
    attribute.value[3] = 0.5f;  // the progress, and the level's weight
    map.values.insert(map.values.end(), 2, attribute);
  }
  const Grid grid = bench_grid(bench.settings.grid);
  Mesh mesh;
  return measure_surface(
      {bench, device, *engine, fmt::format("between objects {}^3", bench.settings.grid),
       fmt::format("{} pairs", kPairs)},
      mesh, [&](const ExtractSettings& settings, Mesh& target) {
        MorphSurface surface{std::make_shared<const Regression>(map), from, to};
        // Half way, both objects' distances are read with and without detail.
        surface.smooth_from = from, surface.smooth_to = to;
        return to_status(engine->extract(surface, grid, settings, target));
      });
}

}  // namespace

Status bench_surface(Bench& bench, const std::string& device, Engine& engine, Mesh& mesh) {
  if (bench.settings.what != "render") PM_TRY_STATUS(bench_between(bench, device));
  PM_TRY(const BallFile file, bench_balls(bench.settings));
  const BallSet balls = file.balls;
  ExtractSettings settings;
  settings.field = file.kind;
  // Make the grid: that of the torus, or one that fits the surface of a file's balls.
  Grid grid = bench_grid(bench.settings.grid);
  if (!bench.settings.ball_file.empty()) {
    const Box box = surface_bounds(balls.balls(), settings);
    const Vec3 size = box.high - box.low;
    PM_TRY(grid, fit_grid(box, std::max({size.x, size.y, size.z}) /
                                   static_cast<float>(bench.settings.grid - 1)));
  }
  const std::string name =
      fmt::format("surface {} {}^3", field_name(file.kind), bench.settings.grid);
  PM_TRY_STATUS(measure_surface(
      {bench, device, engine, name, fmt::format("{} balls", balls.size()), settings}, mesh,
      [&](const ExtractSettings& row_settings, Mesh& target) {
        return extract_once(engine, balls, grid, row_settings, target);
      }));
  return bench_interpolation(bench, name, {balls, settings, mesh}, engine);
}

Status bench_report_figures(Bench& bench, Engine& engine) {
  PM_TRY_STATUS(bench_table(bench, engine));
  return bench_graph(bench);
}

}  // namespace polymorph
