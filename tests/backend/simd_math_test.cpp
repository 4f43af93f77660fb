#include "kernels/simd_math.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "kernels/cpu_backend.h"
#include "kernels/distance_field.h"
#include "kernels/falloff.h"
#include "kernels/regression.h"
#include "testing/backend.h"

namespace polymorph {
namespace {

TEST(Math, exp2_is_within_1_5e_7) {
  double worst = 0;
  for (int i = 0; i <= 2250000; ++i) {
    const float e = kMinExponent + static_cast<float>(i) * 1e-4f;
    const double exact = std::exp2(static_cast<double>(e));
    worst = std::max(worst, std::fabs(static_cast<double>(exp2(e)) / exact - 1));
  }
  EXPECT_LT(worst, 1.5e-7);
  RecordProperty("worst", std::to_string(worst));
}

TEST(Math, exp2_is_exact_for_whole_exponents) {
  for (int e = -125; e <= 100; ++e) {
    EXPECT_EQ(exp2(static_cast<float>(e)), std::ldexp(1.0f, e)) << e;
  }
}

TEST(Math, log2_is_within_2e_7) {
  double worst = 0;
  for (int i = 0; i < 2000000; ++i) {
    const float a = std::ldexp(1.0f + static_cast<float>(i % 8191) / 8191.0f, i % 240 - 120);
    const double exact = std::log2(static_cast<double>(a));
    const double error = std::fabs(static_cast<double>(log2(a)) - exact);
    worst = std::max(worst, error / std::max(1.0, std::fabs(exact)));
  }
  EXPECT_LT(worst, 2e-7);
  EXPECT_EQ(log2(1.0f), 0.0f);
  EXPECT_EQ(log2(0.125f), -3.0f);
}

TEST(Math, branchless_selections_agree_with_comparisons) {
  const float values[] = {-2.5f, -0.0f, 0.0f, 1e-30f, 3.0f, 1e30f};
  for (const float a : values) {
    for (const float b : values) {
      EXPECT_EQ(min(a, b), std::fmin(a, b));
      EXPECT_EQ(max(a, b), std::fmax(a, b));
    }
    EXPECT_EQ(float_bits(zero_unless(false, a)), 0u);
    EXPECT_EQ(float_bits(zero_unless(true, a)), float_bits(a));
  }
  EXPECT_EQ(float_bits(zero_unless(false, std::numeric_limits<float>::quiet_NaN())), 0u);
}

#if defined(PM_PACKS)
TEST(Packs, gathers_of_rows_permutations_and_transposes_move_every_float) {
  float table[64];
  for (int i = 0; i < 64; ++i) table[i] = static_cast<float>(i);
  const PackBits index{3, 51, 1, 17, 17, 40, 8, 52};
  const std::int32_t offsets[2] = {-1, 8};
  Pack pairs[2][2], quadruples[2][4];
  gather_rows(table, index, offsets, pairs);
  gather_rows(table, index, offsets, quadruples);
  const PackBits order{7, 0, 3, 3, 5, 1, 6, 2};
  const Pack permuted = permute(Lanes<Pack>::load(table + 8), order);
  Pack rows[8];
  for (int r = 0; r < 8; ++r) rows[r] = Lanes<Pack>::load(table + 8 * r);
  transpose(rows);
  for (int l = 0; l < 8; ++l) {
    for (int r = 0; r < 2; ++r) {
      float quadruple[1][4];
      const std::int32_t offset[1] = {offsets[r]};
      gather_rows(table, index[l], offset, quadruple);
      for (int i = 0; i < 4; ++i) {
        const float expected = table[static_cast<int>(index[l]) + offsets[r] + i];
        if (i < 2) {
          EXPECT_EQ(pairs[r][i][l], expected) << l;
        }
        EXPECT_EQ(quadruples[r][i][l], expected) << l;
        EXPECT_EQ(quadruple[0][i], expected) << l;
      }
    }
    EXPECT_EQ(permuted[l], table[8 + order[l]]) << l;
    for (int r = 0; r < 8; ++r) EXPECT_EQ(rows[r][l], table[8 * l + r]) << r << ' ' << l;
  }
}

TEST(Packs, splines_have_the_bits_of_each_point_alone) {
  Regression regression;
  regression.lattice = {{-1, -1, -1}, 0.25f, {9, 9, 9}};
  std::vector<float> nodes(9 * 9 * 9 * kRegressionValues);
  for (std::size_t i = 0; i < nodes.size(); ++i)
    nodes[i] = static_cast<float>(i * 2654435761u % 1000003u) * 1e-6f - 0.4f;
  const SmoothMap map(regression, nodes.data());
  const auto expect_point = [&](Vec3 p, const Pack(&values)[kRegressionValues], int lane) {
    float expected[kRegressionValues];
    map.spline(Points<float>{p.x, p.y, p.z}, expected);
    for (int k = 0; k < kRegressionValues; ++k)
      EXPECT_EQ(float_bits(values[k][lane]), float_bits(expected[k])) << p.x << ' ' << lane;
  };
  // Bricks within a cell, across some, beyond the lattice, and across too many.
  int packs = 0, teams = 0;
  for (const float step : {0.01f, 0.11f, 0.17f, 0.4f})
    for (const float start : {-1.3f, -0.6f, 0.1f, 0.55f, 0.9f}) {
      const Pack x = start + step * Lanes<Pack>::iota(), y = x + 0.05f, z = x - 0.03f;
      Pack values[kRegressionValues], slopes[3][kRegressionValues];
      map.spline(Points<Pack>{x, y, z}, values);
      for (int l = 0; l < 8; ++l) expect_point({x[l], y[l], z[l]}, values, l);
      map.spline(Points<Pack>{x, y, z}, values, slopes);
      for (int l = 0; l < 8; ++l) {
        expect_point({x[l], y[l], z[l]}, values, l);
        float value[kRegressionValues], expected[3][kRegressionValues];
        map.spline(Points<float>{x[l], y[l], z[l]}, value, expected);
        for (int axis = 0; axis < 3; ++axis)
          for (int k = 0; k < kRegressionValues; ++k)
            EXPECT_EQ(float_bits(slopes[axis][k][l]), float_bits(expected[axis][k])) << step;
      }
      const Grid grid = {{start, start + 0.05f, start - 0.03f}, step, {8, 8, 8}};
      TeamBrickSpline::Scratch scratch;
      PackBrickSpline::Scratch pack_scratch;
      const CpuTeam<float> team;
      PackBrickSpline brick(pack_scratch, map, brick_box(grid, {0, 0, 0}).axes);
      const TeamBrickSpline shared(team, scratch, map, grid, {0, 0, 0});
      for (const auto& [j, k] : {std::pair(0, 0), std::pair(7, 2), std::pair(4, 7)}) {
        const int line = j + kBrickPoints * k;
        // clang captures no names of structured bindings.
        const auto position = [&, y_index = j, z_index = k](int l) {
          return grid_point(grid, {l, y_index, z_index});
        };
        if (brick.has_lines()) {
          ++packs;
          brick.add_lines(std::uint64_t{1} << line);
          // The line's points in another order.
          std::uint32_t points[8];
          for (int l = 0; l < 8; ++l)
            points[l] = static_cast<std::uint32_t>(3 * l % 8 + kBrickPoints * line);
          brick.values(points, values);
          for (int l = 0; l < 8; ++l) expect_point(position(3 * l % 8), values, l);
        }
        if (shared.has_lines()) {
          ++teams;
          for (int l = 0; l < 8; ++l) {
            float at_point[kRegressionValues];
            shared.values(kBrickPoints * line + l, at_point);
            for (int i = 0; i < kRegressionValues; ++i) values[i][l] = at_point[i];
            expect_point(position(l), values, l);
          }
        }
      }
    }
  EXPECT_GE(packs, 45);
  EXPECT_GE(teams, 30);
  TeamBrickSpline::Scratch scratch;
  PackBrickSpline::Scratch pack_scratch;
  const Grid coarse = {{-1, 0, 0}, 0.28f, {8, 8, 8}};
  EXPECT_FALSE(PackBrickSpline(pack_scratch, map, brick_box(coarse, {0, 0, 0}).axes).has_lines());
  EXPECT_FALSE(TeamBrickSpline(CpuTeam<float>{}, scratch, map, coarse, {0, 0, 0}).has_lines());
}

TEST(Packs, slopes_of_distances_have_the_bits_of_their_differences) {
  const Grid grid = {{-1, -1, -1}, 0.25f, {9, 9, 9}};
  std::vector<float> values(9 * 9 * 9), smooth(values.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    values[i] = static_cast<float>(i * 2654435761u % 1000003u) * 1e-6f - 0.4f;
    smooth[i] = 0.5f * values[i] + 0.01f;
  }
  DistanceField plain(grid, values.data()), detailed = plain;
  detailed.set_detail(smooth.data(), {});
  int inner = 0;
  for (const DistanceField& field : {plain, detailed}) {
    for (const float share : {0.0f, 0.3f, 1.0f}) {
      // Inside, where the cells of all differences are neighbours, and across the border.
      for (const float start : {-0.7f, -0.55f, -1.4f, 0.3f}) {
        // The step avoids the grid's points, where either neighbouring cell is right.
        const Pack x = start + 0.13f * Lanes<Pack>::iota();
        const Points<Pack> p = {x, 0.3f * x, 0.1f - 0.7f * x};
        bool has_neighbours = true;  // every cell and both its neighbours are in the grid
        for (const Pack& c : {p.x, p.y, p.z})
          for (int l = 0; l < 8; ++l) {
            const float u = (c[l] - grid.origin.x) / grid.cell;
            has_neighbours &= u > 1 && u < 7 && std::abs(u - std::round(u)) > 1e-3f;
          }
        inner += has_neighbours ? 1 : 0;
        const Pack detail = broadcast<Pack>(share);
        const auto slope = field.slope(p, detail);
        const auto difference = [&](float dx, float dy, float dz) {
          return (field.value(Points<Pack>{p.x + dx, p.y + dy, p.z + dz}, detail) -
                  field.value(Points<Pack>{p.x - dx, p.y - dy, p.z - dz}, detail)) *
                 (0.5f * field.inv_cell);
        };
        const Pack expected[4] = {field.value(p, detail), difference(grid.cell, 0, 0),
                                  difference(0, grid.cell, 0), difference(0, 0, grid.cell)};
        const Pack slopes[4] = {slope.value, slope.gradient.x, slope.gradient.y, slope.gradient.z};
        for (int l = 0; l < 8; ++l) {
          const Points<float> point = {p.x[l], p.y[l], p.z[l]};
          const auto alone = field.slope(point, share);
          const float of_point[4] = {alone.value, alone.gradient.x, alone.gradient.y,
                                     alone.gradient.z};
          for (int i = 0; i < 4; ++i) {
            EXPECT_EQ(float_bits(slopes[i][l]), float_bits(expected[i][l])) << start << ' ' << i;
            EXPECT_EQ(float_bits(of_point[i]), float_bits(expected[i][l])) << start << ' ' << i;
          }
          const float loss = field.value(point, 1.0f) - field.value(point, 0.0f);
          EXPECT_EQ(slope.detail_derivative[l], field.smooth ? loss : 0.0f);
          EXPECT_EQ(alone.detail_derivative, slope.detail_derivative[l]);
        }
      }
    }
  }
  EXPECT_EQ(inner, 12);  // two starts, three shares, two fields
}
#endif

using RoundGaussian = Field<GaussianField, RoundBall>;
using Ellipsoid = Field<GaussianField, EllipsoidBall>;
using RoundWyvill = Field<WyvillField, RoundBall>;
using InverseSquare = Field<InverseSquareField, RoundBall>;

template <class F>
float value_at(const typename F::Ball& ball, Vec3 p) {
  return F::value(ball, ball.q(p.x, p.y, p.z));
}

/// Turned by 30 degrees about z and 50 about x.
Sym3 tilted_shape() { return shape_of({2, 1, 0.5f}, 0.5235987756, 0.872664626); }

TEST(Falloff, gaussian_is_blinns_and_exactly_zero_beyond_reach) {
  const Ball ball = {{0, 0, 0}, 4.0f / (0.3f * 0.3f), 4.0f};
  const RoundBall p = prepare_ball<RoundGaussian>(ball, FieldScale{std::log2(1e-4f), 1});
  EXPECT_NEAR(value_at<RoundGaussian>(p, {0.3f, 0, 0}), 1.0f, 1e-6f);
  // Reach: r = R sqrt(1 + ln(1 / cutoff) / B).
  const float reach = 0.3f * std::sqrt(1 + std::log(1e4f) / 4);
  EXPECT_NEAR(value_at<RoundGaussian>(p, {0, reach * 0.9999f, 0}), 1e-4f, 1e-6f);
  EXPECT_EQ(float_bits(value_at<RoundGaussian>(p, {0, 0, reach * 1.0001f})), 0u);
  EXPECT_EQ(float_bits(value_at<RoundGaussian>(p, {1e15f, 0, 0})), 0u);
  EXPECT_EQ(float_bits(RoundGaussian::value(p, kInfinity)), 0u);
  EXPECT_EQ(float_bits(RoundGaussian::value(p, std::nanf(""))), 0u);
}

TEST(Falloff, a_ball_below_the_cutoff_contributes_nowhere) {
  const RoundBall p =
      prepare_ball<RoundGaussian>({{0, 0, 0}, 1, -20}, FieldScale{std::log2(1e-4f), 1});
  EXPECT_EQ(value_at<RoundGaussian>(p, {0, 0, 0}), 0.0f);
}

TEST(Falloff, a_very_strong_ball_stays_finite) {
  const RoundBall p =
      prepare_ball<RoundGaussian>({{0, 0, 0}, 1, 1000}, FieldScale{std::log2(1e-4f), 1});
  EXPECT_EQ(value_at<RoundGaussian>(p, {0, 0, 0}), std::ldexp(1.0f, 100));
}

TEST(Falloff, inverse_square_is_finite_at_the_center) {
  const RoundBall p = prepare_ball<InverseSquare>({{0, 0, 0}, 1, 0.25f}, FieldScale{});
  EXPECT_TRUE(std::isfinite(value_at<InverseSquare>(p, {0, 0, 0})));
  EXPECT_FLOAT_EQ(value_at<InverseSquare>(p, {0.5f, 0, 0}), 1.0f);
}

TEST(Falloff, wyvill_is_his_polynomial_and_ends_at_the_support) {
  const RoundBall p = prepare_ball<RoundWyvill>({{0, 0, 0}, 1 / (0.5f * 0.5f), 3}, FieldScale{});
  for (double r = 0; r < 0.5; r += 0.01) {
    const double q = r * r / 0.25;
    const double expected = 3 * (1 - 22.0 / 9 * q + 17.0 / 9 * q * q - 4.0 / 9 * q * q * q);
    EXPECT_NEAR(static_cast<double>(value_at<RoundWyvill>(p, {0, static_cast<float>(r), 0})),
                expected, 3e-6);
  }
  EXPECT_EQ(value_at<RoundWyvill>(p, {0.5f, 0, 0}), 0.0f);
  EXPECT_EQ(value_at<RoundWyvill>(p, {0.51f, 0, 0}), 0.0f);
  EXPECT_EQ(RoundWyvill::value(p, kInfinity), 0.0f);
}

TEST(FieldKinds, a_ball_of_a_sphere_is_at_its_radius_and_all_forms_agree) {
  for (const FieldKind kind : kFieldKinds) {
    visit(kind, [&](auto field) {
      EXPECT_EQ(decltype(field)::kKind, kind);
      EXPECT_EQ(field_name(kind), decltype(field)::kName);
      const Ball ball = field.from_sphere({1, 2, 3}, 0.7f, {});
      const auto at = [&](float r) { return field.coordinate(ball, {0, r, 0}); };
      EXPECT_NEAR(to_double(field.log_value(ball, at(0.7f))), 0, 2e-6) << field.kName;
      EXPECT_NEAR(to_double(field.surface(ball)), to_double(at(0.7f)), 1e-5) << field.kName;
      const RoundBall prepared =
          prepare_ball<Field<decltype(field), RoundBall>>(ball, {.log2_floor = -20, .length = 1});
      for (const float r : {0.3f, 0.6f, 0.9f, 1.1f}) {
        const float value = field.value(prepared, prepared.q(1.0f, 2.0f + r, 3.0f));
        EXPECT_NEAR(std::log(to_double(value)), to_double(field.log_value(ball, at(r))), 2e-5)
            << field.kName << " at " << r;
        constexpr float kStep = 1e-3f;
        const double slope = (to_double(field.log_value(ball, at(r) + kStep)) -
                              to_double(field.log_value(ball, at(r) - kStep))) /
                             (2 * to_double(kStep));
        EXPECT_NEAR(to_double(field.log_slope(ball, at(r))), slope, 0.01 * std::fabs(slope) + 1e-3)
            << field.kName << " at " << r;
      }
      // Half of the value, and twice the level.
      Ball half = ball;
      half.w = field.scale_weight(ball.w, 0.5f);
      EXPECT_NEAR(to_double(field.log_value(half, at(0.7f))), std::log(0.5), 1e-5) << field.kName;
      Ball lower = ball;
      field.rescale(lower, 2);
      EXPECT_NEAR(to_double(field.log_value(lower, at(0.7f))), std::log(0.5), 1e-5) << field.kName;
    });
  }
}

TEST(Falloff, negated_derivative_is_the_slope_of_value) {
  const auto check = [](auto field, const Ball& ball) {
    using F = decltype(field);
    const auto p = prepare_ball<F>(ball, FieldScale{std::log2(1e-4f), 1});
    // One factor common to all q: the ratio of the slopes at two places.
    const auto slope = [&](float q) {
      const double h = 1e-3;
      return static_cast<double>(F::value(p, q - 1e-3f) - F::value(p, q + 1e-3f)) / (2 * h);
    };
    EXPECT_NEAR(
        slope(0.3f) / slope(0.6f),
        static_cast<double>(F::negated_derivative(p, 0.3f) / F::negated_derivative(p, 0.6f)), 2e-3);
  };
  check(RoundGaussian{}, {{0, 0, 0}, 4, 1});
  check(RoundWyvill{}, {{0, 0, 0}, 1, 2});
  check(InverseSquare{}, {{0, 0, 0}, 1, 2});
}

TEST(Falloff, an_ellipsoid_is_the_quadratic_form_of_its_shape) {
  const Ball ball = {{0.1f, -0.2f, 0.3f}, 3, 2, tilted_shape()};
  EXPECT_NEAR(determinant(ball.shape), 1, 1e-5f);
  const EllipsoidBall p = prepare_ball<Ellipsoid>(ball, FieldScale{std::log2(1e-6f), 1});
  for (int i = 0; i < 200; ++i) {
    const auto f = static_cast<float>(i);
    const Vec3 d = {0.5f * std::sin(f), 0.5f * std::sin(1.7f * f), 0.5f * std::cos(2.3f * f)};
    const Vec3 at = ball.center + d;
    const float expected = std::exp(2 - 3 * quadratic(ball.shape, d));
    EXPECT_NEAR(value_at<Ellipsoid>(p, at), expected > 1e-6f ? expected : 0, 2e-5f * expected);
    // The gradient of q is 2 a log2(e) shape d.
    const Points<float> g = p.half_gradient_of_q(Points<float>{at.x, at.y, at.z});
    const Sym3& s = ball.shape;
    const float k = 3 * 1.44269504f;
    EXPECT_NEAR(g.x, k * (s.xx * d.x + s.xy * d.y + s.xz * d.z), 1e-4f);
    EXPECT_NEAR(g.y, k * (s.xy * d.x + s.yy * d.y + s.yz * d.z), 1e-4f);
    EXPECT_NEAR(g.z, k * (s.xz * d.x + s.yz * d.y + s.zz * d.z), 1e-4f);
  }
}

TEST(Falloff, the_range_of_a_box_holds_every_coordinate_computed_in_it) {
  const Ball ball = {{0.1f, -0.2f, 0.3f}, 3, 2, tilted_shape()};
  const EllipsoidBall e = prepare_ball<Ellipsoid>(ball, FieldScale{std::log2(1e-4f), 1});
  const RoundBall r = prepare_ball<RoundGaussian>(ball, FieldScale{std::log2(1e-4f), 1});
  for (int b = 0; b < 300; ++b) {
    const auto f = static_cast<float>(b);
    const Vec3 low = {std::sin(f), std::sin(1.3f * f), std::sin(2.1f * f)};
    const Vec3 high = low + Vec3{0.3f, 0.01f, 0.1f} * (1 + std::cos(f));
    const CoordinateRange<float> box = {low.x, high.x, low.y, high.y, low.z, high.z};
    const auto in_e = e.range(box);
    const auto in_r = r.range(box);
    for (int i = 0; i < 125; ++i) {
      const auto part = [](float a, float c, int k) {
        return k == 0 ? a : k == 4 ? c : a + (c - a) * 0.25f * static_cast<float>(k);
      };
      const Vec3 p = {part(low.x, high.x, i % 5), part(low.y, high.y, i / 5 % 5),
                      part(low.z, high.z, i / 25)};
      const float qe = e.q(p.x, p.y, p.z), qr = r.q(p.x, p.y, p.z);
      ASSERT_TRUE(in_e.near <= qe && qe <= in_e.far);
      ASSERT_TRUE(in_r.near <= qr && qr <= in_r.far);
    }
  }
}

TEST(Falloff, a_shape_that_is_no_body_has_no_factor) {
  double m[6];
  EXPECT_TRUE(factor_shape(tilted_shape(), 1, m));
  EXPECT_FALSE(factor_shape({1, 1, -1, 0, 0, 0}, 1, m));
  EXPECT_FALSE(factor_shape({1, 1, 1, 2, 0, 0}, 1, m));
  EXPECT_FALSE(factor_shape({1, 1, 1, 1, 0, 0}, 1, m));
  EXPECT_FALSE(factor_shape({std::nanf(""), 1, 1, 0, 0, 0}, 1, m));
}

}  // namespace
}  // namespace polymorph
