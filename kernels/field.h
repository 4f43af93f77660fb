// The field at several points at once: sums over a list of balls, in ascending ball order.
//
// Two lists give the same bits at a point when they differ only in balls that contribute exactly 0
// there: all sums start at +0 and adding +0 changes no float (for kInverseSquare every list holds
// every ball). The lists of a brick hold every ball that reaches any of its points (see bricks.h),
// so a point shared by several bricks has one value, and it is the value of the sum over all balls.
//
// kLanes points share a list. The lanes are plain inner loops that the compiler turns into vectors
// on the CPU; on the GPU kLanes is 1. The operations on one point, and their order, are the same
// for any kLanes.
#pragma once

#include <cstdint>

#include "falloff.h"
#include "host_device.h"
#include "view.h"

namespace polymorph {

/// A run of ball indices, ascending.
struct BallList {
  const std::uint32_t* indices = nullptr;
  std::uint32_t count = 0;
};

template <int kLanes>
struct Points {
  float x[kLanes], y[kLanes], z[kLanes];
};

template <class F, int kLanes>
PM_HD inline void field_at(const Points<kLanes>& points, const typename F::Ball* balls,
                           BallList list, float (&value)[kLanes]) {
  // Copies, so that the compiler sees that nothing aliases and keeps the lanes in registers.
  const Points<kLanes> p = points;
  float sum[kLanes];
  for (int l = 0; l < kLanes; ++l) sum[l] = 0;
  for (std::uint32_t j = 0; j < list.count; ++j) {
    const typename F::Ball ball = balls[list.indices[j]];
    PM_LANES
    for (int l = 0; l < kLanes; ++l) {
      sum[l] += F::value(ball, ball.q(p.x[l], p.y[l], p.z[l]));
    }
  }
  for (int l = 0; l < kLanes; ++l) value[l] = sum[l];
}

/// -grad of the field up to a positive factor: outward at the surface.
template <class F, int kLanes>
PM_HD inline void downhill_at(const Points<kLanes>& points, const typename F::Ball* balls,
                              BallList list, Points<kLanes>& direction) {
  const Points<kLanes> p = points;
  Points<kLanes> sum;
  for (int l = 0; l < kLanes; ++l) sum.x[l] = sum.y[l] = sum.z[l] = 0;
  for (std::uint32_t j = 0; j < list.count; ++j) {
    const typename F::Ball ball = balls[list.indices[j]];
    PM_LANES
    for (int l = 0; l < kLanes; ++l) {
      const float fall = F::fall(ball, ball.q(p.x[l], p.y[l], p.z[l]));
      float x, y, z;
      ball.q_rise(p.x[l], p.y[l], p.z[l], x, y, z);
      sum.x[l] = fused(fall, x, sum.x[l]);
      sum.y[l] = fused(fall, y, sum.y[l]);
      sum.z[l] = fused(fall, z, sum.z[l]);
    }
  }
  direction = sum;
}

/// Prepares all balls; one item a ball.
template <class F>
struct PrepareBalls {
  View<const Ball> balls;
  View<typename F::Ball> prepared;
  View<std::uint32_t> everyone;  ///< 0, 1, 2, ...: the list that holds all balls
  float log2_floor = 0;

  PM_HD void operator()(std::int64_t i) const {
    if (i >= balls.size) return;
    prepared[i] = prepare_ball<F>(balls[i], log2_floor);
    everyone[i] = static_cast<std::uint32_t>(i);
  }
};

/// Field values at arbitrary points, summed over all balls; one item kLanes points.
template <class F, int kLanes>
struct SamplePoints {
  View<const Vec3> points;
  View<const typename F::Ball> balls;
  BallList everyone;
  View<float> values;

  PM_HD void operator()(std::int64_t item) const {
    const std::int64_t base = item * kLanes;
    if (base >= points.size) return;
    Points<kLanes> p;
    for (int l = 0; l < kLanes; ++l) {
      const Vec3 at = points[base + l < points.size ? base + l : points.size - 1];
      p.x[l] = at.x;
      p.y[l] = at.y;
      p.z[l] = at.z;
    }
    float value[kLanes];
    field_at<F>(p, balls.data, everyone, value);
    for (int l = 0; l < kLanes; ++l) {
      if (base + l < points.size) values[base + l] = value[l];
    }
  }
};

}  // namespace polymorph
