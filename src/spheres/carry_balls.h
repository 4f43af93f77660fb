// Balls carried from a model to another pose of it, the same faces with their points in other
// places: no fit is needed, and each ball stays the one that it is (rigid skinning to the surface
// around it; Kavan et al. 2007 for the idea).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/matrix_decompositions.h"
#include "kernels/types.h"
#include "model/model.h"

namespace polymorph {

/// Balls in a pose, and the rotation of each since the pose that it was carried from; no rotations:
/// it is that pose.
struct CarriedBalls {
  std::vector<Ball> balls;
  std::vector<Mat3> turns;
};

/// Points of a model that a ball goes with.
struct BoundPoint {
  std::uint32_t point = 0;
  float weight = 0;  ///< (0, 1], times the area around the point
};

/// For each ball the points of the surface around it. They are connected with the point nearest to
/// it: a part that only passes by does not pull at it. Points in the same place are one.
std::vector<std::vector<BoundPoint>> bind_balls(const Model& model, std::span<const Ball> balls);

/// Balls in places where `posed` has the points of `model`: each follows the similarity that fits
/// its bound points best (Horn 1987). One that turns, grows or shifts with the whole does so
/// exactly.
CarriedBalls carry_balls(const Model& model, std::span<const Ball> balls,
                         std::span<const std::vector<BoundPoint>> bound,
                         std::span<const Vec3> posed);

}  // namespace polymorph
