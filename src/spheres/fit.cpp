#include "spheres/fit.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "base/exact_math.h"
#include "base/morton.h"
#include "base/parallel.h"
#include "base/random.h"
#include "base/result.h"
#include "field/extract_surface.h"
#include "field/near_balls.h"
#include "kernels/linear.h"
#include "mesh/closest.h"
#include "spheres/fit_field.h"
#include "spheres/fit_step.h"

namespace polymorph {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

Vector3d to_eigen(Vec3 p) { return {p.x, p.y, p.z}; }

constexpr double kStartDamping = 1e-2;  // of a round or pass of Levenberg-Marquardt steps

/// Samples, targets and state of one fit.
struct Fit {
  std::vector<FitBall> balls;
  /// Three per sample (surface, outside, inside), then active free points (make_free_points()) and
  /// those of add_outlier_constraints().
  std::vector<FitPoint> points;
  std::vector<FitPoint> inactive;  ///< free points that have not been on the wrong side yet
  std::size_t sample_count = 0;
  double length = 1;                      ///< diagonal of the model's box
  int parameters = kEllipsoidParameters;  ///< per ball
  double damping = kStartDamping;
  FitRows rows;
  FitRows tentative;  ///< rows of a tentative step; a member to reuse its memory
};

/// Value of w with which a ball starts. The field is steep enough to be local, and flat enough to
/// depend on points nearby.
constexpr double kStartW = 4;

/// Makes a round ball whose field alone is 1 on the sphere.
FitBall make_ball(const Sphere& sphere) {
  FitBall ball;
  ball.center = to_eigen(sphere.center);
  ball.root = Matrix3d::Identity() * (std::sqrt(kStartW) / static_cast<double>(sphere.radius));
  ball.w = kStartW;
  return ball;
}

/// Moments of the region of the solid that belongs to a sphere. The region lies between the samples
/// nearest to the sphere and the centres of their inner balls; it is flat in a plate and long in a
/// limb. A ball that starts as the ellipsoid of these moments need not be deformed step by step.
struct SecondMoments {
  double weight = 0;                   ///< sum of the weights w of points p of the region
  Vector3d first = Vector3d::Zero();   ///< sum of w p
  Matrix3d second = Matrix3d::Zero();  ///< sum of w p p^T
  void add(const Vector3d& p, double w) {
    weight += w;
    first += w * p;
    second += w * p * p.transpose();
  }
};

/// Computes the moments of each sphere's region. A sample belongs to the sphere with the smallest
/// signed distance.
std::vector<SecondMoments> compute_second_moments(const std::vector<Sphere>& spheres,
                                                  const std::vector<BoundarySample>& samples) {
  std::vector<std::uint32_t> owner(samples.size());
  parallel_for(
      static_cast<std::int64_t>(samples.size()),
      [&](std::int64_t k) {
        const auto s = static_cast<std::size_t>(k);
        float smallest = std::numeric_limits<float>::infinity();
        for (std::size_t i = 0; i < spheres.size(); ++i) {
          const float d = length(samples[s].point - spheres[i].center) - spheres[i].radius;
          if (d < smallest) smallest = d, owner[s] = static_cast<std::uint32_t>(i);
        }
      },
      /*grain=*/64);
  std::vector<SecondMoments> moments(spheres.size());
  for (std::size_t s = 0; s < samples.size(); ++s) {
    const Vector3d p = to_eigen(samples[s].point), n = to_eigen(samples[s].normal);
    const double r = static_cast<double>(samples[s].inner_radius);
    // Points on the line from the inner ball's centre (t = 0) to the sample (t = 1). They represent
    // a cone that ends at the sample's patch: the weight r t^2 is proportional to a slice's volume.
    for (const double t : {0.25, 0.75, 0.95}) moments[owner[s]].add(p - (1 - t) * r * n, r * t * t);
  }
  return moments;
}

/// Makes the ellipsoid with the moments of the sphere's region, or a round ball if it has no
/// samples. `length`: Fit::length.
FitBall make_ball(const Sphere& sphere, const SecondMoments& moments, double length) {
  FitBall ball = make_ball(sphere);
  if (!(moments.weight > 0)) return ball;
  const Vector3d mean = moments.first / moments.weight;
  Eigen::SelfAdjointEigenSolver<Matrix3d> axes(moments.second / moments.weight -
                                               mean * mean.transpose());
  // The variance of a solid ellipsoid along an axis is a fifth of its squared half axis. A flat
  // region has a variance near 0, hence the minimum.
  const double min_half_axis = 0.004 * length;
  const Vector3d half_axes =
      (5 * axes.eigenvalues()).cwiseMax(min_half_axis * min_half_axis).cwiseSqrt();
  ball.center = mean;
  ball.root = (std::sqrt(kStartW) * half_axes.cwiseInverse()).asDiagonal() *
              axes.eigenvectors().transpose();
  return ball;
}

void add_samples(Fit& fit, const std::vector<BoundarySample>& samples) {
  // Offsets stay well within the wall and the gap that the sample's two balls measure.
  const auto clamp_offset = [&](float radius) {
    return std::min(0.01 * fit.length, 0.5 * static_cast<double>(radius));
  };
  constexpr double kOffsetWeight = 0.05;  // a point on the surface has the weight 1
  for (const BoundarySample& s : samples) {
    const Vector3d p = to_eigen(s.point), n = to_eigen(s.normal);
    const double outward = clamp_offset(s.outer_radius), inward = clamp_offset(s.inner_radius);
    fit.points.push_back({p, 0, 1, FitPoint::Rule::kSurface});
    fit.points.push_back({p + outward * n, -outward, kOffsetWeight, FitPoint::Rule::kOffset});
    fit.points.push_back({p - inward * n, inward, kOffsetWeight, FitPoint::Rule::kOffset});
  }
  fit.sample_count = samples.size();
}

/// Makes points that constrain only the sign of the field, in Morton order: one within each
/// sample's inner ball, one within its outer ball, and a lattice through the box. A fit to the
/// surface alone makes holes inside and spurious components outside, where there are no samples.
std::vector<FitPoint> make_free_points(const std::vector<BoundarySample>& samples,
                                       const InsideTest& inside, const Box& box) {
  constexpr double kFreeWeight = 0.1;  // a point on the surface has the weight 1
  const Vec3 margin = box.size() * 0.05f + Vec3{1, 1, 1} * (0.01f * box.diagonal());
  const Box wide{box.low - margin, box.high + margin};
  struct FreePoint {
    Vec3 point;
    bool inside;
  };
  std::vector<FreePoint> free_points;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    // A ball that touches the boundary in p contains no boundary, so points from p almost to its
    // opposite end are inside (outside) without a test.
    const BoundarySample& s = samples[i];
    const float inner_fraction = random_float(/*seed=*/1, /*stream=*/0, i),
                outer_fraction = random_float(/*seed=*/1, /*stream=*/1, i);
    free_points.push_back({s.point - s.normal * (1.8f * s.inner_radius * inner_fraction), true});
    // The lattice covers points further outside.
    const float max_offset = std::min(1.8f * s.outer_radius, 0.1f * box.diagonal());
    free_points.push_back({s.point + s.normal * (max_offset * outer_fraction), false});
  }
  const std::size_t lattice_begin = free_points.size();
  for (std::size_t i = 0; i < 3 * samples.size(); ++i) {
    const auto [x, y, z] = r3_point(i);
    const Vec3 point = wide.low + wide.size() * Vec3{static_cast<float>(x), static_cast<float>(y),
                                                     static_cast<float>(z)};
    free_points.push_back({point, /*inside=*/false});  // set below
  }
  std::vector<std::pair<std::uint64_t, std::size_t>> order(free_points.size());
  for (std::size_t i = 0; i < free_points.size(); ++i)
    order[i] = {morton_key(free_points[i].point, wide), i};
  std::sort(order.begin(), order.end());
  // In this order points are near to each other, so that they are tested faster.
  std::vector<std::size_t> in_lattice;
  std::vector<Vec3> lattice;
  for (const auto& [key, i] : order) {
    if (i < lattice_begin) continue;
    in_lattice.push_back(i);
    lattice.push_back(free_points[i].point);
  }
  const std::vector<std::uint8_t> is_inside = inside.inside(lattice);
  for (std::size_t k = 0; k < lattice.size(); ++k)
    free_points[in_lattice[k]].inside = is_inside[k] != 0;
  std::vector<FitPoint> points;
  for (const auto& [key, i] : order)
    points.push_back({to_eigen(free_points[i].point), /*target=*/0, kFreeWeight,
                      free_points[i].inside ? FitPoint::Rule::kInside : FitPoint::Rule::kOutside});
  return points;
}

/// Activates the free points that are on the wrong side. Most never are, so they are tested only
/// every few steps. Active points stay active.
void activate_wrong_points(Fit& fit) {
  const std::vector<std::uint8_t> inside = test_inside_field(fit.balls, fit.inactive);
  std::vector<FitPoint> still_inactive;
  for (std::size_t i = 0; i < fit.inactive.size(); ++i) {
    const bool wrong = (inside[i] != 0) != (fit.inactive[i].rule == FitPoint::Rule::kInside);
    (wrong ? fit.points : still_inactive).push_back(fit.inactive[i]);
  }
  fit.inactive = std::move(still_inactive);
}

/// Applies a step to one ball; the change of each parameter is limited. `step`: changes of w, of
/// the centre and of D (FitBall::root), as xx, yy, zz, xy, xz, yz or, for a round ball, as one
/// number.
FitBall apply_step(const FitBall& ball, const double* step, int parameters, double length) {
  FitBall next = ball;
  const double shift = Vector3d(step[1], step[2], step[3]).norm();
  const double max_shift = 0.02 * length;
  next.w += std::clamp(step[0], -2.0, 2.0);
  next.center +=
      Vector3d(step[1], step[2], step[3]) * (shift > max_shift ? max_shift / shift : 1.0);
  Matrix3d d;
  if (parameters == kRoundParameters) {
    d = Matrix3d::Identity() * step[4];
  } else {
    d << step[4], step[7], step[8], step[7], step[5], step[9], step[8], step[9], step[6];
  }
  constexpr double kMaxStretch = 0.4;
  if (const double size = d.norm(); size > kMaxStretch) d *= kMaxStretch / size;
  // The second-order approximation of exp(d / 2) root.
  next.root = (Matrix3d::Identity() + d / 2 + d * d / 8) * ball.root;
  return next;
}

/// Limits an ellipsoid's axes to lengths that the samples can determine and the surface grid can
/// resolve.
void limit_axes(FitBall& ball, double length) {
  constexpr double kMaxRatio = 12;  // of an ellipsoid's axes
  // At w = 4, a half axis is 2 / s for a singular value s of `root`: 0.002 to 4 times the length.
  const double max_root = 2 / (0.002 * length), min_root = 0.5 / length;
  Eigen::JacobiSVD<Matrix3d> svd(ball.root, Eigen::ComputeFullV);
  Vector3d s = svd.singularValues();  // descending
  const double largest = std::min(s[0], max_root);
  const Vector3d limited = s.cwiseMin(largest).cwiseMax(std::max(largest / kMaxRatio, min_root));
  if (limited == s) return;
  ball.root = limited.asDiagonal() * svd.matrixV().transpose();
}

/// Evaluates all points after the balls have changed.
void evaluate(const std::vector<FitBall>& balls, const Fit& fit, FitRows& rows) {
  compute_fit_rows(balls, fit.points, fit.length, fit.parameters, rows);
}

/// Evaluates only points added since the last call, with unchanged balls.
void evaluate_added(Fit& fit) {
  add_fit_rows(fit.balls, fit.points, fit.length, fit.parameters, fit.rows);
}

/// Makes one Levenberg-Marquardt step; returns false if no damping reduces the cost.
bool improve(Fit& fit) {
  for (int attempt = 0; attempt < 6; ++attempt) {
    const std::vector<double> step =
        solve_damped_step(fit.rows, fit.balls.size(), fit.parameters, fit.damping);
    std::vector<FitBall> next(fit.balls.size());
    parallel_for(
        static_cast<std::int64_t>(next.size()),
        [&](std::int64_t k) {
          const auto i = static_cast<std::size_t>(k);
          next[i] =
              apply_step(fit.balls[i], step.data() + i * static_cast<std::size_t>(fit.parameters),
                         fit.parameters, fit.length);
          limit_axes(next[i], fit.length);
        },
        /*grain=*/16);
    evaluate(next, fit, fit.tentative);
    if (fit.tentative.cost < fit.rows.cost) {
      fit.balls = std::move(next);
      std::swap(fit.rows, fit.tentative);
      fit.damping = std::max(fit.damping / 2, 1e-5);
      return true;
    }
    fit.damping = std::min(fit.damping * 4, 1e4);
  }
  return false;
}

/// Computes the first-order signed distance of a sample.
double compute_distance(const Fit& fit, std::size_t sample) {
  const std::size_t p = 3 * sample;
  return static_cast<double>(fit.rows.psi[p]) / static_cast<double>(fit.rows.steepness[p]);
}

/// Computes the contribution of each ball: the squared error that its removal would cause, to first
/// order.
std::vector<double> compute_contributions(const Fit& fit) {
  std::vector<double> contributions(fit.balls.size(), 0.0);
  for (std::size_t s = 0; s < fit.sample_count; ++s) {
    const std::size_t p = 3 * s;  // the sample's point on the surface
    const auto steepness = static_cast<double>(fit.rows.steepness[p]);
    for_each_fit_entry(fit.rows, p, [&](std::uint32_t ball, float weight, std::uint32_t) {
      // Without the ball psi changes by ln(1 - q); the two limits keep this finite.
      const double q = std::min(static_cast<double>(weight), 0.999);
      const double shift = std::min(-exact::log1p(-q) / steepness, 0.05 * fit.length);
      contributions[ball] += shift * shift;
    });
  }
  return contributions;
}

/// Moves the balls with the smallest contributions, at most `max_fraction` of all, to the largest
/// errors, while these are more than twice as large: into the medial ball of a sample that lies
/// outside the field, or next to a ball that would need two shapes at once.
void move_balls(Fit& fit, const std::vector<BoundarySample>& samples, double max_fraction) {
  const std::vector<double> contributions = compute_contributions(fit);
  std::vector<std::size_t> by_contribution(fit.balls.size());
  std::iota(by_contribution.begin(), by_contribution.end(), std::size_t{0});
  std::sort(by_contribution.begin(), by_contribution.end(), [&](std::size_t a, std::size_t b) {
    return contributions[a] != contributions[b] ? contributions[a] < contributions[b] : a < b;
  });
  // Distribute each sample's squared error to its balls.
  std::vector<double> squared_errors(fit.balls.size(), 0.0);
  for (std::size_t s = 0; s < fit.sample_count; ++s) {
    const double e = compute_distance(fit, s);
    for_each_fit_entry(fit.rows, 3 * s, [&](std::uint32_t ball, float weight, std::uint32_t) {
      squared_errors[ball] += static_cast<double>(weight) * e * e;
    });
  }
  std::vector<std::size_t> by_error(fit.balls.size());
  std::iota(by_error.begin(), by_error.end(), std::size_t{0});
  std::sort(by_error.begin(), by_error.end(), [&](std::size_t a, std::size_t b) {
    return squared_errors[a] != squared_errors[b] ? squared_errors[a] > squared_errors[b] : a < b;
  });
  const auto max_moves =
      static_cast<std::size_t>(max_fraction * static_cast<double>(fit.balls.size()));
  std::vector<std::uint8_t> is_used(fit.balls.size(), 0);
  // The sample with the largest error in each ball's region.
  std::vector<std::size_t> worst_sample(fit.balls.size(), fit.sample_count);
  std::vector<double> worst_error(fit.balls.size(), 0.0);
  for (std::size_t s = 0; s < fit.sample_count; ++s) {
    const double e = std::abs(compute_distance(fit, s));
    for_each_fit_entry(fit.rows, 3 * s, [&](std::uint32_t ball, float weight, std::uint32_t) {
      const double weighted_error = e * static_cast<double>(weight);
      if (weighted_error > worst_error[ball])
        worst_error[ball] = weighted_error, worst_sample[ball] = s;
    });
  }
  std::size_t move_count = 0;
  for (std::size_t i = 0; i < by_error.size() && move_count < max_moves; ++i) {
    // Both lists are sorted: later balls contribute more, and later errors are smaller.
    const std::size_t moved = by_contribution[move_count], crowded = by_error[i];
    if (contributions[moved] * 2 > squared_errors[crowded] || is_used[crowded] || moved == crowded)
      break;
    const std::size_t s = worst_sample[crowded];
    if (s == fit.sample_count) continue;  // the ball contributes to no sample
    is_used[moved] = is_used[crowded] = 1;
    ++move_count;
    if (fit.rows.psi[3 * s] < 0) {  // the sample lies outside the field: fill it in
      const BoundarySample& sample = samples[s];
      const float r = std::max(sample.inner_radius, 0.004f * static_cast<float>(fit.length));
      fit.balls[moved] = make_ball({sample.point - sample.normal * r, r});
      // The ball adds 1 - field at the sample, so that the sum there is 1.
      fit.balls[moved].w +=
          exact::log(-exact::expm1(std::max(static_cast<double>(fit.rows.psi[3 * s]), -40.0)));
      continue;
    }
    // Split the ball along its longest axis into two smaller and weaker halves.
    FitBall& ball = fit.balls[crowded];
    Eigen::JacobiSVD<Matrix3d> svd(ball.root, Eigen::ComputeFullV);
    // The longest axis belongs to the smallest singular value, which is the last one.
    const Vector3d axis = svd.matrixV().col(2) / svd.singularValues()[2];
    ball.root *= 1.15;
    ball.w -= 0.5;
    FitBall twin = ball;
    ball.center += 0.6 * axis;
    twin.center -= 0.6 * axis;
    fit.balls[moved] = twin;
  }
}

FitBall to_fit_ball(const Ball& ball) {
  const auto& s = ball.shape;
  Matrix3d shape;
  shape << s.xx, s.xy, s.xz, s.xy, s.yy, s.yz, s.xz, s.yz, s.zz;
  FitBall fitted;
  fitted.center = to_eigen(ball.center);
  fitted.root = Eigen::SelfAdjointEigenSolver<Matrix3d>(shape).operatorSqrt() *
                std::sqrt(static_cast<double>(ball.a));
  fitted.w = static_cast<double>(ball.w);
  return fitted;
}

Ball to_ball(const FitBall& fitted) {
  const Matrix3d a = fitted.root.transpose() * fitted.root;
  const double size = cube_root(a.determinant());  // a ball's shape has determinant 1
  const auto scaled = [&](double v) { return static_cast<float>(v / size); };
  Ball ball;
  ball.center = {static_cast<float>(fitted.center[0]), static_cast<float>(fitted.center[1]),
                 static_cast<float>(fitted.center[2])};
  ball.a = static_cast<float>(size);
  ball.w = static_cast<float>(fitted.w);
  ball.shape = {scaled(a(0, 0)), scaled(a(1, 1)), scaled(a(2, 2)),
                scaled(a(0, 1)), scaled(a(0, 2)), scaled(a(1, 2))};
  return ball;
}

std::vector<Ball> to_balls(const Fit& fit) {
  std::vector<Ball> balls;
  for (const FitBall& ball : fit.balls) balls.push_back(to_ball(ball));
  return balls;
}

/// Computes the RMS of the first-order distance at the samples.
double compute_surface_rms(const Fit& fit) {
  double sum = 0;
  for (std::size_t s = 0; s < fit.sample_count; ++s) {
    const double error = compute_distance(fit, s);
    sum += error * error;
  }
  return std::sqrt(sum / static_cast<double>(fit.sample_count));
}

/// Finds the vertices of the surface that lie far from the model, and constrains at most
/// kMaxConstraints of them to lie outside or inside. The constraints remove spurious components and
/// bulges between the free points. Returns the number of vertices found.
Result<std::size_t> add_outlier_constraints(Fit& fit, const ClosestPointQuery& boundary,
                                            const InsideTest& inside) {
  constexpr std::size_t kMaxConstraints = 2000;
  const double max_distance = 0.008 * fit.length;
  PM_TRY(const Mesh mesh, extract_surface(*make_cpu_engine(), to_balls(fit),
                                          static_cast<float>(fit.length / 160), {}));
  const std::vector<ClosestPoint> closest = boundary.closest(mesh.positions);
  std::vector<Vec3> outliers;
  std::vector<double> distances;
  for (std::size_t i = 0; i < closest.size(); ++i) {
    if (static_cast<double>(closest[i].distance) <= max_distance) continue;
    outliers.push_back(mesh.positions[i]);
    distances.push_back(static_cast<double>(closest[i].distance));
  }
  const std::vector<std::uint8_t> is_inside = inside.inside(outliers);
  const std::size_t stride = outliers.size() / kMaxConstraints + 1;
  for (std::size_t i = 0; i < outliers.size(); i += stride) {
    const double target = std::min(distances[i], 0.02 * fit.length);
    fit.points.push_back({to_eigen(outliers[i]), is_inside[i] ? target : -target, /*weight=*/1,
                          is_inside[i] ? FitPoint::Rule::kInside : FitPoint::Rule::kOutside});
  }
  return outliers.size();
}

/// Computes the half extents, along the coordinate axes, of a ball's ellipsoid, in which
/// (x - c)^T A (x - c) <= w, with A = Ball::a * Ball::shape.
Vector3d half_extents(const Ball& ball, double w) {
  const auto& s = ball.shape;
  Matrix3d a;
  a << s.xx, s.xy, s.xz, s.xy, s.yy, s.yz, s.xz, s.yz, s.zz;
  a *= static_cast<double>(ball.a);
  return (std::max(w, 0.0) * a.inverse().diagonal()).cwiseMax(0).cwiseSqrt();
}

/// Tests whether the balls' surface crosses the sides of the box, each moved outward by 0.08 of the
/// diagonal, or lies beyond them.
bool extends_beyond(const std::vector<Ball>& balls, const Box& box) {
  constexpr int kSteps = 24;  // per side of the box
  const float margin = 0.08f * box.diagonal();
  const Box wide = widened(box, margin);
  const Vec3 size = wide.size();
  const auto is_outside = [&](Vec3 p) { return !(min(max(p, wide.low), wide.high) == p); };
  // Contributions of which none reaches 1 / count do not sum to 1; 0.99 is for rounding.
  const auto min_logarithm =
      static_cast<float>(exact::log(0.99 / static_cast<double>(balls.size())));
  const auto is_inside_surface = [&](Vec3 p) {
    if (std::none_of(balls.begin(), balls.end(), [&](const Ball& ball) {
          return log_contribution(ball, FieldKind::kGaussian, p - ball.center) > min_logarithm;
        }))
      return false;
    double field = 0;
    for (const Ball& ball : balls)
      field += exact::exp(
          static_cast<double>(log_contribution(ball, FieldKind::kGaussian, p - ball.center)));
    return field > 1;
  };
  for (const Ball& ball : balls)
    if (ball.w > 0 && is_outside(ball.center)) return true;
  // Test a lattice of points on each of the six sides; f has coordinates from 0 to 1.
  for (int i = 0; i <= kSteps; ++i)
    for (int k = 0; k <= kSteps; ++k) {
      const float s = static_cast<float>(i) / kSteps, t = static_cast<float>(k) / kSteps;
      for (const float side : {0.0f, 1.0f})
        for (const Vec3 f : {Vec3{side, s, t}, Vec3{s, side, t}, Vec3{s, t, side}})
          if (is_inside_surface(wide.low + Vec3{f.x * size.x, f.y * size.y, f.z * size.z}))
            return true;
    }
  return false;
}

}  // namespace

std::vector<Ball> move_into_box(std::vector<Ball> balls, const Box& box) {
  constexpr double kMargin = 0.01;          // fraction of the diagonal
  constexpr double kNeighbourWeight = 1.4;  // ln 4: neighbours make the field 4 times a ball's own
  if (!extends_beyond(balls, box)) return balls;
  const Vector3d low = to_eigen(box.low), high = to_eigen(box.high);
  const auto diagonal = static_cast<double>(box.diagonal());
  for (Ball& ball : balls) {
    ball.center = min(max(ball.center, box.low), box.high);
    const Vector3d center = to_eigen(ball.center),
                   half = half_extents(ball, static_cast<double>(ball.w) + kNeighbourWeight);
    const Vector3d available = (center - low).cwiseMin(high - center).array() + kMargin * diagonal;
    const double shrink = half.cwiseQuotient(available).maxCoeff();
    if (shrink > 1) ball.a *= static_cast<float>(shrink * shrink);
  }
  return balls;
}

Result<FitResult> refit_balls(const Model& model, const InsideTest& inside,
                              const std::vector<BoundarySample>& samples,
                              const std::vector<Ball>& balls, const FitSettings& settings) {
  PM_CHECK(!balls.empty() && !samples.empty());
  Fit fit;
  fit.length = static_cast<double>(model.box().diagonal());
  fit.parameters = settings.ellipsoids ? kEllipsoidParameters : kRoundParameters;
  for (const Ball& ball : balls) {
    fit.balls.push_back(to_fit_ball(ball));
    limit_axes(fit.balls.back(), fit.length);
  }
  add_samples(fit, samples);
  fit.inactive = make_free_points(samples, inside, model.box());
  activate_wrong_points(fit);
  evaluate(fit.balls, fit, fit.rows);
  FitResult result;
  while (result.iterations < settings.iterations && improve(fit)) ++result.iterations;
  result.rms = compute_surface_rms(fit);
  result.balls = to_balls(fit);
  return result;
}

Result<FitResult> fit_balls(const Model& model, const InsideTest& inside,
                            const std::vector<BoundarySample>& samples,
                            const std::vector<Sphere>& spheres, const FitSettings& settings) {
  PM_CHECK(!spheres.empty() && !samples.empty());
  const Box box = model.box();
  Fit fit;
  fit.length = static_cast<double>(box.diagonal());
  fit.parameters = settings.ellipsoids ? kEllipsoidParameters : kRoundParameters;
  const std::vector<SecondMoments> moments = compute_second_moments(spheres, samples);
  for (std::size_t i = 0; i < spheres.size(); ++i) {
    fit.balls.push_back(settings.ellipsoids ? make_ball(spheres[i], moments[i], fit.length)
                                            : make_ball(spheres[i]));
    limit_axes(fit.balls.back(), fit.length);
  }
  add_samples(fit, samples);
  fit.inactive = make_free_points(samples, inside, box);
  activate_wrong_points(fit);
  evaluate(fit.balls, fit, fit.rows);
  constexpr int kActivationInterval = 4, kPassSteps = 4;  // Levenberg-Marquardt steps
  // Rounds of steps, each but the last followed by moves of balls.
  FitResult result;
  std::vector<FitBall> best;  // the best so far: a round may increase the cost
  for (int round = 0; round <= settings.rounds; ++round) {
    const int end = settings.iterations * (round + 1) / (settings.rounds + 1);
    for (int i = 1; result.iterations < end && improve(fit); ++i, ++result.iterations) {
      if (i % kActivationInterval == 0) {
        activate_wrong_points(fit);
        evaluate_added(fit);
      }
    }
    result.iterations = end;  // also if no damping reduced the cost
    activate_wrong_points(fit);
    evaluate_added(fit);
    if (!best.empty() && compute_fit_cost(best, fit.points, fit.length) < fit.rows.cost) {
      fit.balls = best;
      evaluate(fit.balls, fit, fit.rows);
    }
    best = fit.balls;
    if (round == settings.rounds) break;
    move_balls(fit, samples, /*max_fraction=*/0.08);
    activate_wrong_points(fit);
    fit.damping = kStartDamping;
    evaluate(fit.balls, fit, fit.rows);
  }
  // Passes: constrain points of the surface far from the model, and continue the fit.
  const ClosestPointQuery boundary(model);
  for (int pass = 0; pass < settings.passes; ++pass) {
    PM_TRY(const std::size_t outliers, add_outlier_constraints(fit, boundary, inside));
    if (outliers == 0) break;
    evaluate_added(fit);
    fit.damping = kStartDamping;
    for (int i = 0; i < kPassSteps && improve(fit); ++i) ++result.iterations;
  }
  result.rms = compute_surface_rms(fit);
  result.balls = to_balls(fit);
  return result;
}

}  // namespace polymorph
