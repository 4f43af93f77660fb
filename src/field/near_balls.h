// Local field evaluation: the field at points from a neighbourhood's list of balls.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "base/box.h"
#include "kernels/types.h"

namespace polymorph {

/// Returns the natural logarithm of one ball's contribution to the field at the offset `d` from its
/// centre; -infinity if the contribution is 0.
float log_contribution(const Ball& ball, FieldKind kind, Vec3 d);

/// The field at a point: its logarithm (0 on the surface field = 1) and that logarithm's gradient.
struct LogField {
  double value = 0;
  Vec3 gradient;
};

/// Evaluates the field of the balls that matter near a position. A ball matters in a box unless its
/// contribution there is below e^-12 min(1, m), m being the largest contribution of any ball;
/// inverse-square balls always matter. The balls must outlive the object.
class NearBalls {
 public:
  NearBalls(std::span<const Ball> balls, FieldKind kind);

  /// Lists the indices of the balls that matter in a box, ascending; at least one if there are
  /// balls.
  std::vector<std::uint32_t> within(const Box& box) const;

  /// Evaluates the field at `p`, over a list that within() returned for a box around it. The value
  /// is -infinity outside the support of all balls.
  LogField log_field(Vec3 p, std::span<const std::uint32_t> list) const;

 private:
  std::span<const Ball> balls_;
  FieldKind kind_;
  std::vector<float> min_a_;  ///< a times the smallest eigenvalue of the shape, per ball
};

/// Calls f(begin, end, list) for chunks of [0, points.size()) in parallel; `list` holds the balls
/// that matter at the chunk's points and within `max_distance` of them. Points should be sorted so
/// that neighbours follow each other. Write results by index.
void for_each_near(
    const NearBalls& balls, std::span<const Vec3> points, float max_distance,
    const std::function<void(std::size_t, std::size_t, std::span<const std::uint32_t>)>& f);

}  // namespace polymorph
