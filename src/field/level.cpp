#include "field/level.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/activity.h"
#include "base/exact_math.h"
#include "field/extract_surface.h"
#include "field/sample_field.h"
#include "kernels/field_kinds.h"
#include "kernels/linear.h"
#include "mesh/mesh_check.h"

namespace polymorph {
namespace {

/// Samples the field at the centre of each ball. `name` is that of sample_field().
Result<std::vector<float>> field_at_centers(Engine& engine, const BallSet& balls,
                                            const ExtractSettings& settings,
                                            const std::string& name) {
  std::vector<Vec3> centers;
  for (const Ball& ball : balls) centers.push_back(ball.center);
  return sample_field(engine, balls, centers, settings, name);
}

}  // namespace

Result<float> iso_for_volume(Engine& engine, const BallSet& balls, const VolumeMeasure& measure,
                             float start) {
  const double volume = measure.volume;
  PM_CHECK(volume > 0 && start > 0);
  // The volume decreases with ln iso. Doubling steps find a bracket; then the Illinois variant of
  // false position, which does not stall where the surface vanishes (volume 0 for any larger iso).
  constexpr double kTolerance = 0.002, kMin = -40, kMax = 40;  // kMin, kMax: range of ln iso
  struct BracketEnd {
    double x = 0, excess = 0;  // ln iso; relative excess of the volume
    bool is_known = false;
  };
  BracketEnd large, small;  // volume too large, too small
  double x = exact::log(static_cast<double>(start)), step = 0, best = x,
         best_error = std::numeric_limits<double>::infinity();
  int side = 0;  // last iteration: +1 volume too large, -1 too small
  for (int i = 0; i < 30; ++i) {
    const Activity activity(
        fmt::format("finding the level of {} balls, surface {}", balls.size(), i + 1));
    ExtractSettings trial = measure.extract;
    trial.iso = static_cast<float>(exact::exp(x));
    PM_TRY(const Mesh mesh, extract_surface(engine, balls, measure.cell, trial));
    const double excess = volume_of(mesh) / volume - 1;
    if (std::abs(excess) < best_error) best_error = std::abs(excess), best = x;
    if (best_error <= kTolerance) break;
    BracketEnd& current = excess > 0 ? large : small;
    BracketEnd& other = excess > 0 ? small : large;
    const int new_side = excess > 0 ? 1 : -1;
    current = {x, excess, true};
    if (new_side == side && other.is_known) other.excess /= 2;  // the Illinois variant
    side = new_side;
    if (large.is_known && small.is_known) {
      const double width = small.x - large.x;
      if (width < 1e-6) break;
      // False position, but not close to the bracket's ends.
      x = std::clamp(large.x + width * large.excess / (large.excess - small.excess),
                     large.x + 0.02 * width, small.x - 0.02 * width);
    } else {  // no bracket yet: begin with ln of the volume's ratio, then double the step
      step = step == 0 ? std::clamp(std::abs(exact::log1p(std::max(excess, -0.9))), 0.05, 2.0)
                       : 2 * step;
      x = std::clamp(x + new_side * step, kMin, kMax);
    }
  }
  return static_cast<float>(exact::exp(best));
}

Result<LevelSurface> surface_of_volume(Engine& engine, MorphSurface surface, const Box& box,
                                       const LevelSearch& search, const VolumeGoal& goal) {
  PM_CHECK(goal.volume > 0 && goal.cell > 0 && goal.limit >= 0);
  constexpr int kMaxIterations = 8;
  const double bound = static_cast<double>(goal.limit);
  const LevelEstimate near = search.near.value_or(LevelEstimate{});
  double level = std::clamp(static_cast<double>(near.level), -bound, bound);
  double response = near.response;
  LevelSurface nearest;
  /// Searches from `level` on cells of the given edge. In a distance field the volume changes by
  /// response x area x level, which gives a Newton step at first. Later steps use the secant
  /// through the last two levels, which sets the response.
  const auto search_on = [&](float edge, double tolerance) -> Status {
    // The volume lost by facets is proportional to the square of the edge. This fraction of it
    // would not be lost on the goal's cells.
    const double fraction = 1 - static_cast<double>(goal.cell * goal.cell / (edge * edge));
    double last_level = 0, last_excess = 0, best = level, best_excess = 0;
    // Bracket: the last levels with too much volume and with too little.
    double bracket_low = -std::numeric_limits<double>::infinity(), bracket_high = -bracket_low;
    for (int i = 0; i < kMaxIterations; ++i) {
      surface.level = static_cast<float>(level);
      PM_TRY(Mesh mesh, extract_surface(engine, surface, box, edge, search.extract));
      const double faceting_volume = fraction == 0 ? 0 : fraction * faceting_loss(mesh);
      const double excess = volume_of(mesh) + faceting_volume - goal.volume;
      const double area = area_of(mesh);
      if (i == 0 || std::abs(excess) < std::abs(best_excess)) {
        best = level, best_excess = excess;
        nearest = {std::move(mesh), static_cast<float>(level), {}};
      }
      if (i > 0 && area > 0) {
        // Ignores the secant if its response differs much from 1: where components appear or
        // vanish, the volume is not a smooth function of the level. A level that weighs little at
        // thin limbs changes the volume by a tenth of area x level between objects of such limbs.
        const double secant = (last_excess - excess) / (area * (level - last_level));
        response = secant > 0.02 && secant < 5 ? secant : 1;
      }
      // Without a surface, assume the area of a face of a cube of the goal's volume.
      const double slope = area > 0 ? -response * area : -cube_root(goal.volume * goal.volume);
      if (best == level)
        nearest.estimate.level =
            static_cast<float>(std::clamp(level - excess / slope, -bound, bound));
      if (std::abs(excess) <= tolerance * goal.volume) break;
      last_level = level, last_excess = excess;
      (excess > 0 ? bracket_low : bracket_high) = level;
      level = std::clamp(level - excess / slope, -bound, bound);
      if (level <= bracket_low || level >= bracket_high)
        level = (std::max(bracket_low, -bound) + std::min(bracket_high, bound)) / 2;
      if (level == last_level) break;
    }
    level = best;
    return Ok{};
  };
  if (!search.near) {
    // Most iterations use larger cells, at a sixteenth and a fourth of the cost.
    PM_TRY_STATUS(search_on(4 * search.cell, 5 * search.tolerance));
    PM_TRY_STATUS(search_on(2 * search.cell, search.tolerance / 2));
  }
  PM_TRY_STATUS(search_on(search.cell, search.tolerance));
  nearest.estimate.response = response;
  return nearest;
}

std::vector<Ball> rescale_balls(std::vector<Ball> balls, FieldKind kind, float iso) {
  visit(kind, [&](auto field) {
    for (Ball& ball : balls) field.rescale(ball, iso);
  });
  return balls;
}

std::vector<Ball> grow_balls(std::vector<Ball> balls, FieldKind kind, float growth, float maximum) {
  if (growth >= 1) return balls;
  if (growth <= 0) return {};
  // The field may be larger between centres than at them.
  constexpr float kMinMaximum = 1.5f;
  if (visit(kind, [](auto field) { return decltype(field)::kCompactSupport; }))
    return rescale_balls(
        std::move(balls), kind,
        static_cast<float>(exact::pow(static_cast<double>(std::max(maximum, kMinMaximum)),
                                      1 - static_cast<double>(growth))));
  for (Ball& ball : balls) ball.w *= growth * growth;
  return balls;
}

Result<float> find_field_maximum(Engine& engine, const BallSet& balls,
                                 const ExtractSettings& settings) {
  PM_TRY(const std::vector<float> values,
         field_at_centers(engine, balls, settings, "looking for the field's maximum"));
  return values.empty() ? 0.0f : *std::max_element(values.begin(), values.end());
}

Result<std::vector<Ball>> equalize_field(Engine& engine, std::vector<Ball> balls,
                                         const ExtractSettings& settings) {
  PM_CHECK(settings.field == FieldKind::kGaussian);
  // Three steps bring thin parts to within a tenth of the plateau; more would sharpen voxel steps.
  constexpr int kSteps = 3;
  constexpr float kDamping = 0.7f;
  for (int step = 0; step < kSteps; ++step) {
    const std::string name = fmt::format("evening out the field of {} balls, step {} of {}",
                                         balls.size(), step + 1, kSteps);
    const Activity activity(name);
    PM_TRY(const std::vector<float> values, field_at_centers(engine, balls, settings, name));
    std::vector<float> sorted = values;
    std::sort(sorted.begin(), sorted.end());
    const float plateau = sorted[sorted.size() * 9 / 10];
    for (std::size_t i = 0; i < balls.size(); ++i)
      balls[i].w += kDamping * log(plateau / std::max(values[i], 1e-6f * plateau));
  }
  return balls;
}

}  // namespace polymorph
