#include "analyze/roughness.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "analyze/occupancy.h"
#include "base/parallel.h"
#include "field/extract_surface.h"
#include "mesh/mesh_check.h"
#include "model/shapes.h"
#include "testing/morph.h"

namespace polymorph {
namespace {

Mesh shape(const char* name) {
  const Model model = make_shape(name).value();
  return {model.points, {}, model.triangles};
}

Mesh moved(Mesh mesh, float scale, Vec3 shift, const Mat3& turn = {}) {
  for (Vec3& p : mesh.positions) p = to_float(turn * Vec3d(p)) * scale + shift;
  return mesh;
}

Mesh both(Mesh one, const Mesh& two) {
  const auto first = static_cast<std::uint32_t>(one.positions.size());
  one.positions.insert(one.positions.end(), two.positions.begin(), two.positions.end());
  for (const Triangle& t : two.triangles)
    one.triangles.push_back({{t.v[0] + first, t.v[1] + first, t.v[2] + first}});
  return one;
}

/// A sphere of radius 1 with Gaussian bumps, or with dents where `height` is below 0, spread evenly
/// over it.
Mesh bumpy_sphere(int bumps, double height = 0.35) {
  constexpr int kRings = 160, kAround = 320;
  constexpr double kWidth = 0.1, kGolden = 2.399963229728653;
  std::vector<Vec3d> tops;
  for (int i = 0; i < bumps; ++i) {
    const double z = 1 - (2.0 * i + 1) / bumps, side = std::sqrt(1 - z * z);
    tops.push_back({side * std::cos(kGolden * i), side * std::sin(kGolden * i), z});
  }
  Mesh mesh;
  const auto add = [&](double polar, double around) {
    const Vec3d way{std::sin(polar) * std::cos(around), std::sin(polar) * std::sin(around),
                    std::cos(polar)};
    double radius = 1;
    for (const Vec3d& top : tops)
      radius += height * std::exp(-dot(way - top, way - top) / (2 * kWidth * kWidth));
    mesh.positions.push_back(to_float(way * radius));
  };
  add(0, 0);
  for (int r = 1; r < kRings; ++r)
    for (int k = 0; k < kAround; ++k)
      add(r * std::numbers::pi / kRings, k * 2 * std::numbers::pi / kAround);
  add(std::numbers::pi, 0);
  const auto at = [&](int r, int k) -> std::uint32_t {
    if (r == 0) return 0;
    if (r == kRings) return static_cast<std::uint32_t>(mesh.positions.size() - 1);
    return static_cast<std::uint32_t>(1 + (r - 1) * kAround + k % kAround);
  };
  for (int r = 0; r < kRings; ++r)
    for (int k = 0; k < kAround; ++k) {
      if (r > 0) mesh.triangles.push_back({{at(r, k), at(r + 1, k), at(r, k + 1)}});
      if (r + 1 < kRings)
        mesh.triangles.push_back({{at(r, k + 1), at(r + 1, k), at(r + 1, k + 1)}});
    }
  return mesh;
}

RoughnessScale own_scale(const Mesh& mesh, int resolution = 104) {
  return roughness_scale(bounding_box(mesh.positions), resolution);
}
Roughness roughness(const Mesh& mesh, int resolution = 104) {
  return measure_roughness(mesh, own_scale(mesh, resolution));
}

/// Balls on straight ways, the same for every version of plans and motions.
Mesh lumps_at(double u) {
  const std::vector<Ball> from = random_balls(24, 3), to = random_balls(24, 5);
  std::vector<Ball> balls = from;
  const auto t = static_cast<float>(u);
  for (std::size_t i = 0; i < balls.size(); ++i) {
    balls[i].center = (from[i].center * (1 - t) + to[i].center * t) * 1.8f;
    balls[i].a = from[i].a * (1 - t) + to[i].a * t;
    balls[i].w = from[i].w * (1 - t) + to[i].w * t;
  }
  const auto engine = make_cpu_engine();
  return extract_surface(*engine, balls, 0.02f, {}).value();
}

TEST(Occupancy, OfACubeIsItsVolume) {
  const Mesh cube = shape("cube");
  for (const double cell : {0.1, 0.037}) {
    const CellValues values = compute_occupancy(cube, cell, 0.3);
    EXPECT_NEAR(sum_values(values) * cell * cell * cell, 8, 0.02);
    for (const float v : values.values) {
      ASSERT_GE(v, 0);
      ASSERT_LE(v, 1.0001f);
    }
  }
}

TEST(Occupancy, IsNothingWhereTheMeshIsOpen) {
  Mesh cube = shape("cube");
  const double whole = sum_values(compute_occupancy(cube, 0.1, 0.3));
  // Without one triangle the lines through it have no other end.
  std::erase_if(cube.triangles, [&](const Triangle& t) {
    return std::abs(cube.positions[t.v[0]].z - 1) + std::abs(cube.positions[t.v[1]].z - 1) +
               std::abs(cube.positions[t.v[2]].z - 1) <
           1e-6f;
  });
  EXPECT_LT(cube.triangles.size(), shape("cube").triangles.size());
  EXPECT_LT(sum_values(compute_occupancy(cube, 0.1, 0.3)), 0.6 * whole);
  EXPECT_TRUE(compute_occupancy({}, 0.1, 0.3).values.empty());
}

TEST(Smoothed, KeepsTheSumAndItsLevelTheVolume) {
  const CellValues sharp = compute_occupancy(bumpy_sphere(8), 0.04, 0.5);
  const CellValues field = smooth(sharp, 2, 4);
  EXPECT_NEAR(sum_values(field) / sum_values(sharp), 1, 1e-5);
  const float level = find_level_of_volume(field, sum_values(sharp));
  EXPECT_NEAR(level, 0.5f, 0.05f);
  const IsoSurface surface = extract_iso_surface(field, level);
  const Mesh mesh{surface.positions, std::vector<Vec3>(surface.positions.size()),
                  surface.triangles};
  const MeshReport report = check_mesh(mesh);
  EXPECT_TRUE(report.is_manifold());
  EXPECT_EQ(report.genus, 0);
  EXPECT_NEAR(report.volume / sum_values(sharp), 1, 0.01);
  double area = 0;
  for (const double a : vertex_areas(surface)) area += a;
  EXPECT_NEAR(area, report.area, 1e-3 * report.area);
}

TEST(Roughness, OfConvexShapesIsOneAndNoBump) {
  for (const char* name : {"sphere", "cube"}) {
    const Roughness r = roughness(shape(name));
    EXPECT_NEAR(r.tac, 1, 0.07) << name;
    EXPECT_EQ(r.groove, 0) << name;
  }
  EXPECT_NEAR(roughness(shape("sphere"), 160).tac, 1, 0.03);
  const Roughness sphere = roughness(shape("sphere"));
  EXPECT_EQ(sphere.bumps, 0);
  EXPECT_LT(sphere.rho, 0.02);
  EXPECT_EQ(roughness(shape("cube")).bumps, 8) << "its corners";
}

TEST(Roughness, OfATorusIsTwo) {
  // An outer half of 1 and an inner one of -1, whatever the radii.
  EXPECT_NEAR(roughness(shape("torus")).tac, 2, 0.15);
  EXPECT_NEAR(roughness(shape("torus"), 160).tac, 2, 0.08);
}

TEST(Roughness, OfTwoSpheresIsTwo) {
  const Mesh sphere = shape("sphere");
  const Mesh two = both(sphere, moved(sphere, 0.7f, {3, 0, 0}));
  EXPECT_NEAR(roughness(two).tac, 2, 0.2);
  EXPECT_NEAR(roughness(two, 208).tac, 2, 0.08);
}

TEST(Roughness, CountsBumps) {
  for (const int bumps : {1, 6, 20}) {
    const Roughness r = roughness(bumpy_sphere(bumps));
    EXPECT_EQ(r.bumps, bumps);
    // Each has a dome and a saddle around it.
    EXPECT_GT(r.tac, 1 + 0.35 * bumps) << bumps;
    EXPECT_LT(r.tac, 1 + bumps) << bumps;
  }
  EXPECT_GT(roughness(bumpy_sphere(20)).rho, 5 * roughness(bumpy_sphere(0)).rho);
}

TEST(Roughness, FindsGrooves) {
  // A bump has one around its foot, a dent is one.
  EXPECT_EQ(roughness(bumpy_sphere(0)).groove, 0);
  EXPECT_GT(roughness(bumpy_sphere(12)).groove, 3);
  const Roughness dents = roughness(bumpy_sphere(12, -0.15));
  EXPECT_GT(dents.groove, 3);
  EXPECT_EQ(dents.bumps, 0);
}

TEST(Roughness, DoesNotDependOnSizeOrPlaceAndHardlyOnTheTurn) {
  const Mesh mesh = lumps_at(0.5);
  const Roughness r = roughness(mesh);
  const Roughness large = roughness(moved(mesh, 64, {}));
  EXPECT_NEAR(large.tac, r.tac, 1e-3 * r.tac);
  EXPECT_EQ(large.bumps, r.bumps);
  EXPECT_NEAR(large.groove, r.groove, 0.02);
  EXPECT_NEAR(large.rho, r.rho, 1e-3 * r.rho);
  const Mesh turned = moved(mesh, 1, {3, -2, 5}, exp_rotation(Vec3d{0.5, -0.8, 0.7}));
  const Roughness other = measure_roughness(turned, own_scale(mesh));
  EXPECT_NEAR(other.tac, r.tac, 0.02 * r.tac);
  EXPECT_NEAR(other.bumps, r.bumps, 1);
  EXPECT_NEAR(other.rho, r.rho, 0.02 * r.rho);
}

TEST(Roughness, IsTheSameForAnyNumberOfThreads) {
  const Mesh mesh = lumps_at(0.5);
  set_thread_count(1);
  const Roughness one = roughness(mesh);
  set_thread_count(5);
  const Roughness five = roughness(mesh);
  set_thread_count(0);
  EXPECT_EQ(one.tac, five.tac);
  EXPECT_EQ(one.bumps, five.bumps);
  EXPECT_EQ(one.groove, five.groove);
  EXPECT_EQ(one.rho, five.rho);
}

TEST(Roughness, OfNothingAndNextToNothingIsZero) {
  EXPECT_EQ(roughness({}).tac, 0);
  const Mesh sphere = shape("sphere");
  const Roughness crumb = measure_roughness(moved(sphere, 0.001f, {}), own_scale(sphere));
  EXPECT_EQ(crumb.tac, 0);
  EXPECT_EQ(crumb.rho, 0);
  // Far larger than both ends: its cells are, too.
  EXPECT_GT(measure_roughness(moved(sphere, 20, {}), own_scale(sphere)).tac, 0);
}

TEST(Roughness, AgreesWithThePrototype) {
  // What the same definitions gave for these meshes in NumPy, SciPy and scikit-image, whose
  // marching cubes resolve ambiguous cells in another way.
  const Roughness known[] = {{6.9943, 1, 8.9943, 0.30088},
                             {3.6223, 0, 5.4510, 0.21115},
                             {4.2473, 1, 7.1005, 0.23733},
                             {4.7055, 1, 8.8481, 0.28042},
                             {9.8880, 7, 10.8994, 0.30308}};
  std::vector<Mesh> frames;
  for (int k = 0; k < 5; ++k) frames.push_back(lumps_at(k / 4.0));
  const RoughnessScale scale = roughness_scale(
      unite(bounding_box(frames.front().positions), bounding_box(frames.back().positions)));
  for (std::size_t k = 0; k < frames.size(); ++k) {
    const Roughness r = measure_roughness(frames[k], scale);
    EXPECT_NEAR(r.tac, known[k].tac, 0.01 * known[k].tac) << k;
    EXPECT_NEAR(r.bumps, known[k].bumps, 1) << k;
    EXPECT_NEAR(r.groove, known[k].groove, 0.01 * known[k].groove) << k;
    EXPECT_NEAR(r.rho, known[k].rho, 0.01 * known[k].rho) << k;
  }
}

}  // namespace
}  // namespace polymorph
