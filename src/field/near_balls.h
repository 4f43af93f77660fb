// Local field evaluation: the field at points from a neighbourhood's list of balls.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "base/box.h"
#include "kernels/types.h"

namespace polymorph {

/// ln of what one ball adds at the offset `d` from its centre; -infinity where that is nothing.
float log_strength(const Ball& ball, FieldKind kind, Vec3 d);

/// The field at a point: its logarithm (0 on the surface field = 1) and that logarithm's gradient.
struct LogField {
  double value = 0;
  Vec3 gradient;
};

/// Balls in groups that matter near each other. Balls that add less than e^-12 to any point of a
/// box are left out there (inverse-square ones never are). Borrows the balls.
class NearBalls {
 public:
  NearBalls(std::span<const Ball> balls, FieldKind kind);

  /// Indices of the balls that matter in a box, ascending; at least one where there are balls.
  std::vector<std::uint32_t> within(const Box& box) const;

  /// The field at `p`, over a list that within() gave for a box around it. -infinity where nothing
  /// reaches.
  LogField log_field(Vec3 p, std::span<const std::uint32_t> list) const;

 private:
  std::span<const Ball> balls_;
  FieldKind kind_;
  std::vector<float> least_;  ///< of each ball: a times the smallest eigenvalue of its shape
};

/// Runs f(begin, end, list) over [0, points.size()) in runs of neighbours; `list` matters at all
/// points of the run and `reach` around them. In parallel: write by index.
void for_each_near(
    const NearBalls& balls, std::span<const Vec3> points, float reach,
    const std::function<void(std::size_t, std::size_t, std::span<const std::uint32_t>)>& f);

}  // namespace polymorph
