// Farthest point sampling (Gonzalez 1985): a few points of a set that are far from each other.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace polymorph {

/// A few points of a set, the bases, and the division of the set among them.
template <class Distance>
struct FarthestPoints {
  std::vector<std::uint32_t> bases;  ///< indices of the points chosen
  std::vector<std::uint32_t> owner;  ///< per point, the index in `bases` of its nearest base
  std::vector<std::vector<Distance>> distances;  ///< [base][point]: distance between the two
  std::vector<double> weights;  ///< per base, the summed weights of the points it owns

  /// Estimates the weighted sum of the distances from a point to all others, as if each were at its
  /// base.
  double sum_distances(std::size_t point) const {
    double sum = 0;
    for (std::size_t b = 0; b < bases.size(); ++b)
      sum += weights[b] * static_cast<double>(distances[b][point]);
    return sum;
  }
};

/// Chooses at most `count` points: first `base`, then repeatedly the point that is farthest from
/// those chosen. `weights`: one per point. `distances_from(base)`: returns the distances of all
/// points from the point `base`.
template <class DistancesFrom>
auto farthest_points(std::span<const double> weights, std::size_t count, std::uint32_t base,
                     const DistancesFrom& distances_from) {
  using Distance = typename decltype(distances_from(base))::value_type;
  using Limits = std::numeric_limits<Distance>;
  FarthestPoints<Distance> sample;
  sample.owner.resize(weights.size(), 0);
  // Per point, the distance to the nearest base so far.
  std::vector<Distance> base_distance(weights.size(),
                                      Limits::has_infinity ? Limits::infinity() : Limits::max());
  for (std::uint32_t k = 0; k < std::min(count, weights.size()); ++k) {
    sample.bases.push_back(base);
    const std::vector<Distance>& distances = sample.distances.emplace_back(distances_from(base));
    for (std::size_t i = 0; i < base_distance.size(); ++i)
      if (distances[i] < base_distance[i]) base_distance[i] = distances[i], sample.owner[i] = k;
    base = static_cast<std::uint32_t>(std::max_element(base_distance.begin(), base_distance.end()) -
                                      base_distance.begin());
  }
  sample.weights.resize(sample.bases.size(), 0);
  for (std::size_t i = 0; i < weights.size(); ++i) sample.weights[sample.owner[i]] += weights[i];
  return sample;
}

}  // namespace polymorph
