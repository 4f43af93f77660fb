#include "inspect/inspect_spheres.h"

#include <algorithm>
#include <optional>

#include "base/activity.h"
#include "base/file.h"
#include "base/log.h"
#include "base/stopwatch.h"
#include "export/spheres_picture.h"
#include "field/balls_io.h"
#include "field/extract_surface.h"
#include "interchange/json_vectors.h"
#include "interchange/mesh_file.h"
#include "model/clustered_model.h"
#include "model/load/load_model.h"
#include "model/repair/diagnose.h"
#include "model/shapes.h"
#include "spheres/quality.h"

namespace polymorph {
namespace {

Result<Model> load_model_or_shape(const std::string& name) {
  if (is_shape_name(name)) return make_shape(name);
  PM_TRY(LoadedModel loaded, load_model(name, /*settings=*/{}));
  for (const std::string& warning : loaded.warnings) log_warning("{}", warning);
  return std::move(loaded.model);
}

/// Measures of an approximation: its quality, the seconds that it took, and the model's faults.
struct Measurements {
  std::optional<ApproximationQuality> quality;  ///< empty unless SpheresRequest::measure is set
  double seconds = 0;
  std::vector<std::string> problems;
};

std::size_t ball_count(const SpheresResult& result) {
  return result.balls.empty() ? result.approximation.tree.leaves().size() : result.balls.size();
}

const char* method_name(SphereMethod method) {
  switch (method) {
    case SphereMethod::kMedial:
      return "medial";
    case SphereMethod::kHubbard:
      return "hubbard";
    case SphereMethod::kOctree:
      return "octree";
    case SphereMethod::kActive:
      break;
  }
  return "active";
}

const char* fit_name(FitKind fit) {
  return fit == FitKind::kNone ? "none" : fit == FitKind::kRound ? "round" : "ellipsoid";
}

JsonValue to_json(const SpheresRequest& request, const SpheresResult& result,
                  const Measurements& measurements) {
  std::vector<int> levels;  // number of spheres of each level of the tree
  for (const SphereNode& node : result.approximation.tree.nodes) {
    const auto level = static_cast<std::size_t>(node.level);
    if (levels.size() <= level) levels.resize(level + 1);
    ++levels[level];
  }
  JsonValue json{{"model", result.model.name},
                 {"triangles", result.model.triangles.size()},
                 {"method", method_name(request.settings.method)},
                 {"fit", fit_name(request.settings.fit)},
                 {"spheres", result.approximation.tree.leaves().size()},
                 {"levels", levels},
                 {"balls", ball_count(result)}};
  if (measurements.quality) {
    const ApproximationQuality& quality = *measurements.quality;
    json.update({{"iou", quality.iou},
                 {"volume_ratio", quality.volume_ratio},
                 {"rms_to_model", quality.rms_to_model},
                 {"rms_to_surface", quality.rms_to_surface},
                 {"hausdorff_to_model", quality.hausdorff_to_model},
                 {"hausdorff_to_surface", quality.hausdorff_to_surface},
                 {"grid", request.grid},
                 {"surface_triangles", quality.triangles}});
  }
  json["seconds"] = measurements.seconds;
  json["problems"] = measurements.problems;
  return json;
}

/// Formats the sphere tree, parents before children. Its leaves are the approximation.
std::string tree_json(const SphereTree& tree) {
  JsonValue spheres = JsonValue::array();
  for (const SphereNode& node : tree.nodes) {
    spheres.push_back({{"center", to_array(node.sphere.center)},
                       {"radius", node.sphere.radius},
                       {"level", node.level},
                       {"parent", node.parent},
                       {"leaf", node.leaf}});
  }
  return dump_json({{"spheres", std::move(spheres)}}, /*indent=*/-1);
}

std::string to_table(const SpheresRequest& request, const SpheresResult& result,
                     const Measurements& measurements) {
  std::string text;
  text += fmt::format("{}: {} triangles, {}, {}\n", result.model.name,
                      result.model.triangles.size(), method_name(request.settings.method),
                      request.settings.fit == FitKind::kNone
                          ? "not fitted"
                          : fmt::format("{} balls fitted", fit_name(request.settings.fit)));
  text += fmt::format("  {:<34}{:>10}\n", "spheres", result.approximation.tree.leaves().size());
  text += fmt::format("  {:<34}{:>10}\n", "balls", ball_count(result));
  if (measurements.quality) {
    const ApproximationQuality& quality = *measurements.quality;
    text += fmt::format("  {:<34}{:>10.4f}\n", "overlap (IoU)", quality.iou);
    text += fmt::format("  {:<34}{:>10.4f}\n", "volume ratio", quality.volume_ratio);
    text += fmt::format("  {:<34}{:>10}{:>12}\n", "% of the box diagonal", "RMS", "Hausdorff");
    text += fmt::format("  {:<34}{:>10.3f}{:>12.3f}\n", "  surface to model",
                        100 * quality.rms_to_model, 100 * quality.hausdorff_to_model);
    text += fmt::format("  {:<34}{:>10.3f}{:>12.3f}\n", "  model to surface",
                        100 * quality.rms_to_surface, 100 * quality.hausdorff_to_surface);
  }
  text += fmt::format("  {:<34}{:>10.2f} s\n", "time for spheres and balls", measurements.seconds);
  return text;
}

}  // namespace

Result<SpheresResult> inspect_spheres(const SpheresRequest& request) {
  SpheresResult result;
  PM_TRY(result.model, load_model_or_shape(request.model));
  const Model& model = result.model;
  // Warn of the model's faults.
  Measurements measurements;
  std::optional<Activity> activity(std::in_place, "looking for faults in " + model.name);
  const Diagnosis diagnosis = diagnose_fully(model);
  activity.reset();
  measurements.problems = describe_problems(diagnosis);
  for (const std::string& problem : measurements.problems)
    log_warning("{}: {}", model.name, problem);
  const SphereSettings& settings = request.settings;
  if (const std::string crossings = describe_crossings(diagnosis); !crossings.empty()) {
    measurements.problems.push_back(crossings);
    // Self-intersections matter only to the parity test, not to the winding number.
    const bool matters = settings.inside == InsideMethod::kParity;
    matters ? log_warning("{}: {}", model.name, crossings)
            : log_debug("{}: {}", model.name, crossings);
  }
  // Approximate the model.
  const Stopwatch stopwatch;
  activity.emplace("making spheres and balls of " + model.name);
  PM_TRY(const std::optional<Model> proxy, make_solid_proxy(model, settings));
  PM_TRY(result.approximation, approximate_cached(model, settings, request.cache_folder, &proxy));
  measurements.seconds = stopwatch.seconds();
  activity.emplace(request.measure ? "measuring how well they fit" : "making balls of spheres");
  // Compare the balls with the solid that they approximate: the proxy of a shell or of a solidified
  // model, if there is one, or the clusters of a model of many long triangles.
  const std::optional<ClusteredModel> clustered = cluster_long_triangles(model);
  const Model& solid = proxy ? *proxy : clustered ? clustered->model : model;
  if (proxy && !settings.solidify)
    log_info(
        "{}: it bounds no solid, so it is taken for a shell and given thickness; --solidify "
        "fills it",
        model.name);
  const InsideTest inside(proxy ? *proxy : model);  // clusters long triangles itself
  const Vec3 size = model.box().size();
  const float cell = result.cell =
      std::max({size.x, size.y, size.z}) / static_cast<float>(request.grid);
  const auto engine = make_cpu_engine();
  // Make the balls, and measure them.
  result.balls = result.approximation.balls;
  // Without a fit each sphere becomes a ball, which takes seconds for 100 000 of them.
  const bool needs_balls = request.measure || !request.write_balls.empty() ||
                           !request.write_surface.empty() || !request.output.empty();
  if (result.balls.empty() && needs_balls) {
    PM_TRY(result.balls,
           make_unfitted_balls(result.approximation.tree.leaves(), settings.method, FieldSettings{},
                               {solid_volume(solid, inside), cell}, *engine));
  }
  if (request.measure) {
    PM_TRY(measurements.quality,
           measure_quality(solid, inside, result.balls, FieldKind::kGaussian, {request.grid}));
    if (!is_good_fit(*measurements.quality))
      log_warning("{}: {}", model.name, describe_fit(*measurements.quality));
  }
  activity.reset();
  result.report = {to_json(request, result, measurements), to_table(request, result, measurements)};
  return result;
}

Status write_spheres(const SpheresRequest& request, const SpheresResult& result) {
  if (!request.write_balls.empty())
    PM_TRY_STATUS(
        write_file(request.write_balls, request.write_balls.ends_with(".csv")
                                            ? encode_balls_csv(result.balls, FieldKind::kGaussian)
                                            : encode_balls(result.balls, FieldKind::kGaussian)));
  const std::vector<Sphere> spheres = result.approximation.tree.leaves();
  if (!request.write_spheres.empty())
    PM_TRY_STATUS(request.write_spheres.ends_with(".json")
                      ? write_file(request.write_spheres, tree_json(result.approximation.tree))
                      : write_mesh(request.write_spheres, make_sphere_mesh(spheres)));
  if (request.write_surface.empty() && request.output.empty()) return Ok{};
  PM_TRY(const Mesh surface,
         extract_surface(*make_cpu_engine(), result.balls, result.cell, /*settings=*/{}));
  if (!request.write_surface.empty()) PM_TRY_STATUS(write_mesh(request.write_surface, surface));
  if (!request.output.empty())
    PM_TRY_STATUS(
        write_spheres_picture(request.output, result.model, spheres, surface, request.width));
  return Ok{};
}

}  // namespace polymorph
