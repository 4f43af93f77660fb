#include <algorithm>
#include <cmath>
#include <optional>

#include "base/activity.h"
#include "base/file.h"
#include "base/json.h"
#include "base/log.h"
#include "base/stopwatch.h"
#include "cli/command_line.h"
#include "export/spheres_picture.h"
#include "field/balls_io.h"
#include "field/extract_surface.h"
#include "interchange/mesh_file.h"
#include "model/clustered_model.h"
#include "model/load/load_model.h"
#include "model/repair/diagnose.h"
#include "model/shapes.h"
#include "spheres/quality.h"
#include "spheres/spheres.h"

namespace polymorph {
namespace {

struct SpheresOptions {
  std::string model, method = "medial", fit = "ellipsoid", inside = "winding";
  int balls = 0, resolution = 0, grid = 192, width = 480;
  double error = 0, root_margin = 0;
  bool no_fit = false, solidify = false;
  std::string write_balls, write_surface, write_spheres, output;
  JsonOutput json;
};

Result<Model> load(const std::string& name) {
  if (std::find(kShapeNames.begin(), kShapeNames.end(), name) != kShapeNames.end())
    return make_shape(name);
  PM_TRY(LoadedModel loaded, load_model(name, {}));
  for (const std::string& warning : loaded.warnings) log_warning("{}", warning);
  return std::move(loaded.model);
}

SphereSettings settings_of(const SpheresOptions& options) {
  SphereSettings settings;
  settings.method = options.method == "octree"    ? SphereMethod::kOctree
                    : options.method == "active"  ? SphereMethod::kActive
                    : options.method == "hubbard" ? SphereMethod::kHubbard
                                                  : SphereMethod::kMedial;
  if (options.balls > 0) settings.balls = options.balls;
  settings.error = static_cast<float>(options.error);
  settings.resolution = options.resolution;
  settings.root_margin = static_cast<float>(options.root_margin);
  settings.fit = options.no_fit           ? FitKind::kNone
                 : options.fit == "round" ? FitKind::kRound
                                          : FitKind::kEllipsoid;
  settings.inside = options.inside == "parity" ? InsideMethod::kParity : InsideMethod::kWinding;
  settings.solidify = options.solidify;
  return settings;
}

Status check_outputs(const SpheresOptions& options, bool overwrite) {
  const auto wants = [](const std::string& file,
                        std::initializer_list<const char*> known) -> Status {
    const std::string extension = std::filesystem::path(file).extension().string();
    std::string list;
    for (const char* k : known) {
      if (extension == k) return Ok{};
      list += (list.empty() ? "" : " or ") + std::string(k);
    }
    return make_error(ErrorCode::kUsage, "{}: unknown format \"{}\" - use {}", file, extension,
                      list);
  };
  if (!options.write_balls.empty()) PM_TRY_STATUS(wants(options.write_balls, {".json", ".csv"}));
  if (!options.write_surface.empty()) PM_TRY_STATUS(wants(options.write_surface, {".obj", ".ply"}));
  if (!options.write_spheres.empty())
    PM_TRY_STATUS(wants(options.write_spheres, {".obj", ".ply", ".json"}));
  if (!options.output.empty()) PM_TRY_STATUS(wants(options.output, {".png", ".exr"}));
  for (const std::string& file :
       {options.write_balls, options.write_surface, options.write_spheres, options.output}) {
    if (file.empty()) continue;
    PM_TRY_STATUS(check_output(file, overwrite));
  }
  return Ok{};
}

/// Approximation of the model and its quality.
struct FittedModel {
  Approximation approximation;
  std::vector<Ball> balls;  ///< fitted, or straight from the spheres
  ApproximationQuality figures;
  double seconds = 0;
  std::vector<std::string> problems;
};

JsonValue to_json(const Model& model, const SpheresOptions& options, const FittedModel& fitted) {
  const ApproximationQuality& f = fitted.figures;
  std::vector<int> levels;
  for (const SphereNode& node : fitted.approximation.tree.nodes) {
    const auto level = static_cast<std::size_t>(node.level);
    if (levels.size() <= level) levels.resize(level + 1);
    ++levels[level];
  }
  return {{"model", model.name},
          {"triangles", model.triangles.size()},
          {"method", options.method},
          {"fit", options.no_fit ? "none" : options.fit},
          {"spheres", fitted.approximation.tree.leaves().size()},
          {"levels", levels},
          {"balls", fitted.balls.size()},
          {"iou", f.iou},
          {"volume_ratio", f.volume_ratio},
          {"rms_to_model", f.rms_to_model},
          {"rms_to_surface", f.rms_to_surface},
          {"hausdorff_to_model", f.hausdorff_to_model},
          {"hausdorff_to_surface", f.hausdorff_to_surface},
          {"grid", options.grid},
          {"surface_triangles", f.triangles},
          {"seconds", fitted.seconds},
          {"problems", fitted.problems}};
}

/// The whole tree, parents before children; the leaves are the approximation.
std::string tree_json(const SphereTree& tree) {
  JsonValue spheres = JsonValue::array();
  for (const SphereNode& node : tree.nodes) {
    const Vec3 c = node.sphere.center;
    spheres.push_back({{"center", JsonValue::array({c.x, c.y, c.z})},
                       {"radius", node.sphere.radius},
                       {"level", node.level},
                       {"parent", node.parent},
                       {"leaf", node.leaf}});
  }
  return dump_json({{"spheres", std::move(spheres)}}, -1);
}

void print_table(const Model& model, const SpheresOptions& options, const FittedModel& fitted) {
  const ApproximationQuality& f = fitted.figures;
  print_data("{}: {} triangles, {}, {}\n", model.name, model.triangles.size(), options.method,
             options.no_fit ? "not fitted" : options.fit + " balls fitted");
  print_data("  {:<34}{:>10}\n", "spheres", fitted.approximation.tree.leaves().size());
  print_data("  {:<34}{:>10}\n", "balls", fitted.balls.size());
  print_data("  {:<34}{:>10.4f}\n", "overlap (IoU)", f.iou);
  print_data("  {:<34}{:>10.4f}\n", "volume ratio", f.volume_ratio);
  print_data("  {:<34}{:>10}{:>12}\n", "% of the box diagonal", "RMS", "Hausdorff");
  print_data("  {:<34}{:>10.3f}{:>12.3f}\n", "  surface to model", 100 * f.rms_to_model,
             100 * f.hausdorff_to_model);
  print_data("  {:<34}{:>10.3f}{:>12.3f}\n", "  model to surface", 100 * f.rms_to_surface,
             100 * f.hausdorff_to_surface);
  print_data("  {:<34}{:>10.2f} s\n", "time", fitted.seconds);
}

Result<int> run_spheres(const CommandLine& line, const SpheresOptions& options) {
  PM_TRY_STATUS(check_outputs(options, line.common.overwrite));
  PM_TRY(const Model model, load(options.model));
  FittedModel fitted;
  std::optional<Activity> activity(std::in_place, "looking for faults in " + model.name);
  const Diagnosis diagnosis = diagnose_fully(model);
  activity.reset();
  fitted.problems = describe_problems(diagnosis);
  for (const std::string& problem : fitted.problems) log_warning("{}: {}", model.name, problem);
  const SphereSettings settings = settings_of(options);
  if (const std::string crossings = describe_crossings(diagnosis); !crossings.empty()) {
    fitted.problems.push_back(crossings);
    // The winding number is not affected.
    const bool matters = settings.inside == InsideMethod::kParity;
    matters ? log_warning("{}: {}", model.name, crossings)
            : log_debug("{}: {}", model.name, crossings);
  }
  const Stopwatch stopwatch;
  activity.emplace("making spheres and balls of " + model.name);
  PM_TRY(const std::optional<Model> stand_in, make_solid_proxy(model, settings));
  PM_TRY(fitted.approximation,
         approximate_cached(model, settings, cache_folder(line.common), &stand_in));
  fitted.seconds = stopwatch.seconds();
  activity.emplace("measuring how well they fit");
  // Balls of a shell or of a solidified model are judged by what they stand for.
  const std::optional<ClusteredModel> few = cluster_long_triangles(model);
  const Model& solid = stand_in ? *stand_in : few ? few->model : model;
  if (stand_in && !settings.solidify)
    log_info(
        "{}: it bounds no solid, so it is taken for a shell and given thickness; --solidify "
        "fills it",
        model.name);
  const InsideTest inside(stand_in ? *stand_in : model);
  const Vec3 size = model.box().size();
  const float cell = std::max({size.x, size.y, size.z}) / static_cast<float>(options.grid);
  const auto engine = make_cpu_engine();
  fitted.balls = fitted.approximation.balls;
  if (fitted.balls.empty()) {
    PM_TRY(fitted.balls,
           make_unfitted_balls(fitted.approximation.tree.leaves(), settings.method,
                               solid_volume(solid, inside), FieldSettings{}, cell, {}, *engine));
  }
  PM_TRY(fitted.figures,
         measure_quality(solid, inside, fitted.balls, FieldKind::kGaussian, options.grid));
  activity.reset();
  if (const std::string bad = describe_bad_fit(fitted.figures); !bad.empty())
    log_warning("{}: {}", model.name, bad);
  if (options.json.enabled)
    PM_TRY_STATUS(write_json(options.json, to_json(model, options, fitted)));
  else
    print_table(model, options, fitted);

  if (!options.write_balls.empty())
    PM_TRY_STATUS(
        write_file(options.write_balls, options.write_balls.ends_with(".csv")
                                            ? encode_balls_csv(fitted.balls, FieldKind::kGaussian)
                                            : encode_balls(fitted.balls, FieldKind::kGaussian)));
  const std::vector<Sphere> spheres = fitted.approximation.tree.leaves();
  if (!options.write_spheres.empty())
    PM_TRY_STATUS(options.write_spheres.ends_with(".json")
                      ? write_file(options.write_spheres, tree_json(fitted.approximation.tree))
                      : write_mesh(options.write_spheres, mesh_of_spheres(spheres)));
  if (options.write_surface.empty() && options.output.empty()) return 0;
  PM_TRY(const Mesh surface, extract_surface(*engine, fitted.balls, cell, {}));
  if (!options.write_surface.empty()) PM_TRY_STATUS(write_mesh(options.write_surface, surface));
  if (!options.output.empty())
    PM_TRY_STATUS(write_spheres_picture(options.output, model, spheres, surface, options.width));
  return 0;
}

}  // namespace

void add_spheres(CommandLine& line) {
  auto options = std::make_shared<SpheresOptions>();
  Command command =
      add_command(line, "spheres", "Approximate a model by spheres and fitted balls; say how well.",
                  "  polymorph spheres teapot.obj --balls 128 -o teapot.png\n"
                  "  polymorph spheres teapot.obj --error 0.005 --write-balls balls.json\n"
                  "  polymorph spheres teapot.obj --method octree --resolution 5 --no-fit --json",
                  "  0 done   2 usage   3 bad model, or nothing of it is inside\n"
                  "  4 cannot write   5 memory");
  command.add_option("model", options->model, "a model file, or sphere, cube, torus, puddle, drops")
      .required()
      .type_name("MODEL")
      .group("Main");
  command.add_option("--method", options->method, "medial, hubbard, octree or active")
      .choices({"medial", "hubbard", "octree", "active"})
      .type_name("NAME")
      .group("Main");
  Option balls = command.add_option("--balls", options->balls, "number of balls (256)")
                     .range(1, 4096)
                     .type_name("N")
                     .group("Main");
  Option error =
      command
          .add_option("--error", options->error,
                      "fewest balls within this Hausdorff distance, a share of the diagonal")
          .range(1e-4, 0.5)
          .type_name("E")
          .group("Main");
  error.excludes(balls);
  command
      .add_option("--resolution", options->resolution,
                  "resolution of octree and active: 2^(R-1) cells per axis")
      .range(1, 9)
      .type_name("R")
      .group("Main");
  command
      .add_option("--root-margin", options->root_margin,
                  "share by which the root cube of octree and active exceeds the model (0)")
      .range(0.0, 1.0)
      .type_name("M")
      .group("Main");
  const Option fit = command.add_option("--fit", options->fit, "ellipsoid or round balls")
                         .choices({"ellipsoid", "round"})
                         .type_name("KIND")
                         .group("Main");
  command.add_flag("--no-fit", options->no_fit, "balls straight from the spheres, as in the report")
      .excludes(fit)
      .group("Main");
  command.add_option("--inside", options->inside, "inside test: winding or parity")
      .choices({"winding", "parity"})
      .type_name("TEST")
      .group("Main");
  command.add_flag("--solidify", options->solidify, "fill cavities and close holes first")
      .group("Main");
  command.add_option("--grid", options->grid, "cells along the longest side, for the surface (192)")
      .range(8, 4096)
      .type_name("N")
      .group("Main");
  command.add_option("-o,--output", options->output, "picture: model | spheres | surface")
      .type_name("FILE")
      .group("Main");
  command.add_option("--width", options->width, "width of each of the three pictures (480)")
      .range(16, 8192)
      .type_name("PIXELS")
      .group("Main");
  command.add_option("--write-balls", options->write_balls, "balls as .json or .csv")
      .type_name("FILE")
      .group("Main");
  command.add_option("--write-surface", options->write_surface, "their surface as .obj or .ply")
      .type_name("FILE")
      .group("Main");
  command
      .add_option("--write-spheres", options->write_spheres,
                  "the spheres as .obj, .ply, or .json with their tree")
      .type_name("FILE")
      .group("Main");
  add_overwrite(command, line.common).group("Main");
  add_json(command, options->json);
  set_action(line, command, [&line, options] { return run_spheres(line, *options); });
}

}  // namespace polymorph
