// Choice of the resolution for the octree and active methods, and diagnosis if nothing is inside.
#include <algorithm>

#include "base/log.h"
#include "model/repair/diagnose.h"
#include "spheres/cells.h"

namespace polymorph {
namespace {

constexpr int kMaxSuggestedResolution = 7;  // 2^18 cells: a fraction of a second
constexpr std::size_t kMaxFitted = 4096;    // balls of one fit

SphereTree build_at_resolution(const InsideTest& test, const RootCube& root, SphereMethod method,
                               int resolution) {
  return method == SphereMethod::kActive ? build_active_tree(test, root, resolution - 1)
                                         : build_octree(test, root, resolution - 1);
}

/// Builds the tree of the finest resolution with at most `max_count` spheres: thousands of balls
/// are still extracted in milliseconds, and a thin model gets finer cells than a thick one. The
/// resolution is at least kMinResolution, so that a cube is not reduced to a few balls.
SphereTree build_automatic(const InsideTest& test, const RootCube& root, SphereMethod method,
                           std::size_t max_count) {
  constexpr int kMinResolution = 4, kStartResolution = 6, kMaxResolution = 8;
  // With each level an octree has 8 times as many cells. The active method divides cells only at
  // the surface, so it has 4 times as many.
  const std::size_t growth = method == SphereMethod::kActive ? 4 : 8;
  int resolution = kStartResolution;
  SphereTree tree = build_at_resolution(test, root, method, resolution);
  const auto count = [&] { return tree.leaves().size(); };
  while (count() > max_count && resolution > kMinResolution)
    tree = build_at_resolution(test, root, method, --resolution);
  while (resolution >= kStartResolution && resolution < kMaxResolution &&
         count() * growth <= max_count)
    tree = build_at_resolution(test, root, method, ++resolution);
  return tree;
}

/// Explains why nothing is inside and what would help.
Error make_nothing_inside_error(const Model& model, const InsideTest& test, const RootCube& root,
                                const SphereSettings& settings) {
  if (settings.method == SphereMethod::kActive && settings.resolution > 0 &&
      !build_at_resolution(test, root, SphereMethod::kOctree, settings.resolution).nodes.empty())
    return make_error(ErrorCode::kInput,
                      "model \"{}\": no cell of resolution {} has more than 4 corners inside it "
                      "(it is too thin for "
                      "the active method) - raise spheres.resolution or use the octree method",
                      model.name, settings.resolution);
  for (int resolution = settings.resolution + 1; resolution <= kMaxSuggestedResolution;
       ++resolution)
    if (!build_at_resolution(test, root, settings.method, resolution).nodes.empty())
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
        model.name, std::max(settings.resolution, kMaxSuggestedResolution), diagnosis.volume,
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

Result<SphereTree> build_cell_spheres(const Model& model, const InsideTest& test,
                                      const SphereSettings& settings, std::size_t max_count) {
  const RootCube root = make_root_cube(model, static_cast<double>(settings.root_margin));
  SphereTree tree = settings.resolution == 0
                        ? build_automatic(test, root, settings.method, max_count)
                        : build_at_resolution(test, root, settings.method, settings.resolution);
  // The centres of a few large cells may all lie outside although centres of smaller cells do not.
  const bool may_refine = settings.method == SphereMethod::kOctree;
  for (int finer = settings.resolution + 1;
       may_refine && tree.nodes.empty() && finer <= kMaxSuggestedResolution; ++finer) {
    tree = build_at_resolution(test, root, settings.method, finer);
    if (!tree.nodes.empty())
      log_warning("model \"{}\": no cell of resolution {} lies inside it - resolution {} is taken",
                  model.name, settings.resolution, finer);
  }
  if (tree.nodes.empty()) return make_nothing_inside_error(model, test, root, settings);
  // Without a fit even a million balls are fast enough.
  if (settings.fit == FitKind::kNone || tree.leaves().size() <= kMaxFitted) return tree;
  int coarser = settings.resolution;
  while (coarser > 1 && tree.leaves().size() > kMaxFitted)
    tree = build_at_resolution(test, root, settings.method, --coarser);
  log_warning(
      "model \"{}\": resolution {} gives more than the {} balls that are fitted at once - "
      "resolution {} is taken; without a fit it may be finer",
      model.name, settings.resolution, kMaxFitted, coarser);
  return tree;
}

}  // namespace polymorph
