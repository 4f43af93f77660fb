// Transfer of balls from a model to another pose of it, with the same faces but other point
// positions. Each ball follows the surface around it (rigid skinning, in the manner of Kavan et al.
// 2007). No fit is needed, and balls keep their indices.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/matrix_decompositions.h"
#include "kernels/types.h"
#include "model/model.h"

namespace polymorph {

/// Balls in a pose, and the rotation of each ball from the reference pose, in which the balls were
/// made. In the reference pose itself, `rotations` is empty.
struct CarriedBalls {
  std::vector<Ball> balls;
  std::vector<Mat3> rotations;
};

/// A point of the model's surface that a ball moves with.
struct BoundPoint {
  std::uint32_t point = 0;  ///< index into the model's points
  /// A third of the area of the triangles at the point, times a falloff from 1 to 1e-4 with the
  /// distance from the ball's centre.
  float weight = 0;
};

/// Lists for each ball the points of the surface that it moves with: points near the ball that are
/// connected with the point nearest to the ball, by edges between such points. A limb that merely
/// passes by the ball is therefore left out. Coincident points count as one.
std::vector<std::vector<BoundPoint>> bind_balls(const Model& model, std::span<const Ball> balls);

/// Moves the balls to the pose in which the points of `model` are at `posed`. Each ball follows the
/// similarity transform that fits its bound points best (Horn 1987). For a similarity transform of
/// the whole model the result is exact. `bound`: bind_balls(model, balls).
CarriedBalls carry_balls(const Model& model, std::span<const Ball> balls,
                         std::span<const std::vector<BoundPoint>> bound,
                         std::span<const Vec3> posed);

}  // namespace polymorph
