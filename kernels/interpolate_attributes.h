// Attribute interpolation: the values that balls carry (colour, texture coordinates, motion),
// weighted at each point by the balls' shares of the field.
//
// A ball's share is its contribution to the field divided by the sum of all contributions. Balls
// that contribute less than kMinShare times the largest contribution are left out. Neighbouring
// points share a list of the balls that can matter in the box around them. By the bounds of
// falloff.h, all other balls are below kMinShare at each of these points, so that the list changes
// no bit.
#pragma once

#include <cstdint>

#include "engine.h"
#include "falloff.h"
#include "field.h"
#include "host_device.h"
#include "view.h"

namespace polymorph {

constexpr float kMinShare = 1e-4f;

/// Writes the interpolated values at kRun neighbouring points (a run). One team per run. A ball and
/// a point have kMaps quadruples of values each. The points of a run lie in as many boxes as V has
/// lanes, and each ball is tested against all of them at once. The last run repeats points in place
/// of missing ones.
template <class F, class V, int kMaps>
struct InterpolateAttributes {
  static constexpr int kThreads = 128;
  static constexpr int kBoxes = Lanes<V>::kCount, kPointsPerBox = kBoxes > 1 ? 32 : 128;
  static constexpr int kRun = kBoxes * kPointsPerBox;
  static constexpr std::uint32_t kMaxNear = 2048;  ///< maximum number of balls in a box's list
  struct Scratch {
    std::uint32_t near[kBoxes * kMaxNear];  ///< lists of ball indices, kMaxNear per box
    std::uint32_t
        count[kBoxes];  ///< per box; kMaxNear + 1: the list is full, so all balls are used
  };
  View<const Vec3> points;
  View<const typename F::Ball> balls;
  BallList all_balls;
  View<const BallAttribute> attributes;  ///< kMaps per ball
  View<AttributeValues> out;             ///< kMaps per point

  template <class Team>
  PM_HD void operator()(const Team& team, Scratch& scratch, std::int64_t run) const {
    constexpr int kLanes = Lanes<V>::kCount;
    const std::int64_t begin = run * kRun, remaining = points.size - begin;
    const int n = remaining < kRun ? static_cast<int>(remaining) : kRun;
    team.each_group(1, [&](int) { list_near(team, scratch, begin, n); });
    team.sync();
    team.each((n + kLanes - 1) / kLanes, [&](int item) {
      const int first = item * kLanes, box = first / kPointsPerBox;
      BallList list = {scratch.near + box * kMaxNear, scratch.count[box]};
      if (list.count > kMaxNear) list = all_balls;
      interpolate(list, begin + first, n - first < kLanes ? n - first : kLanes);
    });
  }

  /// Lists the balls that matter in each box, in ascending order. The boxes surround kPointsPerBox
  /// points each, of the n points from index `begin` on. The function finds the boxes first, then a
  /// threshold for each box, and then the balls whose contribution may exceed it.
  template <class Team>
  PM_HD void list_near(const Team& team, Scratch& scratch, std::int64_t begin, int n) const {
    const std::uint32_t rank = team.group_rank();
    alignas(32) float bounds[6][kBoxes];
    for (int box = 0; box < kBoxes; ++box) {
      const auto point = [&](int i) {
        const int k = box * kPointsPerBox + i;
        return points[begin + (k < n ? k : n - 1)];
      };
      Vec3 low = point(0), high = low;
      for (int i = static_cast<int>(rank); i < kPointsPerBox; i += static_cast<int>(Team::kGroup)) {
        low = min(low, point(i)), high = max(high, point(i));
      }
      bounds[0][box] = -team.group_max(-low.x), bounds[1][box] = team.group_max(high.x);
      bounds[2][box] = -team.group_max(-low.y), bounds[3][box] = team.group_max(high.y);
      bounds[4][box] = -team.group_max(-low.z), bounds[5][box] = team.group_max(high.z);
    }
    const CoordinateRange<V> boxes = {Lanes<V>::load(bounds[0]), Lanes<V>::load(bounds[1]),
                                      Lanes<V>::load(bounds[2]), Lanes<V>::load(bounds[3]),
                                      Lanes<V>::load(bounds[4]), Lanes<V>::load(bounds[5])};
    const auto range = [&](std::uint32_t j) { return balls[j].range(boxes); };
    // A lower bound of the largest contribution at every point of a box.
    V strongest = broadcast<V>(0.0f);
    for (std::uint32_t j = rank; j < all_balls.count; j += Team::kGroup) {
      strongest = max(strongest, F::Kind::share(balls[j], range(j).far));
    }
    // The factor 0.999 is needed because the polynomial of exp2() is not quite monotone.
    const V threshold = 0.999f * kMinShare * team.group_max(strongest);
    std::int64_t cursor[kBoxes], end[kBoxes];
    for (int box = 0; box < kBoxes; ++box) {
      cursor[box] = box * std::int64_t{kMaxNear}, end[box] = cursor[box] + kMaxNear;
    }
    std::uint32_t full_boxes = 0;
    for (std::uint32_t j0 = 0; j0 < all_balls.count; j0 += Team::kGroup) {
      const std::uint32_t j = j0 + rank;
      // A box whose list has no room for another ball of each thread is full.
      for (int box = 0; box < kBoxes; ++box) {
        full_boxes |= (cursor[box] + Team::kGroup > end[box] ? 1u : 0u) << box;
      }
      const std::uint32_t relevant_boxes =
          j < all_balls.count ? Lanes<V>::bits(F::Kind::share(balls[j], range(j).near) > threshold)
                              : 0;
      team.append(relevant_boxes & ~full_boxes, cursor,
                  [&](std::int64_t slot) { scratch.near[slot] = j; });
    }
    if (!team.leads_group()) return;
    for (int box = 0; box < kBoxes; ++box) {
      scratch.count[box] = full_boxes >> box & 1u
                               ? kMaxNear + 1
                               : static_cast<std::uint32_t>(cursor[box] + kMaxNear - end[box]);
    }
  }

  /// Interpolates the attributes of the listed balls at the n points from index `first` on.
  PM_HD void interpolate(BallList list, std::int64_t first, int n) const {
    constexpr int kLanes = Lanes<V>::kCount;
    alignas(32) float p[3][kLanes];
    for (int l = 0; l < kLanes; ++l) {
      const Vec3 point = points[first + (l < n ? l : 0)];
      p[0][l] = point.x, p[1][l] = point.y, p[2][l] = point.z;
    }
    const Points<V> at = {Lanes<V>::load(p[0]), Lanes<V>::load(p[1]), Lanes<V>::load(p[2])};
    V strongest = broadcast<V>(0.0f);
    for (std::uint32_t j = 0; j < list.count; ++j) {
      const typename F::Ball ball = balls[list.indices[j]];
      strongest = max(strongest, F::Kind::share(ball, ball.q(at.x, at.y, at.z)));
    }
    const V threshold = kMinShare * strongest;
    V sum = broadcast<V>(0.0f), value[4 * kMaps];
    for (V& v : value) v = broadcast<V>(0.0f);
    for (std::uint32_t j = 0; j < list.count; ++j) {
      const std::uint32_t ball_index = list.indices[j];
      const typename F::Ball ball = balls[ball_index];
      const V contribution = F::Kind::share(ball, ball.q(at.x, at.y, at.z));
      const auto significant = contribution > threshold;
      if (Lanes<V>::bits(significant) == 0) continue;
      const V weight = zero_unless(significant, contribution);
      sum = sum + weight;
      add<V>(ball_index, weight, {at.x - ball.x, at.y - ball.y, at.z - ball.z}, value);
    }
    const std::uint32_t reached = Lanes<V>::bits(sum > 0.0f);
    for (int k = 0; k < 4 * kMaps; ++k) {
      alignas(32) float lanes[kLanes];
      Lanes<V>::store(lanes, value[k] / sum);
      for (int l = 0; l < n; ++l) out[(first + l) * kMaps + k / 4].v[k % 4] = lanes[l];
    }
    for (int l = 0; l < n; ++l) {
      if (!(reached >> l & 1u)) take_nearest(first + l);
    }
  }

  /// Adds the attributes of ball e, times `weight`, at the offset d from its centre.
  template <class T>
  PM_HD void add(std::uint32_t e, T weight, const Points<T>& d, T (&value)[4 * kMaps]) const {
    for (int k = 0; k < 4 * kMaps; ++k) {
      const BallAttribute& attribute = attributes[std::int64_t{e} * kMaps + k / 4];
      const Vec3 slope = attribute.slope[k % 4];
      T local_value = fma(broadcast<T>(slope.z), d.z, broadcast<T>(attribute.value[k % 4]));
      local_value = fma(broadcast<T>(slope.x), d.x, fma(broadcast<T>(slope.y), d.y, local_value));
      value[k] = fma(weight, local_value, value[k]);
    }
  }

  /// Takes the values of the nearest ball, for a point that no ball reaches.
  PM_HD void take_nearest(std::int64_t at) const {
    const Vec3 p = points[at];
    std::uint32_t nearest = 0;
    float q = kInfinity;
    for (std::uint32_t j = 0; j < all_balls.count; ++j) {
      const float ball_q = balls[j].q(p.x, p.y, p.z);
      if (ball_q < q) q = ball_q, nearest = j;
    }
    const typename F::Ball ball = balls[nearest];
    float value[4 * kMaps] = {};
    add<float>(nearest, 1.0f, {p.x - ball.x, p.y - ball.y, p.z - ball.z}, value);
    for (int k = 0; k < 4 * kMaps; ++k) out[at * kMaps + k / 4].v[k % 4] = value[k];
  }
};

}  // namespace polymorph
