#include "sequence/pacing.h"

#include <algorithm>

#include "model/closest.h"
#include "morph/motion.h"
#include "sequence/geometry.h"

namespace polymorph {
namespace {

constexpr int kSteps = 12;

/// Mean distance from some of a surface's vertices to another surface.
double mean_distance(const Mesh& from, const ClosestPointQuery& to) {
  constexpr std::size_t kSamples = 1500;
  const std::size_t stride = std::max<std::size_t>(1, from.positions.size() / kSamples);
  std::vector<Vec3> points;
  for (std::size_t i = 0; i < from.positions.size(); i += stride)
    points.push_back(from.positions[i]);
  double sum = 0;
  for (const ClosestPoint& at : to.closest(points)) sum += static_cast<double>(at.distance);
  return points.empty() ? 0 : sum / static_cast<double>(points.size());
}

}  // namespace

Result<std::vector<float>> even_pacing(const PreparedScene& prepared, const PreparedActor& actor,
                                       const PreparedLeg& leg, SurfaceExtractor& extractor) {
  PreparedLeg linear = leg;
  linear.plan.motion.easing = Easing::kLinear;
  linear.plan.pacing.clear();
  // A part of the pace is left to the eased time itself: where nothing changes it goes on.
  constexpr double kOwnShare = 0.4;
  std::vector<double> done{0};
  Mesh before;
  for (int k = 0; k <= kSteps; ++k) {
    const float u = static_cast<float>(k) / kSteps;
    ActorGeometry geometry;
    geometry.moment.time = geometry.moment.u = u;
    geometry.map = map_at(actor, linear, u, balls_at(linear.plan, u));
    PM_TRY(Mesh mesh,
           surface_between(actor, linear, geometry, 3 * actor.cell, prepared.extract, extractor));
    if (mesh.triangles.empty()) return std::vector<float>{};
    if (k > 0)
      done.push_back(done.back() +
                     mean_distance(before, ClosestPointQuery(mesh.positions, mesh.triangles)) +
                     mean_distance(mesh, ClosestPointQuery(before.positions, before.triangles)));
    before = std::move(mesh);
  }
  const double whole = done.back();
  if (!(whole > 0)) return std::vector<float>{};
  for (int k = 0; k <= kSteps; ++k) {
    double& share = done[static_cast<std::size_t>(k)];
    share = (1 - kOwnShare) * share / whole + kOwnShare * k / kSteps;
  }
  std::vector<float> pacing{0};
  for (int i = 1; i < kSteps; ++i) {
    const double wanted = static_cast<double>(i) / kSteps;
    const auto next =
        static_cast<std::size_t>(std::upper_bound(done.begin(), done.end(), wanted) - done.begin());
    const double within = (wanted - done[next - 1]) / (done[next] - done[next - 1]);
    pacing.push_back(static_cast<float>((static_cast<double>(next) - 1 + within) / kSteps));
  }
  pacing.push_back(1);
  return pacing;
}

}  // namespace polymorph
