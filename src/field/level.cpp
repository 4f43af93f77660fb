#include "field/level.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/exact_math.h"
#include "field/extract_surface.h"
#include "kernels/field_kinds.h"
#include "kernels/linear.h"
#include "mesh/mesh_check.h"

namespace polymorph {
namespace {

Result<std::vector<float>> field_at_centers(Engine& engine, const BallSet& balls,
                                            const ExtractSettings& settings) {
  std::vector<Vec3> centers;
  for (const Ball& ball : balls) centers.push_back(ball.center);
  std::vector<float> values;
  PM_TRY_STATUS(to_status(engine.sample(balls, centers, settings, values)));
  return values;
}

}  // namespace

Result<float> iso_for_volume(Engine& engine, const BallSet& balls, float cell,
                             const ExtractSettings& settings, double volume, float start) {
  PM_CHECK(volume > 0 && start > 0);
  // Volume falls as ln iso rises. Steps that double find a bracket; then false position with
  // Illinois' halving, which a vanishing surface (volume 0, however far the level) does not stall.
  constexpr double kTolerance = 0.002, kMin = -40, kMax = 40;
  struct Try {
    double x = 0, excess = 0;
    bool known = false;
  };
  Try large, small;  // too much volume, too little
  double x = exact::log(static_cast<double>(start)), step = 0, best = x,
         best_error = std::numeric_limits<double>::infinity();
  int side = 0;  // of the last try: +1 too much, -1 too little
  for (int i = 0; i < 30; ++i) {
    ExtractSettings at = settings;
    at.iso = static_cast<float>(exact::exp(x));
    PM_TRY(const Mesh mesh, extract_surface(engine, balls, cell, at));
    const double excess = volume_of(mesh) / volume - 1;
    if (std::abs(excess) < best_error) best_error = std::abs(excess), best = x;
    if (best_error <= kTolerance) break;
    Try& mine = excess > 0 ? large : small;
    Try& other = excess > 0 ? small : large;
    const int now = excess > 0 ? 1 : -1;
    mine = {x, excess, true};
    if (now == side && other.known) other.excess /= 2;
    side = now;
    if (large.known && small.known) {
      const double width = small.x - large.x;
      if (width < 1e-6) break;
      x = std::clamp(large.x + width * large.excess / (large.excess - small.excess),
                     large.x + 0.02 * width, small.x - 0.02 * width);
    } else {
      step = step == 0 ? std::clamp(std::abs(exact::log1p(std::max(excess, -0.9))), 0.05, 2.0)
                       : 2 * step;
      x = std::clamp(x + now * step, kMin, kMax);
    }
  }
  return static_cast<float>(exact::exp(best));
}

Result<LevelSurface> surface_of_volume(Engine& engine, MorphSurface between, const Box& box,
                                       float cell, const ExtractSettings& settings,
                                       const VolumeGoal& goal) {
  PM_CHECK(goal.volume > 0 && goal.cell > 0 && goal.limit >= 0);
  constexpr int kMaxTries = 8;
  const double bound = static_cast<double>(goal.limit);
  double level = std::clamp(static_cast<double>(goal.near.value_or(0.0f)), -bound, bound);
  LevelSurface nearest;
  /// From `level` on to the level at which, as far as cells of this edge can tell, the goal's cells
  /// show its volume. In a field of distances the volume changes by the area times the level:
  /// Newton's steps, and from two tries on the chord.
  const auto search = [&](float edge, double tolerance) -> Status {
    // What facets lose goes with the square of the edge.
    const double share = 1 - static_cast<double>(goal.cell * goal.cell / (edge * edge));
    double last = 0, last_excess = 0, best = level, best_excess = 0;
    // Levels that were tried, with too much volume and with too little.
    double least = -std::numeric_limits<double>::infinity(), most = -least;
    for (int i = 0; i < kMaxTries; ++i) {
      between.level = static_cast<float>(level);
      PM_TRY(Mesh mesh, extract_surface(engine, between, box, edge, settings));
      const double lost = share == 0 ? 0 : share * faceting_loss(mesh);
      const double excess = volume_of(mesh) + lost - goal.volume;
      double slope = -area_of(mesh);
      if (i == 0 || std::abs(excess) < std::abs(best_excess)) {
        best = level, best_excess = excess;
        nearest = {std::move(mesh), static_cast<float>(level)};
      }
      if (std::abs(excess) <= tolerance * goal.volume) break;
      if (i > 0) {
        // Where parts come and go the volume is no smooth function of the level.
        const double chord = (excess - last_excess) / (level - last);
        if (chord < slope / 5 && chord > 5 * slope) slope = chord;
      }
      if (!(slope < 0)) slope = -cube_root(goal.volume * goal.volume);
      last = level, last_excess = excess;
      (excess > 0 ? least : most) = level;
      level = std::clamp(level - excess / slope, -bound, bound);
      if (level <= least || level >= most)
        level = (std::max(least, -bound) + std::min(most, bound)) / 2;
      if (level == last) break;
    }
    level = best;
    return Ok{};
  };
  if (!goal.near) {
    // Most tries on larger cells, which cost a sixteenth and a fourth.
    PM_TRY_STATUS(search(4 * cell, 5 * goal.tolerance));
    PM_TRY_STATUS(search(2 * cell, goal.tolerance / 2));
  }
  PM_TRY_STATUS(search(cell, goal.tolerance));
  return nearest;
}

std::vector<Ball> rescaled(std::vector<Ball> balls, FieldKind kind, float iso) {
  visit(kind, [&](auto field) {
    for (Ball& ball : balls) field.rescale(ball, iso);
  });
  return balls;
}

std::vector<Ball> grown(std::vector<Ball> balls, FieldKind kind, float growth, float maximum) {
  if (growth >= 1) return balls;
  if (growth <= 0) return {};
  // The field may stand higher between centres than at them.
  constexpr float kMinMaximum = 1.5f;
  if (visit(kind, [](auto field) { return decltype(field)::kCompactSupport; }))
    return rescaled(
        std::move(balls), kind,
        static_cast<float>(exact::pow(static_cast<double>(std::max(maximum, kMinMaximum)),
                                      1 - static_cast<double>(growth))));
  for (Ball& ball : balls) ball.w *= growth * growth;
  return balls;
}

Result<float> field_maximum(Engine& engine, const BallSet& balls, const ExtractSettings& settings) {
  PM_TRY(const std::vector<float> values, field_at_centers(engine, balls, settings));
  return values.empty() ? 0.0f : *std::max_element(values.begin(), values.end());
}

Result<std::vector<Ball>> evened(Engine& engine, std::vector<Ball> balls,
                                 const ExtractSettings& settings) {
  PM_CHECK(settings.field == FieldKind::kGaussian);
  // Three steps bring thin parts to within a tenth of the plateau; more would only sharpen the
  // cells' steps.
  constexpr int kSteps = 3;
  constexpr float kDamping = 0.7f;
  for (int step = 0; step < kSteps; ++step) {
    PM_TRY(const std::vector<float> values, field_at_centers(engine, balls, settings));
    std::vector<float> sorted = values;
    std::sort(sorted.begin(), sorted.end());
    const float plateau = sorted[sorted.size() * 9 / 10];
    for (std::size_t i = 0; i < balls.size(); ++i)
      balls[i].w += kDamping * log(plateau / std::max(values[i], 1e-6f * plateau));
  }
  return balls;
}

}  // namespace polymorph
