// Far-field expansion pass: makes a node's polynomial (far_field.h) from its parent's, one team per
// node.
#pragma once

#include <cstdint>

#include "falloff.h"
#include "far_field.h"
#include "host_device.h"
#include "simd_math.h"
#include "tree.h"
#include "types.h"
#include "view.h"

namespace polymorph {

/// A distant ball, relative to the middle of the node, in units of FieldScale::length.
struct alignas(16) FarBall {
  float x, y, z, w;
};

/// Computes the far field of each node of a level.
template <class F>
struct ExpandFarField {
  static constexpr int kThreads = 64;
  static constexpr int kChunk = 64;  ///< entries of the parent's list per step
  struct Scratch {
    FarBall far[kChunk];
    std::uint32_t slot[kChunk + 1];  ///< per entry: its index among the chunk's distant balls
    /// Coordinates of the points, in the units of a FarBall.
    alignas(32) float x[kFarPoints], y[kFarPoints], z[kFarPoints];
    alignas(32) float value[kFarPoints];
    /// Partial sums of FarField's error, second_derivative_bound, magnitude and
    /// negative_weight_bound:
    /// terms[k][i] sums over entry i of each chunk, so that all backends add in the same order.
    alignas(32) float terms[4][kChunk];
    float sum[4];  ///< totals of `terms`
  };
  Grid grid;
  Level level;
  View<const Node> parents;
  View<const Node> nodes;
  View<const std::uint32_t> entries;  ///< the parents' lists
  View<const typename F::Ball> balls;
  View<const FarField> parent_far;  ///< per parent
  View<FarField> out;               ///< per node

  /// Starts from the parent's polynomial, adds the distant balls of the parent's list chunk by
  /// chunk, and then adds up the bounds. The factors 1.0001 allow for rounding.
  template <class Team>
  PM_HD void operator()(const Team& team, Scratch& scratch, std::int64_t n) const {
    using V = typename Team::V;
    constexpr int kLanes = Lanes<V>::kCount;
    const Node node = nodes[n], parent = parents[node.parent];
    const NodeBox bounds = node_box(grid, level.cells, level.margin, node.at);
    const FarBox box(bounds.low, bounds.high);
    initialize(team, scratch, node, parent, box);
    const std::uint32_t* list = entries.data + parent.begin;
    for (std::uint32_t j = 0; j < parent.count; j += kChunk) {
      const auto remaining = static_cast<int>(parent.count - j);
      team.each(kChunk / kLanes, [&](int item) {
        mark_distant<V>(scratch, bounds, list + j, remaining, item * kLanes);
      });
      team.sync();
      const auto count = static_cast<int>(team.scan(scratch.slot, kChunk));
      if (count == 0) continue;
      team.each(kChunk, [&](int i) {
        const auto slot = static_cast<int>(scratch.slot[i]);
        if (static_cast<int>(scratch.slot[i + 1]) > slot) {
          const RoundBall ball = balls[list[j + static_cast<std::uint32_t>(i)]];
          scratch.far[slot] = {ball.scale * (ball.x - box.middle.x),
                               ball.scale * (ball.y - box.middle.y),
                               ball.scale * (ball.z - box.middle.z), ball.w};
        }
        // Balls of weight 0 fill up the last batch.
        if (i >= count && i / kBatch == (count - 1) / kBatch) scratch.far[i] = {};
      });
      team.sync();
      team.each(kFarPoints / kLanes,
                [&](int item) { add_balls<V>(scratch, count, item * kLanes); });
    }
    team.sync();
    team.each(4, [&](int k) {
      float sum = 0;
      for (int i = 0; i < kChunk; ++i) sum = sum + scratch.terms[k][i];
      scratch.sum[k] = sum;
    });
    team.each(kFarPoints, [&](int i) { out[n].value[i] = scratch.value[i]; });
    team.sync();
    team.each(1, [&](int) {
      const FarField& inherited = parent_far[node.parent];
      const float magnitude = inherited.magnitude + scratch.sum[2];
      // The relative bound of the rounding errors of the sums at the points, of the weights, and of
      // the weighted sums; between the points each error is at most 6.3 times as large.
      const float rounding = 0x1p-24f * (1200.0f + 2.0f * static_cast<float>(parent.count));
      out[n].error = 1.0001f * (inherited.error + scratch.sum[0]);
      out[n].rounding = fma(rounding, magnitude, inherited.rounding);
      out[n].second_derivative_bound = inherited.second_derivative_bound + 1.0001f * scratch.sum[1];
      out[n].magnitude = magnitude;
      out[n].negative_weight_bound = scratch.sum[3];
    });
  }

  /// Initialises the points, their values (the parent's polynomial there) and the terms (0).
  template <class Team>
  PM_HD void initialize(const Team& team, Scratch& scratch, const Node& node, const Node& parent,
                        const FarBox& box) const {
    using V = typename Team::V;
    constexpr int kLanes = Lanes<V>::kCount;
    const FarBox parent_box = far_box(grid, kBranching * level.cells, level.margin, parent.at);
    const float scale = balls[0].scale;
    team.each(kFarPoints, [&](int i) {
      scratch.x[i] = scale * (box.half.x * far_point(i % kFarAlong));
      scratch.y[i] = scale * (box.half.y * far_point(i / kFarAlong % kFarAlong));
      scratch.z[i] = scale * (box.half.z * far_point(i / kFarAlong / kFarAlong));
    });
    team.each(4 * kChunk, [&](int i) { scratch.terms[i / kChunk][i % kChunk] = 0; });
    team.sync();
    const FarField& far = parent_far[node.parent];
    const Vec3 shift = box.middle - parent_box.middle;
    team.each(kFarPoints / kLanes, [&](int item) {
      const float inv_scale = 1.0f / scale;
      const auto load = [&](const float* array) { return Lanes<V>::load(array + item * kLanes); };
      const V value =
          far_value<V>(far.value, parent_box.inverse.x * (shift.x + inv_scale * load(scratch.x)),
                       parent_box.inverse.y * (shift.y + inv_scale * load(scratch.y)),
                       parent_box.inverse.z * (shift.z + inv_scale * load(scratch.z)));
      Lanes<V>::store(scratch.value + item * kLanes, value);
    });
  }

  /// Marks the distant balls among the chunk's entries from position `at` on, and adds their bounds
  /// to the terms. `remaining`: number of entries from the chunk's first to the end of the list.
  template <class V>
  PM_HD void mark_distant(Scratch& scratch, const NodeBox& box, const std::uint32_t* list,
                          int remaining, int at) const {
    constexpr int kLanes = Lanes<V>::kCount;
    alignas(32) float x[kLanes], y[kLanes], z[kLanes], w[kLanes];
    for (int l = 0; l < kLanes; ++l) {
      const RoundBall ball = at + l < remaining ? balls[list[at + l]] : RoundBall{};
      x[l] = ball.x, y[l] = ball.y, z[l] = ball.z, w[l] = ball.w;
    }
    const float scale = balls[0].scale, scale_squared = balls[0].scale_squared,
                base = balls[0].base;
    const V cx = Lanes<V>::load(x), cy = Lanes<V>::load(y), cz = Lanes<V>::load(z);
    const V weight = Lanes<V>::load(w), zero = broadcast<V>(0.0f);
    const QRange<V> q =
        q_range<V>({scale * (box.low.x - cx), scale * (box.high.x - cx), scale * (box.low.y - cy),
                    scale * (box.high.y - cy), scale * (box.low.z - cz), scale * (box.high.z - cz)},
                   base);
    const auto near = is_near(weight, q, level.reach);
    const V inverse = 1.0f / q.near, size = max(weight, -weight) * inverse;
    const V terms[4] = {select(near, zero, level.truncation * (size * (inverse * inverse))),
                        select(near, zero, (3.0f * scale_squared) * (size * inverse)),
                        select(near, zero, size), select(near & (weight < 0.0f), size, zero)};
    for (int k = 0; k < 4; ++k) {
      float* to = scratch.terms[k] + at;
      Lanes<V>::store(to, Lanes<V>::load(to) + terms[k]);
    }
    const std::uint32_t far = ~Lanes<V>::bits(near);
    for (int l = 0; l < kLanes; ++l) {
      scratch.slot[at + l] = at + l < remaining ? far >> l & 1u : 0;
    }
  }

  /// Adds the values of `count` distant balls at the points from index `at` on.
  template <class V>
  PM_HD void add_balls(Scratch& scratch, int count, int at) const {
    const V x = Lanes<V>::load(scratch.x + at), y = Lanes<V>::load(scratch.y + at),
            z = Lanes<V>::load(scratch.z + at), base = broadcast<V>(kMinDistance2);
    V sum = Lanes<V>::load(scratch.value + at);
    for (int j = 0; j < count; j += kBatch) {
      FarBall batch[kBatch];
      V q[kBatch];
      for (int i = 0; i < kBatch; ++i) {
        batch[i] = scratch.far[j + i];
        const V ux = x - batch[i].x, uy = y - batch[i].y, uz = z - batch[i].z;
        q[i] = fma(ux, ux, fma(uy, uy, fma(uz, uz, base)));
      }
      sum = sum + sum_of_batch(batch, q);
    }
    Lanes<V>::store(scratch.value + at, sum);
  }
};

}  // namespace polymorph
