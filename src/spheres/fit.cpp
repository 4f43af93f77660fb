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

/// Samples, targets and state of one fit.
struct Fit {
  std::vector<FitBall> balls;
  std::vector<FitPoint> points;  ///< three per sample (surface, outside, inside), then free ones
  std::vector<FitPoint> free;    ///< free points that were never on the wrong side
  std::size_t sample_count = 0;
  double length = 1;
  int numbers = kEllipsoidNumbers;
  double damping = 1e-2;
  FitRows rows;
  FitRows tried;  ///< of the balls of a step that may be taken; kept for its memory
};

FitBall ball_of(const Sphere& sphere) {
  // A lone ball of w = 4 has its surface at its sphere; the field is steep enough to be local, and
  // flat enough to feel what is near.
  constexpr double kWeight = 4;
  FitBall ball;
  ball.center = to_eigen(sphere.center);
  ball.root = Matrix3d::Identity() * (std::sqrt(kWeight) / static_cast<double>(sphere.radius));
  ball.w = kWeight;
  return ball;
}

/// The part of the solid that a sphere stands for: second moments of what lies between the samples
/// nearest to it and their own inner balls' centres. A sphere in a plate stands for a flat piece of
/// it, one in a limb for a length of it; a ball started as the ellipsoid of those moments need not
/// find that out step by step.
struct SecondMoments {
  double weight = 0;
  Vector3d first = Vector3d::Zero();
  Matrix3d second = Matrix3d::Zero();
  void add(const Vector3d& p, double w) {
    weight += w;
    first += w * p;
    second += w * p * p.transpose();
  }
};

std::vector<SecondMoments> second_moments_of(const std::vector<Sphere>& spheres,
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
      64);
  std::vector<SecondMoments> moments(spheres.size());
  for (std::size_t s = 0; s < samples.size(); ++s) {
    const Vector3d p = to_eigen(samples[s].point), n = to_eigen(samples[s].normal);
    const double r = static_cast<double>(samples[s].inner_radius);
    // A cone from the sample's patch to the centre: more of it lies near the patch.
    for (const double t : {0.25, 0.75, 0.95}) moments[owner[s]].add(p - (1 - t) * r * n, r * t * t);
  }
  return moments;
}

FitBall ball_of(const Sphere& sphere, const SecondMoments& moments, double length) {
  constexpr double kWeight = 4;
  FitBall ball = ball_of(sphere);
  if (!(moments.weight > 0)) return ball;
  const Vector3d mean = moments.first / moments.weight;
  Eigen::SelfAdjointEigenSolver<Matrix3d> axes(moments.second / moments.weight -
                                               mean * mean.transpose());
  // A solid ellipsoid's variance along an axis is a fifth of the square of its half length.
  const double smallest = 0.004 * length;
  const Vector3d half = (5 * axes.eigenvalues()).cwiseMax(smallest * smallest).cwiseSqrt();
  ball.center = mean;
  ball.root =
      (std::sqrt(kWeight) * half.cwiseInverse()).asDiagonal() * axes.eigenvectors().transpose();
  return ball;
}

void add_samples(Fit& fit, const std::vector<BoundarySample>& samples) {
  // Offsets stay well within the wall and the gap that the sample's balls measured.
  const auto offset_in = [&](float radius) {
    return std::min(0.01 * fit.length, 0.5 * static_cast<double>(radius));
  };
  constexpr double kOffsetWeight = 0.05;
  for (const BoundarySample& s : samples) {
    const Vector3d p = to_eigen(s.point), n = to_eigen(s.normal);
    const double out = offset_in(s.outer_radius), in = offset_in(s.inner_radius);
    fit.points.push_back({p, 0, 1, FitPoint::Rule::kSurface});
    fit.points.push_back({p + out * n, -out, kOffsetWeight, FitPoint::Rule::kOffset});
    fit.points.push_back({p - in * n, in, kOffsetWeight, FitPoint::Rule::kOffset});
  }
  fit.sample_count = samples.size();
}

/// Points that only say on which side they are, in Morton order: one within each sample's inner
/// ball, one within its outer ball, and a lattice through the box. A fit that looks at the surface
/// alone grows holes inside and spurious components outside, where it has no sample.
std::vector<FitPoint> free_points(const std::vector<BoundarySample>& samples,
                                  const InsideTest& inside, const Box& box) {
  constexpr double kFreeWeight = 0.1;
  const Vec3 margin = box.size() * 0.05f + Vec3{1, 1, 1} * (0.01f * box.diagonal());
  const Box wide{box.low - margin, box.high + margin};
  struct Free {
    Vec3 point;
    bool inside;
  };
  std::vector<Free> all;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    // A ball that touches the boundary in p holds no boundary: from p to nearly its far end a point
    // is known to lie inside (outside) without asking.
    const BoundarySample& s = samples[i];
    const float deep = random_float(1, 0, i), out = random_float(1, 1, i);
    all.push_back({s.point - s.normal * (1.8f * s.inner_radius * deep), true});
    // Farther out the lattice does.
    const float reach = std::min(1.8f * s.outer_radius, 0.1f * box.diagonal());
    all.push_back({s.point + s.normal * (reach * out), false});
  }
  std::vector<Vec3> lattice(3 * samples.size());
  for (std::size_t i = 0; i < lattice.size(); ++i) {
    const auto [x, y, z] = r3_point(i);
    lattice[i] = wide.low + wide.size() * Vec3{static_cast<float>(x), static_cast<float>(y),
                                               static_cast<float>(z)};
  }
  const std::vector<std::uint8_t> in = inside.inside(lattice);
  for (std::size_t i = 0; i < lattice.size(); ++i) all.push_back({lattice[i], in[i] != 0});
  std::vector<std::pair<std::uint64_t, std::size_t>> order(all.size());
  for (std::size_t i = 0; i < all.size(); ++i) order[i] = {morton_key(all[i].point, wide), i};
  std::sort(order.begin(), order.end());
  std::vector<FitPoint> points;
  for (const auto& [key, i] : order)
    points.push_back({to_eigen(all[i].point), 0, kFreeWeight,
                      all[i].inside ? FitPoint::Rule::kInside : FitPoint::Rule::kOutside});
  return points;
}

/// Takes up the free points that the fit has on the wrong side. Most never are, and are tested once
/// per round instead of once per step; those once taken up stay.
void add_wrong(Fit& fit) {
  const std::vector<std::uint8_t> inside = inside_field(fit.balls, fit.free);
  std::vector<FitPoint> right;
  for (std::size_t i = 0; i < fit.free.size(); ++i) {
    const bool wrong = (inside[i] != 0) != (fit.free[i].rule == FitPoint::Rule::kInside);
    (wrong ? fit.points : right).push_back(fit.free[i]);
  }
  fit.free = std::move(right);
}

/// The ball after its part of a step, each number clamped.
FitBall moved(const FitBall& ball, const double* step, int numbers, double length) {
  FitBall next = ball;
  const double shift = Vector3d(step[1], step[2], step[3]).norm();
  const double max_shift = 0.02 * length;
  next.w += std::clamp(step[0], -2.0, 2.0);
  next.center +=
      Vector3d(step[1], step[2], step[3]) * (shift > max_shift ? max_shift / shift : 1.0);
  Matrix3d d;
  if (numbers == kRoundNumbers) {
    d = Matrix3d::Identity() * step[4];
  } else {
    d << step[4], step[7], step[8], step[7], step[5], step[9], step[8], step[9], step[6];
  }
  constexpr double kMaxStretch = 0.4;
  if (const double size = d.norm(); size > kMaxStretch) d *= kMaxStretch / size;
  next.root = (Matrix3d::Identity() + d / 2 + d * d / 8) * ball.root;
  return next;
}

/// Holds an ellipsoid's axes within what the samples can tell and the surface grid can show.
void limit_axes(FitBall& ball, double length) {
  constexpr double kMaxRatio = 12;
  const double max_root = 2 / (0.002 * length), min_root = 0.5 / length;
  Eigen::JacobiSVD<Matrix3d> svd(ball.root, Eigen::ComputeFullV);
  Vector3d s = svd.singularValues();  // falling
  const double high = std::min(s[0], max_root);
  const Vector3d limited = s.cwiseMin(high).cwiseMax(std::max(high / kMaxRatio, min_root));
  if (limited == s) return;
  ball.root = limited.asDiagonal() * svd.matrixV().transpose();
}

/// Of all points, after the balls were changed.
void evaluate(const std::vector<FitBall>& balls, const Fit& fit, FitRows& rows) {
  rows.clear();
  add_fit_rows(balls, fit.points, fit.length, fit.numbers, rows);
}

/// Of the points that were added since, with the same balls.
void evaluate_added(Fit& fit) {
  add_fit_rows(fit.balls, fit.points, fit.length, fit.numbers, fit.rows);
}

/// One Levenberg-Marquardt step; false when no damping makes the cost fall.
bool improve(Fit& fit) {
  for (int attempt = 0; attempt < 6; ++attempt) {
    const std::vector<double> step =
        damped_step(fit.rows, fit.balls.size(), fit.numbers, fit.damping);
    std::vector<FitBall> next(fit.balls.size());
    for (std::size_t i = 0; i < next.size(); ++i) {
      next[i] = moved(fit.balls[i], step.data() + i * static_cast<std::size_t>(fit.numbers),
                      fit.numbers, fit.length);
      limit_axes(next[i], fit.length);
    }
    evaluate(next, fit, fit.tried);
    if (fit.tried.cost < fit.rows.cost) {
      fit.balls = std::move(next);
      std::swap(fit.rows, fit.tried);
      fit.damping = std::max(fit.damping / 2, 1e-5);
      return true;
    }
    fit.damping = std::min(fit.damping * 4, 1e4);
  }
  return false;
}

/// The contribution of each ball: the squared error that its removal would cause, to first order.
std::vector<double> ball_contributions(const Fit& fit) {
  std::vector<double> contributions(fit.balls.size(), 0.0);
  for (std::size_t s = 0; s < fit.sample_count; ++s) {
    const std::size_t p = 3 * s;
    for (std::uint32_t e = fit.rows.begins[p]; e < fit.rows.begins[p + 1]; ++e) {
      // Without the ball psi falls by ln(1 - q).
      const double q = std::min(static_cast<double>(fit.rows.shares[e]), 0.999);
      const double shift = std::min(-exact::log1p(-q) / fit.rows.steepness[p], 0.05 * fit.length);
      contributions[fit.rows.balls[e]] += shift * shift;
    }
  }
  return contributions;
}

/// Moves the balls that contribute least to where the error is largest: into the medial ball of a
/// sample that the field leaves out, or beside a ball that is asked for two shapes at once.
void move_balls(Fit& fit, const std::vector<BoundarySample>& samples, double share) {
  const std::vector<double> contributions = ball_contributions(fit);
  std::vector<std::size_t> cheap(fit.balls.size());
  std::iota(cheap.begin(), cheap.end(), std::size_t{0});
  std::sort(cheap.begin(), cheap.end(), [&](std::size_t a, std::size_t b) {
    return contributions[a] != contributions[b] ? contributions[a] < contributions[b] : a < b;
  });
  // Error each ball is responsible for.
  std::vector<double> squared_errors(fit.balls.size(), 0.0);
  for (std::size_t s = 0; s < fit.sample_count; ++s) {
    const std::size_t p = 3 * s;
    const double e = fit.rows.psi[p] / fit.rows.steepness[p];
    for (std::uint32_t k = fit.rows.begins[p]; k < fit.rows.begins[p + 1]; ++k)
      squared_errors[fit.rows.balls[k]] += static_cast<double>(fit.rows.shares[k]) * e * e;
  }
  std::vector<std::size_t> worst(fit.balls.size());
  std::iota(worst.begin(), worst.end(), std::size_t{0});
  std::sort(worst.begin(), worst.end(), [&](std::size_t a, std::size_t b) {
    return squared_errors[a] != squared_errors[b] ? squared_errors[a] > squared_errors[b] : a < b;
  });
  const auto moves = static_cast<std::size_t>(share * static_cast<double>(fit.balls.size()));
  std::vector<std::uint8_t> taken(fit.balls.size(), 0);
  // The worst sample of the region where each ball dominates.
  std::vector<std::size_t> worst_sample(fit.balls.size(), fit.sample_count);
  std::vector<double> worst_error(fit.balls.size(), 0.0);
  for (std::size_t s = 0; s < fit.sample_count; ++s) {
    const std::size_t p = 3 * s;
    const double e = std::abs(fit.rows.psi[p] / fit.rows.steepness[p]);
    for (std::uint32_t k = fit.rows.begins[p]; k < fit.rows.begins[p + 1]; ++k) {
      const double mine = e * static_cast<double>(fit.rows.shares[k]);
      if (mine > worst_error[fit.rows.balls[k]])
        worst_error[fit.rows.balls[k]] = mine, worst_sample[fit.rows.balls[k]] = s;
    }
  }
  std::size_t done = 0;
  for (std::size_t i = 0; i < worst.size() && done < moves; ++i) {
    const std::size_t from = cheap[done], at = worst[i];
    if (contributions[from] * 2 > squared_errors[at] || taken[at] || from == at) break;
    const std::size_t s = worst_sample[at];
    if (s == fit.sample_count) continue;
    taken[from] = taken[at] = 1;
    ++done;
    if (fit.rows.psi[3 * s] < 0) {  // the sample lies outside the field: fill it in
      const BoundarySample& sample = samples[s];
      const float r = std::max(sample.inner_radius, 0.004f * static_cast<float>(fit.length));
      fit.balls[from] = ball_of({sample.point - sample.normal * r, r});
      // As strong as it takes to bring the field at the sample to 1.
      fit.balls[from].w += exact::log(-exact::expm1(std::max(fit.rows.psi[3 * s], -40.0)));
      continue;
    }
    // Two halves along the ball's longest axis.
    FitBall& ball = fit.balls[at];
    Eigen::JacobiSVD<Matrix3d> svd(ball.root, Eigen::ComputeFullV);
    const Vector3d axis = svd.matrixV().col(2) / svd.singularValues()[2];
    ball.root *= 1.15;
    ball.w -= 0.5;
    FitBall twin = ball;
    ball.center += 0.6 * axis;
    twin.center -= 0.6 * axis;
    fit.balls[from] = twin;
  }
}

Ball finished(const FitBall& fitted) {
  const Matrix3d a = fitted.root.transpose() * fitted.root;
  const double size = cube_root(a.determinant());
  const auto f = [&](double v) { return static_cast<float>(v / size); };
  Ball ball;
  ball.center = {static_cast<float>(fitted.center[0]), static_cast<float>(fitted.center[1]),
                 static_cast<float>(fitted.center[2])};
  ball.a = static_cast<float>(size);
  ball.w = static_cast<float>(fitted.w);
  ball.shape = {f(a(0, 0)), f(a(1, 1)), f(a(2, 2)), f(a(0, 1)), f(a(0, 2)), f(a(1, 2))};
  return ball;
}

std::vector<Ball> finished(const Fit& fit) {
  std::vector<Ball> balls;
  for (const FitBall& ball : fit.balls) balls.push_back(finished(ball));
  return balls;
}

/// Adds points of the surface that lie far from the model, constrained to lie outside or inside:
/// spurious components and bulges between the free points. Returns how many points were added.
Result<std::size_t> add_outlier_constraints(Fit& fit, const ClosestPointQuery& boundary,
                                            const InsideTest& inside) {
  constexpr std::size_t kMax = 2000;
  const double far = 0.008 * fit.length;
  PM_TRY(const Mesh mesh, extract_surface(*make_cpu_engine(), finished(fit),
                                          static_cast<float>(fit.length / 160), {}));
  const std::vector<ClosestPoint> closest = boundary.closest(mesh.positions);
  std::vector<Vec3> outliers;
  std::vector<double> distances;
  for (std::size_t i = 0; i < closest.size(); ++i) {
    if (static_cast<double>(closest[i].distance) <= far) continue;
    outliers.push_back(mesh.positions[i]);
    distances.push_back(static_cast<double>(closest[i].distance));
  }
  const std::vector<std::uint8_t> in = inside.inside(outliers);
  const std::size_t stride = outliers.size() / kMax + 1;
  for (std::size_t i = 0; i < outliers.size(); i += stride) {
    const double target = std::min(distances[i], 0.02 * fit.length);
    fit.points.push_back({to_eigen(outliers[i]), in[i] ? target : -target, 1,
                          in[i] ? FitPoint::Rule::kInside : FitPoint::Rule::kOutside});
  }
  return outliers.size();
}

/// Half the extent along each axis of where w - (x - c)^T A (x - c) is not negative.
Vector3d half_extent(const Ball& ball, double w) {
  const auto& s = ball.shape;
  Matrix3d a;
  a << s.xx, s.xy, s.xz, s.xy, s.yy, s.yz, s.xz, s.yz, s.zz;
  a *= static_cast<double>(ball.a);
  return (std::max(w, 0.0) * a.inverse().diagonal()).cwiseMax(0).cwiseSqrt();
}

/// Does the balls' surface cross the sides of the box, each pushed out by 0.08 of the diagonal,
/// or lie beyond them?
bool reaches_beyond(const std::vector<Ball>& balls, const Box& box) {
  constexpr int kSteps = 24;
  const float margin = 0.08f * box.diagonal();
  const Box wide = {box.low - Vec3{margin, margin, margin},
                    box.high + Vec3{margin, margin, margin}};
  const Vec3 size = wide.size();
  const auto is_outside = [&](Vec3 p) { return !(min(max(p, wide.low), wide.high) == p); };
  const auto is_inside_surface = [&](Vec3 p) {
    double field = 0;
    for (const Ball& ball : balls)
      field += exact::exp(
          static_cast<double>(log_strength(ball, FieldKind::kGaussian, p - ball.center)));
    return field > 1;
  };
  for (const Ball& ball : balls)
    if (ball.w > 0 && is_outside(ball.center)) return true;
  for (int i = 0; i <= kSteps; ++i)
    for (int k = 0; k <= kSteps; ++k) {
      const float s = static_cast<float>(i) / kSteps, t = static_cast<float>(k) / kSteps;
      for (const float side : {0.0f, 1.0f})
        for (const Vec3 at : {Vec3{side, s, t}, Vec3{s, side, t}, Vec3{s, t, side}})
          if (is_inside_surface(wide.low + Vec3{at.x * size.x, at.y * size.y, at.z * size.z}))
            return true;
    }
  return false;
}

}  // namespace

std::vector<Ball> within_box(std::vector<Ball> balls, const Box& box) {
  constexpr double kMargin = 0.01;   // of the diagonal
  constexpr double kTogether = 1.4;  // ln 4: neighbours add to a ball what makes it larger
  if (!reaches_beyond(balls, box)) return balls;
  const Vector3d low = to_eigen(box.low), high = to_eigen(box.high);
  const auto diagonal = static_cast<double>(box.diagonal());
  for (Ball& ball : balls) {
    ball.center = min(max(ball.center, box.low), box.high);
    const Vector3d center = to_eigen(ball.center),
                   half = half_extent(ball, static_cast<double>(ball.w) + kTogether);
    const Vector3d room = (center - low).cwiseMin(high - center).array() + kMargin * diagonal;
    const double shrink = half.cwiseQuotient(room).maxCoeff();
    if (shrink > 1) ball.a *= static_cast<float>(shrink * shrink);
  }
  return balls;
}

Result<FitResult> fit_balls(const Model& model, const InsideTest& inside,
                            const std::vector<BoundarySample>& samples,
                            const std::vector<Sphere>& spheres, const FitSettings& settings) {
  PM_CHECK(!spheres.empty() && !samples.empty());
  const Box box = model.box();
  Fit fit;
  fit.length = static_cast<double>(box.diagonal());
  fit.numbers = settings.ellipsoids ? kEllipsoidNumbers : kRoundNumbers;
  const std::vector<SecondMoments> moments = second_moments_of(spheres, samples);
  for (std::size_t i = 0; i < spheres.size(); ++i) {
    fit.balls.push_back(settings.ellipsoids ? ball_of(spheres[i], moments[i], fit.length)
                                            : ball_of(spheres[i]));
    limit_axes(fit.balls.back(), fit.length);
  }
  add_samples(fit, samples);
  fit.free = free_points(samples, inside, box);
  add_wrong(fit);
  evaluate(fit.balls, fit, fit.rows);

  FitResult result;
  std::vector<FitBall> best;  // of the rounds so far: a round may do more harm than good
  for (int round = 0; round <= settings.rounds; ++round) {
    const int end = settings.iterations * (round + 1) / (settings.rounds + 1);
    for (int i = 1; result.iterations < end && improve(fit); ++i, ++result.iterations) {
      if (i % 4 == 0) {
        add_wrong(fit);
        evaluate_added(fit);
      }
    }
    result.iterations = end;
    add_wrong(fit);
    evaluate_added(fit);
    if (!best.empty()) {
      evaluate(best, fit, fit.tried);
      if (fit.tried.cost < fit.rows.cost) {
        fit.balls = best;
        std::swap(fit.rows, fit.tried);
      }
    }
    best = fit.balls;
    if (round == settings.rounds) break;
    move_balls(fit, samples, 0.08);
    add_wrong(fit);
    fit.damping = 1e-2;
    evaluate(fit.balls, fit, fit.rows);
  }
  const ClosestPointQuery boundary(model);
  for (int pass = 0; pass < settings.passes; ++pass) {
    PM_TRY(const std::size_t outliers, add_outlier_constraints(fit, boundary, inside));
    if (outliers == 0) break;
    evaluate_added(fit);
    fit.damping = 1e-2;
    for (int i = 0; i < 4 && improve(fit); ++i) ++result.iterations;
  }
  double sum = 0;
  for (std::size_t s = 0; s < fit.sample_count; ++s) {
    const double error = fit.rows.psi[3 * s] / fit.rows.steepness[3 * s];
    sum += error * error;
  }
  result.rms = std::sqrt(sum / static_cast<double>(fit.sample_count));
  result.balls = finished(fit);
  return result;
}

}  // namespace polymorph
