#include "bench/bench_run.h"
#include "device/device.h"
#include "render/ray_bench.h"
#include "render/render.h"

namespace polymorph {
namespace {

/// Times frames of a scene, traced by `device` (make_renderer()). Adds no row if `device` is a GPU
/// that could not trace the scene, so that the CPU did.
Status bench_frames(Bench& bench, const RenderScene& scene, const RenderSettings& settings,
                    const std::string& device) {
  PM_TRY(Renderer renderer, make_renderer(device));
  Renderer::Stats stats;
  // Frames take long, so time at most three runs.
  PM_TRY(const Timing timing, time_runs(std::min(bench.settings.repeats, 3), [&]() -> Status {
           PM_TRY(const Image image, renderer.render(scene, settings));
           stats = renderer.stats();
           return Ok{};
         }));
  if (device != "cpu" && renderer.traced_on_cpu()) return Ok{};
  const double paths = static_cast<double>(stats.paths) * 1e-6;
  bench.rows.push_back(print_row(
      bench,
      fmt::format("render {}x{} {} spp{}", settings.image.width, settings.image.height,
                  settings.image.samples, device == "cpu" ? "" : ", " + device),
      timing,
      fmt::format("{:.2f} M paths/s, {:.1f} M rays/s, build {:.1f} ms", paths / stats.trace_seconds,
                  static_cast<double>(stats.rays) * 1e-6 / stats.trace_seconds,
                  stats.build_seconds * 1e3)));
  return Ok{};
}

/// Prints and adds a row for each loop, with its rays per second.
void report_loops(Bench& bench, const std::vector<RayLoop>& loops) {
  for (const RayLoop& loop : loops) {
    const Timing t = timing_of(loop.seconds);
    bench.rows.push_back(print_row(
        bench, loop.name, t,
        fmt::format("{:.1f} M rays/s", static_cast<double>(loop.rays) * 1e-6 / t.median)));
  }
}

/// Returns the ratio of a loop's rays per second to those of `bare`, the loop that does nothing
/// but trace the same rays: the median of the ratios of all runs.
double rate_ratio(const RayLoop& loop, const RayLoop& bare) {
  std::vector<double> ratios;
  for (std::size_t i = 0; i < loop.seconds.size(); ++i)
    ratios.push_back(bare.seconds[i] / loop.seconds[i]);
  return median_of(ratios);
}
/// Prints and adds a row with the rate_ratio() of camera rays and of scattered rays.
void report_ratios(Bench& bench, const char* name, double camera, double scattered) {
  bench.print_line(
      "  camera rays at {:.0f} % of the bare ones' rate, scattered rays at {:.0f} % of the bare "
      "ones'\n",
      100 * camera, 100 * scattered);
  bench.rows.push_back({{"name", name}, {"camera", camera}, {"scattered", scattered}});
}

Status bench_device_rays(Bench& bench, const RenderScene& scene, const std::string& device) {
  std::string error;
  const std::unique_ptr<DeviceTracer> tracer = open_tracer(device, error);
  if (!tracer) return make_error(ErrorCode::kResource, "{}: {}", device, error);
  PM_TRY(const std::vector<RayLoop> loops,
         measure_device_rays(scene, *tracer, bench.settings.width, bench.settings.height,
                             bench.settings.repeats));
  report_loops(bench, loops);
  // The loops: camera rays, bare and exact; then scattered rays, bare and exact.
  report_ratios(bench, "share of bare rates, GPU", rate_ratio(loops[1], loops[0]),
                rate_ratio(loops[3], loops[2]));
  return Ok{};
}

}  // namespace

Status bench_render(Bench& bench, const std::string& device, const Mesh& mesh) {
  RenderScene scene;
  RenderMesh surface;
  surface.positions = mesh.positions;
  surface.triangles = mesh.triangles;
  surface.vertex_normals = mesh.normals;
  surface.look = 1;  // only RenderScene::look: the mesh has no materials
  surface.id = 2;    // id 1 is the ground
  scene.meshes.push_back(surface);
  scene.bounds = bounding_box(mesh.positions);
  scene.camera =
      make_camera(CameraSettings{}, scene.bounds, bench.settings.width, bench.settings.height);
  scene.ground.height = scene.bounds.low.y;
  RenderSettings settings;
  settings.image.width = bench.settings.width;
  settings.image.height = bench.settings.height;
  settings.image.samples = bench.settings.samples;
  PM_TRY_STATUS(bench_frames(bench, scene, settings, "cpu"));
  if (device != "cpu") PM_TRY_STATUS(bench_frames(bench, scene, settings, device));
  PM_TRY(const std::vector<RayLoop> loops,
         measure_rays(scene, bench.settings.width, bench.settings.height, bench.settings.repeats));
  report_loops(bench, loops);
  // Loops 1 and 3 are plain Embree, loops 2 and 4 the renderer (measure_rays()); loop 0 casts
  // single rays, which are not compared.
  report_ratios(bench, "share of bare rates", rate_ratio(loops[2], loops[1]),
                rate_ratio(loops[4], loops[3]));
  if (device != "cpu") PM_TRY_STATUS(bench_device_rays(bench, scene, device));
  PM_TRY(const std::vector<BuildQuality> builds, measure_builds(scene));
  for (const BuildQuality& build : builds) {
    bench.print_line("  BVH quality {:<8} {:>8.1f} ms to build, {:>8.1f} ms per million rays\n",
                     build.name, build.build_seconds * 1e3, build.trace_seconds * 1e3);
    bench.rows.push_back({{"name", fmt::format("bvh {}", build.name)},
                          {"build_ms", build.build_seconds * 1e3},
                          {"million_rays_ms", build.trace_seconds * 1e3}});
  }
  return Ok{};
}

}  // namespace polymorph
