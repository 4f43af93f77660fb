#include "spheres/spheres.h"

#include <algorithm>
#include <cmath>
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

constexpr int kFinestResolution = 9;  // 2^24 cells

/// What every step of an approximation looks at.
struct Solid {
  const Model& model;
  InsideTest inside;
  std::vector<BoundarySample> samples;
};

Error no_boundary(const Model& model) {
  std::string reasons;
  for (const std::string& problem : describe_problems(diagnose(model))) reasons += "\n  " + problem;
  return make_error(ErrorCode::kInput,
                    "model \"{}\": it encloses no volume, so no spheres can stand for it - give "
                    "sheets thickness, close holes and turn faces outward, or set "
                    "\"solidify\": true{}",
                    model.name, reasons);
}

/// Enough samples that every number of a ball is well determined, and thin parts get some; of a
/// coarse fit hardly so.
std::size_t samples_for(std::size_t balls, bool coarse) {
  return coarse ? 1000 + 20 * balls : std::min<std::size_t>(3000 + 40 * balls, 60000);
}

Status sample(Solid& solid, std::size_t balls, bool coarse) {
  solid.samples = sample_boundary(solid.model, solid.inside, samples_for(balls, coarse));
  if (solid.samples.empty()) return no_boundary(solid.model);
  return Ok{};
}

/// Shifts all weights by one number so that the surface encloses what the model does.
Result<std::vector<Ball>> with_volume(const Solid& solid, std::vector<Ball> balls) {
  const auto engine = make_cpu_engine();
  const Box box = solid.model.box();
  // Fine enough that the mesh's own flattening is below the tolerance.
  const float cell = box.diagonal() / 200;
  const ExtractSettings extract;
  const Diagnosis diagnosis = diagnose(solid.model);
  double volume = diagnosis.volume;
  if (!diagnosis.closed || diagnosis.shells != 1 || !(volume > 0)) {
    // Open and overlapping parts: count points of one lattice in the model and in the field, so
    // that what a lattice misses is missed in both.
    PM_TRY(const double ratio, lattice_volume_ratio(solid.model, solid.inside, balls));
    PM_TRY(const Mesh mesh, extract_surface(*engine, balls, cell, extract));
    volume = volume_of(mesh) / std::max(ratio, 1e-6);
  }
  if (!(volume > 0)) return balls;
  PM_TRY(const float iso, iso_for_volume(*engine, balls, cell, extract, volume));
  return rescaled(std::move(balls), FieldKind::kGaussian, iso);
}

Result<std::vector<Ball>> fitted(const Solid& solid, const std::vector<Sphere>& spheres,
                                 const SphereSettings& settings) {
  FitSettings fit;
  fit.ellipsoids = settings.fit == FitKind::kEllipsoid;
  if (settings.coarse) fit.iterations = 10, fit.rounds = 2, fit.passes = 1;
  PM_TRY(FitResult result, fit_balls(solid.model, solid.inside, solid.samples, spheres, fit));
  PM_TRY(std::vector<Ball> balls, with_volume(solid, std::move(result.balls)));
  return within_box(std::move(balls), solid.model.box());
}

Result<Approximation> medial_approximation(const Solid& solid, const SphereSettings& settings,
                                           std::size_t count) {
  Approximation result{medial_tree(solid.samples, count), {}};
  if (settings.fit != FitKind::kNone) {
    PM_TRY(result.balls, fitted(solid, result.tree.leaves(), settings));
  }
  return result;
}

/// The fewest medial balls that keep settings.error, by doubling and bisection of their number; the
/// distance does not fall strictly with it, so this is the fewest to within an eighth.
Result<Approximation> medial_to_error(Solid& solid, const SphereSettings& settings) {
  constexpr std::size_t kMax = 2048;
  struct Try {
    std::size_t count = 0;
    double error = 0;
    Approximation result;
  };
  const auto attempt = [&](std::size_t count) -> Result<Try> {
    PM_TRY_STATUS(sample(solid, count, settings.coarse));
    PM_TRY(Approximation result, medial_approximation(solid, settings, count));
    PM_TRY(const double error, hausdorff_distance(solid.model, solid.samples, result));
    return Try{count, error, std::move(result)};
  };
  std::size_t low = 8;
  PM_TRY(Try best, attempt(16));
  while (best.error > settings.error && best.count < kMax) {
    low = best.count;
    PM_TRY(best, attempt(2 * best.count));
  }
  if (best.error > settings.error) {
    log_warning("model \"{}\": {} balls keep {:.4f} of the diagonal, not the wanted {:.4f}",
                solid.model.name, best.count, best.error, settings.error);
    return std::move(best.result);
  }
  while (best.count - low > std::max<std::size_t>(2, best.count / 8)) {
    PM_TRY(Try next, attempt((low + best.count) / 2));
    if (next.error <= settings.error)
      best = std::move(next);
    else
      low = next.count;
  }
  return std::move(best.result);
}

/// A closed model around a shell's faces, as thick as the surface of its distances at the default
/// resolution is, or at that of previews.
Result<Model> thickened(const Model& model, const InsideTest& inside, bool coarse) {
  const int resolution = SurfaceSettings{}.resolution;
  const auto cells = static_cast<float>(coarse ? resolution / 2 : resolution);
  const Vec3 size = model.box().size();
  const float cell = std::max({size.x, size.y, size.z}) / cells;
  if (!(cell > 0)) return make_error(ErrorCode::kInput, "model \"{}\" has no extent", model.name);
  const std::vector<FaceSide> sheets(model.triangles.size(), FaceSide::kSheet);
  const auto distances = std::make_shared<const DistanceGrid>(signed_distances(
      model, inside, ClosestPointQuery(model), sheets, 0.5f * cell, kThinnestPart * cell));
  const auto engine = make_cpu_engine();
  PM_TRY(Mesh mesh, extract_distances(*engine, distances, cell, {}));
  if (mesh.triangles.empty()) return no_boundary(model);
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

Result<std::optional<Model>> solid_stand_in(const Model& model, const SphereSettings& settings) {
  if (settings.solidify) {
    PM_TRY(Model solid, solidify(model));
    return std::optional<Model>(std::move(solid));
  }
  if (diagnose(model).closed) return std::optional<Model>{};
  const InsideTest inside(model);
  if (undecided_share(model, inside) < kShellShare) return std::optional<Model>{};
  const std::optional<ClusteredModel> few = cluster_long_triangles(model);
  // Where most of the faces are left out, it says little where exactly the others are.
  const bool coarse = settings.coarse || (few && few->thinned);
  PM_TRY(Model shell, thickened(few ? few->model : model, inside, coarse));
  return std::optional<Model>(std::move(shell));
}

Result<Approximation> approximate(const Model& model, const SphereSettings& settings,
                                  const std::optional<Model>* stand_in) {
  if (settings.resolution < 0 || settings.resolution > kFinestResolution)
    return make_error(ErrorCode::kInput,
                      "spheres.resolution {} is out of range - use 1 to {}, or 0 for automatic",
                      settings.resolution, kFinestResolution);
  if (model.triangles.empty())
    return make_error(ErrorCode::kInput, "model \"{}\" has no faces", model.name);
  std::optional<Model> made;
  if (!stand_in) {
    PM_TRY(made, solid_stand_in(model, settings));
    stand_in = &made;
  }
  if (*stand_in) {
    SphereSettings plain = settings;
    plain.solidify = false;
    return approximate(**stand_in, plain);
  }
  // Spheres and balls stand for the shape alone.
  const std::optional<ClusteredModel> few = cluster_long_triangles(model);
  const Model& shape = few ? few->model : model;
  Solid solid{shape,
              settings.inside == InsideMethod::kParity ? InsideTest(shape, InsideRule::kParity)
                                                       : InsideTest(model, InsideRule::kWinding),
              {}};
  const bool fit = settings.fit != FitKind::kNone;
  const auto count = static_cast<std::size_t>(std::max(settings.balls, 1));
  if (settings.method == SphereMethod::kMedial && settings.error > 0)
    return medial_to_error(solid, settings);
  if (settings.method == SphereMethod::kMedial) {
    PM_TRY_STATUS(sample(solid, count, settings.coarse));
    return medial_approximation(solid, settings, count);
  }
  Approximation result;
  if (settings.method == SphereMethod::kHubbard) {
    HubbardSettings hubbard;
    hubbard.spheres = settings.balls;
    PM_TRY(result.tree, hubbard_spheres(shape, solid.inside, hubbard));
  } else {
    PM_TRY(result.tree, cell_spheres(shape, solid.inside, settings, fit ? count : 8000));
  }
  if (fit) {
    const std::vector<Sphere> spheres = result.tree.leaves();
    PM_TRY_STATUS(sample(solid, spheres.size(), settings.coarse));
    PM_TRY(result.balls, fitted(solid, spheres, settings));
  }
  return result;
}

Result<std::vector<Ball>> unfitted_balls(const std::vector<Sphere>& spheres, SphereMethod method,
                                         double volume, FieldSettings field, float cell,
                                         const ExtractSettings& extract, Engine& engine) {
  const bool cells = method == SphereMethod::kOctree || method == SphereMethod::kActive;
  // Cells lie side by side and are to melt into one body; a cover's spheres overlap, and are the
  // shape themselves.
  if (field.blobbiness == 0) field.blobbiness = cells ? 0.12f : 6.0f;
  std::vector<Ball> balls = balls_of(spheres, field);
  if (field.kind == FieldKind::kGaussian && field.even && cells) {
    PM_TRY(balls, evened(engine, std::move(balls), extract));
  }
  if (!field.match_volume || !(volume > 0)) return balls;
  // A ball of infinite support is then at its sphere's radius, however large the constants are.
  const bool compact = visit(field.kind, [](auto kind) { return decltype(kind)::kCompactSupport; });
  const float start = !compact ? field.blob_constant * field.magnitude / field.threshold : 1.0f;
  PM_TRY(const float iso, iso_for_volume(engine, balls, cell, extract, volume, start));
  return rescaled(std::move(balls), field.kind, iso);
}

std::vector<Ball> balls_of(const std::vector<Sphere>& spheres, const FieldSettings& field) {
  std::vector<Ball> balls;
  balls.reserve(spheres.size());
  const BallConstants constants{field.blobbiness, field.blob_constant, field.magnitude,
                                field.threshold};
  for (const Sphere& sphere : spheres) {
    PM_CHECK(sphere.radius > 0);
    balls.push_back(visit(field.kind, [&](auto kind) {
      return kind.of_sphere(sphere.center, sphere.radius, constants);
    }));
  }
  return balls;
}

}  // namespace polymorph
