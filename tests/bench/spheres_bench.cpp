// Model to fitted balls: time and quality of every method, on models and budgets of choice.
//   spheres_bench [--json] [--balls 64,128,256,512] [--methods medial,hubbard] [--grid 192]
//   MODEL...
// Without models: those of scenes/models. Each figure is measured on the extracted surface; times
// are those of one run without a cache, in seconds.
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "base/json.h"
#include "base/parallel.h"
#include "model/load/load_obj.h"
#include "spheres/boundary.h"
#include "spheres/fit.h"
#include "spheres/medial.h"
#include "spheres/quality.h"
#include "spheres/spheres.h"
#include "testing/paths.h"

namespace polymorph {
namespace {

double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

std::vector<std::string> split(const std::string& text) {
  std::vector<std::string> parts;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    parts.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return parts;
}

struct Row {
  std::string model, method;
  std::size_t triangles = 0, balls = 0;
  double seconds = 0, sample_seconds = 0, cover_seconds = 0, fit_seconds = 0;
  ApproximationQuality figures;
};

/// The stages of the default method by themselves; the whole, with levels of the tree and the
/// volume, is `seconds`.
void time_stages(const Model& model, std::size_t balls, Row& row) {
  const double start = now();
  const InsideTest inside(model);
  const auto samples = sample_boundary(model, inside, 3000 + 40 * balls);
  const double sampled = now();
  const auto spheres = make_medial_cover(samples, balls);
  const double covered = now();
  if (!fit_balls(model, inside, samples, spheres, {})) return;
  row.sample_seconds = sampled - start;
  row.cover_seconds = covered - sampled;
  row.fit_seconds = now() - covered;
}

int run(int argc, char** argv) {
  bool json = false;
  int grid = 192;
  std::string budgets = "64,128,256,512", methods = "medial";
  std::vector<std::filesystem::path> models;
  for (int i = 1; i < argc; ++i) {
    const std::string arg = argv[i];
    if (arg == "--json")
      json = true;
    else if (arg == "--balls" && i + 1 < argc)
      budgets = argv[++i];
    else if (arg == "--methods" && i + 1 < argc)
      methods = argv[++i];
    else if (arg == "--grid" && i + 1 < argc)
      grid = std::atoi(argv[++i]);
    else
      models.emplace_back(arg);
  }
  if (models.empty())
    for (const char* name : {"teapot", "monkey", "penguin", "torus", "humanoid", "spider"})
      models.push_back(source_dir() / "scenes" / "models" / (std::string(name) + ".obj"));
  set_thread_count(0);
  if (!json)
    std::printf("%-12s %9s %-8s %5s | %6s %6s %8s %8s %8s %8s | %6s %6s %6s %6s  (%d threads)\n",
                "model", "triangles", "method", "balls", "IoU", "volume", "RMS ->", "RMS <-",
                "H ->", "H <-", "sample", "cover", "fit", "all s", thread_count());
  JsonValue rows = JsonValue::array();
  for (const auto& path : models) {
    LoadObjSettings plain;
    plain.textures = false;
    const auto loaded = load_obj(path, plain);
    if (!loaded) {
      std::fprintf(stderr, "%s\n", loaded.error().message.c_str());
      return 3;
    }
    const Model& model = loaded->model;
    for (const std::string& method : split(methods)) {
      for (const std::string& budget : split(budgets)) {
        SphereSettings settings;
        settings.method = method == "hubbard" ? SphereMethod::kHubbard : SphereMethod::kMedial;
        settings.balls = std::atoi(budget.c_str());
        Row row{model.name, method, model.triangles.size(), 0, 0, 0, 0, 0, {}};
        if (settings.method == SphereMethod::kMedial)
          time_stages(model, static_cast<std::size_t>(settings.balls), row);
        const double start = now();
        const auto result = approximate(model, settings);
        row.seconds = now() - start;
        if (!result) {
          std::fprintf(stderr, "%s\n", result.error().message.c_str());
          continue;
        }
        row.balls = result->balls.size();
        const auto figures =
            measure_quality(model, InsideTest(model), result->balls, FieldKind::kGaussian, {grid});
        if (!figures) continue;
        row.figures = *figures;
        const ApproximationQuality& f = row.figures;
        if (!json)
          std::printf(
              "%-12s %9zu %-8s %5zu | %.4f %.4f %7.3f%% %7.3f%% %7.3f%% %7.3f%% | %6.2f %6.2f "
              "%6.2f "
              "%6.2f\n",
              row.model.c_str(), row.triangles, method.c_str(), row.balls, f.iou, f.volume_ratio,
              100 * f.rms_to_model, 100 * f.rms_to_surface, 100 * f.hausdorff_to_model,
              100 * f.hausdorff_to_surface, row.sample_seconds, row.cover_seconds, row.fit_seconds,
              row.seconds);
        std::fflush(stdout);
        rows.push_back({{"model", row.model},
                        {"triangles", row.triangles},
                        {"method", method},
                        {"balls", row.balls},
                        {"iou", f.iou},
                        {"volume_ratio", f.volume_ratio},
                        {"rms_to_model", f.rms_to_model},
                        {"rms_to_surface", f.rms_to_surface},
                        {"hausdorff_to_model", f.hausdorff_to_model},
                        {"hausdorff_to_surface", f.hausdorff_to_surface},
                        {"sample_seconds", row.sample_seconds},
                        {"cover_seconds", row.cover_seconds},
                        {"fit_seconds", row.fit_seconds},
                        {"seconds", row.seconds}});
      }
    }
  }
  if (json) std::printf("%s\n", dump_json(rows).c_str());
  return 0;
}

}  // namespace
}  // namespace polymorph

int main(int argc, char** argv) { return polymorph::run(argc, argv); }
