// Evaluation of the metaball field and its gradient at points: sums over a list of balls, in
// ascending order of their indices.
//
// Two lists give the same bits at a point when they differ only in balls that contribute exactly 0
// there: all sums start at +0 and adding 0 changes no float. The lists of a brick hold every ball
// that reaches any of its points (tree.h), so a point shared by several bricks has one value, and
// it is the value of the sum over all balls. With infinite support, a brick's value is the sum of
// its list and its polynomial. Then bricks differ by rounding and by the error of far_field.h, but
// bricks.h makes them agree on which points are inside.
//
// In a separable field, the value at a grid point is a sum of products of one factor per axis.
// Between grid points, which cannot share factors, it is a sum of single powers. The two differ by
// rounding.
#pragma once

#include <cstdint>

#include "falloff.h"
#include "far_field.h"
#include "host_device.h"
#include "tree.h"
#include "view.h"

namespace polymorph {

/// Ball indices in ascending order.
struct BallList {
  const std::uint32_t* indices = nullptr;
  std::uint32_t count = 0;
};

/// Returns as many points of a grid line as V has lanes, from grid point `start` on along x.
template <class V>
PM_HD inline Points<V> line_points(const Grid& grid, Int3 start) {
  const V x = Lanes<V>::iota() + static_cast<float>(start.x);
  const Vec3 start_point = grid_point(grid, start);
  return {grid.origin.x + grid.cell * x, broadcast<V>(start_point.y), broadcast<V>(start_point.z)};
}

/// Returns as many points of a brick as V has lanes, from point `lanes * item` on: a part of a line
/// along x. `first`: the brick's lowest grid point.
template <class V>
PM_HD inline Points<V> brick_points(const Grid& grid, Int3 first, int item) {
  constexpr int kLanes = Lanes<V>::kCount;
  const int line = item * kLanes / kBrickPoints;
  return line_points<V>(grid, {first.x + item * kLanes % kBrickPoints,
                               first.y + line % kBrickPoints, first.z + line / kBrickPoints});
}

#if defined(PM_PACKS)
/// Returns the eight corners of the brick whose lowest grid point is `first`.
inline Points<Pack> brick_corners(const Grid& grid, Int3 first) {
  const Vec3 a = grid_point(grid, first),
             b = grid_point(grid,
                            {first.x + kBrickCells, first.y + kBrickCells, first.z + kBrickCells});
  return {Pack{a.x, b.x, a.x, b.x, a.x, b.x, a.x, b.x},
          Pack{a.y, a.y, b.y, b.y, a.y, a.y, b.y, b.y},
          Pack{a.z, a.z, a.z, a.z, b.z, b.z, b.z, b.z}};
}

/// The 8^3 points of a box that is aligned with the axes. The index of point (x, y, z) is
/// x + 8 (y + 8 z).
struct BoxPoints {
  Points<Pack> axes;  ///< the coordinates along each axis, in ascending order

  /// Returns as many points as V has lanes.
  template <class V>
  Points<V> at(const std::uint32_t* points) const {
    const auto index = Lanes<V>::load_bits(points);
    return {permute(axes.x, index % kBrickPoints),
            permute(axes.y, index / kBrickPoints % kBrickPoints),
            permute(axes.z, index / (kBrickPoints * kBrickPoints))};
  }
};
/// Returns the points of the brick whose lowest grid point is `first`.
inline BoxPoints brick_box(const Grid& grid, Int3 first) {
  const auto axis = [&](float origin, int index) {
    return origin + grid.cell * (Lanes<Pack>::iota() + static_cast<float>(index));
  };
  return {
      {axis(grid.origin.x, first.x), axis(grid.origin.y, first.y), axis(grid.origin.z, first.z)}};
}
#endif

/// Computes q of each ball of a batch, clamped to kMaxDistance2.
template <class V>
PM_HD inline void batch_q(const RoundBall (&batch)[kBatch], const Points<V>& p, V (&q)[kBatch]) {
  for (int i = 0; i < kBatch; ++i) {
    q[i] = min(batch[i].q(p.x, p.y, p.z), broadcast<V>(kMaxDistance2));
  }
}

/// Evaluates the field of the balls in a list.
template <class F, class V>
PM_HD inline V field_at(const Points<V>& p, const typename F::Ball* balls, BallList list) {
  V sum = broadcast<V>(0.0f);
  if constexpr (!F::kCompactSupport) {
    for (std::uint32_t j = 0; j < list.count; j += kBatch) {
      RoundBall batch[kBatch];
      V q[kBatch];
      load_batch(balls, list.indices + j, list.count - j, batch);
      batch_q(batch, p, q);
      sum = sum + sum_of_batch(batch, q);
    }
  } else {
    for (std::uint32_t j = 0; j < list.count; ++j) {
      const typename F::Ball ball = balls[list.indices[j]];
      sum = sum + F::value(ball, ball.q(p.x, p.y, p.z));
    }
  }
  return sum;
}

/// Evaluates the field at points of the grid. The result is that of field_at(), but a separable
/// field is summed by add_product().
template <class F, class V>
PM_HD inline V grid_field_at(const Points<V>& p, const typename F::Ball* balls, BallList list) {
  if constexpr (F::kSeparable) {
    V sum = broadcast<V>(0.0f);
    for (std::uint32_t j = 0; j < list.count; ++j) {
      sum = add_product(sum, balls[list.indices[j]], p.x, p.y, p.z);
    }
    return sum;
  } else {
    return field_at<F>(p, balls, list);
  }
}

/// Returns minus the field's gradient, up to a positive factor; it points outward at the surface.
template <class F, class V>
PM_HD inline Points<V> negated_gradient_at(const Points<V>& p, const typename F::Ball* balls,
                                           BallList list) {
  Points<V> sum = {broadcast<V>(0.0f), broadcast<V>(0.0f), broadcast<V>(0.0f)};
  if constexpr (!F::kCompactSupport) {
    for (std::uint32_t j = 0; j < list.count; j += kBatch) {
      RoundBall batch[kBatch];
      V q[kBatch];
      load_batch(balls, list.indices + j, list.count - j, batch);
      batch_q(batch, p, q);
      const V d01 = q[0] * q[1], d23 = q[2] * q[3], inv_product = 1.0f / (d01 * d23);
      const V inv_d01 = d23 * inv_product, inv_d23 = d01 * inv_product;
      // inverse[i] = 1 / q[i], with one division for the batch.
      const V inverse[kBatch] = {q[1] * inv_d01, q[0] * inv_d01, q[3] * inv_d23, q[2] * inv_d23};
      for (int i = 0; i < kBatch; ++i) {
        const V negated_derivative = batch[i].w * (inverse[i] * inverse[i]);
        const Points<V> g = batch[i].half_gradient_of_q(p);
        sum.x = fma(negated_derivative, g.x, sum.x), sum.y = fma(negated_derivative, g.y, sum.y);
        sum.z = fma(negated_derivative, g.z, sum.z);
      }
    }
  } else {
    for (std::uint32_t j = 0; j < list.count; ++j) {
      const typename F::Ball ball = balls[list.indices[j]];
      const V negated_derivative = F::negated_derivative(ball, ball.q(p.x, p.y, p.z));
      const Points<V> g = ball.half_gradient_of_q(p);
      sum.x = fma(negated_derivative, g.x, sum.x), sum.y = fma(negated_derivative, g.y, sum.y);
      sum.z = fma(negated_derivative, g.z, sum.z);
    }
  }
  return sum;
}

/// The field in a brick: the sum over the brick's list and, with infinite support, its polynomial.
template <class F>
struct BrickField {
  const typename F::Ball* balls = nullptr;
  BallList list;
  const FarField* far = nullptr;  ///< null with finite support
  FarBox box = {};                ///< the box of `far`; unused with finite support

  /// `margin`: Level::margin of the bricks.
  PM_HD BrickField(const Grid& grid, int margin, const Node& brick, const typename F::Ball* all,
                   const std::uint32_t* entries, const FarField* brick_far)
      : balls(all), list{entries + brick.begin, brick.count}, far(brick_far) {
    if constexpr (!F::kCompactSupport) box = far_box(grid, kBrickCells, margin, brick.at);
  }

  template <class V>
  PM_HD V value(const Points<V>& p) const {
    const V near = field_at<F>(p, balls, list);
    if constexpr (F::kCompactSupport) {
      return near;
    } else {
      return near + far_value<V>(far->value, box.inverse.x * (p.x - box.middle.x),
                                 box.inverse.y * (p.y - box.middle.y),
                                 box.inverse.z * (p.z - box.middle.z));
    }
  }
  /// Returns minus the gradient, up to a positive factor; it points outward at the surface.
  template <class V>
  PM_HD Points<V> negated_gradient(const Points<V>& p) const {
    Points<V> sum = negated_gradient_at<F>(p, balls, list);
    if constexpr (!F::kCompactSupport) {
      // The sum over the list is of half gradients, so the polynomial's gradient is halved, too.
      const FarSlope<V> slope(far->value, box, p.x, p.y, p.z);
      sum.x = fma(broadcast<V>(-0.5f), slope.x, sum.x),
      sum.y = fma(broadcast<V>(-0.5f), slope.y, sum.y);
      sum.z = fma(broadcast<V>(-0.5f), slope.z, sum.z);
    }
    return sum;
  }
};

/// Prepares all balls and, if there is a tree, its roots; one item per ball or root.
template <class F>
struct PrepareBalls {
  View<const Ball> balls;
  View<typename F::Ball> prepared;
  View<std::uint32_t> all_balls;  ///< 0, 1, 2, ...: the list that holds all balls
  FieldScale scale;
  Int3 roots;                ///< along each axis
  View<Node> nodes;          ///< the roots; empty if there is no tree
  View<Counts> counts;       ///< per root: set to 0 for ClassifyChildren
  View<Offsets> node_count;  ///< nodes and entries of the roots' level
  View<FarField> far;        ///< per root, where support is infinite

  PM_HD void operator()(std::int64_t i) const {
    if (i < balls.size) {
      prepared[i] = prepare_ball<F>(balls[i], scale);
      all_balls[i] = static_cast<std::uint32_t>(i);
    }
    if (i >= nodes.size) return;
    const auto root = static_cast<int>(i);
    Node node;
    node.at = {root % roots.x, root / roots.x % roots.y, root / roots.x / roots.y};
    node.count = static_cast<std::uint32_t>(balls.size);
    nodes[i] = node;
    counts[i] = {};
    if (i < far.size) far[i] = FarField{};
    if (i == 0) node_count[0] = {nodes.size, 0};
  }
};

/// Samples the field at arbitrary points as sums over all balls. An item is as many points as V has
/// lanes; lanes beyond the last point repeat it.
template <class F, class V>
struct SamplePoints {
  View<const Vec3> points;
  View<const typename F::Ball> balls;
  BallList all_balls;
  View<float> values;

  PM_HD void operator()(std::int64_t item) const {
    constexpr int kLanes = Lanes<V>::kCount;
    const std::int64_t base = item * kLanes;
    if (base >= points.size) return;
    alignas(32) float x[kLanes], y[kLanes], z[kLanes], value[kLanes];
    for (int l = 0; l < kLanes; ++l) {
      const Vec3 at = points[base + l < points.size ? base + l : points.size - 1];
      x[l] = at.x, y[l] = at.y, z[l] = at.z;
    }
    const Points<V> at = {Lanes<V>::load(x), Lanes<V>::load(y), Lanes<V>::load(z)};
    Lanes<V>::store(value, grid_field_at<F>(at, balls.data, all_balls));
    for (int l = 0; l < kLanes; ++l) {
      if (base + l < points.size) values[base + l] = value[l];
    }
  }
};

}  // namespace polymorph
