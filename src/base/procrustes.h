// Weighted Procrustes analysis: the sums over paired points from which a similarity is fitted.
#pragma once

#include <cmath>
#include <cstddef>

#include "kernels/linear.h"

namespace polymorph {

/// Adds weight q p^T to `sum`. nearest_rotation() (base/matrix_decompositions.h) of such a sum is
/// the rotation that takes the vectors p closest to the vectors q.
inline void add_outer_product(Mat3& sum, double weight, Vec3d q, Vec3d p) {
  const double row[3] = {p.x, p.y, p.z}, column[3] = {q.x, q.y, q.z};
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) sum.at(r, c) += weight * column[r] * row[c];
}

/// A point and its partner on the other side.
struct WeightedPair {
  Vec3d from, to;
  double weight = 1;
};

/// Weighted means of the points `from` and of the points `to` of pairs, and the sums of
/// weight q p^T, weight |p|^2 and weight |q|^2, where p and q are the offsets of `from` and `to`
/// from these means.
struct PairMoments {
  Vec3d from_center, to_center;
  Mat3 covariance{{0, 0, 0, 0, 0, 0, 0, 0, 0}};
  double from_square = 0, to_square = 0;

  /// Adds a pair's offsets to the sums.
  void add(Vec3d p, Vec3d q, double weight) {
    add_outer_product(covariance, weight, q, p);
    from_square += weight * dot(p, p);
    to_square += weight * dot(q, q);
  }
  /// Scale of the similarity that maps the points `from` to the points `to`; 1 if all points of a
  /// side coincide.
  double scale() const {
    return from_square > 0 && to_square > 0 ? std::sqrt(to_square / from_square) : 1;
  }
};

/// Computes the moments of `pair_at(0)` to `pair_at(count - 1)`, each a WeightedPair. The sum of
/// their weights must not be 0.
template <class PairAt>
PairMoments pair_moments(std::size_t count, const PairAt& pair_at) {
  PairMoments moments;
  double weight_sum = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const WeightedPair pair = pair_at(i);
    moments.from_center = moments.from_center + pair.from * pair.weight;
    moments.to_center = moments.to_center + pair.to * pair.weight;
    weight_sum += pair.weight;
  }
  moments.from_center = moments.from_center * (1 / weight_sum);
  moments.to_center = moments.to_center * (1 / weight_sum);
  for (std::size_t i = 0; i < count; ++i) {
    const WeightedPair pair = pair_at(i);
    moments.add(pair.from - moments.from_center, pair.to - moments.to_center, pair.weight);
  }
  return moments;
}

}  // namespace polymorph
