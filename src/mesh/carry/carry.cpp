#include "mesh/carry/carry.h"

#include <algorithm>
#include <optional>

#include "base/log.h"
#include "mesh/carry/carry_measure.h"
#include "mesh/carry/carry_moves.h"
#include "mesh/carry/divide.h"
#include "mesh/carry/patch_map.h"

namespace polymorph {
namespace {

/// How many cells a surface may be from where the flow leads, before a step is halved.
constexpr float kMaxStep = 0.7f;
/// Shares of the limit: what is improved where it can be, and what ends the work at a moment.
constexpr float kEnough = 0.7f, kGood = 0.9f;

float longest_edge(std::span<const Vec3> points, const Triangle& t) {
  return std::max({length(points[t.v[1]] - points[t.v[0]]), length(points[t.v[2]] - points[t.v[1]]),
                   length(points[t.v[0]] - points[t.v[2]])});
}

/// The meshes of several moments, all of the same triangles.
class Carrier {
 public:
  Carrier(const MovingSurface& surface, std::span<const float> moments,
          const CarrySettings& settings)
      : surface_(surface), moments_(moments), settings_(settings), points_(moments.size()) {}

  Status run(std::size_t start);
  Result<CarriedMesh> result();

 private:
  using Points = std::vector<Vec3>;

  MovedMesh moved(Points& points) const { return {points, triangles_, fans_}; }
  CarryMeasure measure(const Points& points) { return meter_->measure(points, triangles_); }
  bool is_good(const CarryFault& fault) const {
    return fault.inverted == 0 && fault.distance <= settings_.limit;
  }
  Status step(std::size_t from, std::size_t to);
  Status advance(Points& points, float from, float to, const CarryTarget& target, int depth);
  CarryMeasure place(Points& points, const CarryTarget& target, int steps);
  void map_patches(Points& points, const CarryTarget& target, CarryMeasure& m);
  CarryMeasure improve(Points& points, const CarryTarget& target,
                       const std::vector<std::uint32_t>& fresh, const CarryMeasure& last);
  CarryFault finish(std::size_t k, const CarryTarget& target);
  void divide(std::size_t k, std::vector<std::uint32_t> chosen);
  CarryFault mend(Points& points, const CarryTarget& target);

  const MovingSurface& surface_;
  std::span<const float> moments_;
  CarrySettings settings_;
  std::vector<Triangle> triangles_;
  Fans fans_;
  std::vector<Points> points_;
  std::optional<CarryMeter> meter_;  ///< of the moment that is worked on
  std::vector<float> residual_;      ///< how far each point was off the surface when a step began
};

Status Carrier::advance(Points& points, float from, float to, const CarryTarget& target,
                        int depth) {
  constexpr int kDepth = 5, kSweeps = 3;
  PM_TRY(Points there, surface_.flow(points, from, to));
  std::vector<std::uint32_t> near;
  const Footprint foot = footprint(there, target, near);
  float far = 0;
  for (std::size_t i = 0; i < there.size(); ++i)
    far = std::max(far, length(foot.points[i] - there[i]) - residual_[i]);
  const bool is_torn = std::any_of(triangles_.begin(), triangles_.end(), [&](const Triangle& t) {
    const Vec3 n = normalized(foot.normals[t.v[0]] + foot.normals[t.v[1]] + foot.normals[t.v[2]]);
    return !(shape_of(there[t.v[0]], there[t.v[1]], there[t.v[2]], n) > 0);
  });
  if (depth < kDepth && (far > kMaxStep * settings_.cell || is_torn)) {
    const float middle = 0.5f * (from + to);
    PM_TRY(const CarryTarget half, surface_.at(middle));
    PM_TRY_STATUS(advance(points, from, middle, half, depth + 1));
    return advance(points, middle, to, target, depth + 1);
  }
  points = std::move(there);
  for (int k = std::min(depth, kSweeps - 1); k < kSweeps; ++k)
    sweep(moved(points), target, kRelax, near);
  repair(moved(points), target, 0.3f * settings_.cell, near);
  const std::vector<ClosestPoint> rest = target.query().closest(points, near);
  for (std::size_t i = 0; i < rest.size(); ++i) residual_[i] = rest[i].distance;
  return Ok{};
}

/// Puts points onto the surface and towards what they miss.
CarryMeasure Carrier::place(Points& points, const CarryTarget& target, int steps) {
  CarryMeasure m;
  std::vector<std::uint32_t> near;
  for (int step = 0;; ++step) {
    sweep(moved(points), target, 0, near);
    m = measure(points);
    if (m.fault.distance < kEnough * settings_.limit || step + 1 == steps) break;
    reach(moved(points), target, m.misses, m.near);
    near = std::move(m.near);
  }
  // repair() moves points although it leaves nothing inverted.
  const Points before = points;
  repair(moved(points), target, kEnough * settings_.limit, m.near);
  return points == before ? m : measure(points);
}

/// Maps the patches around what is inverted or too far off, where that is better.
void Carrier::map_patches(Points& points, const CarryTarget& target, CarryMeasure& m) {
  for (const int rings : {7, 12}) {
    std::vector<std::uint32_t> seeds = m.inverted;
    for (std::uint32_t f = 0; f < triangles_.size(); ++f)
      if (m.of_triangle[f] > settings_.limit) seeds.push_back(f);
    if (seeds.empty()) return;
    Points mapped = points;
    if (polymorph::map_patches(mapped, triangles_, seeds, rings, target, m.mesh_near) == 0)
      continue;
    repair(moved(mapped), target, kEnough * settings_.limit, m.near, seeds);
    CarryMeasure after = measure(mapped);
    if (is_better(after.fault, m.fault)) m = std::move(after), points = std::move(mapped);
    if (m.fault.inverted == 0) return;
  }
}

/// One round of moves at a moment. `fresh`: triangles that the division before made; `last`: what
/// it found.
CarryMeasure Carrier::improve(Points& points, const CarryTarget& target,
                              const std::vector<std::uint32_t>& fresh, const CarryMeasure& last) {
  const bool is_first = fresh.empty();
  Points before = points;
  if (!is_first) repair(moved(points), target, kEnough * settings_.limit, last.near, fresh);
  CarryMeasure m = place(points, target, is_first ? 3 : 2);
  map_patches(points, target, m);
  if (!is_first && is_better(last.fault, m.fault)) {
    // Neither relaxing nor mapping helped here; reaching alone may.
    CarryMeasure after = place(before, target, 2);
    if (is_better(after.fault, m.fault)) m = std::move(after), points = std::move(before);
  }
  return m;
}

/// Halves triangles at all moments, by their edges at the moment `k`, and what is long of them.
void Carrier::divide(std::size_t k, std::vector<std::uint32_t> chosen) {
  constexpr int kTimes = 3;
  for (int time = 0; time < kTimes && !chosen.empty() &&
                     triangles_.size() + 2 * chosen.size() <= settings_.max_triangles;
       ++time) {
    const std::size_t old = points_[k].size();
    Division division = halve_triangles(points_[k], triangles_, chosen);
    triangles_ = std::move(division.triangles);
    for (Points& points : points_)
      if (!points.empty())
        for (const auto& [a, b] : division.halved) points.push_back((points[a] + points[b]) * 0.5f);
    chosen.clear();
    for (std::uint32_t f = 0; f < triangles_.size(); ++f) {
      const Triangle& t = triangles_[f];
      if (std::max({t.v[0], t.v[1], t.v[2]}) >= old &&
          longest_edge(points_[k], t) > 1.5f * settings_.cell)
        chosen.push_back(f);
    }
  }
  fans_ = Fans(points_[k].size(), triangles_);
}

/// Improves the mesh at a moment, dividing what is too large, until it is near enough.
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
    std::vector<std::uint32_t> coarse;
    for (std::uint32_t f = 0; f < triangles_.size(); ++f)
      if (m.of_triangle[f] > kEnough * settings_.limit &&
          longest_edge(points, triangles_[f]) > 1.5f * m.of_triangle[f])
        coarse.push_back(f);
    // What moves alone do not turn over may be too large for the rim or the groove that it is at.
    if (round >= kMovesAlone)
      for (const std::uint32_t f : m.inverted)
        if (longest_edge(points, triangles_[f]) > kSmallest * settings_.limit) coarse.push_back(f);
    log_debug(
        "moment {}, round {}: {} triangles, {:.2f} of the limit at ({:.3f}, {:.3f}, {:.3f}), "
        "{} inverted, {} to divide",
        k, round, triangles_.size(), m.fault.distance / settings_.limit, m.fault.place.x,
        m.fault.place.y, m.fault.place.z, m.fault.inverted, coarse.size());
    const bool is_done = m.fault.distance < kGood * settings_.limit && m.fault.inverted == 0;
    const bool is_stuck = round > kMovesAlone && coarse.empty();
    if (is_done || is_stuck || round == kRounds ||
        triangles_.size() + 2 * coarse.size() > settings_.max_triangles)
      return m.fault;
    const std::size_t old = points.size();
    divide(k, coarse);
    fresh.clear();
    for (std::uint32_t f = 0; f < triangles_.size(); ++f)
      if (std::max({triangles_[f].v[0], triangles_[f].v[1], triangles_[f].v[2]}) >= old)
        fresh.push_back(f);
  }
}

/// Mends, without dividing any more, what the divisions of other moments brought up.
CarryFault Carrier::mend(Points& points, const CarryTarget& target) {
  constexpr int kTries = 6;
  meter_.emplace(target, settings_.limit);
  CarryMeasure best = measure(points);
  // Points that other moments asked for lie on their edges still.
  Points tried = points;
  std::vector<std::uint32_t> near = best.near;
  sweep(moved(tried), target, 0, near);
  CarryMeasure m = measure(tried);
  for (int k = 0;; ++k) {
    if (is_good(m.fault) || is_better(m.fault, best.fault)) best = m, points = tried;
    if (is_good(best.fault) || k == kTries) return best.fault;
    tried = points;
    m = best;
    if (k % 2 == 0) {
      // Around single triangles a few moves mostly do.
      repair(moved(tried), target, kEnough * settings_.limit, m.near, m.inverted);
      m = measure(tried);
      if (m.fault.distance > settings_.limit) {
        reach(moved(tried), target, m.misses, m.near);
        m = measure(tried);
      }
    } else {
      map_patches(tried, target, m);
    }
  }
}

Status Carrier::step(std::size_t from, std::size_t to) {
  residual_.assign(points_[from].size(), 0.0f);
  PM_TRY(const CarryTarget target, surface_.at(moments_[to]));
  Points points = points_[from];
  PM_TRY_STATUS(advance(points, moments_[from], moments_[to], target, 0));
  points_[to] = std::move(points);
  finish(to, target);
  return Ok{};
}

Status Carrier::run(std::size_t start) {
  constexpr int kSweeps = 12;
  PM_TRY(const CarryTarget target, surface_.at(moments_[start]));
  triangles_ = target.surface.triangles;
  points_[start] = target.surface.positions;
  fans_ = Fans(points_[start].size(), triangles_);
  // Marching cubes leave slivers.
  std::vector<std::uint32_t> near;
  for (int k = 0; k < kSweeps; ++k) sweep(moved(points_[start]), target, kRelax, near);
  finish(start, target);
  for (std::size_t k = start; k-- > 0;) PM_TRY_STATUS(step(k + 1, k));
  for (std::size_t k = start + 1; k < moments_.size(); ++k) PM_TRY_STATUS(step(k - 1, k));
  return Ok{};
}

/// Mends every moment; where that does not do, the mesh is divided again, and all are looked at
/// once more.
Result<CarriedMesh> Carrier::result() {
  constexpr int kPasses = 4;
  CarriedMesh carried;
  carried.faults.resize(points_.size());
  bool is_divided = true;
  for (int pass = 0; pass < kPasses && is_divided; ++pass) {
    is_divided = false;
    for (std::size_t k = 0; k < points_.size(); ++k) {
      PM_TRY(const CarryTarget target, surface_.at(moments_[k]));
      carried.faults[k] = mend(points_[k], target);
      if (is_good(carried.faults[k]) || pass + 1 == kPasses) continue;
      const std::size_t before = triangles_.size();
      carried.faults[k] = finish(k, target);
      is_divided |= triangles_.size() > before;
    }
  }
  carried.points = std::move(points_);
  carried.triangles = std::move(triangles_);
  return carried;
}

}  // namespace

Result<CarriedMesh> carry(const MovingSurface& surface, std::span<const float> moments,
                          std::size_t start, const CarrySettings& settings) {
  Carrier carrier(surface, moments, settings);
  PM_TRY_STATUS(carrier.run(start));
  return carrier.result();
}

}  // namespace polymorph
