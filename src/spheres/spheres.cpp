#include "spheres/spheres.h"

#include <algorithm>
#include <memory>

#include "base/log.h"
#include "field/distance_grid.h"
#include "field/extract_surface.h"
#include "field/level.h"
#include "kernels/engine.h"
#include "kernels/field_kinds.h"
#include "mesh/mesh_check.h"
#include "model/clustered_model.h"
#include "model/repair/diagnose.h"
#include "model/repair/shell.h"
#include "model/repair/solidify.h"
#include "spheres/boundary.h"
#include "spheres/cells.h"
#include "spheres/fit.h"
#include "spheres/hubbard.h"
#include "spheres/medial.h"
#include "spheres/quality.h"

namespace polymorph {
namespace {

constexpr int kFinestResolution = 9;  // 2^8 cells per axis

/// A model with its inside test, and with its boundary samples once sample_solid() has drawn them.
struct Solid {
  const Model& model;
  InsideTest inside;
  std::vector<BoundarySample> samples;
};

Error make_no_volume_error(const Model& model) {
  std::string reasons;
  for (const std::string& problem : describe_problems(diagnose(model))) reasons += "\n  " + problem;
  return make_error(ErrorCode::kInput,
                    "model \"{}\": it encloses no volume, so no spheres can stand for it - give "
                    "sheets thickness, close holes and turn faces outward, or set "
                    "\"solidify\": true{}",
                    model.name, reasons);
}

/// Chooses enough samples to determine every parameter of a ball and to cover thin parts; a coarse
/// fit gets barely enough.
std::size_t choose_sample_count(std::size_t balls, bool coarse) {
  return coarse ? 1000 + 20 * balls : std::min<std::size_t>(3000 + 40 * balls, 60000);
}

Status sample_solid(Solid& solid, std::size_t balls, bool coarse) {
  solid.samples = sample_boundary(solid.model, solid.inside, choose_sample_count(balls, coarse));
  if (solid.samples.empty()) return make_no_volume_error(solid.model);
  return Ok{};
}

/// Shifts all weights by the same amount so that the surface encloses the model's volume.
Result<std::vector<Ball>> match_volume(const Solid& solid, std::vector<Ball> balls) {
  const auto engine = make_cpu_engine();
  const Box box = solid.model.box();
  // Fine enough that the volume lost by facets is below the tolerance of 0.2 %.
  const float cell = box.diagonal() / 200;
  const ExtractSettings extract;
  const Diagnosis diagnosis = diagnose(solid.model);
  double volume = diagnosis.volume;
  if (!diagnosis.closed || diagnosis.shells != 1 || !(volume > 0)) {
    // For open and overlapping parts count lattice points in the model and in the field; using the
    // same lattice cancels its error.
    PM_TRY(const double ratio, lattice_volume_ratio(solid.model, solid.inside, balls));
    PM_TRY(const Mesh mesh, extract_surface(*engine, balls, cell, extract));
    volume = volume_of(mesh) / std::max(ratio, 1e-6);
  }
  if (!(volume > 0)) return balls;  // no level matches it
  PM_TRY(const float iso, iso_for_volume(*engine, balls, {volume, cell, extract}));
  return rescale_balls(std::move(balls), FieldKind::kGaussian, iso);
}

Result<std::vector<Ball>> fit_spheres(const Solid& solid, const std::vector<Sphere>& spheres,
                                      const SphereSettings& settings) {
  FitSettings fit;
  fit.ellipsoids = settings.fit == FitKind::kEllipsoid;
  if (settings.coarse) fit.iterations = 10, fit.rounds = 2, fit.passes = 1;
  PM_TRY(FitResult result, fit_balls(solid.model, solid.inside, solid.samples, spheres, fit));
  PM_TRY(std::vector<Ball> balls, match_volume(solid, std::move(result.balls)));
  return move_into_box(std::move(balls), solid.model.box());
}

Result<Approximation> approximate_by_medial_balls(const Solid& solid,
                                                  const SphereSettings& settings,
                                                  std::size_t count) {
  Approximation result{build_medial_tree(solid.samples, count), {}};
  if (settings.fit != FitKind::kNone) {
    PM_TRY(result.balls, fit_spheres(solid, result.tree.leaves(), settings));
  }
  return result;
}

/// Makes the solid that spheres and balls approximate. `shape`: `model` or its clustered form,
/// whose winding number is not the same, so that only the parity rule is applied to it.
Solid make_solid(const Model& shape, const Model& model, InsideMethod inside) {
  return {shape,
          inside == InsideMethod::kParity ? InsideTest(shape, InsideRule::kParity)
                                          : InsideTest(model, InsideRule::kWinding),
          /*samples=*/{}};
}

/// Finds the smallest number of medial balls whose error (hausdorff_distance()) is at most
/// settings.error, by doubling and bisection. The error is not strictly monotonic in the number, so
/// the result is the minimum to within an eighth.
Result<Approximation> approximate_to_error(Solid& solid, const SphereSettings& settings) {
  constexpr std::size_t kMaxBalls = 2048;
  struct Candidate {
    std::size_t count = 0;
    double error = 0;
    Approximation result;
  };
  const auto attempt = [&](std::size_t count) -> Result<Candidate> {
    PM_TRY_STATUS(sample_solid(solid, count, settings.coarse));
    PM_TRY(Approximation result, approximate_by_medial_balls(solid, settings, count));
    PM_TRY(const double error, hausdorff_distance(solid.model, solid.samples, result));
    return Candidate{count, error, std::move(result)};
  };
  std::size_t low = 8;  // the largest number taken to be too small
  PM_TRY(Candidate best, attempt(16));
  while (best.error > settings.error && best.count < kMaxBalls) {
    low = best.count;
    PM_TRY(best, attempt(2 * best.count));
  }
  if (best.error > settings.error) {
    log_warning(
        "model \"{}\": {} balls have an error of {:.4f} of the diagonal, above the limit of {:.4f}",
        solid.model.name, best.count, best.error, settings.error);
    return std::move(best.result);
  }
  while (best.count - low > std::max<std::size_t>(2, best.count / 8)) {
    PM_TRY(Candidate next, attempt((low + best.count) / 2));
    if (next.error <= settings.error)
      best = std::move(next);
    else
      low = next.count;
  }
  return std::move(best.result);
}

/// Makes a closed model around a shell's faces: the surface of its distances, extracted at the
/// default resolution, or at half of it if `coarse`. Its thickness is the smallest that these cells
/// show without gaps.
Result<Model> thicken_shell(const Model& model, const InsideTest& inside, bool coarse) {
  const int resolution = SurfaceSettings{}.resolution;
  const auto cells = static_cast<float>(coarse ? resolution / 2 : resolution);
  const Vec3 size = model.box().size();
  const float cell = std::max({size.x, size.y, size.z}) / cells;
  if (!(cell > 0)) return make_error(ErrorCode::kInput, "model \"{}\" has no extent", model.name);
  const std::vector<FaceClass> sheets(model.triangles.size(), FaceClass::kSheet);
  const auto distances = std::make_shared<const DistanceGrid>(
      compute_signed_distances({model, inside, ClosestPointQuery(model), sheets, model.box()},
                               0.5f * cell, kThinnestPart * cell));
  const auto engine = make_cpu_engine();
  PM_TRY(Mesh mesh, extract_distances(*engine, distances, cell, {}));
  if (mesh.triangles.empty()) return make_no_volume_error(model);
  log_debug("model \"{}\" is taken for a shell", model.name);
  Model shell;
  shell.name = model.name;
  shell.points = std::move(mesh.positions);
  shell.triangles = std::move(mesh.triangles);
  return shell;
}

}  // namespace

std::vector<Sphere> SphereTree::leaves() const {
  std::vector<Sphere> spheres;
  for (const SphereNode& node : nodes)
    if (node.leaf) spheres.push_back(node.sphere);
  return spheres;
}

Result<std::optional<Model>> make_solid_proxy(const Model& model, const SphereSettings& settings) {
  if (settings.solidify) {
    PM_TRY(Model solid, solidify(model));
    return std::optional<Model>(std::move(solid));
  }
  if (diagnose(model).closed) return std::optional<Model>{};
  const InsideTest inside(model);
  if (measure_undecided_fraction(model, inside) < kMinShellFraction) return std::optional<Model>{};
  const std::optional<ClusteredModel> clustered = cluster_long_triangles(model);
  // If most faces were left out, the exact positions of the others do not matter.
  const bool coarse = settings.coarse || (clustered && clustered->thinned);
  PM_TRY(Model shell, thicken_shell(clustered ? clustered->model : model, inside, coarse));
  return std::optional<Model>(std::move(shell));
}

Result<Approximation> approximate(const Model& model, const SphereSettings& settings,
                                  const std::optional<Model>* proxy) {
  if (settings.resolution < 0 || settings.resolution > kFinestResolution)
    return make_error(ErrorCode::kInput,
                      "spheres.resolution {} is out of range - use 1 to {}, or 0 for automatic",
                      settings.resolution, kFinestResolution);
  if (model.triangles.empty())
    return make_error(ErrorCode::kInput, "model \"{}\" has no faces", model.name);
  std::optional<Model> own_proxy;
  if (!proxy) {
    PM_TRY(own_proxy, make_solid_proxy(model, settings));
    proxy = &own_proxy;
  }
  if (*proxy) {
    // The proxy is solid, so the inner call makes no other one.
    SphereSettings solid_settings = settings;
    solid_settings.solidify = false;
    return approximate(**proxy, solid_settings);
  }
  // Only the shape matters for spheres and balls.
  const std::optional<ClusteredModel> clustered = cluster_long_triangles(model);
  const Model& shape = clustered ? clustered->model : model;
  Solid solid = make_solid(shape, model, settings.inside);
  const bool fit = settings.fit != FitKind::kNone;
  const auto count = static_cast<std::size_t>(std::max(settings.balls, 1));
  if (settings.method == SphereMethod::kMedial && settings.error > 0)
    return approximate_to_error(solid, settings);
  if (settings.method == SphereMethod::kMedial) {
    PM_TRY_STATUS(sample_solid(solid, count, settings.coarse));
    return approximate_by_medial_balls(solid, settings, count);
  }
  Approximation result;
  if (settings.method == SphereMethod::kHubbard) {
    HubbardSettings hubbard;
    hubbard.spheres = settings.balls;
    PM_TRY(result.tree, build_hubbard_tree(shape, solid.inside, hubbard));
  } else {
    PM_TRY(result.tree,
           build_cell_spheres(shape, solid.inside, settings, /*max_count=*/fit ? count : 8000));
  }
  if (fit) {
    const std::vector<Sphere> spheres = result.tree.leaves();
    PM_TRY_STATUS(sample_solid(solid, spheres.size(), settings.coarse));
    PM_TRY(result.balls, fit_spheres(solid, spheres, settings));
  }
  return result;
}

Result<std::vector<Ball>> refit(const Model& model, const SphereSettings& settings,
                                const std::vector<Ball>& balls) {
  if (model.triangles.empty())
    return make_error(ErrorCode::kInput, "model \"{}\" has no faces", model.name);
  PM_TRY(const std::optional<Model> proxy, make_solid_proxy(model, settings));
  const Model& solid_model = proxy ? *proxy : model;
  const std::optional<ClusteredModel> clustered = cluster_long_triangles(solid_model);
  Solid solid =
      make_solid(clustered ? clustered->model : solid_model, solid_model, settings.inside);
  // Balls that nearly fit need no more samples than a coarse fit has.
  PM_TRY_STATUS(sample_solid(solid, balls.size(), /*coarse=*/true));
  FitSettings fit;
  fit.ellipsoids = settings.fit == FitKind::kEllipsoid;
  fit.iterations = 6;  // few steps, because the balls nearly fit
  PM_TRY(FitResult result, refit_balls(solid.model, solid.inside, solid.samples, balls, fit));
  PM_TRY(std::vector<Ball> fitted, match_volume(solid, std::move(result.balls)));
  return move_into_box(std::move(fitted), solid.model.box());
}

Result<std::vector<Ball>> make_unfitted_balls(const std::vector<Sphere>& spheres,
                                              SphereMethod method, FieldSettings field,
                                              const VolumeMeasure& measure, Engine& engine) {
  const auto& [volume, cell, extract] = measure;
  const bool cells = method == SphereMethod::kOctree || method == SphereMethod::kActive;
  // Spheres of cells do not overlap and must blend into one body; spheres of a cover overlap and
  // already have the shape.
  if (field.blobbiness == 0) field.blobbiness = cells ? 0.12f : 6.0f;
  std::vector<Ball> balls = convert_to_balls(spheres, field);
  if (field.kind == FieldKind::kGaussian && field.even && cells) {
    PM_TRY(balls, equalize_field(engine, std::move(balls), extract));
  }
  if (!field.match_volume || !(volume > 0)) return balls;
  // At the level `start`, the surface of a lone inverse-square ball has its sphere's radius,
  // whatever the constants are.
  const bool compact = visit(field.kind, [](auto kind) { return decltype(kind)::kCompactSupport; });
  const float start = !compact ? field.blob_constant * field.magnitude / field.threshold : 1.0f;
  PM_TRY(const float iso, iso_for_volume(engine, balls, measure, start));
  return rescale_balls(std::move(balls), field.kind, iso);
}

std::vector<Ball> convert_to_balls(const std::vector<Sphere>& spheres, const FieldSettings& field) {
  std::vector<Ball> balls;
  balls.reserve(spheres.size());
  const BallConstants constants{field.blobbiness, field.blob_constant, field.magnitude,
                                field.threshold};
  for (const Sphere& sphere : spheres) {
    PM_CHECK(sphere.radius > 0);
    balls.push_back(visit(field.kind, [&](auto kind) {
      return kind.from_sphere(sphere.center, sphere.radius, constants);
    }));
  }
  return balls;
}

}  // namespace polymorph
