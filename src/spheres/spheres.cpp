#include "spheres/spheres.h"

#include "model/diagnose.h"
#include "spheres/cells.h"

namespace polymorph {
namespace {

constexpr int kFinestResolution = 9;  // 2^24 cells
constexpr int kSuggestUpTo = 7;       // 2^18 cells: a fraction of a second

SphereTree spheres_at(const InsideTest& test, const RootCube& root, SphereMethod method,
                      int resolution) {
  return method == SphereMethod::kActive ? active_spheres(test, root, resolution - 1)
                                         : octree_spheres(test, root, resolution - 1);
}

/// The finest resolution that gives at most kAutomaticSpheres: thousands of balls are still
/// extracted in milliseconds, and a thin model gets finer cells than a stout one. At least
/// kCoarsest, so that a cube does not end as a handful of balls.
SphereTree automatic_spheres(const InsideTest& test, const RootCube& root, SphereMethod method) {
  constexpr std::size_t kAutomaticSpheres = 8000;
  constexpr int kCoarsest = 4, kStart = 6, kFinest = 8;
  // Cells halve: an octree gets 8 times as many, the active method, which only splits at the
  // surface, 4.
  const std::size_t growth = method == SphereMethod::kActive ? 4 : 8;
  int resolution = kStart;
  SphereTree tree = spheres_at(test, root, method, resolution);
  const auto count = [&] { return tree.leaves().size(); };
  while (count() > kAutomaticSpheres && resolution > kCoarsest)
    tree = spheres_at(test, root, method, --resolution);
  while (resolution >= kStart && resolution < kFinest && count() * growth <= kAutomaticSpheres)
    tree = spheres_at(test, root, method, ++resolution);
  return tree;
}

/// Nothing was found: why, and what would help.
Error nothing_inside(const Model& model, const InsideTest& test, const RootCube& root,
                     const SphereSettings& settings) {
  if (settings.method == SphereMethod::kActive &&
      !spheres_at(test, root, SphereMethod::kOctree, settings.resolution).nodes.empty())
    return make_error(ErrorCode::kInput,
                      "model \"{}\": no cell of resolution {} has more than 4 corners inside it "
                      "(it is too thin for "
                      "the active method) - raise spheres.resolution or use the octree method",
                      model.name, settings.resolution);
  for (int resolution = settings.resolution + 1; resolution <= kSuggestUpTo; ++resolution)
    if (!spheres_at(test, root, settings.method, resolution).nodes.empty())
      return make_error(
          ErrorCode::kInput,
          "model \"{}\": no cell of resolution {} lies inside it (it is too thin) - raise "
          "spheres.resolution to {} or more",
          model.name, settings.resolution, resolution);
  const Diagnosis diagnosis = diagnose(model);
  if (diagnosis.closed && diagnosis.volume > 0)
    return make_error(
        ErrorCode::kInput,
        "model \"{}\": no cell up to resolution {} lies inside it (it is very thin: volume {:.3g} "
        "in "
        "a box of {:.3g} x {:.3g} x {:.3g}) - raise spheres.resolution or thicken the model",
        model.name, std::max(settings.resolution, kSuggestUpTo), diagnosis.volume,
        diagnosis.box.size().x, diagnosis.box.size().y, diagnosis.box.size().z);
  std::string reasons;
  for (const std::string& problem : describe_problems(diagnosis)) reasons += "\n  " + problem;
  return make_error(ErrorCode::kInput,
                    "model \"{}\": it encloses no volume, so no spheres can stand for it - close "
                    "its holes and turn "
                    "its faces outward{}",
                    model.name, reasons);
}

}  // namespace

std::vector<Sphere> SphereTree::leaves() const {
  std::vector<Sphere> spheres;
  for (const SphereNode& node : nodes)
    if (node.leaf) spheres.push_back(node.sphere);
  return spheres;
}

Result<SphereTree> approximate(const Model& model, const SphereSettings& settings) {
  if (settings.resolution < 0 || settings.resolution > kFinestResolution)
    return make_error(ErrorCode::kInput,
                      "spheres.resolution {} is out of range - use 1 to {}, or 0 for automatic",
                      settings.resolution, kFinestResolution);
  if (model.triangles.empty())
    return make_error(ErrorCode::kInput, "model \"{}\" has no faces", model.name);
  const InsideTest test(
      model, settings.inside == InsideMethod::kParity ? InsideRule::kParity : InsideRule::kWinding);
  const RootCube root = root_cube(model);
  SphereTree tree = settings.resolution == 0
                        ? automatic_spheres(test, root, settings.method)
                        : spheres_at(test, root, settings.method, settings.resolution);
  if (tree.nodes.empty()) return nothing_inside(model, test, root, settings);
  return tree;
}

std::vector<Ball> balls_of(const std::vector<Sphere>& spheres, const FieldSettings& field) {
  std::vector<Ball> balls;
  balls.reserve(spheres.size());
  for (const Sphere& sphere : spheres) {
    PM_CHECK(sphere.radius > 0);
    const float r2 = sphere.radius * sphere.radius;
    Ball ball{sphere.center, 1, 0};
    if (field.kind == FieldKind::kGaussian) {
      // Blinn 1982: F/T = exp(B (1 - r^2/R^2)), B = |blobbiness|.
      ball.a = field.blobbiness / r2;
      ball.w = field.blobbiness;
    } else {
      // Report, algorithm 5.1: F = blobConstant magnitude / d^2, over the threshold.
      ball.w = field.blob_constant * field.magnitude * r2 / field.threshold;
    }
    balls.push_back(ball);
  }
  return balls;
}

}  // namespace polymorph
