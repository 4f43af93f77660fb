// Shape features of balls: mean geodesic distance, linearity, planarity and outward direction. They
// are the terms of the plan's cost that distinguish a limb from a trunk.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kernels/types.h"

namespace polymorph {

/// Finds the `count` nearest other points of each point, nearest first; all others if there are
/// fewer. Parallel, deterministic.
std::vector<std::vector<std::uint32_t>> nearest_neighbors(std::span<const Vec3> points,
                                                          std::size_t count);

struct BallFeatures {
  /// Mean geodesic distance to all balls, weighted by mass (Hilaga et al. 2001), over the least
  /// such mean, minus 1: 0 at the object's centre, largest at the tips of limbs.
  std::vector<float> distance;
  std::vector<float>
      linearity;  ///< (l1 - l2) / l1 of the neighbourhood's principal variances, [0, 1]
  std::vector<float> planarity;  ///< (l2 - l3) / l1
  std::vector<Vec3> outward;     ///< away from the neighbours: 0 deep inside, about 1 long outside
};

/// `masses`: ball_masses(). Parallel, deterministic.
BallFeatures ball_features(const std::vector<Ball>& balls, std::span<const double> masses);

}  // namespace polymorph
