#include "leg/map_fold.h"

#include <algorithm>
#include <array>
#include <map>

#include "base/text.h"
#include "field/extract_surface.h"
#include "kernels/linear.h"
#include "leg/leg_surface.h"
#include "morph/motion.h"

namespace polymorph {
namespace {

/// Approximate number of points that are tested per time.
constexpr std::size_t kFoldPoints = 4000;
/// Step of the differences, in cells of the map's lattice. It is short, so that the points of a
/// difference mostly lie in one piece of the spline.
constexpr float kStepInCells = 0.25f;
/// Minimum fraction of points that landmarks fold. A smaller fraction consists of single points
/// where the map nearly folds even without landmarks.
constexpr double kMinFoldedShare = 1e-3;

/// Selects evenly spaced points of the list, about kFoldPoints.
std::vector<Vec3> select_points(const std::vector<Vec3>& points) {
  const std::size_t stride = std::max<std::size_t>(1, points.size() / kFoldPoints);
  std::vector<Vec3> selection;
  for (std::size_t i = 0; i < points.size(); i += stride) selection.push_back(points[i]);
  return selection;
}

}  // namespace

Result<std::vector<std::uint8_t>> find_folds(const std::shared_ptr<const Regression>& regression,
                                             std::span<const std::size_t> maps,
                                             const std::vector<Vec3>& points, float step,
                                             Engine& engine) {
  // Each point and its neighbours along x, y and z.
  std::vector<Vec3> stencil;
  for (const Vec3 p : points)
    for (const Vec3 d : {Vec3{0, 0, 0}, Vec3{step, 0, 0}, Vec3{0, step, 0}, Vec3{0, 0, step}})
      stencil.push_back(p + d);
  std::vector<AttributeValues> values;
  PM_TRY_STATUS(to_status(engine.regress(regression, stencil, values)));
  std::vector<std::uint8_t> folds(points.size(), 0);
  for (std::size_t i = 0; i < points.size(); ++i)
    for (const std::size_t m : maps) {
      // Image of point k of the stencil: each of its four points has a value per map.
      const auto image = [&](std::size_t k) {
        const float* v = values[2 * (4 * i + k) + m].v;
        return Vec3d(Vec3{v[0], v[1], v[2]});
      };
      const Vec3d x = image(1) - image(0), y = image(2) - image(0), z = image(3) - image(0);
      if (!(dot(x, cross(y, z)) > 0)) folds[i] = 1;
    }
  return folds;
}

Result<std::string> describe_fold(const Leg& leg, Engine& engine) {
  const bool is_distance_leg = visit(
      leg, [] { return false; }, [](const DistanceLeg&) { return true; });
  if (!is_distance_leg || leg.plan.landmarks.empty()) return std::string();
  std::size_t folded_count = 0, point_count = 0;
  std::map<std::string, std::size_t> nearest;  // number of folded points by their nearest landmark
  // Test points of the source's model, of the surface half way, and of the target's model.
  for (const float time : {0.0f, 0.5f, 1.0f}) {
    PM_TRY(const LegState state, leg_state(leg, time, engine));
    std::vector<Vec3> points;
    if (time == 0.5f) {
      PM_TRY(const LegSurface surface, leg_surface(leg, time, engine));
      points = select_points(surface.mesh.positions);
    } else {
      points = select_points((time == 0 ? leg.from : leg.to)->model.points);
    }
    // Count the points that the map folds, but not the map without landmarks.
    auto without_landmarks = std::make_shared<Regression>(*state.map.regression);
    without_landmarks->landmarks.clear();
    const float step = kStepInCells * without_landmarks->lattice.cell;
    constexpr std::array<std::size_t, 2> kBoth{0, 1};
    PM_TRY(const auto folded, find_folds(state.map.regression, kBoth, points, step, engine));
    PM_TRY(const auto folded_without, find_folds(without_landmarks, kBoth, points, step, engine));
    const std::vector<Vec3> places = landmark_positions(leg.plan, time, state.balls);
    point_count += points.size();
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (!folded[i] || folded_without[i]) continue;
      ++folded_count;
      const auto nearest_place = std::min_element(
          places.begin(), places.end(),
          [&](Vec3 a, Vec3 b) { return length(a - points[i]) < length(b - points[i]); });
      ++nearest[leg.landmark_names[static_cast<std::size_t>(nearest_place - places.begin())]];
    }
  }
  const double folded_fraction =
      static_cast<double>(folded_count) / static_cast<double>(point_count);
  if (!(folded_fraction > kMinFoldedShare)) return std::string();
  // Name the landmark that is nearest to most folded points.
  const auto worst =
      std::max_element(nearest.begin(), nearest.end(),
                       [](const auto& a, const auto& b) { return a.second < b.second; });
  return fmt::format(
      "{} -> {}: landmarks fold the map, most of all around \"{}\": {:.2g} % of the surface's "
      "points "
      "are turned inside out on the way - look whether it is the same place on both, or leave it "
      "out",
      leg.from->name, leg.to->name, printable(worst->first), 100 * folded_fraction);
}

}  // namespace polymorph
