#include "mesh/carry/carry.h"

#include <algorithm>
#include <optional>

#include "base/activity.h"
#include "base/log.h"
#include "mesh/carry/carry_measure.h"
#include "mesh/carry/carry_moves.h"
#include "mesh/carry/divide.h"
#include "mesh/carry/patch_map.h"

namespace polymorph {
namespace {

/// Maximum distance, in cells, from the surface to points that the flow has moved. A longer step in
/// time is halved.
constexpr float kMaxStep = 0.7f;
/// Fractions of the limit: triangles further than kImproveAbove are improved where possible; a time
/// is finished when all are below kDoneBelow.
constexpr float kImproveAbove = 0.7f, kDoneBelow = 0.9f;

float longest_edge(std::span<const Vec3> points, const Triangle& t) {
  return std::max({length(points[t.v[1]] - points[t.v[0]]), length(points[t.v[2]] - points[t.v[1]]),
                   length(points[t.v[0]] - points[t.v[2]])});
}

/// Carries one mesh through several times, with the same triangles at all of them.
class Carrier {
 public:
  Carrier(const MovingSurface& surface, std::span<const float> times, const CarrySettings& settings)
      : surface_(surface), times_(times), settings_(settings), points_(times.size()) {}

  Status run(std::size_t start);
  Result<CarriedMesh> result();

 private:
  using Points = std::vector<Vec3>;

  MovedMesh view(Points& points) const { return {points, triangles_, fans_, &keep_going_}; }
  CarryMeasure measure(const Points& points) { return meter_->measure(points, triangles_); }
  bool is_good(const CarryFault& fault) const {
    return fault.inverted == 0 && fault.distance <= settings_.limit;
  }
  /// Returns false once `going_on` has failed; results measured after that must not be used.
  bool keep_going() {
    if (status_.ok()) status_ = settings_.going_on();
    return status_.ok();
  }
  std::string stage_name(const char* work, std::size_t k) const {
    return fmt::format("{} {} at time {} of {}", work, settings_.name, k + 1, times_.size());
  }
  Status step(std::size_t from, std::size_t to);
  Status advance(Points& points, float from, float to, const CarryTarget& target, int depth);
  CarryMeasure place_on_surface(Points& points, const CarryTarget& target, int steps);
  void map_patches(Points& points, const CarryTarget& target, CarryMeasure& m);
  CarryMeasure improve(Points& points, const CarryTarget& target,
                       const std::vector<std::uint32_t>& new_triangles, const CarryMeasure& last);
  CarryFault finish(std::size_t k, const CarryTarget& target);
  void divide(std::size_t k, std::vector<std::uint32_t> chosen);
  CarryFault improve_without_division(Points& points, const CarryTarget& target);

  const MovingSurface& surface_;
  std::span<const float> times_;
  CarrySettings settings_;
  std::vector<Triangle> triangles_;
  Fans fans_;
  std::vector<Points> points_;
  std::optional<CarryMeter> meter_;  ///< measures at the current time
  Status status_ = Ok{};
  const std::function<bool()> keep_going_ = [this] { return keep_going(); };
  std::vector<float> residual_;  ///< distance of each point from the surface at the start of a step
};

Status Carrier::advance(Points& points, float from, float to, const CarryTarget& target,
                        int depth) {
  constexpr int kMaxDepth = 5, kSweeps = 3;
  PM_TRY_STATUS(settings_.going_on());
  PM_TRY(Points moved_points, surface_.flow(points, from, to));
  std::vector<std::uint32_t> near;
  const SurfaceProjection foot = project_onto_surface(moved_points, target, near);
  float max_offset = 0;
  for (std::size_t i = 0; i < moved_points.size(); ++i)
    max_offset = std::max(max_offset, length(foot.points[i] - moved_points[i]) - residual_[i]);
  const bool has_inverted =
      std::any_of(triangles_.begin(), triangles_.end(), [&](const Triangle& t) {
        const Vec3 n =
            normalized(foot.normals[t.v[0]] + foot.normals[t.v[1]] + foot.normals[t.v[2]]);
        return !(triangle_quality(moved_points[t.v[0]], moved_points[t.v[1]], moved_points[t.v[2]],
                                  n) > 0);
      });
  if (depth < kMaxDepth && (max_offset > kMaxStep * settings_.cell || has_inverted)) {
    const float middle = 0.5f * (from + to);
    PM_TRY(const CarryTarget middle_target, surface_.at(middle));
    PM_TRY_STATUS(advance(points, from, middle, middle_target, depth + 1));
    return advance(points, middle, to, target, depth + 1);
  }
  points = std::move(moved_points);
  // The shorter the step, the fewer sweeps are needed.
  for (int k = std::min(depth, kSweeps - 1); k < kSweeps; ++k) {
    move_onto_surface(view(points), target, kRelax, near);
    PM_TRY_STATUS(settings_.going_on());
  }
  repair(view(points), target, 0.3f * settings_.cell, near);
  const std::vector<ClosestPoint> hits = target.query().closest(points, near);
  for (std::size_t i = 0; i < hits.size(); ++i) residual_[i] = hits[i].distance;
  return Ok{};
}

/// Projects points onto the surface and pulls them towards points that the mesh misses.
CarryMeasure Carrier::place_on_surface(Points& points, const CarryTarget& target, int steps) {
  CarryMeasure m;
  std::vector<std::uint32_t> near;
  for (int step = 0;; ++step) {
    move_onto_surface(view(points), target, 0, near);
    m = measure(points);
    if (!keep_going()) return m;
    if (m.fault.distance < kImproveAbove * settings_.limit || step + 1 == steps) break;
    pull_towards_misses(view(points), target, m.misses, m.near);
    near = std::move(m.near);
  }
  // Measure again only if repair() has moved points.
  const Points before = points;
  repair(view(points), target, kImproveAbove * settings_.limit, m.near);
  return points == before ? m : measure(points);
}

/// Maps the patches around inverted or distant triangles, and keeps the result if it is better.
void Carrier::map_patches(Points& points, const CarryTarget& target, CarryMeasure& m) {
  for (const int rings : {7, 12}) {
    std::vector<std::uint32_t> seeds = m.inverted;
    for (std::uint32_t f = 0; f < triangles_.size(); ++f)
      if (m.triangle_distance[f] > settings_.limit) seeds.push_back(f);
    if (seeds.empty() || !keep_going()) return;
    Points mapped_points = points;
    if (polymorph::map_patches(mapped_points, triangles_, {seeds, rings}, target, m.mesh_near) == 0)
      continue;
    if (!keep_going()) return;
    repair(view(mapped_points), target, kImproveAbove * settings_.limit, m.near, seeds);
    CarryMeasure after = measure(mapped_points);
    if (is_better(after.fault, m.fault)) m = std::move(after), points = std::move(mapped_points);
    if (m.fault.inverted == 0) return;
  }
}

/// Makes one round of moves at one time. `new_triangles`: those of the preceding division; `last`:
/// the measurement before it.
CarryMeasure Carrier::improve(Points& points, const CarryTarget& target,
                              const std::vector<std::uint32_t>& new_triangles,
                              const CarryMeasure& last) {
  const bool is_first = new_triangles.empty();
  Points before = points;
  if (!is_first)
    repair(view(points), target, kImproveAbove * settings_.limit, last.near, new_triangles);
  CarryMeasure m = place_on_surface(points, target, is_first ? 3 : 2);
  map_patches(points, target, m);
  if (!is_first && is_better(last.fault, m.fault) && keep_going()) {
    // Neither relaxation nor mapping helped; pulling points towards missed ones may.
    CarryMeasure after = place_on_surface(before, target, 2);
    if (is_better(after.fault, m.fault)) m = std::move(after), points = std::move(before);
  }
  return m;
}

/// Halves the chosen triangles, at all times alike, by their edge lengths at time `k`. Then halves
/// new ones that are still long, in up to two more rounds.
void Carrier::divide(std::size_t k, std::vector<std::uint32_t> chosen) {
  constexpr int kMaxRounds = 3;
  for (int round = 0; round < kMaxRounds && !chosen.empty() &&
                      triangles_.size() + 2 * chosen.size() <= settings_.max_triangles;
       ++round) {
    const std::size_t old_count = points_[k].size();
    Division division = halve_triangles(points_[k], triangles_, chosen);
    triangles_ = std::move(division.triangles);
    for (Points& points : points_)
      if (!points.empty())
        for (const auto& [a, b] : division.halved) points.push_back((points[a] + points[b]) * 0.5f);
    chosen.clear();
    for (std::uint32_t f = 0; f < triangles_.size(); ++f) {
      const Triangle& t = triangles_[f];
      if (std::max({t.v[0], t.v[1], t.v[2]}) >= old_count &&
          longest_edge(points_[k], t) > 1.5f * settings_.cell)
        chosen.push_back(f);
    }
  }
  fans_ = Fans(points_[k].size(), triangles_);
}

/// Improves the mesh at time `k` until it is near enough; divides triangles that are too large.
CarryFault Carrier::finish(std::size_t k, const CarryTarget& target) {
  // Maximum number of rounds, and number of rounds before inverted triangles are divided.
  constexpr int kRounds = 30, kMovesAlone = 2;
  constexpr float kSmallest = 0.1f;  // in limits; inverted triangles without a longer edge stay
  meter_.emplace(target, settings_.limit);
  std::vector<std::uint32_t> new_triangles;
  CarryMeasure last;
  for (int round = 0;; ++round) {
    Points& points = points_[k];
    last = improve(points, target, new_triangles, last);
    const CarryMeasure& m = last;
    if (!keep_going()) return m.fault;
    std::vector<std::uint32_t> coarse;
    for (std::uint32_t f = 0; f < triangles_.size(); ++f)
      if (m.triangle_distance[f] > kImproveAbove * settings_.limit &&
          longest_edge(points, triangles_[f]) > 1.5f * m.triangle_distance[f])
        coarse.push_back(f);
    // Triangles that stay inverted after moves alone may be too large for the ridge or groove that
    // they lie on.
    if (round >= kMovesAlone)
      for (const std::uint32_t f : m.inverted)
        if (longest_edge(points, triangles_[f]) > kSmallest * settings_.limit) coarse.push_back(f);
    log_debug(
        "time {}, round {}: {} triangles, {:.2f} of the limit at ({:.3f}, {:.3f}, {:.3f}), "
        "{} inverted, {} to divide",
        k, round, triangles_.size(), m.fault.distance / settings_.limit, m.fault.position.x,
        m.fault.position.y, m.fault.position.z, m.fault.inverted, coarse.size());
    const bool is_done = m.fault.distance < kDoneBelow * settings_.limit && m.fault.inverted == 0;
    const bool is_stuck = round > kMovesAlone && coarse.empty();
    if (is_done || is_stuck || round == kRounds ||
        triangles_.size() + 2 * coarse.size() > settings_.max_triangles)
      return m.fault;
    const std::size_t old_count = points.size();
    divide(k, coarse);
    new_triangles.clear();
    for (std::uint32_t f = 0; f < triangles_.size(); ++f)
      if (std::max({triangles_[f].v[0], triangles_[f].v[1], triangles_[f].v[2]}) >= old_count)
        new_triangles.push_back(f);
  }
}

/// Repairs what divisions at other times have broken, without dividing again.
CarryFault Carrier::improve_without_division(Points& points, const CarryTarget& target) {
  constexpr int kMaxAttempts = 6;
  meter_.emplace(target, settings_.limit);
  CarryMeasure best = measure(points);
  // Points that were added for other times still lie on the edges that they halve.
  Points candidate = points;
  std::vector<std::uint32_t> near = best.near;
  move_onto_surface(view(candidate), target, 0, near);
  CarryMeasure m = measure(candidate);
  for (int k = 0;; ++k) {
    if (is_good(m.fault) || is_better(m.fault, best.fault)) best = m, points = candidate;
    if (is_good(best.fault) || k == kMaxAttempts || !keep_going()) return best.fault;
    candidate = points;
    m = best;
    if (k % 2 == 0) {
      // For single triangles a few moves are usually enough.
      repair(view(candidate), target, kImproveAbove * settings_.limit, m.near, m.inverted);
      m = measure(candidate);
      if (m.fault.distance > settings_.limit) {
        pull_towards_misses(view(candidate), target, m.misses, m.near);
        m = measure(candidate);
      }
    } else {
      map_patches(candidate, target, m);
    }
  }
}

Status Carrier::step(std::size_t from, std::size_t to) {
  const Activity activity(stage_name("carrying", to));
  residual_.assign(points_[from].size(), 0.0f);
  PM_TRY(const CarryTarget target, surface_.at(times_[to]));
  Points points = points_[from];
  PM_TRY_STATUS(advance(points, times_[from], times_[to], target, 0));
  points_[to] = std::move(points);
  finish(to, target);
  return status_;
}

Status Carrier::run(std::size_t start) {
  constexpr int kSweeps = 12;
  PM_TRY(const CarryTarget target, surface_.at(times_[start]));
  triangles_ = target.surface.triangles;
  points_[start] = target.surface.positions;
  fans_ = Fans(points_[start].size(), triangles_);
  // Marching cubes make slivers; relaxation removes them.
  std::vector<std::uint32_t> near;
  {
    const Activity activity(stage_name("beginning", start));
    for (int k = 0; k < kSweeps && keep_going(); ++k)
      move_onto_surface(view(points_[start]), target, kRelax, near);
    if (keep_going()) finish(start, target);
    PM_TRY_STATUS(status_);
  }
  for (std::size_t k = start; k-- > 0;) PM_TRY_STATUS(step(k + 1, k));
  for (std::size_t k = start + 1; k < times_.size(); ++k) PM_TRY_STATUS(step(k - 1, k));
  return Ok{};
}

/// Repairs the mesh at every time. If that is not enough, divides it again and checks all times
/// once more.
Result<CarriedMesh> Carrier::result() {
  constexpr int kPasses = 4;
  CarriedMesh carried;
  carried.faults.resize(points_.size());
  bool is_divided = true;
  for (int pass = 0; pass < kPasses && is_divided; ++pass) {
    is_divided = false;
    for (std::size_t k = 0; k < points_.size(); ++k) {
      const Activity activity(stage_name("checking", k));
      PM_TRY(const CarryTarget target, surface_.at(times_[k]));
      carried.faults[k] = improve_without_division(points_[k], target);
      PM_TRY_STATUS(status_);
      if (is_good(carried.faults[k]) || pass + 1 == kPasses) continue;
      const std::size_t before = triangles_.size();
      carried.faults[k] = finish(k, target);
      PM_TRY_STATUS(status_);
      is_divided |= triangles_.size() > before;
    }
  }
  carried.points = std::move(points_);
  carried.triangles = std::move(triangles_);
  return carried;
}

}  // namespace

Result<CarriedMesh> carry(const MovingSurface& surface, std::span<const float> times,
                          std::size_t start, const CarrySettings& settings) {
  Carrier carrier(surface, times, settings);
  PM_TRY_STATUS(carrier.run(start));
  return carrier.result();
}

}  // namespace polymorph
