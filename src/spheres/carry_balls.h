// Transfer of balls from a model to another pose of it, which has the same faces but other point
// positions. Each ball follows the surface around it (rigid skinning; the idea is that of Kavan et
// al. 2007), so no fit is needed and balls keep their indices.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/matrix_decompositions.h"
#include "kernels/types.h"
#include "model/model.h"

namespace polymorph {

/// Balls in a pose, and the rotation of each ball from the reference pose, from which they were
/// carried. In the reference pose itself `turns` is empty.
struct CarriedBalls {
  std::vector<Ball> balls;
  std::vector<Mat3> turns;
};

/// A point of the model's surface that a ball moves with.
struct BoundPoint {
  std::uint32_t point = 0;
  float weight = 0;  ///< falls from 1 to 0 with the distance; times the area around the point
};

/// Lists for each ball the points of the surface around it. They are connected, near the ball, with
/// the point nearest to it, so a limb that only passes by does not move the ball. Coincident points
/// count as one.
std::vector<std::vector<BoundPoint>> bind_balls(const Model& model, std::span<const Ball> balls);

/// Moves the balls to the pose in which the points of `model` are at `posed`. Each ball follows the
/// similarity transform that fits its bound points best (Horn 1987); for a similarity transform of
/// the whole model the result is exact.
CarriedBalls carry_balls(const Model& model, std::span<const Ball> balls,
                         std::span<const std::vector<BoundPoint>> bound,
                         std::span<const Vec3> posed);

}  // namespace polymorph
