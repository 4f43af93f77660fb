// Shape features of balls: mean geodesic distance, linearity, planarity and outward direction. They
// are the terms of the plan's cost that distinguish a limb from a trunk.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kernels/types.h"

namespace polymorph {

/// Finds for each point the indices of its `count` nearest other points, nearest first; of all
/// others if there are fewer. Parallel, deterministic.
std::vector<std::vector<std::uint32_t>> nearest_neighbors(std::span<const Vec3> points,
                                                          std::size_t count);

/// Features of balls; each list has one element per ball. The neighbourhood of a ball is the ball
/// with its 16 nearest others, weighted by mass.
struct BallFeatures {
  /// Mean geodesic distance to all balls, weighted by mass (Hilaga et al. 2001), divided by the
  /// smallest such mean, minus 1: 0 at the object's centre, largest at the tips of limbs.
  std::vector<float> distance;
  /// (l1 - l2) / l1, in [0, 1], where l1 >= l2 >= l3 are the principal variances of the
  /// neighbourhood's centres.
  std::vector<float> linearity;
  std::vector<float> planarity;  ///< (l2 - l3) / l1
  /// Outward direction: the ball's offset from the neighbourhood's centroid, divided by the
  /// neighbourhood's RMS radius. It is near 0 deep inside and about 1 long near the surface.
  std::vector<Vec3> outward;
};

/// Computes the features. `masses`: ball_masses() (morph/mass.h). Parallel, deterministic.
BallFeatures ball_features(const std::vector<Ball>& balls, std::span<const double> masses);

}  // namespace polymorph
