#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <set>

#include "base/parallel.h"
#include "field/extract_surface.h"
#include "mesh/mesh_check.h"
#include "model/shapes.h"
#include "spheres/boundary.h"
#include "spheres/fit.h"
#include "spheres/fit_field.h"
#include "spheres/fit_step.h"
#include "spheres/medial.h"
#include "spheres/quality.h"
#include "spheres/spheres.h"
#include "testing/model.h"

namespace polymorph {
namespace {

SphereSettings medial(int balls, FitKind fit = FitKind::kEllipsoid) {
  SphereSettings settings;
  settings.balls = balls;
  settings.fit = fit;
  return settings;
}

ApproximationQuality figures_of(const Model& model, const Approximation& approximation) {
  const auto figures = measure_quality(model, InsideTest(model), approximation.balls,
                                       FieldKind::kGaussian, {64, 5e4});
  EXPECT_TRUE(figures);
  return figures ? *figures : ApproximationQuality{};
}

TEST(Boundary, SamplesTellTheirWallAndGap) {
  const Model ball = *make_shape("sphere");  // radius 1, around (0, 1, 0)
  const auto samples = sample_boundary(ball, InsideTest(ball), 2000);
  ASSERT_GT(samples.size(), 1800u);
  float mean = 0;
  std::size_t open = 0;
  for (const BoundarySample& s : samples) {
    const Vec3 out = normalized(s.point - Vec3{0, 1, 0});
    EXPECT_GT(dot(s.normal, out), 0.99f);
    EXPECT_GT(s.inner_radius, 0.75f);
    EXPECT_LT(s.inner_radius, 1.1f);
    mean += s.inner_radius / static_cast<float>(samples.size());
    open += s.outer_radius > 1.5f;  // nothing is outside
  }
  EXPECT_NEAR(mean, 1, 0.1);
  EXPECT_GT(open * 10, samples.size() * 9);
}

TEST(Boundary, FacesWithinTheSolidGetNoSamples) {
  // Two boxes that overlap: the faces in the middle are no boundary.
  Model model = box_model({0, 0, 0}, {2, 1, 1});
  add_box(model, {1, 0, 0}, {3, 1, 1});
  const auto samples = sample_boundary(model, InsideTest(model), 3000);
  ASSERT_GT(samples.size(), 2400u);
  for (const BoundarySample& s : samples) {
    const bool within = s.point.x > 0.01f && s.point.x < 2.99f && s.point.y > 0.01f &&
                        s.point.y < 0.99f && s.point.z > 0.01f && s.point.z < 0.99f;
    EXPECT_FALSE(within) << s.point.x << " " << s.point.y << " " << s.point.z;
  }
}

TEST(Boundary, NormalsPointOutwardOnModelsTurnedInsideOut) {
  Model model = *make_shape("sphere");
  for (Triangle& t : model.triangles) std::swap(t.v[1], t.v[2]);
  // Winding is -1 inside: the parity of a ray is not affected.
  const auto samples = sample_boundary(model, InsideTest(model, InsideRule::kParity), 500);
  ASSERT_GT(samples.size(), 400u);
  for (const BoundarySample& s : samples)
    EXPECT_GT(dot(s.normal, normalized(s.point - Vec3{0, 1, 0})), 0.9f);
}

TEST(Medial, GivesExactlyAsManyBallsAsAsked) {
  const Model torus = *make_shape("torus");
  const auto samples = sample_boundary(torus, InsideTest(torus), 8000);
  for (const std::size_t n : {1u, 7u, 64u, 300u})
    EXPECT_EQ(make_medial_cover(samples, n).size(), n);
  EXPECT_TRUE(make_medial_cover({}, 10).empty());
}

TEST(Medial, CoversTheBoundaryBetterWithMoreBalls) {
  const Model torus = *make_shape("torus");
  const auto samples = sample_boundary(torus, InsideTest(torus), 4000);
  float last = 1e9f;
  for (const std::size_t n : {16u, 64u, 256u}) {
    float worst = 0;
    const auto spheres = make_medial_cover(samples, n);
    for (const BoundarySample& s : samples) {
      float nearest = 1e9f;
      for (const Sphere& b : spheres)
        nearest = std::min(nearest, length(s.point - b.center) - b.radius);
      worst = std::max(worst, nearest);
    }
    EXPECT_LT(worst, 0.75f * last) << n;
    last = worst;
  }
  EXPECT_LT(last, 0.02f);
}

TEST(Medial, TheTreesLevelsGrowAndParentsStandFirst) {
  const Model torus = *make_shape("torus");
  const SphereTree tree = build_medial_tree(sample_boundary(torus, InsideTest(torus), 4000), 128);
  EXPECT_EQ(tree.leaves().size(), 128u);
  std::vector<std::size_t> counts;
  for (std::size_t i = 0; i < tree.nodes.size(); ++i) {
    const SphereNode& node = tree.nodes[i];
    counts.resize(std::max<std::size_t>(counts.size(), static_cast<std::size_t>(node.level) + 1));
    ++counts[static_cast<std::size_t>(node.level)];
    if (node.level == 0) {
      EXPECT_EQ(node.parent, -1);
    } else {
      ASSERT_LT(node.parent, static_cast<std::int32_t>(i));
      EXPECT_EQ(tree.nodes[static_cast<std::size_t>(node.parent)].level, node.level - 1);
    }
  }
  EXPECT_EQ(counts, (std::vector<std::size_t>{2, 16, 128}));
}

FitRows make_fit_rows(const std::vector<FitBall>& balls, const std::vector<FitPoint>& points,
                      double length, int parameters) {
  FitRows rows;
  compute_fit_rows(balls, points, length, parameters, rows);
  EXPECT_EQ(compute_fit_cost(balls, points, length), rows.cost) << "computed alone";
  return rows;
}

/// Derivative `k` of a block at point p.
double derivative_of(const FitRows& rows, std::size_t p, std::size_t block, int parameters, int k) {
  const auto row = block * static_cast<std::size_t>(parameters) + static_cast<std::size_t>(k);
  return static_cast<double>(rows.chunks[p / kFitChunkSize].derivatives[row].lanes[p % kFitLanes]);
}

// The derivatives are what makes the fit converge: against differences of the residuals.
TEST(FitField, DerivativesAreThoseOfTheResiduals) {
  std::vector<FitBall> balls(3);
  for (std::size_t i = 0; i < balls.size(); ++i) {
    const double k = static_cast<double>(i);
    balls[i].center = {0.3 * k, 0.1 * k * k, -0.2 * k};
    balls[i].root << 2.0, 0.1 * k, 0.2, 0.0, 1.7 + 0.2 * k, -0.1, 0.3, 0.0, 2.2;
    balls[i].w = 3 + 0.3 * k;
  }
  std::vector<FitPoint> points;
  for (int i = 0; i < 43; ++i) {  // not whole vectors
    const double t = 0.37 * i;
    points.push_back({{std::sin(t), std::cos(1.3 * t), std::sin(2.1 * t + 1)},
                      0.02 * (i % 3),
                      1,
                      i % 2 ? FitPoint::Rule::kSurface : FitPoint::Rule::kOffset});
  }
  constexpr double kLength = 200;  // Huber's border and the least steepness are then far off
  for (const int numbers : {kRoundParameters, kEllipsoidParameters}) {
    const FitRows rows = make_fit_rows(balls, points, kLength, numbers);
    std::size_t entries = 0;
    for (std::size_t p = 0; p < points.size(); ++p) {
      for_each_fit_entry(rows, p, [&](std::uint32_t index, float, std::uint32_t block) {
        for (int k = 0; k < numbers; ++k) {
          constexpr double kStep = 2e-3;
          const auto residual = [&](double step) {
            std::vector<FitBall> moved = balls;
            FitBall& ball = moved[index];
            Eigen::Matrix3d d = Eigen::Matrix3d::Zero();
            const int at = k - 4;
            if (k == 0) ball.w += step;
            if (k >= 1 && k <= 3) ball.center[k - 1] += step;
            if (numbers == kRoundParameters && k == 4) d = Eigen::Matrix3d::Identity() * step;
            if (numbers == kEllipsoidParameters && at >= 0) {
              constexpr int kRow[] = {0, 1, 2, 0, 0, 1}, kColumn[] = {0, 1, 2, 1, 2, 2};
              d(kRow[at], kColumn[at]) = d(kColumn[at], kRow[at]) = step;
            }
            ball.root = (Eigen::Matrix3d::Identity() + d / 2) * ball.root;
            return static_cast<double>(make_fit_rows(moved, points, kLength, numbers).residuals[p]);
          };
          const double expected = (residual(kStep) - residual(-kStep)) / (2 * kStep);
          EXPECT_NEAR(derivative_of(rows, p, block, numbers, k), expected,
                      3e-4 + 1e-3 * std::abs(expected))
              << "point " << p << " ball " << index << " number " << k;
          ++entries;
        }
      });
    }
    EXPECT_GT(entries, 2 * points.size() * static_cast<std::size_t>(numbers));
  }
}

TEST(FitField, TheFieldIsTheSumOfTheBalls) {
  std::vector<FitBall> balls(40);
  for (std::size_t i = 0; i < balls.size(); ++i) {
    const auto k = static_cast<double>(i);
    // Far from the origin, where single precision alone would not suffice.
    balls[i].center = {1000 + 0.2 * k, 2000 + std::sin(k), 3000 + std::cos(2 * k)};
    balls[i].root *= 2 + 0.05 * k;
    balls[i].w = 2;
  }
  std::vector<FitPoint> points;
  for (int i = 0; i < 2500; ++i)  // three chunks
    points.push_back({{1000 + 0.003 * i, 2000 + std::sin(0.7 * i), 3000 + std::cos(1.1 * i)},
                      0,
                      1,
                      FitPoint::Rule::kSurface});
  const FitRows rows = make_fit_rows(balls, points, 10, kEllipsoidParameters);
  for (std::size_t p = 0; p < points.size(); ++p) {
    double field = 0;
    for (const FitBall& ball : balls)
      field += std::exp(ball.w - (ball.root * (points[p].point - ball.center)).squaredNorm());
    EXPECT_NEAR(static_cast<double>(rows.psi[p]), std::log(field), 2e-3) << p;
  }
}

TEST(FitField, PointsThatAreAddedGetTheRowsOfAllAtOnce) {
  std::vector<FitBall> balls(5);
  std::vector<FitPoint> points;
  for (std::size_t i = 0; i < balls.size(); ++i) {
    const auto k = static_cast<double>(i);
    balls[i].center = {0.4 * k, 0.1 * k * k, -0.2 * k};
    balls[i].root *= 1.5 + 0.2 * k;
    balls[i].w = 2;
  }
  for (int i = 0; i < 2110; ++i)
    points.push_back({{std::sin(0.7 * i), std::cos(1.1 * i), 2 * std::sin(2.3 * i)}, 0, 1, {}});
  const FitRows all = make_fit_rows(balls, points, 10, kEllipsoidParameters);
  const std::vector<FitPoint> some(points.begin(), points.begin() + 1045);  // not whole groups
  FitRows rows = make_fit_rows(balls, some, 10, kEllipsoidParameters);
  EXPECT_LT(rows.cost, all.cost);
  add_fit_rows(balls, points, 10, kEllipsoidParameters, rows);
  EXPECT_EQ(rows.residuals, all.residuals);
  EXPECT_EQ(rows.psi, all.psi);
  EXPECT_EQ(rows.cost, all.cost);
  ASSERT_EQ(rows.chunks.size(), 3u);
  for (std::size_t c = 0; c < all.chunks.size(); ++c) {
    const FitChunk &one = rows.chunks[c], &other = all.chunks[c];
    EXPECT_EQ(one.begins, other.begins);
    EXPECT_EQ(one.balls, other.balls);
    EXPECT_EQ(one.block_balls, other.block_balls);
    EXPECT_EQ(one.sums, other.sums);
    ASSERT_EQ(one.derivatives.size(), other.derivatives.size());
    EXPECT_EQ(std::memcmp(one.derivatives.data(), other.derivatives.data(),
                          one.derivatives.size() * sizeof(FitLanes)),
              0);
  }
  const std::vector<std::uint8_t> inside = test_inside_field(balls, points);
  std::size_t count = 0;
  for (std::size_t p = 0; p < points.size(); ++p) {
    EXPECT_EQ(inside[p] != 0, all.psi[p] > 0) << p;
    count += inside[p];
  }
  EXPECT_GT(count, 100u);
  EXPECT_LT(count, 2000u);
}

TEST(FitStep, SolvesTheDampedNormalEquations) {
  // One ball, round: five unknowns, many points; against a dense solution.
  std::vector<FitBall> balls(1);
  balls[0].root *= 2;
  balls[0].w = 3;
  std::vector<FitPoint> points;
  for (int i = 0; i < 2100; ++i) {
    const double t = 0.7 * i;
    points.push_back({{std::sin(t) + 0.1, std::cos(1.3 * t), std::sin(2.1 * t + 1)}, 0, 1, {}});
  }
  const FitRows rows = make_fit_rows(balls, points, 10, kRoundParameters);
  Eigen::MatrixXd j = Eigen::MatrixXd::Zero(2100, 5);
  Eigen::VectorXd r(2100);
  for (int p = 0; p < 2100; ++p) {
    const auto at = static_cast<std::size_t>(p);
    for_each_fit_entry(rows, at, [&](std::uint32_t, float weight, std::uint32_t block) {
      EXPECT_NEAR(weight, 1, 1e-6f);
      for (int k = 0; k < 5; ++k) j(p, k) = derivative_of(rows, at, block, kRoundParameters, k);
    });
    EXPECT_GT(j.row(p).norm(), 0);
    r(p) = static_cast<double>(rows.residuals[at]);
  }
  Eigen::MatrixXd normal = j.transpose() * j;
  normal.diagonal() *= 1.5;
  const Eigen::VectorXd expected = normal.ldlt().solve(-j.transpose() * r);
  const std::vector<double> step = solve_damped_step(rows, 1, kRoundParameters, 0.5);
  for (int k = 0; k < 5; ++k)
    EXPECT_NEAR(step[static_cast<std::size_t>(k)], expected[k], 1e-4 * expected.norm());
}

TEST(Fit, OneBallBecomesTheSphere) {
  const Model model = *make_shape("sphere");
  const auto result = approximate(model, medial(1));
  ASSERT_TRUE(result);
  ASSERT_EQ(result->balls.size(), 1u);
  const Ball& ball = result->balls[0];
  EXPECT_LT(length(ball.center - Vec3{0, 1, 0}), 0.01f);
  EXPECT_NEAR(std::sqrt(ball.w / ball.a), 1, 0.01);
}

TEST(Fit, OneBallBecomesTheEllipsoid) {
  Model model = *make_shape("sphere");
  for (Vec3& p : model.points) p = {2 * p.x + 0.3f * p.y, p.y, 0.5f * p.z};
  const auto result = approximate(model, medial(1));
  ASSERT_TRUE(result);
  EXPECT_GT(figures_of(model, *result).iou, 0.985);
  const auto round = approximate(model, medial(1, FitKind::kRound));
  ASSERT_TRUE(round);
  EXPECT_TRUE(is_round(round->balls[0]));
  EXPECT_LT(figures_of(model, *round).iou, 0.7);
}

/// A coarse fit is roughly the model, and not as good as the full one.
void expect_roughly(const Model& model, SphereSettings settings, double full_iou) {
  settings.coarse = true;
  const auto coarse = approximate(model, settings);
  ASSERT_TRUE(coarse);
  EXPECT_EQ(coarse->balls.size(), static_cast<std::size_t>(settings.balls));
  const ApproximationQuality figures = figures_of(model, *coarse);
  EXPECT_GT(figures.iou, 0.93);
  EXPECT_LT(figures.iou, full_iou);
  EXPECT_NEAR(figures.volume_ratio, 1, 0.006);
  EXPECT_LT(figures.hausdorff_to_surface, 0.06);
}

TEST(Fit, SurfacesAreTheModels) {
  struct Case {
    const char* name;
    int balls;
    double iou;
  };
  for (const auto& [name, balls, iou] :
       {Case{"torus", 48, 0.97}, {"cube", 64, 0.96}, {"puddle", 64, 0.95}, {"sphere", 16, 0.985}}) {
    const Model model = *make_shape(name);
    const auto result = approximate(model, medial(balls));
    ASSERT_TRUE(result) << name;
    EXPECT_EQ(result->balls.size(), static_cast<std::size_t>(balls));
    const ApproximationQuality figures = figures_of(model, *result);
    EXPECT_GT(figures.iou, iou) << name;
    EXPECT_NEAR(figures.volume_ratio, 1, 0.006) << name;
    EXPECT_LT(figures.rms_to_model, 0.01) << name;
    EXPECT_LT(figures.rms_to_surface, 0.01) << name;
    SCOPED_TRACE(name);
    if (balls > 16) expect_roughly(model, medial(balls), figures.iou);
  }
}

TEST(Fit, TheVolumeIsTheModels) {
  const Model model = *make_shape("torus");
  const auto result = approximate(model, medial(40));
  ASSERT_TRUE(result);
  const auto mesh =
      extract_surface(*make_cpu_engine(), result->balls, model.box().diagonal() / 250, {});
  ASSERT_TRUE(mesh);
  EXPECT_NEAR(volume_of(*mesh) / solid_volume(model, InsideTest(model)), 1, 0.004);
}

TEST(Fit, EllipsoidsBeatRoundBallsOnAPlate) {
  const Model plate = box_model({0, 0, 0}, {2, 0.1f, 1});
  const auto round = approximate(plate, medial(40, FitKind::kRound));
  const auto stretched = approximate(plate, medial(40));
  ASSERT_TRUE(round && stretched);
  EXPECT_GT(figures_of(plate, *stretched).iou, figures_of(plate, *round).iou + 0.1);
  EXPECT_GT(figures_of(plate, *stretched).iou, 0.9);
}

TEST(Fit, EveryMethodCanBeFitted) {
  const Model torus = *make_shape("torus");
  for (const SphereMethod method : {SphereMethod::kOctree, SphereMethod::kActive,
                                    SphereMethod::kHubbard, SphereMethod::kMedial}) {
    SphereSettings settings = medial(80);
    settings.method = method;
    const auto result = approximate(torus, settings);
    ASSERT_TRUE(result) << static_cast<int>(method);
    EXPECT_EQ(result->balls.size(), result->tree.leaves().size());
    EXPECT_GT(figures_of(torus, *result).iou, 0.95) << static_cast<int>(method);
  }
}

TEST(Fit, AnErrorIsKeptByFewBalls) {
  SphereSettings settings;
  settings.error = 0.012f;
  std::size_t last = 0;
  for (const char* name : {"torus", "cube"}) {  // corners need more balls than a ring
    const Model model = *make_shape(name);
    const auto result = approximate(model, settings);
    ASSERT_TRUE(result);
    const ApproximationQuality figures = figures_of(model, *result);
    EXPECT_LT(figures.hausdorff_to_model, 0.015) << name;
    EXPECT_LT(figures.hausdorff_to_surface, 0.015) << name;
    EXPECT_GT(result->balls.size(), last) << name;
    EXPECT_LT(result->balls.size(), 200u) << name;
    last = result->balls.size();
  }
}

TEST(Fit, OpenModelsAreFittedWhereTheyEncloseSomething) {
  Model sphere = *make_shape("sphere");
  sphere.triangles.resize(sphere.triangles.size() - 40);
  const auto result = approximate(sphere, medial(24));
  ASSERT_TRUE(result);
  EXPECT_GT(figures_of(sphere, *result).iou, 0.95);
}

/// Where faces disagree inside is guesswork; the balls' surface is within the model's box all the
/// same.
TEST(Fit, StaysWithinTheBoxOfModelsWhoseFacesDisagree) {
  for (const char* name : {"torus", "cube", "puddle"})
    for (const std::size_t every : {11u, 4u}) {
      Model model = *make_shape(name);
      for (std::size_t t = 0; t < model.triangles.size(); t += every)
        std::swap(model.triangles[t].v[1], model.triangles[t].v[2]);
      const auto result = approximate(model, medial(48));
      ASSERT_TRUE(result) << name;
      const Box box = model.box();
      const auto mesh =
          extract_surface(*make_cpu_engine(), result->balls, box.diagonal() / 150, {});
      ASSERT_TRUE(mesh) << name;
      ASSERT_FALSE(mesh->positions.empty()) << name;
      const float beyond = 0.1f * box.diagonal();
      const Box found = bounding_box(mesh->positions);
      for (const float excess :
           {box.low.x - found.low.x, box.low.y - found.low.y, box.low.z - found.low.z,
            found.high.x - box.high.x, found.high.y - box.high.y, found.high.z - box.high.z})
        EXPECT_LT(excess, beyond) << name << " " << every;
    }
}

TEST(Fit, IsTheSameForAnyNumberOfThreads) {
  const Model torus = *make_shape("torus");
  set_thread_count(1);
  const auto one = approximate(torus, medial(24));
  set_thread_count(2);
  const auto two = approximate(torus, medial(24));
  set_thread_count(0);
  ASSERT_TRUE(one && two);
  ASSERT_EQ(one->balls.size(), two->balls.size());
  EXPECT_EQ(std::memcmp(one->balls.data(), two->balls.data(), one->balls.size() * sizeof(Ball)), 0);
}

TEST(ApproximationQuality, OfTheSurfaceItselfAreNearlyPerfect) {
  // A ball's surface as the model: only its flattening remains.
  const std::vector<Ball> balls{{{0, 0, 0}, 4, 4}};
  const auto mesh = extract_surface(*make_cpu_engine(), balls, 0.02f, {});
  ASSERT_TRUE(mesh);
  Model model;
  model.points = mesh->positions;
  model.triangles = mesh->triangles;
  const auto figures =
      measure_quality(model, InsideTest(model), balls, FieldKind::kGaussian, {100});
  ASSERT_TRUE(figures);
  EXPECT_GT(figures->iou, 0.998);
  EXPECT_NEAR(figures->volume_ratio, 1, 0.002);
  EXPECT_LT(figures->hausdorff_to_model, 1e-3);
  EXPECT_LT(figures->hausdorff_to_surface, 1e-3);
}

TEST(ApproximationQuality, NoticeAPartThatIsMissing) {
  Model two = box_model({0, 0, 0}, {1, 1, 1});
  add_box(two, {3, 0, 0}, {4, 1, 1});
  const Model one = box_model({0, 0, 0}, {1, 1, 1});
  const auto fitted = approximate(one, medial(40));
  ASSERT_TRUE(fitted);
  const ApproximationQuality figures = figures_of(two, *fitted);
  EXPECT_NEAR(figures.iou, 0.5, 0.03);
  EXPECT_NEAR(figures.volume_ratio, 0.5, 0.02);
  EXPECT_GT(figures.hausdorff_to_surface, 0.5);
  EXPECT_LT(figures.hausdorff_to_model, 0.05);
}

}  // namespace
}  // namespace polymorph
