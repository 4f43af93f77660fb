#include "spheres/fit_field.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "base/parallel.h"
#include "kernels/simd_math.h"

namespace polymorph {
namespace {

using Eigen::Vector3d;

static_assert(kFitLanes == Lanes<Pack>::kCount);

constexpr std::size_t kGroupSize = 32;  // points that use a common list of balls
static_assert(kFitChunkSize % kGroupSize == 0 && kGroupSize % kFitLanes == 0);

/// A ball whose contribution is below e^-kNegligible times the largest does not matter.
constexpr float kNegligible = 9;
constexpr float kLog2E = 1.44269504f, kLn2 = 0.693147181f;

/// FitBall in single precision, in one cache line.
struct alignas(64) SingleBall {
  float center[3], root[3][3], w;
};

/// Bounds the largest singular value of a matrix. It is the root of the largest eigenvalue of
/// A = M^T M, which is at most the 16th root of the trace of A^16, and at least 0.93 times that.
float bound_norm(const Eigen::Matrix3d& matrix) {
  Eigen::Matrix3d power = matrix.transpose() * matrix;
  const double scale = power.trace();
  if (!(scale > 0)) return 0;
  power /= scale;  // its eigenvalues sum to 1
  for (int k = 0; k < 3; ++k) power = (power * power).eval();
  double bound = power.squaredNorm();  // the trace of the 16th power
  for (int k = 0; k < 4; ++k) bound = std::sqrt(bound);
  return static_cast<float>(std::sqrt(scale * bound) * (1 + 1e-6));  // for rounding
}

/// All balls in single precision, relative to `origin`, so that a model may lie anywhere.
struct SingleBalls {
  Vector3d origin = Vector3d::Zero();  ///< mean of the centres
  std::vector<SingleBall> balls;
  /// Structure of arrays of their numbers, for the bounds of groups. Balls that never matter fill
  /// the last vector.
  std::vector<float> center[3], root[3][3], w, norm;

  explicit SingleBalls(const std::vector<FitBall>& all) {
    for (const FitBall& ball : all) origin += ball.center;
    origin /= static_cast<double>(all.size());
    const std::size_t padded_count = (all.size() + kFitLanes - 1) / kFitLanes * kFitLanes;
    for (std::size_t k = 0; k < 3; ++k) {
      center[k].resize(padded_count);
      for (std::size_t c = 0; c < 3; ++c) root[k][c].resize(padded_count);
    }
    w.resize(padded_count, -1e30f);
    norm.resize(padded_count);
    balls.resize(all.size());
    for (std::size_t i = 0; i < all.size(); ++i) {
      const Vector3d offset = all[i].center - origin;
      for (std::size_t k = 0; k < 3; ++k) {
        const auto row = static_cast<Eigen::Index>(k);
        balls[i].center[k] = center[k][i] = static_cast<float>(offset[row]);
        for (std::size_t c = 0; c < 3; ++c)
          balls[i].root[k][c] = root[k][c][i] =
              static_cast<float>(all[i].root(row, static_cast<Eigen::Index>(c)));
      }
      balls[i].w = w[i] = static_cast<float>(all[i].w);
      norm[i] = bound_norm(all[i].root);
    }
  }
};

struct Packs3 {
  Pack x, y, z;
};

Pack dot_product(const Packs3& a, const Packs3& b) {
  return fma(a.x, b.x, fma(a.y, b.y, a.z * b.z));
}

/// Computes root v.
Packs3 multiply(const float (&root)[3][3], const Packs3& v) {
  const auto row = [&](const float(&r)[3]) {
    return fma(broadcast<Pack>(r[0]), v.x,
               fma(broadcast<Pack>(r[1]), v.y, broadcast<Pack>(r[2]) * v.z));
  };
  return {row(root[0]), row(root[1]), row(root[2])};
}
/// Computes root^T v.
Packs3 multiply_transposed(const float (&root)[3][3], const Packs3& v) {
  const auto column = [&](std::size_t c) {
    return fma(broadcast<Pack>(root[0][c]), v.x,
               fma(broadcast<Pack>(root[1][c]), v.y, broadcast<Pack>(root[2][c]) * v.z));
  };
  return {column(0), column(1), column(2)};
}

/// Computes u = root (x - center).
Packs3 to_ball_space(const SingleBall& ball, const Packs3& x) {
  return multiply(ball.root, {x.x - ball.center[0], x.y - ball.center[1], x.z - ball.center[2]});
}

/// kFitLanes points of a group, relative to SingleBalls::origin. Unused lanes repeat the last
/// point, with weight 0.
struct PackedPoints {
  Packs3 position;
  Pack target;
  Pack weight_above, weight_below;  ///< weights at distances above the target, and elsewhere

  PackedPoints(const FitPoint* points, std::size_t count, const Vector3d& origin) {
    constexpr float kSteepFactor = 0.2f;
    alignas(32) float values[6][kFitLanes];
    for (std::size_t k = 0; k < kFitLanes; ++k) {
      const FitPoint& point = points[std::min(k, count - 1)];
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto i = static_cast<Eigen::Index>(axis);
        values[axis][k] = static_cast<float>(point.point[i] - origin[i]);
      }
      values[3][k] = static_cast<float>(point.target);
      const float weight = k < count ? static_cast<float>(point.weight) : 0;
      float& above = values[4][k] = weight;
      float& below = values[5][k] = weight;
      switch (point.rule) {
        case FitPoint::Rule::kSurface:
          break;
        case FitPoint::Rule::kInside:
          above = 0;
          break;
        case FitPoint::Rule::kOutside:
          below = 0;
          break;
        case FitPoint::Rule::kOffset:
          // A field steeper than a distance is harmless; a flatter one means that a second sheet is
          // near.
          (point.target > 0 ? above : below) *= kSteepFactor;
          break;
      }
    }
    const auto load = [&](std::size_t row) { return Lanes<Pack>::load(values[row]); };
    position = {load(0), load(1), load(2)};
    target = load(3), weight_above = load(4), weight_below = load(5);
  }
};

/// Balls that may matter at the points of a group. One object is reused for many groups, so that it
/// keeps its memory.
class GroupBalls {
 public:
  std::vector<std::uint32_t> indices;

  void collect(const SingleBalls& all, const FitPoint* points, std::size_t count) {
    Vector3d low = points[0].point, high = low;
    for (std::size_t i = 1; i < count; ++i) {
      low = low.cwiseMin(points[i].point);
      high = high.cwiseMax(points[i].point);
    }
    const float min_logarithm =
        find_bounds(all, (low + high) / 2 - all.origin, (high - low).norm() / 2) - kNegligible;
    indices.clear();
    for (std::size_t i = 0; i < upper_bounds_.size(); i += kFitLanes) {
      const Pack upper = Lanes<Pack>::load(upper_bounds_.data() + i);
      for (std::uint32_t bits = Lanes<Pack>::bits(upper > min_logarithm); bits != 0;
           bits &= bits - 1)
        indices.push_back(static_cast<std::uint32_t>(i) +
                          static_cast<std::uint32_t>(std::countr_zero(bits)));
    }
  }

 private:
  /// Sets upper bounds of the logarithm of each ball's contribution within `radius` of `middle`;
  /// returns the largest lower bound. Within the radius, |root (x - center)| changes by at most
  /// `extent`.
  float find_bounds(const SingleBalls& all, const Vector3d& middle, double radius) {
    upper_bounds_.resize(all.w.size());
    const auto mx = static_cast<float>(middle[0]), my = static_cast<float>(middle[1]),
               mz = static_cast<float>(middle[2]), r = static_cast<float>(radius);
    Pack max_lower_bound = broadcast<Pack>(-1e30f);
    for (std::size_t i = 0; i < all.w.size(); i += kFitLanes) {
      const auto load = [i](const std::vector<float>& values) {
        return Lanes<Pack>::load(values.data() + i);
      };
      const Packs3 d{mx - load(all.center[0]), my - load(all.center[1]), mz - load(all.center[2])};
      const auto row = [&](std::size_t k) {
        return dot_product({load(all.root[k][0]), load(all.root[k][1]), load(all.root[k][2])}, d);
      };
      const Packs3 u{row(0), row(1), row(2)};
      const Pack distance = sqrt(dot_product(u, u)), extent = load(all.norm) * r, w = load(all.w);
      const Pack near = max(distance - extent, Pack{}), far = distance + extent;
      Lanes<Pack>::store(upper_bounds_.data() + i, w - near * near);
      max_lower_bound = max(max_lower_bound, w - far * far);
    }
    float largest = max_lower_bound[0];
    for (int k = 1; k < Lanes<Pack>::kCount; ++k) largest = std::max(largest, max_lower_bound[k]);
    return largest;
  }

  std::vector<float> upper_bounds_;
};

/// Values of a ball at kFitLanes points: u = root (x - center), and q, the ball's fraction of the
/// field.
struct BallTerm {
  Packs3 u;
  Pack q;
  std::uint32_t ball;
};

/// The field at kFitLanes points. Like GroupBalls, one object is reused for many.
struct FieldTerms {
  std::vector<FitLanes> logarithms;  ///< logarithms of the contributions of the group's balls
  std::vector<BallTerm> balls;       ///< those that matter at one of the points
  Pack top;                          ///< largest logarithm
  Pack psi;                          ///< ln of the field
  Packs3 half_gradient;              ///< grad psi / -2
};

/// Sets the logarithms of the balls' contributions.
void compute_logarithms(const SingleBalls& all, const GroupBalls& group, const Packs3& position,
                        FieldTerms& at) {
  at.logarithms.resize(group.indices.size());
  Pack top = broadcast<Pack>(-1e30f);
  for (std::size_t k = 0; k < group.indices.size(); ++k) {
    const SingleBall& ball = all.balls[group.indices[k]];
    const Packs3 u = to_ball_space(ball, position);
    const Pack logarithm = ball.w - dot_product(u, u);
    Lanes<Pack>::store(at.logarithms[k].lanes, logarithm);
    top = max(top, logarithm);
  }
  at.top = top;
}

/// Computes e^x for x <= 0, or a negligible number where x is below -80.
Pack exponentiate(Pack x) { return exp2(max(x * kLog2E, broadcast<Pack>(kMinExponent))); }

/// Lists the balls that matter; sets psi and the gradient.
void compute_field(const SingleBalls& all, const GroupBalls& group, const Packs3& position,
                   FieldTerms& at) {
  at.balls.resize(group.indices.size());
  std::size_t count = 0;
  const Pack min_logarithm = at.top - kNegligible;
  Pack sum = {};
  for (std::size_t k = 0; k < group.indices.size(); ++k) {
    const Pack logarithm = Lanes<Pack>::load(at.logarithms[k].lanes);
    if (Lanes<Pack>::bits(logarithm > min_logarithm) == 0) continue;
    BallTerm& term = at.balls[count++];
    term.ball = group.indices[k];
    term.q = exponentiate(logarithm - at.top);
    sum += term.q;
  }
  at.balls.resize(count);
  at.psi = fma(log2(sum), broadcast<Pack>(kLn2), at.top);
  const Pack inverse_sum = 1.0f / sum;
  Packs3 half_gradient = {};
  for (BallTerm& term : at.balls) {
    const SingleBall& ball = all.balls[term.ball];
    term.q *= inverse_sum;
    term.u = to_ball_space(ball, position);
    const Packs3 slope = multiply_transposed(ball.root, term.u);
    half_gradient = {fma(term.q, slope.x, half_gradient.x), fma(term.q, slope.y, half_gradient.y),
                     fma(term.q, slope.z, half_gradient.z)};
  }
  at.half_gradient = half_gradient;
}

/// Values at kFitLanes points that the derivatives of their residuals share; g = |grad psi|.
struct PointGradients {
  Packs3 direction;  ///< grad psi / g
  Pack steepness;    ///< g, clamped from below
  Pack ratio;        ///< psi / g, or 0 where g is clamped
  Pack scale;        ///< the root of the residual's weight
  Pack residual;     ///< times `scale`
  Pack cost;         ///< Huber's loss
};

PointGradients compute_residuals(const PackedPoints& points, const FieldTerms& at, double length) {
  const auto min_steepness = static_cast<float>(0.5 / length),
             huber = static_cast<float>(0.01 * length);
  PointGradients out;
  const Pack norm = 2.0f * sqrt(dot_product(at.half_gradient, at.half_gradient));
  out.steepness = max(norm, broadcast<Pack>(min_steepness));
  const Pack distance = at.psi / out.steepness, difference = distance - points.target;
  out.ratio = zero_unless(norm >= min_steepness, distance);
  const Pack factor = -2.0f / max(norm, broadcast<Pack>(1e-30f));
  out.direction = {at.half_gradient.x * factor, at.half_gradient.y * factor,
                   at.half_gradient.z * factor};
  const Pack weight = select(difference > 0.0f, points.weight_above, points.weight_below);
  const Pack size = max(difference, -difference);
  const PackMask is_small = size <= huber;
  out.cost = weight * select(is_small, size * size, huber * (2.0f * size - huber));
  // The weight of the squared difference that represents Huber's loss (IRLS).
  out.scale = sqrt(weight * select(is_small, broadcast<Pack>(1), huber / size));
  out.residual = out.scale * difference;
  return out;
}

/// Computes the derivatives of scale psi / g with respect to (w, c, D). Let d be the derivative
/// with respect to a parameter, and t = w - |u|^2. Then d psi = q dt and dg = q (dt (-2 slope .
/// direction
/// - g) + direction . d(-2 slope)), where slope = root^T u.
template <int kParameters>
void derive(const BallTerm& term, const SingleBall& ball, const PointGradients& at, Pack factor,
            Pack (&out)[kParameters]) {
  const Packs3& u = term.u;
  const Packs3 root_direction = multiply(ball.root, at.direction);
  // slope . direction = u . root_direction
  const Pack t_factor =
      factor * fma(at.ratio, fma(broadcast<Pack>(2), dot_product(u, root_direction), at.steepness),
                   broadcast<Pack>(1));
  const Pack slope_factor = factor * at.ratio;
  out[0] = t_factor;
  const Packs3 a{t_factor * u.x, t_factor * u.y, t_factor * u.z},
      b{slope_factor * root_direction.x, slope_factor * root_direction.y,
        slope_factor * root_direction.z};
  const Packs3 center = multiply_transposed(ball.root, {a.x - b.x, a.y - b.y, a.z - b.z});
  out[1] = 2.0f * center.x, out[2] = 2.0f * center.y, out[3] = 2.0f * center.z;
  const Packs3 p{2.0f * b.x - a.x, 2.0f * b.y - a.y, 2.0f * b.z - a.z};
  if constexpr (kParameters == kRoundParameters) {
    out[4] = dot_product(u, p);
  } else {
    out[4] = u.x * p.x, out[5] = u.y * p.y, out[6] = u.z * p.z;
    out[7] = fma(u.x, p.y, u.y * p.x);
    out[8] = fma(u.x, p.z, u.z * p.x);
    out[9] = fma(u.y, p.z, u.z * p.y);
  }
}

/// Sums the lanes in a fixed order.
float sum_lanes(Pack a) {
  const Pack halves = a + __builtin_shufflevector(a, a, 4, 5, 6, 7, 0, 1, 2, 3);
  const Pack quarters = halves + __builtin_shufflevector(halves, halves, 2, 3, 0, 1, 6, 7, 4, 5);
  return quarters[0] + quarters[1];
}

/// Computes the rows of chunks. One object is reused for many.
template <int kParameters>
class RowBuilder {
  static constexpr std::size_t kSums = count_fit_sums(kParameters);
  static constexpr std::uint32_t kNoSlot = ~0u;

 public:
  RowBuilder(const SingleBalls& balls, const std::vector<FitPoint>& points, double length)
      : balls_(balls), points_(points), length_(length), slots_(balls.balls.size(), kNoSlot) {}

  void build(std::size_t index, FitRows& rows) {
    FitChunk& chunk = rows.chunks[index];
    chunk.clear();
    sums_.clear();
    chunk.begins.push_back(0);
    chunk.cost = sum_costs(
        index, [&](std::size_t p, std::size_t count) { return add_pack(p, count, rows, chunk); });
    chunk.sums.resize(chunk.balls.size() * kSums);
    for (std::size_t k = 0; k < chunk.sums.size(); ++k)
      chunk.sums[k] = sum_lanes(Lanes<Pack>::load(sums_[k].lanes));
    for (const std::uint32_t ball : chunk.balls) slots_[ball] = kNoSlot;
  }

  /// Computes FitChunk::cost of chunk `index` alone.
  double compute_cost(std::size_t index) {
    return sum_costs(index, [&](std::size_t p, std::size_t count) {
      return evaluate(PackedPoints(points_.data() + p, count, balls_.origin)).cost;
    });
  }

 private:
  /// Sums add(p, count), the costs of `count` points from p on, over the points of a chunk.
  template <class Add>
  double sum_costs(std::size_t index, const Add& add) {
    const std::size_t begin = index * kFitChunkSize,
                      end = std::min(begin + kFitChunkSize, points_.size());
    double sum = 0;
    for (std::size_t first = begin; first < end; first += kGroupSize) {
      const std::size_t group_end = std::min(first + kGroupSize, end);
      near_.collect(balls_, points_.data() + first, group_end - first);
      Pack cost = {};
      for (std::size_t p = first; p < group_end; p += kFitLanes)
        cost += add(p, std::min(kFitLanes, group_end - p));
      sum += static_cast<double>(sum_lanes(cost));
    }
    return sum;
  }

  /// Sets terms_ for points of the group whose balls near_ has; returns their residuals.
  PointGradients evaluate(const PackedPoints& points) {
    compute_logarithms(balls_, near_, points.position, terms_);
    compute_field(balls_, near_, points.position, terms_);
    return compute_residuals(points, terms_, length_);
  }

  /// Adds the blocks of `count` points from p on; returns their costs.
  Pack add_pack(std::size_t p, std::size_t count, FitRows& rows, FitChunk& chunk) {
    constexpr float kMinWeight = 5e-3f;  // a ball with less of the field gets no entry
    const PointGradients gradients =
        evaluate(PackedPoints(points_.data() + p, count, balls_.origin));
    Lanes<Pack>::store(rows.residuals.data() + p, gradients.residual);
    Lanes<Pack>::store(rows.psi.data() + p, terms_.psi);
    Lanes<Pack>::store(rows.steepness.data() + p, gradients.steepness);
    const Pack factor = gradients.scale / gradients.steepness;
    const PackMask is_used = gradients.scale > 0.0f;
    if (Lanes<Pack>::bits(is_used) != 0) {
      for (const BallTerm& term : terms_.balls) {
        const PackMask is_taken = (term.q >= kMinWeight) & is_used;
        if (Lanes<Pack>::bits(is_taken) == 0) continue;
        const Pack q = zero_unless(is_taken, term.q);
        Pack derivatives[kParameters];
        derive(term, balls_.balls[term.ball], gradients, factor * q, derivatives);
        add_block(term.ball, q, derivatives, gradients.residual, chunk);
      }
    }
    chunk.begins.push_back(static_cast<std::uint32_t>(chunk.block_balls.size()));
    return gradients.cost;
  }

  void add_block(std::uint32_t ball, Pack q, const Pack (&derivatives)[kParameters], Pack residual,
                 FitChunk& chunk) {
    std::uint32_t& slot = slots_[ball];
    if (slot == kNoSlot) {
      slot = static_cast<std::uint32_t>(chunk.balls.size());
      chunk.balls.push_back(ball);
      sums_.resize(sums_.size() + kSums);
    }
    chunk.block_balls.push_back(slot);
    Lanes<Pack>::store(chunk.weights.emplace_back().lanes, q);
    const std::size_t first = chunk.derivatives.size();
    chunk.derivatives.resize(first + kParameters);
    FitLanes* sum = sums_.data() + slot * kSums;
    const auto add = [&](Pack a, Pack b) {
      Lanes<Pack>::store(sum->lanes, fma(a, b, Lanes<Pack>::load(sum->lanes)));
      ++sum;
    };
    for (std::size_t k = 0; k < kParameters; ++k) {
      Lanes<Pack>::store(chunk.derivatives[first + k].lanes, derivatives[k]);
      add(derivatives[k], residual);
    }
    for (std::size_t row = 0; row < kParameters; ++row)
      for (std::size_t column = 0; column <= row; ++column)
        add(derivatives[row], derivatives[column]);
  }

  const SingleBalls& balls_;
  const std::vector<FitPoint>& points_;
  double length_;
  GroupBalls near_;
  FieldTerms terms_;
  std::vector<std::uint32_t> slots_;  ///< places of the balls in FitChunk::balls
  std::vector<FitLanes> sums_;        ///< FitChunk::sums, lane by lane
};

template <int kParameters>
void build_rows(const std::vector<FitBall>& balls, const std::vector<FitPoint>& points,
                double length, std::size_t first, FitRows& rows) {
  const SingleBalls single(balls);
  parallel_ranges(static_cast<std::int64_t>(rows.chunks.size() - first), /*grain=*/1,
                  [&](std::int64_t begin, std::int64_t end) {
                    RowBuilder<kParameters> builder(single, points, length);
                    for (std::int64_t k = begin; k < end; ++k)
                      builder.build(first + static_cast<std::size_t>(k), rows);
                  });
}

}  // namespace

void add_fit_rows(const std::vector<FitBall>& balls, const std::vector<FitPoint>& points,
                  double length, int parameters, FitRows& rows) {
  // The last chunk, if it was not full, is computed again.
  const std::size_t first = rows.point_count / kFitChunkSize;
  rows.point_count = points.size();
  rows.chunks.resize((points.size() + kFitChunkSize - 1) / kFitChunkSize);
  const std::size_t padded_count = (points.size() + kFitLanes - 1) / kFitLanes * kFitLanes;
  for (auto* values : {&rows.residuals, &rows.psi, &rows.steepness}) values->resize(padded_count);
  (parameters == kRoundParameters
       ? build_rows<kRoundParameters>
       : build_rows<kEllipsoidParameters>)(balls, points, length, first, rows);
  rows.cost = 0;
  for (const FitChunk& chunk : rows.chunks) rows.cost += chunk.cost;  // in a fixed order
}

void compute_fit_rows(const std::vector<FitBall>& balls, const std::vector<FitPoint>& points,
                      double length, int parameters, FitRows& rows) {
  rows.point_count = 0;
  add_fit_rows(balls, points, length, parameters, rows);
}

double compute_fit_cost(const std::vector<FitBall>& balls, const std::vector<FitPoint>& points,
                        double length) {
  const SingleBalls single(balls);
  std::vector<double> costs((points.size() + kFitChunkSize - 1) / kFitChunkSize);
  parallel_ranges(static_cast<std::int64_t>(costs.size()), /*grain=*/1,
                  [&](std::int64_t begin, std::int64_t end) {
                    // The cost does not depend on the parameters.
                    RowBuilder<kRoundParameters> builder(single, points, length);
                    for (std::int64_t k = begin; k < end; ++k) {
                      const auto chunk = static_cast<std::size_t>(k);
                      costs[chunk] = builder.compute_cost(chunk);
                    }
                  });
  double sum = 0;
  for (const double cost : costs) sum += cost;  // in a fixed order
  return sum;
}

std::vector<std::uint8_t> test_inside_field(const std::vector<FitBall>& balls,
                                            const std::vector<FitPoint>& points) {
  std::vector<std::uint8_t> inside(points.size());
  const SingleBalls single(balls);
  const auto test_group = [&](std::size_t first, std::size_t end, GroupBalls& near,
                              FieldTerms& terms) {
    near.collect(single, points.data() + first, end - first);
    // psi = top + ln(sum), and the sum is between 1 and the number of balls.
    const float max_log_sum = log(static_cast<float>(near.indices.size())) + 1e-5f;
    for (std::size_t p = first; p < end; p += kFitLanes) {
      const std::size_t count = std::min(kFitLanes, end - p);
      const PackedPoints pack(points.data() + p, count, single.origin);
      compute_logarithms(single, near, pack.position, terms);
      PackMask is_inside = terms.top > 0.0f;
      if (Lanes<Pack>::bits(~is_inside & (terms.top + max_log_sum > 0.0f)) != 0) {
        compute_field(single, near, pack.position, terms);
        is_inside |= terms.psi > 0.0f;
      }
      const std::uint32_t bits = Lanes<Pack>::bits(is_inside);
      for (std::size_t k = 0; k < count; ++k) inside[p + k] = bits >> k & 1u;
    }
  };
  const std::size_t groups = (points.size() + kGroupSize - 1) / kGroupSize;
  parallel_ranges(static_cast<std::int64_t>(groups), /*grain=*/8,
                  [&](std::int64_t begin, std::int64_t end) {
                    GroupBalls near;
                    FieldTerms terms;
                    for (std::int64_t k = begin; k < end; ++k) {
                      const std::size_t first = static_cast<std::size_t>(k) * kGroupSize;
                      test_group(first, std::min(first + kGroupSize, points.size()), near, terms);
                    }
                  });
  return inside;
}

}  // namespace polymorph
