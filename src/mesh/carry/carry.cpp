#include "mesh/carry/carry.h"

#include <algorithm>
#include <array>
#include <limits>
#include <optional>

#include "base/activity.h"
#include "base/log.h"
#include "mesh/carry/carry_measure.h"
#include "mesh/carry/carry_moves.h"
#include "mesh/carry/coarsen.h"
#include "mesh/carry/divide.h"
#include "mesh/carry/patch_map.h"

namespace polymorph {
namespace {

/// Maximum distance, in cells, from the surface of points that the flow has moved. A step in time
/// that leaves points further away is halved.
constexpr float kMaxStep = 1.5f;
/// Fractions of the limit: a time is finished when all triangles are below kDoneBelow; until then,
/// those further than kImproveAbove are improved where possible.
constexpr float kImproveAbove = 0.85f, kDoneBelow = 0.97f;
/// Below this badness only small patches are mapped and divided: larger ones seldom get better.
constexpr float kSmallBadness = 4;
/// The work ends at a time where the mesh stays further from the surface than this, in limits.
constexpr float kHopeless = 3;
/// Lengths of the carried mesh's edges, in cells: minimum at the start, maximum in mapped patches.
constexpr float kFirstEdge = 3, kMappedEdge = 2;
/// Collapses at later times: maximum length of the edges, in cells, and what they may deviate in
/// all, in limits. Points of triangles that are further than kCriticalAbove limits from the surface
/// take no part.
constexpr float kCollapsedEdge = 1.6f, kCollapseDeviation = 0.25f, kCriticalAbove = 0.8f;

float longest_edge(std::span<const Vec3> points, const Triangle& t) {
  return std::max({length(points[t.v[1]] - points[t.v[0]]), length(points[t.v[2]] - points[t.v[1]]),
                   length(points[t.v[0]] - points[t.v[2]])});
}

/// Carries one mesh through several times, with the same triangles at all of them.
class Carrier {
 public:
  Carrier(const MovingSurface& surface, std::span<const float> times, const CarrySettings& settings)
      : surface_(surface),
        times_(times),
        settings_(settings),
        points_(times.size()),
        states_(times.size()) {}

  Status run(std::size_t start);
  Result<CarriedMesh> result();

 private:
  using Points = std::vector<Vec3>;
  using Halved = std::vector<std::array<std::uint32_t, 2>>;  ///< end points of bisected edges

  MovedMesh view(Points& points) const { return {points, triangles_, fans_, &keep_going_}; }
  CarryMeasure measure(const Points& points, std::span<const std::uint32_t> near = {}) {
    return meter_->measure(points, triangles_, near);
  }
  bool is_good(const CarryFault& fault) const {
    return fault.inverted == 0 && fault.distance <= settings_.limit;
  }
  bool is_done(const CarryFault& fault) const {
    return fault.inverted == 0 && fault.distance < kDoneBelow * settings_.limit;
  }
  /// Tests whether `a` is better than `b`: good where `b` is not, else with less badness.
  bool is_better(const CarryMeasure& a, const CarryMeasure& b) const {
    return is_good(a.fault) != is_good(b.fault) ? is_good(a.fault) : a.badness < b.badness;
  }
  /// Returns false once `check_stop` has failed; results measured after that must not be used.
  bool keep_going() {
    if (status_.ok()) status_ = settings_.check_stop();
    return status_.ok();
  }
  std::string stage_name(const char* work, std::size_t k) const {
    return fmt::format("{} {} at time {} of {}", work, settings_.name, k + 1, times_.size());
  }
  bool collapse(std::size_t k, const CoarsenSettings& settings);
  bool collapse_inverted(std::size_t k, const CarryTarget& target, const CarryMeasure& m);
  Status step(std::size_t from, std::size_t to);
  Status advance(Points& points, float from, float to, const CarryTarget& target, int depth,
                 std::vector<std::uint32_t>& near);
  CarryMeasure place_on_surface(Points& points, const CarryTarget& target,
                                std::vector<std::uint32_t> near, int steps);
  bool map_patches(std::size_t k, const CarryTarget& target, CarryMeasure& m, bool may_divide);
  CarryMeasure measure_repaired(const MovedMesh& mesh, const CarryTarget& target);
  void keep_better_regions(std::size_t k, Points candidate, CarryMeasure after, CarryMeasure& m);
  void spread(std::size_t k, const CarryTarget& target, CarryMeasure& m,
              std::span<const int> rings);
  void halve_at_other_times(std::size_t k, const Halved& halved);
  CarryMeasure improve(std::size_t k, const CarryTarget& target,
                       const std::vector<std::uint32_t>& new_triangles, const CarryMeasure& last);
  void finish(std::size_t k, const CarryTarget& target);
  /// Calls finish(), and ends the work if the mesh stays more than kHopeless limits off.
  void finish_or_give_up(std::size_t k, const CarryTarget& target);
  void divide(std::size_t k, std::vector<std::uint32_t> chosen);
  void add_midpoints(std::size_t k, const Halved& halved);
  void set_state(std::size_t k, CarryMeasure m);
  bool is_good_after_divisions(std::size_t k, const CarryTarget& target);
  Status improve_without_division(std::size_t k, const CarryTarget& target);
  Status carry_again(std::size_t from, std::size_t to, const CarryTarget& target, CarryMeasure& m);

  const MovingSurface& surface_;
  std::span<const float> times_;
  CarrySettings settings_;
  std::vector<Triangle> triangles_;
  Fans fans_;
  std::vector<Points> points_;
  /// Mesh at one time, as it was last measured.
  struct State {
    CarryFault fault;
    std::size_t points = 0;           ///< number of points; bisections have added others since then
    std::vector<std::uint32_t> near;  ///< nearest triangle of the surface, per present point
    bool is_changed = false;          ///< collapses have changed the mesh since it was measured
  };
  std::vector<State> states_;
  std::optional<std::size_t> hopeless_;  ///< index of the time at which the work ended early
  std::optional<CarryMeter> meter_;      ///< measures at the current time
  Status status_ = Ok{};
  const std::function<bool()> keep_going_ = [this] { return keep_going(); };
  /// Deviation per point that collapses have caused (CoarsenedMesh); infinite where the mesh is
  /// near the limit at some time.
  std::vector<float> deviations_;
  std::vector<float> residual_;  ///< distance of each point from the surface at the start of a step
};

/// Moves points along the flow and then onto the surface `target` at the time `to`. Halves a step
/// that leaves points far from the surface or inverts triangles. `depth`: halvings so far. Sets
/// `near` to the points' nearest triangles of the surface.
Status Carrier::advance(Points& points, float from, float to, const CarryTarget& target, int depth,
                        std::vector<std::uint32_t>& near) {
  constexpr int kMaxDepth = 3, kSweeps = 3;
  PM_TRY_STATUS(settings_.check_stop());
  PM_TRY(Points moved_points, surface_.flow(points, from, to));
  near.clear();
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
    PM_TRY_STATUS(advance(points, from, middle, middle_target, depth + 1, near));
    return advance(points, middle, to, target, depth + 1, near);
  }
  points = std::move(moved_points);
  // The shorter the step, the fewer sweeps are needed.
  for (int k = std::min(depth, kSweeps - 1); k < kSweeps; ++k) {
    move_onto_surface(view(points), target, kRelax, near);
    PM_TRY_STATUS(settings_.check_stop());
  }
  repair(view(points), target, /*max_distance=*/0.3f * settings_.cell, near);
  const SurfaceProjection arrival = project_onto_surface(points, target, near);
  for (std::size_t i = 0; i < points.size(); ++i)
    residual_[i] = length(arrival.points[i] - points[i]);
  return Ok{};
}

/// Projects points onto the surface and pulls them towards points that the mesh misses, up to
/// `steps` times; then repairs the mesh if that makes it better.
CarryMeasure Carrier::place_on_surface(Points& points, const CarryTarget& target,
                                       std::vector<std::uint32_t> near, int steps) {
  CarryMeasure m;
  for (int step = 0;; ++step) {
    move_onto_surface(view(points), target, /*relax=*/0, near);
    m = measure(points, near);
    if (!keep_going() || is_done(m.fault)) return m;
    if (m.fault.distance < kImproveAbove * settings_.limit || step + 1 == steps) break;
    pull_towards_misses(view(points), target, m.misses, kDoneBelow * settings_.limit, m.near);
    near = std::move(m.near);
  }
  // Measure again only if repair() has moved points.
  const Points before = points;
  repair(view(points), target, kImproveAbove * settings_.limit, m.near, m.inverted);
  if (points == before) return m;
  CarryMeasure repaired = measure(points);
  if (repaired.badness <= m.badness) return repaired;
  points = before;
  return m;
}

/// Adds the midpoints of bisected edges to the points at time `k`, if it has any.
void Carrier::add_midpoints(std::size_t k, const Halved& halved) {
  Points& points = points_[k];
  std::vector<std::uint32_t>& near = states_[k].near;
  if (points.empty()) return;
  for (const auto& [a, b] : halved) {
    points.push_back((points[a] + points[b]) * 0.5f);
    if (b < near.size()) near.push_back(near[a]);
  }
}

/// Adds the midpoints of bisected edges to the points of all times but `k`.
void Carrier::halve_at_other_times(std::size_t k, const Halved& halved) {
  for (std::size_t other = 0; other < points_.size(); ++other)
    if (other != k) add_midpoints(other, halved);
}

/// Stores the measurement of the mesh at time `k`.
void Carrier::set_state(std::size_t k, CarryMeasure m) {
  deviations_.resize(points_[k].size(), 0.0f);
  for (std::uint32_t f = 0; f < triangles_.size(); ++f)
    if (m.triangle_distance[f] > kCriticalAbove * settings_.limit)
      for (const std::uint32_t v : triangles_[f].v)
        deviations_[v] = std::numeric_limits<float>::infinity();
  states_[k] = {m.fault, points_[k].size(), std::move(m.near)};
}

/// Measures a mesh; repairs it if that makes it better.
CarryMeasure Carrier::measure_repaired(const MovedMesh& mesh, const CarryTarget& target) {
  CarryMeasure m = meter_->measure(mesh.points, mesh.triangles);
  if (m.badness == 0 || !keep_going()) return m;
  Points repaired_points = mesh.points;
  repair({repaired_points, mesh.triangles, mesh.fans, mesh.keep_going}, target,
         kImproveAbove * settings_.limit, m.near, m.inverted);
  CarryMeasure repaired = meter_->measure(repaired_points, mesh.triangles);
  if (repaired.badness >= m.badness) return m;
  mesh.points = std::move(repaired_points);
  return repaired;
}

/// Takes over the `candidate` for the points at time `k`, where it is better: each connected region
/// of moved points is decided by itself. `after` measures the candidate; `m` measures the points at
/// time `k`, before and after.
void Carrier::keep_better_regions(std::size_t k, Points candidate, CarryMeasure after,
                                  CarryMeasure& m) {
  constexpr std::uint32_t kNone = 0xffffffffu;
  // Number the regions, and sum what they gain.
  const Points& points = points_[k];
  const std::vector<float> before_badness = list_badness(m, settings_.limit),
                           after_badness = list_badness(after, settings_.limit);
  std::vector<std::uint32_t> region(points.size(), kNone), stack;
  std::vector<double> gains;
  for (std::uint32_t first = 0; first < points.size(); ++first) {
    if (region[first] != kNone || points[first] == candidate[first]) continue;
    const auto number = static_cast<std::uint32_t>(gains.size());
    std::vector<std::uint32_t> faces;
    region[first] = number;
    stack.push_back(first);
    while (!stack.empty()) {
      const std::uint32_t p = stack.back();
      stack.pop_back();
      for (const std::uint32_t f : fans_.around(p)) {
        faces.push_back(f);
        for (const std::uint32_t v : triangles_[f].v)
          if (region[v] == kNone && !(points[v] == candidate[v]))
            region[v] = number, stack.push_back(v);
      }
    }
    std::sort(faces.begin(), faces.end());
    faces.erase(std::unique(faces.begin(), faces.end()), faces.end());
    double gain = 0;
    for (const std::uint32_t f : faces)
      gain += static_cast<double>(before_badness[f]) - static_cast<double>(after_badness[f]);
    gains.push_back(gain);
  }
  const auto better_count =
      std::count_if(gains.begin(), gains.end(), [](double gain) { return gain > 0; });
  if (better_count > 0 && static_cast<std::size_t>(better_count) < gains.size()) {
    for (std::size_t i = 0; i < points.size(); ++i)
      if (region[i] != kNone && !(gains[region[i]] > 0)) candidate[i] = points[i];
    after = measure(candidate, after.near);
    log_debug("time {}: {} of {} regions are better, badness {:.2f} after {:.2f}", k, better_count,
              gains.size(), after.badness, m.badness);
  }
  if (is_better(after, m)) m = std::move(after), points_[k] = std::move(candidate);
}

/// Spreads the points around inverted triangles at time `k`, in turn with each of the numbers of
/// rings, and keeps the results where they are better. Each attempt begins with the last result,
/// even if that was worse: regions of many small triangles seldom unfold at once.
void Carrier::spread(std::size_t k, const CarryTarget& target, CarryMeasure& m,
                     std::span<const int> rings) {
  Points points = points_[k];
  CarryMeasure last = m;
  for (const int ring_count : rings) {
    if (m.inverted.empty() || last.inverted.empty() || !keep_going()) return;
    spread_points(view(points), target, last.inverted, last.near, ring_count);
    last = measure_repaired(view(points), target);
    log_debug("time {}: spread {} rings, badness {:.2f} after {:.2f}", k, ring_count, last.badness,
              m.badness);
    keep_better_regions(k, points, last, m);
  }
}

/// Maps the patches around inverted or distant triangles at time `k`, which `m` measures. Keeps the
/// result, with its measurement in `m`, if it is better. Returns whether it has divided triangles.
bool Carrier::map_patches(std::size_t k, const CarryTarget& target, CarryMeasure& m,
                          bool may_divide) {
  static constexpr int kPatchRings[] = {3, 4, 6, 8, 12, 16}, kDividedPatchRings[] = {3, 6, 12},
                       kSpreadRings[] = {3, 6, 12, 6, 12}, kDividedSpreadRings[] = {3};
  bool is_divided = false;
  spread(
      k, target, m,
      may_divide ? std::span<const int>(kDividedSpreadRings) : std::span<const int>(kSpreadRings));
  // The more rings, the more often the borders of a patch lie where they can be mapped. Where
  // division may help as well, fewer sizes are tried.
  for (const int rings : may_divide ? std::span<const int>(kDividedPatchRings) : kPatchRings) {
    if (rings > 3 && may_divide && m.badness < kSmallBadness) break;
    std::vector<std::uint32_t> seeds = m.inverted;
    for (std::uint32_t f = 0; f < triangles_.size(); ++f)
      if (m.triangle_distance[f] > settings_.limit) seeds.push_back(f);
    if (seeds.empty() || !keep_going()) return is_divided;
    Points points = points_[k];
    std::vector<Triangle> triangles = triangles_;
    PatchMesh mesh{points, triangles};
    const PatchSettings patch_settings{rings, /*deviation=*/0.5f * settings_.limit,
                                       kMappedEdge * settings_.cell,
                                       may_divide ? settings_.max_triangles : 0, &keep_going_};
    const std::size_t patches =
        polymorph::map_patches(mesh, seeds, patch_settings, target, m.mesh_near);
    if (!keep_going()) return is_divided;
    if (patches == 0) continue;
    const Fans fans(points.size(), triangles);
    const auto old_count = static_cast<std::uint32_t>(points_[k].size());
    CarryMeasure after = measure_repaired({points, triangles, fans, &keep_going_}, target);
    log_debug("time {}: {} patches of {} rings, {} more triangles, badness {:.2f} after {:.2f}", k,
              patches, rings, triangles.size() - triangles_.size(), after.badness, m.badness);
    if (points.size() == old_count) {
      keep_better_regions(k, std::move(points), std::move(after), m);
    } else if (is_better(after, m)) {
      m = std::move(after);
      is_divided = true;
      points_[k] = std::move(points);
      triangles_ = std::move(triangles);
      fans_ = fans;
      halve_at_other_times(k, mesh.halved);
    }
    if (is_good(m.fault)) break;
  }
  return is_divided;
}

/// Makes one round of moves at one time. `new_triangles`: the triangles of a preceding division, if
/// any; `last`: the last measurement, before that division.
CarryMeasure Carrier::improve(std::size_t k, const CarryTarget& target,
                              const std::vector<std::uint32_t>& new_triangles,
                              const CarryMeasure& last) {
  const bool is_undivided = new_triangles.empty();
  Points before = points_[k];
  if (!is_undivided)
    repair(view(points_[k]), target, kImproveAbove * settings_.limit, last.near, new_triangles);
  CarryMeasure m = place_on_surface(points_[k], target, last.near, is_undivided ? 2 : 1);
  const bool is_divided = map_patches(k, target, m, /*may_divide=*/true);
  if (!is_undivided && !is_divided && last.badness < m.badness && keep_going()) {
    // Neither relaxation nor mapping helped; pulling points towards missed ones may.
    CarryMeasure after = place_on_surface(before, target, last.near, 2);
    if (is_better(after, m)) m = std::move(after), points_[k] = std::move(before);
  }
  return m;
}

/// Bisects the chosen triangles, at all times alike, by their edge lengths at time `k`. Then
/// bisects new triangles with edges above 1.5 cells, in up to two more rounds.
void Carrier::divide(std::size_t k, std::vector<std::uint32_t> chosen) {
  constexpr int kMaxRounds = 3;
  for (int round = 0; round < kMaxRounds && !chosen.empty() &&
                      triangles_.size() + 2 * chosen.size() <= settings_.max_triangles;
       ++round) {
    const std::size_t old_count = points_[k].size();
    Division division = halve_triangles(points_[k], triangles_, chosen);
    triangles_ = std::move(division.triangles);
    for (std::size_t time = 0; time < points_.size(); ++time) add_midpoints(time, division.halved);
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
void Carrier::finish(std::size_t k, const CarryTarget& target) {
  // Maximum numbers of rounds: in all, before inverted triangles are divided, and without progress.
  constexpr int kRounds = 20, kMovesAlone = 2, kMaxIdle = 4;
  constexpr float kMinBridge = 0.3f;  // edge over distance of triangles at creases
  constexpr float kSmallest = 0.1f;   // in limits; inverted triangles without a longer edge stay
  std::vector<std::uint32_t> new_triangles;
  CarryMeasure last;
  last.near = states_[k].near;
  // The best state so far.
  std::vector<Points> best_points;
  std::vector<Triangle> best_triangles;
  std::vector<State> best_states;
  std::vector<float> best_deviations;
  CarryMeasure best;
  best.badness = best.fault.distance = std::numeric_limits<float>::infinity();
  int idle_rounds = 0;
  for (int round = 0;; ++round) {
    last = improve(k, target, new_triangles, last);
    const Points& points = points_[k];
    const CarryMeasure& m = last;
    if (!keep_going()) return;
    std::vector<std::uint32_t> coarse;  // triangles to divide
    // Division helps only where triangles are longer than their distance.
    for (std::uint32_t f = 0; f < triangles_.size(); ++f)
      if (m.triangle_distance[f] > kImproveAbove * settings_.limit &&
          longest_edge(points, triangles_[f]) > 1.5f * m.triangle_distance[f])
        coarse.push_back(f);
    // Small triangles at a crease, or at the rim of a thin sheet, are divided only if there is
    // nothing else to do.
    if (coarse.empty() && m.inverted.empty())
      for (std::uint32_t f = 0; f < triangles_.size(); ++f)
        if (m.triangle_distance[f] > kDoneBelow * settings_.limit &&
            longest_edge(points, triangles_[f]) > kMinBridge * m.triangle_distance[f])
          coarse.push_back(f);
    // Triangles that stay inverted after moves alone may be too large for the ridge or groove that
    // they lie on.
    if (round >= kMovesAlone)
      for (const std::uint32_t f : m.inverted)
        if (longest_edge(points, triangles_[f]) > kSmallest * settings_.limit) coarse.push_back(f);
    log_debug(
        "time {}, round {}: {} triangles, {:.2f} of the limit at ({:.3f}, {:.3f}, {:.3f}), "
        "{} inverted, {} to divide, badness {:.2f}",
        k, round, triangles_.size(), m.fault.distance / settings_.limit, m.fault.position.x,
        m.fault.position.y, m.fault.position.z, m.fault.inverted, coarse.size(), m.badness);
    // End with the better one of the present and the best state; otherwise divide and go on.
    idle_rounds = m.badness < 0.9f * best.badness ? 0 : idle_rounds + 1;
    const bool is_stuck =
        round > kMovesAlone && (coarse.empty() || idle_rounds >= kMaxIdle || is_good(best.fault));
    if (is_done(m.fault) || is_stuck || round == kRounds ||
        triangles_.size() + 2 * coarse.size() > settings_.max_triangles) {
      if (is_done(m.fault) || !is_better(best, m)) return set_state(k, last);
      points_ = std::move(best_points);
      triangles_ = std::move(best_triangles);
      states_ = std::move(best_states);
      fans_ = Fans(points_[k].size(), triangles_);
      deviations_ = std::move(best_deviations);
      return set_state(k, best);
    }
    if (is_better(m, best)) {
      best = m, best_points = points_, best_triangles = triangles_, best_states = states_;
      best_deviations = deviations_;
    }
    if (round + 1 >= kMovesAlone && collapse_inverted(k, target, m)) {
      last.near = states_[k].near;
      new_triangles.clear();
      continue;
    }
    const std::size_t old_count = points.size();
    divide(k, coarse);
    new_triangles.clear();
    for (std::uint32_t f = 0; f < triangles_.size(); ++f)
      if (std::max({triangles_[f].v[0], triangles_[f].v[1], triangles_[f].v[2]}) >= old_count)
        new_triangles.push_back(f);
  }
}

/// Tests whether the mesh at time `k`, which was good, is still so. Bisections at other times do
/// not change the mesh as a set of points, so distances remain valid; but the halves of a triangle
/// that is curved over the surface may be inverted.
bool Carrier::is_good_after_divisions(std::size_t k, const CarryTarget& target) {
  State& state = states_[k];
  std::vector<Triangle> new_triangles;
  for (const Triangle& t : triangles_)
    if (std::max({t.v[0], t.v[1], t.v[2]}) >= state.points) new_triangles.push_back(t);
  const std::vector<std::uint32_t> inverted =
      find_inverted(points_[k], new_triangles, target, state.near);
  state.fault.inverted = inverted.size();
  if (inverted.empty())
    state.points = points_[k].size();
  else
    state.fault.inverted_position = points_[k][new_triangles[inverted.front()].v[0]];
  return inverted.empty();
}

/// Carries the mesh again from one time to another. Keeps the result, with its measurement in `m`,
/// if it is better than that.
Status Carrier::carry_again(std::size_t from, std::size_t to, const CarryTarget& target,
                            CarryMeasure& m) {
  Points points = points_[from];
  std::vector<std::uint32_t> near;
  residual_.assign(points.size(), 0.0f);
  PM_TRY_STATUS(advance(points, times_[from], times_[to], target, /*depth=*/0, near));
  CarryMeasure after = place_on_surface(points, target, std::move(near), /*steps=*/2);
  PM_TRY_STATUS(status_);
  log_debug("time {}: carried again from time {}, badness {:.2f} after {:.2f}", to, from,
            after.badness, m.badness);
  if (is_better(after, m)) m = std::move(after), points_[to] = std::move(points);
  return Ok{};
}

/// Repairs what bisections at other times have broken, without further ones.
Status Carrier::improve_without_division(std::size_t k, const CarryTarget& target) {
  constexpr int kAttempts = 4;
  CarryMeasure m = measure(points_[k], states_[k].near);
  const auto keep_better = [&](Points points) {
    CarryMeasure after = measure_repaired(view(points), target);
    keep_better_regions(k, std::move(points), std::move(after), m);
  };
  for (int attempt = 0; attempt < kAttempts && !is_good(m.fault) && keep_going(); ++attempt) {
    if (attempt == 0) {
      // For single triangles a few moves are usually enough.
      keep_better(points_[k]);
    } else if (attempt == 1) {
      // Points that were added for other times still lie on the edges that they halve.
      Points points = points_[k];
      std::vector<std::uint32_t> near = m.near;
      move_onto_surface(view(points), target, /*relax=*/0, near);
      if (m.fault.distance > settings_.limit)
        pull_towards_misses(view(points), target, m.misses, kDoneBelow * settings_.limit, near);
      keep_better(std::move(points));
    } else if (attempt == 2) {
      map_patches(k, target, m, /*may_divide=*/false);
    } else {
      for (const std::size_t from : {k - 1, k + 1})
        if (from < times_.size() && !is_good(m.fault) && is_good(states_[from].fault))
          PM_TRY_STATUS(carry_again(from, k, target, m));
      map_patches(k, target, m, /*may_divide=*/false);
    }
  }
  PM_TRY_STATUS(status_);
  set_state(k, std::move(m));
  return Ok{};
}

/// Collapses edges at all times alike; `settings` refer to the mesh at time `k`. Returns whether it
/// has changed.
bool Carrier::collapse(std::size_t k, const CoarsenSettings& settings) {
  deviations_.resize(points_[k].size(), 0.0f);
  CoarsenedMesh mesh{{&points_[k]}, triangles_, &deviations_};
  for (std::size_t other = 0; other < points_.size(); ++other)
    if (other != k && !points_[other].empty()) mesh.shapes.push_back(&points_[other]);
  const std::size_t old_count = points_[k].size();
  const std::vector<std::uint32_t> new_index = coarsen(mesh, settings);
  if (points_[k].size() == old_count) return false;
  log_debug("time {}: {} of {} points remain", k, points_[k].size(), old_count);
  fans_ = Fans(points_[k].size(), triangles_);
  for (std::size_t time = 0; time < points_.size(); ++time) {
    if (points_[time].empty()) continue;
    State& state = states_[time];
    state.is_changed = true;
    std::vector<std::uint32_t> near(points_[time].size(), ClosestPoint::kNoTriangle);
    for (std::size_t i = 0; i < state.near.size(); ++i) near[new_index[i]] = state.near[i];
    state.near = std::move(near);
  }
  return true;
}

/// Collapses edges of the inverted triangles at time `k`, which `m` measures, where no other
/// triangle is inverted by that. Returns whether the mesh has changed.
bool Carrier::collapse_inverted(std::size_t k, const CarryTarget& target, const CarryMeasure& m) {
  if (m.inverted.empty()) return false;
  states_[k].near = m.near;
  const std::function<bool(Vec3, Vec3, Vec3)> accepts = [&](Vec3 a, Vec3 b, Vec3 c) {
    const Vec3 middle = (a + b + c) / 3, normal = cross(b - a, c - a);
    const ClosestPoint hit = target.tree->closest(middle);
    return dot(normal, face_normal_at(target, middle, hit, normal)) > 0;
  };
  return collapse(k, {kMappedEdge * settings_.cell, kCollapseDeviation * settings_.limit, &accepts,
                      m.inverted});
}

/// Carries the mesh from one time (index) to the next or previous one.
Status Carrier::step(std::size_t from, std::size_t to) {
  const Activity activity(stage_name("carrying", to));
  // Where the surface shrinks, triangles would otherwise become ever smaller, and fold.
  collapse(from, {kCollapsedEdge * settings_.cell, kCollapseDeviation * settings_.limit});
  residual_.assign(points_[from].size(), 0.0f);
  PM_TRY(const CarryTarget target, surface_.at(times_[to]));
  Points points = points_[from];
  PM_TRY_STATUS(advance(points, times_[from], times_[to], target, /*depth=*/0, states_[to].near));
  points_[to] = std::move(points);
  finish_or_give_up(to, target);
  return status_;
}

void Carrier::finish_or_give_up(std::size_t k, const CarryTarget& target) {
  meter_.emplace(target, settings_.limit);
  finish(k, target);
  if (states_[k].fault.distance > kHopeless * settings_.limit) hopeless_ = k;
}

Status Carrier::run(std::size_t start) {
  constexpr int kSweeps = 12;
  PM_TRY(const CarryTarget target, surface_.at(times_[start]));
  triangles_ = target.surface.triangles;
  points_[start] = target.surface.positions;
  coarsen({{&points_[start]}, triangles_},
          {kFirstEdge * settings_.cell, /*deviation=*/0.3f * settings_.limit});
  log_debug("{} of {} triangles", triangles_.size(), target.surface.triangles.size());
  fans_ = Fans(points_[start].size(), triangles_);
  // Marching cubes make slivers; relaxation removes them.
  {
    const Activity activity(stage_name("beginning", start));
    for (int k = 0; k < kSweeps && keep_going(); ++k)
      move_onto_surface(view(points_[start]), target, kRelax, states_[start].near);
    if (keep_going()) finish_or_give_up(start, target);
    PM_TRY_STATUS(status_);
  }
  for (std::size_t k = start; k-- > 0 && !hopeless_;) PM_TRY_STATUS(step(k + 1, k));
  for (std::size_t k = start + 1; k < times_.size() && !hopeless_; ++k)
    PM_TRY_STATUS(step(k - 1, k));
  return Ok{};
}

/// Repairs the mesh at every time. If that is not enough, divides it again and checks all times
/// once more.
Result<CarriedMesh> Carrier::result() {
  constexpr int kPasses = 4;
  bool is_divided = !hopeless_;
  for (int pass = 0; pass < kPasses && is_divided; ++pass) {
    is_divided = false;
    std::vector<std::size_t> broken;
    for (std::size_t k = 0; k < points_.size(); ++k) {
      const Activity activity(stage_name("checking", k));
      if (!is_good(states_[k].fault)) {
        broken.push_back(k);
      } else if (states_[k].is_changed) {
        PM_TRY(const CarryTarget target, surface_.at(times_[k]));
        meter_.emplace(target, settings_.limit);
        set_state(k, measure(points_[k], states_[k].near));
        log_debug("time {}: {:.2f} of the limit after collapses, {} inverted", k,
                  states_[k].fault.distance / settings_.limit, states_[k].fault.inverted);
        if (!is_good(states_[k].fault)) broken.push_back(k);
      } else if (states_[k].points < points_[k].size()) {  // new halves may be inverted
        PM_TRY(const CarryTarget target, surface_.at(times_[k]));
        if (!is_good_after_divisions(k, target)) broken.push_back(k);
      }
    }
    for (const std::size_t k : broken) {
      const Activity activity(stage_name("repairing", k));
      PM_TRY(const CarryTarget target, surface_.at(times_[k]));
      meter_.emplace(target, settings_.limit);
      PM_TRY_STATUS(improve_without_division(k, target));
      if (is_good(states_[k].fault) || pass + 1 == kPasses) continue;
      const std::size_t old_count = triangles_.size();
      finish(k, target);
      PM_TRY_STATUS(status_);
      is_divided |= triangles_.size() != old_count ||
                    std::any_of(states_.begin(), states_.end(),
                                [](const State& state) { return state.is_changed; });
    }
  }
  CarriedMesh carried;
  for (const State& state : states_) carried.faults.push_back(state.fault);
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
