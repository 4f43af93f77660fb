// Properties of the extracted surface, on every backend.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <vector>

#include "kernels/mc_tables.h"
#include "testing/backend.h"
#include "testing/mesh.h"

namespace polymorph {
namespace {

constexpr double kPi = 3.14159265358979323846;

/// In cells: a vertex may be 1/512 off where it is held away from a grid point, more where its edge
/// grazes the sphere. Straight interpolation would leave 0.04.
constexpr double kPlacement = 0.003;

double furthest_from_radius(const Mesh& mesh, Vec3 center, double radius) {
  double worst = 0;
  for (const Vec3 p : mesh.positions) {
    worst = std::max(worst, std::fabs(length_of(minus(to_double(p), to_double(center))) - radius));
  }
  return worst;
}

TEST_P(SurfaceTest, lone_gaussian_ball_is_its_sphere) {
  const Vec3 center = {0.013f, -0.021f, 0.007f};
  const Grid grid = cube_grid(50, 1.0f);
  const Mesh mesh = extract({gaussian_ball(center, 0.7f)}, grid);
  expect_sound(mesh);
  EXPECT_EQ(euler_of(mesh), 2);
  EXPECT_LT(furthest_from_radius(mesh, center, 0.7), kPlacement * static_cast<double>(grid.cell));
  EXPECT_NEAR(volume_of(mesh) / (4.0 / 3 * kPi * 0.343), 1, 0.003);
  EXPECT_NEAR(area_of(mesh) / (4 * kPi * 0.49), 1, 0.003);
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    const Double3 out = minus(to_double(mesh.positions[i]), to_double(center));
    ASSERT_GT(dot_of(out, to_double(mesh.normals[i])) / length_of(out), 0.99999);
  }
}

TEST_P(SurfaceTest, lone_inverse_square_ball_is_its_sphere) {
  ExtractSettings settings;
  settings.field = FieldKind::kInverseSquare;
  const Grid grid = cube_grid(47, 1.0f);
  const Mesh mesh = extract({{{0.01f, 0.02f, 0.03f}, 1, 0.49f}}, grid, settings);
  expect_sound(mesh);
  EXPECT_EQ(euler_of(mesh), 2);
  EXPECT_LT(furthest_from_radius(mesh, {0.01f, 0.02f, 0.03f}, 0.7),
            kPlacement * static_cast<double>(grid.cell));
}

/// How far the points are from { d^T shape d = radius^2 }, to first order.
double furthest_from_ellipsoid(const Mesh& mesh, const Ball& ball, double radius) {
  double worst = 0;
  const Sym3& s = ball.shape;
  for (const Vec3 p : mesh.positions) {
    const Vec3 d = p - ball.center;
    const Vec3 g = {s.xx * d.x + s.xy * d.y + s.xz * d.z, s.xy * d.x + s.yy * d.y + s.yz * d.z,
                    s.xz * d.x + s.yz * d.y + s.zz * d.z};
    worst = std::max(worst, std::fabs(static_cast<double>(quadratic(s, d)) - radius * radius) /
                                (2 * static_cast<double>(length(g))));
  }
  return worst;
}

TEST_P(SurfaceTest, lone_ellipsoid_is_its_ellipsoid) {
  Ball ball = gaussian_ball({0.013f, -0.021f, 0.007f}, 0.5f);
  for (const Vec3 axes : {Vec3{2, 1, 0.5f}, Vec3{1, 1, 3}, Vec3{1, 0.4f, 1}}) {
    ball.shape = shape_of(axes, 0.4, 1.1);
    const Grid grid = cube_grid(70, 1.5f);
    const Mesh mesh = extract({ball}, grid);
    expect_sound(mesh);
    EXPECT_EQ(euler_of(mesh), 2);
    EXPECT_LT(furthest_from_ellipsoid(mesh, ball, 0.5),
              kPlacement * static_cast<double>(grid.cell));
    EXPECT_NEAR(volume_of(mesh) / (4.0 / 3 * kPi * 0.125), 1, 0.01);
    for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
      const Vec3 d = mesh.positions[i] - ball.center;
      const Sym3& s = ball.shape;
      const Vec3 out = normalized(Vec3{s.xx * d.x + s.xy * d.y + s.xz * d.z,
                                       s.xy * d.x + s.yy * d.y + s.yz * d.z,
                                       s.xz * d.x + s.yz * d.y + s.zz * d.z});
      ASSERT_GT(dot(out, mesh.normals[i]), 0.99999f);
    }
  }
}

TEST_P(SurfaceTest, round_balls_among_ellipsoids_are_as_alone) {
  // The long path with round shapes; a far ellipsoid forces it.
  std::vector<Ball> balls = {gaussian_ball({0.02f, 0, 0}, 0.4f)};
  const Grid grid = cube_grid(40, 0.8f);
  const Mesh alone = extract(balls, grid);
  balls.push_back(gaussian_ball({50, 0, 0}, 0.3f));
  balls.back().shape = shape_of({2, 1, 1}, 0, 0);
  const Mesh among = extract(balls, grid);
  ASSERT_TRUE(same_bits(among.triangles, alone.triangles));
  for (std::size_t i = 0; i < alone.positions.size(); ++i)
    ASSERT_LT(length(among.positions[i] - alone.positions[i]), 1e-5f);
}

TEST_P(SurfaceTest, lone_wyvill_ball_is_its_sphere) {
  ExtractSettings settings;
  settings.field = FieldKind::kWyvill;
  settings.iso = 0.5f;  // C(1/4) = 1/2: the surface is at half the support (Wyvill 1986)
  const Grid grid = cube_grid(47, 1.0f);
  const Mesh mesh = extract({{{0.01f, 0.02f, 0.03f}, 1 / (1.4f * 1.4f), 1}}, grid, settings);
  expect_sound(mesh);
  EXPECT_EQ(euler_of(mesh), 2);
  EXPECT_LT(furthest_from_radius(mesh, {0.01f, 0.02f, 0.03f}, 0.7),
            kPlacement * static_cast<double>(grid.cell));
}

TEST_P(SurfaceTest, one_refining_step_is_exact_for_a_lone_gaussian_ball) {
  const Grid grid = cube_grid(12, 1.0f);  // coarse: 0.18 a cell
  for (int steps = 0; steps <= 4; ++steps) {
    ExtractSettings settings;
    settings.refine_steps = steps;
    const double worst =
        furthest_from_radius(extract({gaussian_ball({}, 0.61f)}, grid, settings), {}, 0.61);
    if (steps == 0) {
      EXPECT_GT(worst, 1e-3) << "straight interpolation should show, or the test shows nothing";
    } else {
      EXPECT_LT(worst, 1e-6) << steps << " steps";
    }
  }
}

TEST_P(SurfaceTest, refining_converges_between_many_balls) {
  const std::vector<Ball> balls = random_balls(60, FieldKind::kGaussian, 21);
  const Grid grid = cube_grid(24, 1.7f);
  std::vector<double> mean;
  for (int steps = 0; steps <= 4; ++steps) {
    ExtractSettings settings;
    settings.refine_steps = steps;
    const std::vector<float> values = sample(balls, extract(balls, grid, settings).positions);
    double sum = 0;
    for (float value : values) sum += std::fabs(static_cast<double>(value) - 1);
    mean.push_back(sum / static_cast<double>(values.size()));
  }
  EXPECT_LT(mean[1], 0.25 * mean[0]);
  EXPECT_LT(mean[2], 0.5 * mean[1]);
  EXPECT_LE(mean[4], mean[2] * 1.01);
}

TEST_P(SurfaceTest, iso_moves_the_surface) {
  ExtractSettings settings;
  settings.iso = std::exp(1.0f);  // exp(4 (1 - r^2)) = e at r^2 = 3/4
  const Mesh mesh = extract({gaussian_ball({}, 1)}, cube_grid(60, 1.2f), settings);
  EXPECT_LT(furthest_from_radius(mesh, {}, std::sqrt(0.75)), 1e-4);
}

TEST_P(SurfaceTest, coincident_balls_grow_by_the_blobbiness) {
  for (int k : {2, 5, 20}) {
    const std::vector<Ball> balls(static_cast<std::size_t>(k), gaussian_ball({}, 0.5f));
    const double radius = 0.5 * std::sqrt(1 + std::log(k) / static_cast<double>(kBlobbiness));
    EXPECT_LT(furthest_from_radius(extract(balls, cube_grid(40, 1.0f)), {}, radius), 2e-4) << k;
  }
}

TEST_P(SurfaceTest, ring_of_balls_is_a_torus) {
  std::vector<Ball> balls;
  for (int i = 0; i < 24; ++i) {
    const float angle = static_cast<float>(i) * 6.2831853f / 24;
    balls.push_back(gaussian_ball({std::cos(angle), std::sin(angle), 0.02f}, 0.3f));
  }
  const Mesh mesh = extract(balls, cube_grid(53, 1.7f));
  expect_sound(mesh);
  EXPECT_EQ(euler_of(mesh), 0);
}

/// Coarse grids make every ambiguous case, sizes that are no multiple of a brick every seam.
TEST_P(SurfaceTest, random_balls_give_closed_manifolds) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    for (const FieldKind field : {FieldKind::kGaussian, FieldKind::kInverseSquare}) {
      SCOPED_TRACE(testing::Message() << "seed " << seed << " field " << static_cast<int>(field));
      ExtractSettings settings;
      settings.field = field;
      const int n = 9 + static_cast<int>(seed) * 2;
      const Grid grid = {{-1.6f, -1.5f, -1.7f}, 3.3f / static_cast<float>(n), {n, n + 1, n + 2}};
      ASSERT_NO_FATAL_FAILURE(expect_sound(extract(random_balls(40, field, seed), grid, settings)));
    }
  }
}

TEST_P(SurfaceTest, surface_through_grid_points_has_no_degenerate_triangle) {
  // Radius 4 cells around a grid point: six axis points lie exactly on the surface, others within
  // rounding.
  const Grid grid = {{-1, -1, -1}, 0.125f, {17, 17, 17}};
  for (float w : {3.999999f, 4.0f, 4.000001f}) {
    ASSERT_NO_FATAL_FAILURE(expect_sound(extract({{{0, 0, 0}, 16, w}}, grid)));
  }
}

TEST_P(SurfaceTest, cut_at_the_border_is_flat_and_closed) {
  // Centre on the border plane x = 1: half a ball.
  const Grid grid = cube_grid(51, 1.0f);
  const Mesh mesh = extract({gaussian_ball({1, 0, 0}, 0.6f)}, grid);
  expect_sound(mesh);
  EXPECT_EQ(euler_of(mesh), 2);
  EXPECT_NEAR(volume_of(mesh) / (2.0 / 3 * kPi * 0.216), 1, 0.005);
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    ASSERT_LT(mesh.positions[i].x, 1 + 0.01f * grid.cell);
    if (mesh.positions[i].x <= 1) continue;
    ASSERT_TRUE(mesh.normals[i] == (Vec3{1, 0, 0}));
  }
}

TEST_P(SurfaceTest, grid_wholly_inside_is_a_closed_box) {
  const Grid grid = {{-0.5f, -0.4f, -0.3f}, 0.1f, {11, 9, 7}};
  for (const FieldKind field : {FieldKind::kGaussian, FieldKind::kInverseSquare}) {
    ExtractSettings settings;
    settings.field = field;
    const Mesh mesh = extract({{{0, 0, 0}, 0.04f, 4.0f}}, grid, settings);
    expect_sound(mesh);
    EXPECT_EQ(euler_of(mesh), 2);
    EXPECT_NEAR(volume_of(mesh), 1.0 * 0.8 * 0.6, 0.003);
  }
}

TEST_P(SurfaceTest, nothing_to_extract_is_an_empty_mesh) {
  const Grid grid = cube_grid(20, 1.0f);
  Mesh mesh = extract({gaussian_ball({}, 0.5f)}, grid);
  ASSERT_FALSE(mesh.triangles.empty());
  const std::vector<std::vector<Ball>> cases = {
      {}, {gaussian_ball({50, 0, 0}, 0.5f)}, {{{0, 0, 0}, 4, -0.1f}}, {{{0, 0, 0}, 4, -30.0f}}};
  for (const std::vector<Ball>& balls : cases) {
    EXPECT_EQ(engine_->extract(balls, grid, {}, mesh).code, EngineCode::kOk);
    EXPECT_TRUE(mesh.positions.empty() && mesh.normals.empty() && mesh.triangles.empty());
    mesh.positions.resize(3);  // left over from another frame
  }
}

TEST_P(SurfaceTest, extreme_balls_stay_sound) {
  std::vector<Ball> balls = {gaussian_ball({}, 0.5f)};
  balls.push_back(
      {{0.2f, 0, 0}, 3e4f, 3000.0f});  // far stronger than floats: clamped, radius kept apart
  balls.push_back({{1e30f, -1e30f, 1e30f}, 1, 4});
  balls.push_back({{0, 0, 0}, 1e10f, 4});  // smaller than a cell
  balls.push_back({{0, 0, 0}, 4, -1e30f});
  ASSERT_NO_FATAL_FAILURE(expect_sound(extract(balls, cube_grid(31, 1.0f))));
}

TEST_P(SurfaceTest, bad_input_is_refused_with_a_reason) {
  const Grid grid = cube_grid(20, 1.0f);
  const Ball good = gaussian_ball({}, 0.5f);
  const float nan = std::nanf(""), inf = INFINITY;
  const auto refused = [&](const std::vector<Ball>& balls, const Grid& g, const ExtractSettings& s,
                           const char* word) {
    Mesh mesh;
    mesh.positions.resize(5);
    const EngineStatus status = engine_->extract(balls, g, s, mesh);
    EXPECT_EQ(status.code, EngineCode::kBadInput) << word;
    EXPECT_NE(status.message.find(word), std::string::npos) << status.message;
    EXPECT_TRUE(mesh.positions.empty());
  };
  refused({good, {{nan, 0, 0}, 1, 1}}, grid, {}, "ball 1");
  refused({{{0, inf, 0}, 1, 1}}, grid, {}, "ball 0");
  refused(std::vector<Ball>((1 << 20) + 1, good), grid, {}, "maximum is 2^20");
  refused({{{0, 0, 0}, nan, 1}}, grid, {}, "ball 0");
  refused({{{0, 0, 0}, 1, -inf}}, grid, {}, "ball 0");
  refused({{{0, 0, 0}, 0, 1}}, grid, {}, "a > 0");
  refused({{{0, 0, 0}, -1, 1}}, grid, {}, "a > 0");
  Ball flat = good;
  flat.shape = {1, 1, 1, 2, 0, 0};
  refused({good, good, flat}, grid, {}, "ball 2 has a shape");
  flat.shape = {1, nan, 1, 0, 0, 0};
  refused({flat}, grid, {}, "shape");
  refused({good}, {{0, 0, 0}, 0.1f, {1, 20, 20}}, {}, "1 x 20 x 20");
  refused({good}, {{0, 0, 0}, 0.1f, {1 << 21, 20, 20}}, {}, "coarser");
  refused({good}, {{0, 0, 0}, 0.0f, {20, 20, 20}}, {}, "cell");
  refused({good}, {{0, 0, 0}, nan, {20, 20, 20}}, {}, "cell");
  refused({good}, {{inf, 0, 0}, 0.1f, {20, 20, 20}}, {}, "origin");
  refused({good}, {{1e6f, 0, 0}, 0.1f, {20, 20, 20}}, {}, "origin");
  ExtractSettings settings;
  settings.iso = 0;
  refused({good}, grid, settings, "iso");
  settings = {};
  settings.cutoff = nan;
  refused({good}, grid, settings, "cutoff");
  settings = {};
  settings.refine_steps = 5;
  refused({good}, grid, settings, "refine_steps");
}

TEST_P(SurfaceTest, sample_is_the_sum_over_all_balls) {
  for (const FieldKind field : {FieldKind::kGaussian, FieldKind::kInverseSquare}) {
    ExtractSettings settings;
    settings.field = field;
    const std::vector<Ball> balls = random_balls(50, field, 11);
    std::vector<Vec3> points;
    for (const Ball& ball : random_balls(333, field, 12)) points.push_back(ball.center * 1.5f);
    const std::vector<float> values = sample(balls, points, settings);
    ASSERT_EQ(values.size(), points.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
      double sum = 0;
      for (const Ball& ball : balls) {
        const Double3 d = minus(to_double(points[i]), to_double(ball.center));
        const double r2 = dot_of(d, d), w = static_cast<double>(ball.w);
        const double term =
            field == FieldKind::kGaussian ? std::exp(w - static_cast<double>(ball.a) * r2) : w / r2;
        sum += field == FieldKind::kInverseSquare || term > 1e-4 ? term : 0;
      }
      ASSERT_NEAR(static_cast<double>(values[i]), sum, 1e-4 * sum + 1.5e-4) << i;
    }
  }
}

TEST_P(SurfaceTest, vertices_lie_on_iso_and_normals_go_down_the_field) {
  for (const FieldKind field : {FieldKind::kGaussian, FieldKind::kInverseSquare}) {
    ExtractSettings settings;
    settings.field = field;
    settings.refine_steps = 3;
    const std::vector<Ball> balls = random_balls(60, field, 21);
    const Grid grid = cube_grid(70, 1.7f);
    const Mesh mesh = extract(balls, grid, settings);
    std::vector<Vec3> points = mesh.positions;
    const float h = 0.05f * grid.cell;
    for (std::size_t i = 0; i < mesh.positions.size(); ++i)
      points.push_back(mesh.positions[i] + mesh.normals[i] * h);
    const std::vector<float> values = sample(balls, points, settings);
    std::size_t held = 0;
    for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
      ASSERT_LT(values[mesh.positions.size() + i], values[i]) << i;
      // Held away from a grid point: its distance to the nearest one is the margin.
      const Vec3 p = (mesh.positions[i] - grid.origin) / grid.cell;
      const float away = std::fabs(p.x - std::round(p.x)) + std::fabs(p.y - std::round(p.y)) +
                         std::fabs(p.z - std::round(p.z));
      if (away < 1.1f / 512) {
        ++held;
        continue;
      }
      ASSERT_NEAR(values[i], 1, 0.01) << i;
    }
    EXPECT_LT(held, mesh.positions.size() / 100);
  }
}

/// Most balls are distant from most bricks here. Along the normal and to first order; where the
/// field changes by less than 1 % of iso in a cell, it hardly says where its surface is, and beside
/// a ball that takes away four steps do not always get there.
TEST_P(SurfaceTest, inverse_square_vertices_are_within_a_thousandth_of_a_cell) {
  ExtractSettings settings;
  settings.field = FieldKind::kInverseSquare;
  settings.refine_steps = 4;
  for (const bool holes : {false, true}) {
    std::vector<Ball> balls = random_balls(600, settings.field, 25);
    for (Ball& ball : balls) ball.w *= holes ? 0.3f : 0.08f;
    if (holes) balls = with_holes(balls);
    const Grid grid = cube_grid(100, 1.5f);
    const Mesh mesh = extract(balls, grid, settings);
    ASSERT_NO_FATAL_FAILURE(expect_sound(mesh));
    const std::size_t n = mesh.positions.size();
    const float h = 0.02f * grid.cell;
    std::vector<Vec3> points = mesh.positions;
    for (const float side : {-h, h}) {
      for (std::size_t i = 0; i < n; ++i)
        points.push_back(mesh.positions[i] + mesh.normals[i] * side);
    }
    const std::vector<float> values = sample(balls, points, settings);
    std::vector<float> off;
    for (std::size_t i = 0; i < n; ++i) {
      const float negated_derivative = (values[n + i] - values[2 * n + i]) / (2 * h) * grid.cell;
      const Vec3 p = (mesh.positions[i] - grid.origin) / grid.cell;
      const float away = std::fabs(p.x - std::round(p.x)) + std::fabs(p.y - std::round(p.y)) +
                         std::fabs(p.z - std::round(p.z));
      if (negated_derivative >= 0.01f && away >= 1.1f / 512)
        off.push_back(std::fabs(values[i] - 1) / negated_derivative);
    }
    ASSERT_GT(off.size(), n * 9 / 10);
    std::sort(off.begin(), off.end());
    EXPECT_LT(off[off.size() * 99 / 100], 1e-3f) << "holes " << holes;
    EXPECT_LT(off[off.size() / 2], 2e-5f) << "holes " << holes;
  }
}

/// A sphere of balls of which the field is nearly 1 wherever the surface is: exact sums place it.
TEST_P(SurfaceTest, inverse_square_vertices_in_flat_places_are_where_the_exact_field_is) {
  ExtractSettings settings;
  settings.field = FieldKind::kInverseSquare;
  settings.refine_steps = 4;
  std::vector<Ball> balls;
  constexpr int kBalls = 800;
  for (int i = 0; i < kBalls; ++i) {
    const float z = (2 * static_cast<float>(i) + 1) / kBalls - 1, ring = std::sqrt(1 - z * z);
    const float turn = 2.399963f * static_cast<float>(i);
    balls.push_back({{ring * std::cos(turn), ring * std::sin(turn), z}, 1, 0.001f});
  }
  const float middle = sample(balls, {{0.5f, 0, 0}}, settings)[0];
  for (Ball& ball : balls) ball.w /= middle;
  const Mesh mesh = extract(balls, cube_grid(60, 1.2f), settings);
  ASSERT_NO_FATAL_FAILURE(expect_sound(mesh));
  const std::vector<float> values = sample(balls, mesh.positions, settings);
  float worst = 0;
  std::size_t flat = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (length(mesh.positions[i]) > 0.7f) continue;
    ++flat;
    worst = std::max(worst, std::fabs(values[i] - 1));
  }
  EXPECT_GT(flat, 100u);
  EXPECT_LT(worst, 5e-6f);
}

TEST_P(SurfaceTest, inverse_square_normals_are_those_of_the_exact_field) {
  ExtractSettings settings;
  settings.field = FieldKind::kInverseSquare;
  std::vector<Ball> balls = random_balls(600, settings.field, 26);
  for (Ball& ball : balls) ball.w *= 0.08f;
  const Grid grid = cube_grid(64, 1.5f);
  for (const int influence : {1, 3}) {
    settings.sample_stride = influence;
    const Mesh mesh = extract(balls, grid, settings);
    ASSERT_NO_FATAL_FAILURE(expect_sound(mesh));
    const float h = 0.02f * grid.cell;
    std::vector<Vec3> points;
    for (const Vec3 p : mesh.positions) {
      for (const Vec3 d : {Vec3{h, 0, 0}, Vec3{0, h, 0}, Vec3{0, 0, h}})
        points.push_back(p - d), points.push_back(p + d);
    }
    const std::vector<float> v = sample(balls, points, settings);
    for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
      const float* at = v.data() + 6 * i;
      const Vec3 down = Vec3{at[0] - at[1], at[2] - at[3], at[4] - at[5]} / (2 * h) * grid.cell;
      if (length(down) < 0.1f) continue;
      ASSERT_LT(length(normalized(down) - mesh.normals[i]), 0.03f) << i << " of " << influence;
    }
  }
}

TEST_P(SurfaceTest, an_engine_used_before_gives_what_a_fresh_one_gives) {
  for (int n : {40, 90, 17, 64}) {
    for (const FieldKind field : {FieldKind::kInverseSquare, FieldKind::kGaussian}) {
      ExtractSettings settings;
      settings.field = field;
      const std::vector<Ball> balls = random_balls(n / 2, field, static_cast<unsigned>(n));
      const Grid grid = cube_grid(n, 1.6f);
      EngineStatus status;
      const auto fresh = make_engine(GetParam(), status);
      Mesh expected;
      ASSERT_EQ(fresh->extract(balls, grid, settings, expected).code, EngineCode::kOk);
      expect_same_mesh(extract(balls, grid, settings), expected);
    }
  }
}

TEST_P(SurfaceTest, midpoint_vertices_lie_half_way_and_keep_the_topology) {
  const std::vector<Ball> balls = random_balls(60, FieldKind::kGaussian, 21);
  const Grid grid = cube_grid(50, 1.7f);
  const Mesh rooted = extract(balls, grid);
  ExtractSettings settings;
  settings.placement = Placement::kMidpoint;
  settings.flat = true;
  const Mesh mesh = extract(balls, grid, settings);
  ASSERT_TRUE(same_bits(mesh.triangles, rooted.triangles));
  EXPECT_TRUE(mesh.normals.empty());
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    ASSERT_LT(length(mesh.positions[i] - rooted.positions[i]), 0.51f * grid.cell);
    const Vec3 p = (mesh.positions[i] - grid.origin) / grid.cell;
    const float away = std::fabs(p.x - std::round(p.x)) + std::fabs(p.y - std::round(p.y)) +
                       std::fabs(p.z - std::round(p.z));
    ASSERT_NEAR(away, 0.5f, 1e-3f);
  }
}

TEST_P(SurfaceTest, matrix_is_a_cube_at_each_point_inside) {
  const std::vector<Ball> balls = random_balls(30, FieldKind::kGaussian, 22);
  const Grid grid = {{-1, -1.1f, -0.9f}, 0.07f, {31, 28, 25}};  // cut by the border
  std::vector<Vec3> points;
  for (int z = 0; z < grid.points.z; ++z)
    for (int y = 0; y < grid.points.y; ++y)
      for (int x = 0; x < grid.points.x; ++x) points.push_back(grid_point(grid, {x, y, z}));
  const std::vector<float> values = sample(balls, points);
  const auto inside = [&](int x, int y, int z) {
    const Int3 n = grid.points;
    if (x < 0 || y < 0 || z < 0 || x >= n.x || y >= n.y || z >= n.z) return false;
    return values[static_cast<std::size_t>(x + n.x * (y + n.y * z))] > 1;
  };
  std::size_t cubes = 0, faces = 0;
  for (int z = -1; z < grid.points.z; ++z)
    for (int y = -1; y < grid.points.y; ++y)
      for (int x = -1; x < grid.points.x; ++x) {
        const bool here = inside(x, y, z);
        cubes += here;
        faces +=
            static_cast<std::size_t>((here != inside(x + 1, y, z)) + (here != inside(x, y + 1, z)) +
                                     (here != inside(x, y, z + 1)));
      }
  ExtractSettings settings;
  settings.method = SurfaceMethod::kMatrix;
  const Mesh mesh = extract(balls, grid, settings);
  ASSERT_GT(faces, 0u);
  EXPECT_EQ(mesh.positions.size(), 4 * faces);
  EXPECT_EQ(mesh.triangles.size(), 2 * faces);
  const double cell = static_cast<double>(grid.cell);
  EXPECT_NEAR(volume_of(mesh) / (cell * cell * cell), static_cast<double>(cubes), 1e-2);
  for (const Triangle& t : mesh.triangles) {
    const Double3 area = area_vector(mesh, t);
    ASSERT_NEAR(dot_of(area, to_double(mesh.normals[t.v[0]])), cell * cell, 1e-5);
  }
}

TEST_P(SurfaceTest, a_memory_limit_is_kept_and_named) {
  engine_->limit_memory(1 << 20);
  Mesh mesh;
  const std::vector<Ball> balls = random_balls(100, FieldKind::kGaussian, 24);
  const EngineStatus status = engine_->extract(balls, cube_grid(200, 1.6f), {}, mesh);
  EXPECT_EQ(status.code, EngineCode::kOutOfMemory);
  EXPECT_NE(status.message.find("limit is 2 MB"), std::string::npos) << status.message;
  EXPECT_TRUE(mesh.positions.empty());
  engine_->limit_memory(0);
  EXPECT_EQ(engine_->extract(balls, cube_grid(200, 1.6f), {}, mesh).code, EngineCode::kOk);
  EXPECT_FALSE(mesh.positions.empty());
  EXPECT_GT(engine_->memory_used(), std::size_t{1} << 20);
}

TEST_P(SurfaceTest, pass_times_name_each_pass_once) {
  ExtractSettings settings;
  settings.time_passes = true;
  extract(random_balls(50, FieldKind::kGaussian, 1), cube_grid(64, 1.6f), settings);
  const std::vector<PassTime> times = engine_->pass_times();
  std::vector<std::string> names;
  for (const PassTime& time : times) {
    names.push_back(time.name);
    EXPECT_GT(time.seconds, 0.0) << time.name;
  }
  std::vector<std::string> expected = {"prepare", "bricks",   "sample",
                                       "number",  "vertices", "triangles"};
  if (GetParam() == Backend::kCuda) {
    std::swap(expected[4], expected[5]);
    expected.push_back("download");
  }
  EXPECT_EQ(names, expected);
}

/// The grid without bricks, tree or culling: a plain loop over every lattice point and cell.
struct PlainLoop {
  std::vector<Int3> vertex_point;  ///< lattice point (grid point + 1) of each vertex
  std::vector<int> vertex_axis;
  std::vector<Triangle> triangles;

  PlainLoop(const Grid& grid, const std::vector<float>& values) {
    const Int3 n = {grid.points.x + 2, grid.points.y + 2, grid.points.z + 2};
    const auto inside = [&](int x, int y, int z) {
      if (x < 1 || y < 1 || z < 1 || x >= n.x - 1 || y >= n.y - 1 || z >= n.z - 1) return false;
      return values[static_cast<std::size_t>(
                 x - 1 +
                 grid.points.x * (y - 1 + static_cast<std::int64_t>(grid.points.y) * (z - 1)))] >
             1.0f;
    };
    const auto edge_index = [&](int x, int y, int z, int axis) {
      return static_cast<std::size_t>((x + n.x * (y + static_cast<std::int64_t>(n.y) * z)) * 3 +
                                      axis);
    };
    std::vector<std::uint32_t> number(edge_index(0, 0, n.z, 0));
    for (int z = 0; z < n.z; ++z)
      for (int y = 0; y < n.y; ++y)
        for (int x = 0; x < n.x; ++x)
          for (int axis = 0; axis < 3; ++axis) {
            const Int3 b = {x + (axis == 0), y + (axis == 1), z + (axis == 2)};
            if (inside(x, y, z) == inside(b.x, b.y, b.z)) continue;
            number[edge_index(x, y, z, axis)] = static_cast<std::uint32_t>(vertex_point.size());
            vertex_point.push_back({x, y, z});
            vertex_axis.push_back(axis);
          }
    for (int z = 0; z + 1 < n.z; ++z)
      for (int y = 0; y + 1 < n.y; ++y)
        for (int x = 0; x + 1 < n.x; ++x) {
          bool corners[8];
          for (int c = 0; c < 8; ++c)
            corners[c] = inside(x + (c & 1), y + (c >> 1 & 1), z + (c >> 2));
          const int key = voxel_key(corners);
          for (int t = 0; t < mc_table().count[key]; ++t) {
            Triangle triangle;
            for (int v = 0; v < 3; ++v) {
              const int e = mc_table().edges[key][3 * t + v], c = edge_low_corner(e);
              triangle.v[v] =
                  number[edge_index(x + (c & 1), y + (c >> 1 & 1), z + (c >> 2), edge_axis(e))];
            }
            triangles.push_back(triangle);
          }
        }
  }
};

/// The grid edge that a vertex lies on: lattice point of its lower end, and axis.
struct EdgeOfVertex {
  Int3 point;
  int axis = -1;

  EdgeOfVertex(const Grid& grid, Vec3 p) {
    const float at[3] = {p.x, p.y, p.z}, origin[3] = {grid.origin.x, grid.origin.y, grid.origin.z};
    int* out[3] = {&point.x, &point.y, &point.z};
    for (int a = 0; a < 3; ++a) {
      const float cells = (at[a] - origin[a]) / grid.cell;
      const float nearest = std::round(cells);
      const bool on_point = origin[a] + grid.cell * nearest == at[a];
      if (!on_point) axis = axis == -1 ? a : 3;
      *out[a] = 1 + static_cast<int>(on_point ? nearest : std::floor(cells));
    }
  }
  /// Ascending in the order in which vertices come: the place of the brick in the tree, most
  /// significant digits first, then the place in the brick.
  std::uint64_t order() const {
    std::uint64_t key = 0;
    const Int3 b = {point.x / 7, point.y / 7, point.z / 7};
    for (int l = 9; l >= 0; --l) {
      const auto digit = [l](int v) { return static_cast<std::uint64_t>(v >> 2 * l & 3); };
      key = key << 6 | digit(b.z) << 4 | digit(b.y) << 2 | digit(b.x);
    }
    const int inside = point.x % 7 + 7 * (point.y % 7 + 7 * (point.z % 7));
    return key * 2048 + static_cast<std::uint64_t>(3 * inside + axis);
  }
};

TEST_P(SurfaceTest, order_and_topology_are_those_of_a_plain_loop_over_the_grid) {
  struct Case {
    FieldKind field;
    Int3 points;
    int balls;
    unsigned seed;
    float strength = 1;
    bool holes = false;
  };
  // Trees of one, two and three levels; sizes around multiples of a brick; surfaces that leave the
  // grid; many weak balls of infinite support, of which most are distant from most bricks.
  for (const Case& c :
       {Case{FieldKind::kGaussian, {2, 2, 2}, 30, 1}, Case{FieldKind::kGaussian, {3, 4, 5}, 30, 2},
        Case{FieldKind::kGaussian, {15, 16, 17}, 30, 3},
        Case{FieldKind::kGaussian, {63, 40, 21}, 80, 4},
        Case{FieldKind::kGaussian, {70, 66, 65}, 300, 5},
        Case{FieldKind::kInverseSquare, {19, 36, 8}, 40, 6},
        Case{FieldKind::kInverseSquare, {67, 33, 30}, 60, 7},
        Case{FieldKind::kInverseSquare, {67, 60, 53}, 400, 8, 0.1f},
        Case{FieldKind::kInverseSquare, {127, 66, 64}, 900, 9, 0.05f},
        Case{FieldKind::kInverseSquare, {60, 77, 71}, 300, 10, 0.4f, true}}) {
    SCOPED_TRACE(testing::Message() << c.points.x << " x " << c.points.y << " x " << c.points.z);
    ExtractSettings settings;
    settings.field = c.field;
    std::vector<Ball> balls = random_balls(c.balls, c.field, c.seed);
    for (Ball& ball : balls) ball.w *= c.strength;
    if (c.holes) balls = with_holes(balls);
    const Grid grid = {{-1, -1.1f, -0.9f}, 2.0f / static_cast<float>(c.points.x - 1), c.points};
    std::vector<Vec3> points;
    for (int z = 0; z < c.points.z; ++z)
      for (int y = 0; y < c.points.y; ++y)
        for (int x = 0; x < c.points.x; ++x) points.push_back(grid_point(grid, {x, y, z}));
    const PlainLoop expected(grid, sample(balls, points, settings));
    const Mesh mesh = extract(balls, grid, settings);
    ASSERT_EQ(mesh.positions.size(), expected.vertex_point.size());
    std::map<std::array<int, 4>, std::uint32_t> number;
    for (std::size_t i = 0; i < expected.vertex_point.size(); ++i) {
      const Int3 e = expected.vertex_point[i];
      number[{e.x, e.y, e.z, expected.vertex_axis[i]}] = static_cast<std::uint32_t>(i);
    }
    std::vector<std::uint32_t> plain;
    std::uint64_t last = 0;
    for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
      const EdgeOfVertex edge(grid, mesh.positions[i]);
      const auto found = number.find({edge.point.x, edge.point.y, edge.point.z, edge.axis});
      ASSERT_NE(found, number.end()) << "vertex " << i << " is on no crossed edge";
      plain.push_back(found->second);
      ASSERT_TRUE(i == 0 || edge.order() > last) << "vertex " << i << " is out of order";
      last = edge.order();
    }
    std::vector<std::array<std::uint32_t, 3>> got, want;
    for (const Triangle& t : mesh.triangles)
      got.push_back({plain[t.v[0]], plain[t.v[1]], plain[t.v[2]]});
    for (const Triangle& t : expected.triangles) want.push_back({t.v[0], t.v[1], t.v[2]});
    std::sort(got.begin(), got.end());
    std::sort(want.begin(), want.end());
    ASSERT_EQ(got, want);
  }
}

TEST_P(SurfaceTest, influence_interpolates_between_coarse_points) {
  const std::vector<Ball> balls = random_balls(40, FieldKind::kGaussian, 23);
  const Grid grid = cube_grid(47, 1.7f);
  const std::size_t exact = extract(balls, grid).triangles.size();
  for (int k : {2, 3, 5}) {
    ExtractSettings settings;
    settings.sample_stride = k;
    const Mesh mesh = extract(balls, grid, settings);
    ASSERT_NO_FATAL_FAILURE(expect_sound(mesh));
    EXPECT_NE(mesh.triangles.size(), exact);
    const int n = (grid.points.x + k - 1) / k + 1;
    std::vector<Vec3> points;
    for (int i = 0; i < n * n * n; ++i)
      points.push_back(grid_point(grid, {k * (i % n), k * (i / n % n), k * (i / n / n)}));
    const std::vector<float> coarse = sample(balls, points);
    std::vector<float> values;
    for (int z = 0; z < grid.points.z; ++z)
      for (int y = 0; y < grid.points.y; ++y)
        for (int x = 0; x < grid.points.x; ++x) {
          const auto at = [&](int dx, int dy, int dz) {
            return coarse[static_cast<std::size_t>(x / k + dx +
                                                   n * (y / k + dy + n * (z / k + dz)))];
          };
          const float step = 1.0f / static_cast<float>(k);
          const float tx = step * static_cast<float>(x % k), ty = step * static_cast<float>(y % k),
                      tz = step * static_cast<float>(z % k);
          const auto level = [&](int dz) {
            return lerp(lerp(at(0, 0, dz), at(1, 0, dz), tx), lerp(at(0, 1, dz), at(1, 1, dz), tx),
                        ty);
          };
          values.push_back(lerp(level(0), level(1), tz));
        }
    const PlainLoop expected(grid, values);
    EXPECT_EQ(mesh.positions.size(), expected.vertex_point.size());
    EXPECT_EQ(mesh.triangles.size(), expected.triangles.size());
  }
}

PM_EVERY_BACKEND(SurfaceTest);

}  // namespace
}  // namespace polymorph
