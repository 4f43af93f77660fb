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

/// Maximum distance, in cells, between the surface and where the flow leads; larger steps are
/// halved.
constexpr float kMaxStep = 0.7f;
/// Fractions of the limit: triangles above kEnough are improved where possible, and below kGood the
/// work at a time ends.
constexpr float kEnough = 0.7f, kGood = 0.9f;

float longest_edge(std::span<const Vec3> points, const Triangle& t) {
  return std::max({length(points[t.v[1]] - points[t.v[0]]), length(points[t.v[2]] - points[t.v[1]]),
                   length(points[t.v[0]] - points[t.v[2]])});
}

/// The meshes of several times, all with the same triangles.
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
  /// False from the first time on that the caller wants the work to end: what is measured then is
  /// not to be used.
  bool keep_going() {
    if (ended_.ok()) ended_ = settings_.going_on();
    return ended_.ok();
  }
  std::string stage(const char* work, std::size_t k) const {
    return fmt::format("{} {} at time {} of {}", work, settings_.name, k + 1, times_.size());
  }
  Status step(std::size_t from, std::size_t to);
  Status advance(Points& points, float from, float to, const CarryTarget& target, int depth);
  CarryMeasure place_on_surface(Points& points, const CarryTarget& target, int steps);
  void map_patches(Points& points, const CarryTarget& target, CarryMeasure& m);
  CarryMeasure improve(Points& points, const CarryTarget& target,
                       const std::vector<std::uint32_t>& fresh, const CarryMeasure& last);
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
  Status ended_ = Ok{};
  const std::function<bool()> keep_going_ = [this] { return keep_going(); };
  std::vector<float> residual_;  ///< distance of each point from the surface at the start of a step
};

Status Carrier::advance(Points& points, float from, float to, const CarryTarget& target,
                        int depth) {
  constexpr int kDepth = 5, kSweeps = 3;
  PM_TRY_STATUS(settings_.going_on());
  PM_TRY(Points moved_points, surface_.flow(points, from, to));
  std::vector<std::uint32_t> near;
  const SurfaceProjection foot = project_onto_surface(moved_points, target, near);
  float max_offset = 0;
  for (std::size_t i = 0; i < moved_points.size(); ++i)
    max_offset = std::max(max_offset, length(foot.points[i] - moved_points[i]) - residual_[i]);
  const bool is_torn = std::any_of(triangles_.begin(), triangles_.end(), [&](const Triangle& t) {
    const Vec3 n = normalized(foot.normals[t.v[0]] + foot.normals[t.v[1]] + foot.normals[t.v[2]]);
    return !(triangle_quality(moved_points[t.v[0]], moved_points[t.v[1]], moved_points[t.v[2]], n) >
             0);
  });
  if (depth < kDepth && (max_offset > kMaxStep * settings_.cell || is_torn)) {
    const float middle = 0.5f * (from + to);
    PM_TRY(const CarryTarget half, surface_.at(middle));
    PM_TRY_STATUS(advance(points, from, middle, half, depth + 1));
    return advance(points, middle, to, target, depth + 1);
  }
  points = std::move(moved_points);
  for (int k = std::min(depth, kSweeps - 1); k < kSweeps; ++k) {
    move_onto_surface(view(points), target, kRelax, near);
    PM_TRY_STATUS(settings_.going_on());
  }
  repair(view(points), target, 0.3f * settings_.cell, near);
  const std::vector<ClosestPoint> hits = target.query().closest(points, near);
  for (std::size_t i = 0; i < hits.size(); ++i) residual_[i] = hits[i].distance;
  return Ok{};
}

/// Projects points onto the surface and pulls them towards what the mesh misses.
CarryMeasure Carrier::place_on_surface(Points& points, const CarryTarget& target, int steps) {
  CarryMeasure m;
  std::vector<std::uint32_t> near;
  for (int step = 0;; ++step) {
    move_onto_surface(view(points), target, 0, near);
    m = measure(points);
    if (!keep_going()) return m;
    if (m.fault.distance < kEnough * settings_.limit || step + 1 == steps) break;
    pull_towards_misses(view(points), target, m.misses, m.near);
    near = std::move(m.near);
  }
  // repair() moves points even if there was nothing to repair; measure again only if it did.
  const Points before = points;
  repair(view(points), target, kEnough * settings_.limit, m.near);
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
    repair(view(mapped_points), target, kEnough * settings_.limit, m.near, seeds);
    CarryMeasure after = measure(mapped_points);
    if (is_better(after.fault, m.fault)) m = std::move(after), points = std::move(mapped_points);
    if (m.fault.inverted == 0) return;
  }
}

/// One round of moves at one time. `fresh`: triangles that the preceding division made; `last`: the
/// measurement before it.
CarryMeasure Carrier::improve(Points& points, const CarryTarget& target,
                              const std::vector<std::uint32_t>& fresh, const CarryMeasure& last) {
  const bool is_first = fresh.empty();
  Points before = points;
  if (!is_first) repair(view(points), target, kEnough * settings_.limit, last.near, fresh);
  CarryMeasure m = place_on_surface(points, target, is_first ? 3 : 2);
  map_patches(points, target, m);
  if (!is_first && is_better(last.fault, m.fault) && keep_going()) {
    // Neither relaxation nor mapping helped; pulling points towards the missed ones may.
    CarryMeasure after = place_on_surface(before, target, 2);
    if (is_better(after.fault, m.fault)) m = std::move(after), points = std::move(before);
  }
  return m;
}

/// Halves the chosen triangles, the same at all times, by their edge lengths at time `k`; then
/// those of the new ones that are still long.
void Carrier::divide(std::size_t k, std::vector<std::uint32_t> chosen) {
  constexpr int kTimes = 3;
  for (int time = 0; time < kTimes && !chosen.empty() &&
                     triangles_.size() + 2 * chosen.size() <= settings_.max_triangles;
       ++time) {
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

/// Improves the mesh at a time, dividing triangles that are too large, until it is near enough.
CarryFault Carrier::finish(std::size_t k, const CarryTarget& target) {
  constexpr int kRounds = 30, kMovesAlone = 2;
  constexpr float kSmallest = 0.1f;
  meter_.emplace(target, settings_.limit);
  std::vector<std::uint32_t> fresh;
  CarryMeasure last;
  for (int round = 0;; ++round) {
    Points& points = points_[k];
    last = improve(points, target, fresh, last);
    const CarryMeasure& m = last;
    if (!keep_going()) return m.fault;
    std::vector<std::uint32_t> coarse;
    for (std::uint32_t f = 0; f < triangles_.size(); ++f)
      if (m.triangle_distance[f] > kEnough * settings_.limit &&
          longest_edge(points, triangles_[f]) > 1.5f * m.triangle_distance[f])
        coarse.push_back(f);
    // Triangles that stay inverted may be too large for the ridge or groove that they lie on.
    if (round >= kMovesAlone)
      for (const std::uint32_t f : m.inverted)
        if (longest_edge(points, triangles_[f]) > kSmallest * settings_.limit) coarse.push_back(f);
    log_debug(
        "time {}, round {}: {} triangles, {:.2f} of the limit at ({:.3f}, {:.3f}, {:.3f}), "
        "{} inverted, {} to divide",
        k, round, triangles_.size(), m.fault.distance / settings_.limit, m.fault.position.x,
        m.fault.position.y, m.fault.position.z, m.fault.inverted, coarse.size());
    const bool is_done = m.fault.distance < kGood * settings_.limit && m.fault.inverted == 0;
    const bool is_stuck = round > kMovesAlone && coarse.empty();
    if (is_done || is_stuck || round == kRounds ||
        triangles_.size() + 2 * coarse.size() > settings_.max_triangles)
      return m.fault;
    const std::size_t old_count = points.size();
    divide(k, coarse);
    fresh.clear();
    for (std::uint32_t f = 0; f < triangles_.size(); ++f)
      if (std::max({triangles_[f].v[0], triangles_[f].v[1], triangles_[f].v[2]}) >= old_count)
        fresh.push_back(f);
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
      repair(view(candidate), target, kEnough * settings_.limit, m.near, m.inverted);
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
  const Activity activity(stage("carrying", to));
  residual_.assign(points_[from].size(), 0.0f);
  PM_TRY(const CarryTarget target, surface_.at(times_[to]));
  Points points = points_[from];
  PM_TRY_STATUS(advance(points, times_[from], times_[to], target, 0));
  points_[to] = std::move(points);
  finish(to, target);
  return ended_;
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
    const Activity activity(stage("beginning", start));
    for (int k = 0; k < kSweeps && keep_going(); ++k)
      move_onto_surface(view(points_[start]), target, kRelax, near);
    if (keep_going()) finish(start, target);
    PM_TRY_STATUS(ended_);
  }
  for (std::size_t k = start; k-- > 0;) PM_TRY_STATUS(step(k + 1, k));
  for (std::size_t k = start + 1; k < times_.size(); ++k) PM_TRY_STATUS(step(k - 1, k));
  return Ok{};
}

/// Repairs every time; if that is not enough, the mesh is divided again, and all times are checked
/// once more.
Result<CarriedMesh> Carrier::result() {
  constexpr int kPasses = 4;
  CarriedMesh carried;
  carried.faults.resize(points_.size());
  bool is_divided = true;
  for (int pass = 0; pass < kPasses && is_divided; ++pass) {
    is_divided = false;
    for (std::size_t k = 0; k < points_.size(); ++k) {
      const Activity activity(stage("checking", k));
      PM_TRY(const CarryTarget target, surface_.at(times_[k]));
      carried.faults[k] = improve_without_division(points_[k], target);
      PM_TRY_STATUS(ended_);
      if (is_good(carried.faults[k]) || pass + 1 == kPasses) continue;
      const std::size_t before = triangles_.size();
      carried.faults[k] = finish(k, target);
      PM_TRY_STATUS(ended_);
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
