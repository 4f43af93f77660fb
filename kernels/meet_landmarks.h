// Landmarks of a regression: radial basis functions (Gaussians) that are added to its nodes, so
// that its one or two maps take given points exactly to their goals.
//
// A map X becomes X'(x) = X(x) + sum_l phi_l(|x - x_l|) w_l. The weights w_l solve X'(x_k) =
// goal_k, with each Gaussian phi_l replaced by the spline of its values at the nodes. Landmarks
// that nearly coincide at some time, for example because their paths cross, cannot all be met;
// their weights stay finite.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "field.h"
#include "host_device.h"
#include "morph_surface.h"
#include "regression.h"
#include "simd_math.h"
#include "types.h"
#include "view.h"

namespace polymorph {

/// A Gaussian as the kernels read it: 2^(-falloff d^2) times `weight`.
struct LandmarkTerm {
  Vec3 position;
  float falloff = 0;
  /// Element 4 m + i: for coordinate i of map m; 0 for i = 3, the map's fourth value.
  float weight[kRegressionValues] = {0, 0, 0, 0, 0, 0, 0, 0};

  /// Returns the Gaussian at p, without `weight`.
  PM_HD float at(Vec3 p) const {
    const Vec3 d = p - position;
    // The limit keeps the argument in the range of exp2().
    return exp2(max(-falloff * dot(d, d), -120.0f));
  }
};

/// Adds the terms to the coefficients of the spline; one item per node of the lattice.
struct AddLandmarks {
  Grid lattice;
  View<const LandmarkTerm> terms;
  View<float> nodes;  ///< kRegressionValues each

  PM_HD void operator()(std::int64_t n) const {
    const std::int64_t row = n / lattice.points.x;
    const Vec3 p = grid_point(
        lattice, {static_cast<int>(n % lattice.points.x), static_cast<int>(row % lattice.points.y),
                  static_cast<int>(row / lattice.points.y)});
    float* node = nodes.data + kRegressionValues * n;
    for (std::int64_t l = 0; l < terms.size; ++l) {
      const float phi = terms[l].at(p);
      for (int i = 0; i < kRegressionValues; ++i) node[i] = fma(phi, terms[l].weight[i], node[i]);
    }
  }
};

/// Evaluates, at point p, the spline whose coefficients are the values of a term's Gaussian at the
/// nodes.
inline double spline_of_term(const Grid& lattice, const LandmarkTerm& term, Vec3 p) {
  const float inv_spacing = 1 / lattice.cell;
  const SplineAxis x(p.x, lattice.origin.x, inv_spacing, lattice.points.x);
  const SplineAxis y(p.y, lattice.origin.y, inv_spacing, lattice.points.y);
  const SplineAxis z(p.z, lattice.origin.z, inv_spacing, lattice.points.z);
  double sum = 0;
  for (int k = 0; k < 3; ++k)
    for (int j = 0; j < 3; ++j)
      for (int i = 0; i < 3; ++i) {
        const Vec3 node = grid_point(lattice, {x.first + i, y.first + j, z.first + k});
        sum += static_cast<double>(x.weight[i]) * static_cast<double>(y.weight[j]) *
               static_cast<double>(z.weight[k]) * static_cast<double>(term.at(node));
      }
  return sum;
}

/// A square matrix, row by row.
struct SquareMatrix {
  std::size_t n = 0;
  std::vector<double> values;
  explicit SquareMatrix(std::size_t size) : n(size), values(size * size) {}
  double& at(std::size_t row, std::size_t column) { return values[n * row + column]; }
  double at(std::size_t row, std::size_t column) const { return values[n * row + column]; }
};

/// Replaces a positive definite matrix by its Cholesky factor, in the lower triangle.
inline void factor_cholesky(SquareMatrix& a) {
  for (std::size_t i = 0; i < a.n; ++i)
    for (std::size_t j = 0; j <= i; ++j) {
      double sum = a.at(i, j);
      for (std::size_t k = 0; k < j; ++k) sum -= a.at(i, k) * a.at(j, k);
      a.at(i, j) = i == j ? std::sqrt(sum) : sum / a.at(j, j);
    }
}
/// Solves L L^T x = b in place.
inline void solve_cholesky(const SquareMatrix& factor, std::vector<double>& b) {
  for (std::size_t i = 0; i < factor.n; ++i) {
    for (std::size_t k = 0; k < i; ++k) b[i] -= factor.at(i, k) * b[k];
    b[i] /= factor.at(i, i);
  }
  for (std::size_t i = factor.n; i-- > 0;) {
    for (std::size_t k = i + 1; k < factor.n; ++k) b[i] -= factor.at(k, i) * b[k];
    b[i] /= factor.at(i, i);
  }
}

/// Solves `matrix` w = b for each of the right-hand sides, in place, by iterated Tikhonov
/// regularization (Riley 1955). The solution is exact if the matrix is far from singular, and never
/// longer than about 100 |b|.
inline void solve_regularized(const SquareMatrix& matrix,
                              std::vector<std::vector<double>>& right_sides) {
  // Singular values far below kDamping count as 0; each round makes the solution more accurate for
  // the larger ones.
  constexpr double kDamping = 0.02;
  constexpr int kRounds = 8;
  const std::size_t n = matrix.n;
  SquareMatrix normal(n);  // of the normal equations: M^T M + kDamping^2 I
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = 0; j < n; ++j) {
      double sum = i == j ? kDamping * kDamping : 0;
      for (std::size_t k = 0; k < n; ++k) sum += matrix.at(k, i) * matrix.at(k, j);
      normal.at(i, j) = sum;
    }
  factor_cholesky(normal);
  for (std::vector<double>& right_side : right_sides) {
    std::vector<double> solution(n), residual = right_side;
    for (int round = 0; round < kRounds; ++round) {
      std::vector<double> step(n);
      for (std::size_t i = 0; i < n; ++i)
        for (std::size_t k = 0; k < n; ++k) step[i] += matrix.at(k, i) * residual[k];
      solve_cholesky(normal, step);
      for (std::size_t i = 0; i < n; ++i) solution[i] += step[i];
      for (std::size_t k = 0; k < n; ++k) {
        residual[k] = right_side[k];
        for (std::size_t i = 0; i < n; ++i) residual[k] -= matrix.at(k, i) * solution[i];
      }
    }
    right_side = solution;
  }
}

/// Finds the terms with which the maps take the regression's landmarks to their goals. `images`:
/// those of the landmarks under the maps without these terms, `regression.maps` per landmark.
inline std::vector<LandmarkTerm> find_landmark_terms(const Regression& regression,
                                                     const std::vector<AttributeValues>& images) {
  constexpr float kHalfLog2E = 0.72134752f;  // exp(-d^2 / (2 s^2)) = 2^(-kHalfLog2E d^2 / s^2)
  const std::size_t count = regression.landmarks.size();
  const auto maps = static_cast<std::size_t>(regression.maps);
  std::vector<LandmarkTerm> terms(count);
  for (std::size_t l = 0; l < count; ++l) {
    const RegressionLandmark& landmark = regression.landmarks[l];
    terms[l].position = landmark.position;
    terms[l].falloff = kHalfLog2E / (landmark.deviation * landmark.deviation);
  }
  // Element (k, l): the value of term l at landmark k.
  SquareMatrix matrix(count);
  for (std::size_t k = 0; k < count; ++k)
    for (std::size_t l = 0; l < count; ++l)
      matrix.at(k, l) = spline_of_term(regression.lattice, terms[l], terms[k].position);
  std::vector<std::vector<double>> right_sides(3 * maps, std::vector<double>(count));
  for (std::size_t l = 0; l < count; ++l)
    for (std::size_t m = 0; m < maps; ++m) {
      const Vec3 goal = regression.landmarks[l].goal[m];
      const float* v = images[maps * l + m].v;
      right_sides[3 * m][l] = static_cast<double>(goal.x) - static_cast<double>(v[0]);
      right_sides[3 * m + 1][l] = static_cast<double>(goal.y) - static_cast<double>(v[1]);
      right_sides[3 * m + 2][l] = static_cast<double>(goal.z) - static_cast<double>(v[2]);
    }
  solve_regularized(matrix, right_sides);
  for (std::size_t l = 0; l < count; ++l)
    for (std::size_t m = 0; m < maps; ++m)
      for (std::size_t i = 0; i < 3; ++i)
        terms[l].weight[4 * m + i] = static_cast<float>(right_sides[3 * m + i][l]);
  return terms;
}

}  // namespace polymorph
