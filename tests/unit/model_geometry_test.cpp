#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <span>

#include "base/parallel.h"
#include "base/random.h"
#include "mesh/closest.h"
#include "mesh/inside.h"
#include "mesh/normals.h"
#include "mesh/solid_angle.h"
#include "mesh/triangle_bvh.h"
#include "mesh/vertex_clustering.h"
#include "model/repair/diagnose.h"
#include "model/shapes.h"
#include "model/transform.h"
#include "scene/scene.h"
#include "testing/model.h"

namespace polymorph {
namespace {

Model shape(const std::string& name) {
  auto model = make_shape(name);
  EXPECT_TRUE(model);
  return std::move(model).value();
}

TEST(Shapes, AreClosedOutwardStandingAndOfTheRightGenus) {
  const struct {
    const char* name;
    int genus;
    double volume, area;
    Vec3 size;
  } cases[] = {
      {"sphere", 0, 4 * M_PI / 3, 4 * M_PI, {2, 2, 2}},
      {"cube", 0, 8, 24, {2, 2, 2}},
      {"torus", 1, 2 * M_PI * M_PI * 0.16, 4 * M_PI * M_PI * 0.4, {2.8f, 0.8f, 2.8f}},
      // Pappus: a disc, and a half circle turned around it.
      {"puddle",
       0,
       M_PI * 1.24 * 1.24 * 0.12 +
           2 * M_PI * (1.24 + 4 * 0.06 / (3 * M_PI)) * M_PI * 0.06 * 0.06 / 2,
       2 * M_PI * 1.24 * 1.24 + 2 * M_PI * (1.24 + 2 * 0.06 / M_PI) * M_PI * 0.06,
       {2.6f, 0.12f, 2.6f}},
  };
  for (const auto& c : cases) {
    SCOPED_TRACE(c.name);
    const Model model = shape(c.name);
    const Diagnosis d = diagnose(model);
    EXPECT_TRUE(d.closed);
    EXPECT_EQ(d.shells, 1u);
    EXPECT_EQ(d.genus, c.genus);
    EXPECT_EQ(d.euler, 2 - 2 * c.genus);
    EXPECT_EQ(d.degenerate_triangles, 0u);
    EXPECT_TRUE(describe_problems(d).empty());
    EXPECT_GE(d.triangles, 2000u);
    EXPECT_NEAR(d.volume, c.volume, 0.01 * c.volume);
    EXPECT_NEAR(d.area, c.area, 0.01 * c.area);
    const Box box = model.box();
    EXPECT_NEAR(box.low.y, 0, 1e-6);
    EXPECT_NEAR(length(box.size() - c.size), 0, 0.01);
    EXPECT_EQ(model.label_names, std::vector<std::string>{c.name});
    EXPECT_EQ(model.labels.size(), model.triangles.size());
    EXPECT_EQ(model.triangle_materials.size(), model.triangles.size());
    EXPECT_EQ(model.corner_uvs.size(), 3 * model.triangles.size());
  }
}

TEST(Shapes, NormalsAgreeWithTheFacesAndUvsDoNotTear) {
  for (const std::string& name : kShapeNames) {
    SCOPED_TRACE(name);
    const Model model = shape(name);
    const std::vector<Vec3> faces = face_normals(model);
    ASSERT_EQ(model.corner_normals.size(), 3 * model.triangles.size());
    for (std::size_t c = 0; c < model.corner_normals.size(); ++c) {
      EXPECT_NEAR(length(model.corner_normals[c]), 1, 1e-5);
      EXPECT_GT(dot(model.corner_normals[c], faces[c / 3]), 0.9f);
      const Vec2 a = model.corner_uvs[c], b = model.corner_uvs[3 * (c / 3) + (c + 1) % 3];
      EXPECT_LT(std::abs(a.x - b.x), 0.26f);
      EXPECT_LT(std::abs(a.y - b.y), 0.26f);
    }
  }
}

TEST(Shapes, AnUnknownNameNamesTheNearest) {
  const auto model = make_shape("shpere");
  ASSERT_FALSE(model);
  EXPECT_EQ(model.error().code, ErrorCode::kInput);
  EXPECT_NE(model.error().message.find("did you mean \"sphere\""), std::string::npos)
      << model.error().message;
}

TEST(Normals, PointNormalsOfABoxPointAlongItsDiagonals) {
  // Weighted by angle, so that the diagonals of the sides do not matter.
  const Model box = box_model({0, 0, 0}, {1, 1, 1});
  const std::vector<Vec3> normals = point_normals(box);
  for (std::size_t i = 0; i < 8; ++i) {
    const Vec3 out = normalized(box.points[i] - Vec3{0.5f, 0.5f, 0.5f});
    EXPECT_NEAR(dot(normals[i], out), 1, 1e-6);
  }
}

TEST(Normals, VolumeAndAreaFarFromTheOriginKeepTheirPrecision) {
  const Model box = box_model({4096, -8192, 1024}, {4097, -8190, 1027});
  EXPECT_NEAR(volume_of(box), 6, 1e-9);
  EXPECT_NEAR(area_of(box), 22, 1e-9);
}

TEST(Transforms, RotateAboutXThenYThenZ) {
  const Transform t = make_transform({1, 2, 3}, {90, 0, 90}, {2, 1, 1});
  // (1,0,0) * 2 -> x-turn: (2,0,0) -> z-turn: (0,2,0)
  EXPECT_EQ(apply(t, {1, 0, 0}), (Vec3{1, 4, 3}));
  // (0,1,0) -> x-turn: (0,0,1) -> z-turn: same
  EXPECT_EQ(apply(t, {0, 1, 0}), (Vec3{1, 2, 4}));
  const Transform both =
      compose(make_transform({1, 0, 0}, {}, {1, 1, 1}), make_transform({}, {0, 90, 0}, {1, 1, 1}));
  EXPECT_EQ(apply(both, {0, 0, 1}), (Vec3{2, 0, 0}));
}

TEST(Transforms, MirroringKeepsOutsideOutsideAndNormalsRight) {
  const Model torus = shape("torus");
  const Model moved = transformed(torus, make_transform({3, -1, 2}, {20, 40, 70}, {-1, 2, 0.5f}));
  EXPECT_NEAR(volume_of(moved), volume_of(torus), 1e-3);
  EXPECT_TRUE(describe_problems(diagnose(moved)).empty());
  const std::vector<Vec3> faces = face_normals(moved);
  for (std::size_t c = 0; c < moved.corner_normals.size(); ++c)
    EXPECT_GT(dot(moved.corner_normals[c], faces[c / 3]), 0.9f);
}

TEST(Creases, DependOnTheAngle) {
  const Model box = box_model({0, 0, 0}, {1, 1, 1});
  const std::vector<Vec3> sharp = creased_normals(box), smooth = creased_normals(box, 100);
  const std::vector<Vec3> faces = face_normals(box), points = point_normals(box);
  for (std::size_t c = 0; c < sharp.size(); ++c) {
    EXPECT_EQ(sharp[c], faces[c / 3]);
    EXPECT_NEAR(dot(smooth[c], points[box.triangles[c / 3].v[c % 3]]), 1, 1e-6);
  }
}

TEST(Diagnose, CountsOpenAndFlippedAndManyFacedEdges) {
  Model box = box_model({0, 0, 0}, {1, 1, 1});
  box.triangles.pop_back();
  Diagnosis d = diagnose(box);
  EXPECT_FALSE(d.closed);
  EXPECT_EQ(d.boundary_edges, 3u);
  EXPECT_EQ(d.open_shells, 1u);
  EXPECT_EQ(d.genus, -1);
  EXPECT_TRUE(any_contains(describe_problems(d), "it is open: 3 edges"));

  box = box_model({0, 0, 0}, {1, 1, 1});
  std::swap(box.triangles[0].v[1], box.triangles[0].v[2]);
  d = diagnose(box);
  EXPECT_EQ(d.flipped_edges, 3u);
  EXPECT_FALSE(d.closed);
  EXPECT_TRUE(any_contains(describe_problems(d), "disagree about outside at 3 edges"));

  box = box_model({0, 0, 0}, {1, 1, 1});
  box.triangles.push_back(box.triangles[0]);
  d = diagnose(box);
  EXPECT_EQ(d.non_manifold_edges, 3u);
  EXPECT_TRUE(any_contains(describe_problems(d), "3 edges have three or more faces"));
}

TEST(Diagnose, InsideOutInvertedPartsAndCavities) {
  Model model;
  add_box(model, {0, 0, 0}, {1, 1, 1}, true);
  EXPECT_TRUE(any_contains(describe_problems(diagnose(model)), "inside out"));

  model = box_model({0, 0, 0}, {4, 4, 4});
  add_box(model, {1, 1, 1}, {2, 2, 2}, true);
  Diagnosis d = diagnose(model);
  EXPECT_EQ(d.shells, 2u);
  EXPECT_EQ(d.inverted_shells, 0u) << "a cavity is right";
  EXPECT_NEAR(d.volume, 63, 1e-6);
  EXPECT_TRUE(describe_problems(d).empty());

  add_box(model, {6, 0, 0}, {7, 1, 1}, true);
  d = diagnose(model);
  EXPECT_EQ(d.inverted_shells, 1u);
  EXPECT_TRUE(any_contains(describe_problems(d), "1 of 3 shells is inside out"));
}

TEST(Diagnose, ShellsThatTouchInAPointStayClosedWithTheirOwnGenus) {
  Model model = box_model({0, 0, 0}, {1, 1, 1});
  add_box(model, {1, 1, 1}, {2, 2, 2});
  for (Triangle& t : model.triangles)  // weld the common corner: 7 of the first, 8 of the second
    for (std::uint32_t& v : t.v)
      if (v == 8) v = 7;
  const Diagnosis d = diagnose(model);
  EXPECT_TRUE(d.closed);
  EXPECT_EQ(d.shells, 2u);
  EXPECT_EQ(d.touching_points, 1u);
  EXPECT_EQ(d.genus, 0);
  EXPECT_EQ(d.euler, 3);
}

std::vector<Vec3> random_points(const Box& box, std::size_t n) {
  std::mt19937 random(7);
  std::vector<Vec3> points(n);
  for (Vec3& p : points) {
    const auto draw = [&] { return static_cast<float>(random()) * 0x1p-32f * 1.4f - 0.2f; };
    const float x = draw(), y = draw(), z = draw();
    p = box.low + box.size() * Vec3{x, y, z};
  }
  return points;
}

class BothRules : public testing::TestWithParam<InsideRule> {};
INSTANTIATE_TEST_SUITE_P(Inside, BothRules,
                         testing::Values(InsideRule::kWinding, InsideRule::kParity));

TEST_P(BothRules, AgreeWithAnalyticSolids) {
  const auto expect = [&](const std::string& name, const auto& signed_distance) {
    const Model model = shape(name);
    const InsideTest test(model, GetParam());
    const std::vector<Vec3> points = random_points(model.box(), 20000);
    const std::vector<std::uint8_t> inside = test.inside(points);
    int checked = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const float d = signed_distance(points[i]);
      if (std::abs(d) < 0.004f) continue;  // facets
      ++checked;
      EXPECT_EQ(inside[i] != 0, d < 0)
          << name << " " << points[i].x << " " << points[i].y << " " << points[i].z;
      EXPECT_EQ(inside[i] != 0, test.inside(points[i]));
    }
    EXPECT_GT(checked, 19000);
  };
  expect("sphere", [](Vec3 p) { return length(p - Vec3{0, 1, 0}) - 1; });
  expect("cube", [](Vec3 p) {
    return std::max({std::abs(p.x), std::abs(p.y - 1), std::abs(p.z)}) - 1;
  });
  expect("torus", [](Vec3 p) { return std::hypot(std::hypot(p.x, p.z) - 1, p.y - 0.4f) - 0.4f; });
}

TEST_P(BothRules, RaysThroughEdgesAndCornersOfALatticeAreCountedRight) {
  // All sample points lie in planes of the faces' own edges, where careless tests count twice or
  // not at all.
  Model model = box_model({-1, -1, -1}, {1, 1, 1});
  add_box(model, {2, -1, -1}, {3, 1, 1});
  const InsideTest test(model, GetParam());
  for (int x = -8; x <= 16; ++x)
    for (int y = -6; y <= 6; ++y)
      for (int z = -6; z <= 6; ++z) {
        const Vec3 p{static_cast<float>(x) / 4, static_cast<float>(y) / 4,
                     static_cast<float>(z) / 4};
        const float box1 = std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}) - 1;
        const float box2 =
            std::max({std::abs(p.x - 2.5f) - 0.5f, std::abs(p.y) - 1, std::abs(p.z) - 1});
        const float d = std::min(box1, box2);
        if (d == 0) continue;
        EXPECT_EQ(test.inside(p), d < 0) << p.x << " " << p.y << " " << p.z;
      }
}

TEST_P(BothRules, DoNotDependOnSizePlaceOrThreads) {
  const Model torus = shape("torus");
  const std::vector<Vec3> points = random_points(torus.box(), 5000);
  const std::vector<std::uint8_t> expected = InsideTest(torus, GetParam()).inside(points);
  const Transform far = make_transform({8192, 4096, -2048}, {}, {512, 512, 512});
  std::vector<Vec3> moved;
  for (const Vec3 p : points) moved.push_back(apply(far, p));
  const std::vector<std::uint8_t> got =
      InsideTest(transformed(torus, far), GetParam()).inside(moved);
  std::size_t different = 0;
  for (std::size_t i = 0; i < got.size(); ++i) different += got[i] != expected[i];
  EXPECT_LE(different, 5u);  // within float's rounding of the surface
  set_thread_count(1);
  EXPECT_EQ(InsideTest(torus, GetParam()).inside(points), expected);
  set_thread_count(2);
  EXPECT_EQ(InsideTest(torus, GetParam()).inside(points), expected);
  set_thread_count(0);
}

TEST(Winding, IsOneInsideAndZeroOutside) {
  const Model sphere = shape("sphere");
  const InsideTest test(sphere);
  for (const Vec3 p : random_points(sphere.box(), 5000)) {
    const float d = length(p - Vec3{0, 1, 0}) - 1;
    if (std::abs(d) < 0.004f) continue;
    EXPECT_NEAR(test.winding_number(p), d < 0 ? 1 : 0, 0.08);
  }
}

TEST(Winding, SurvivesHolesDoubledFacesAndOverlaps) {
  Model holed = shape("sphere");
  for (std::size_t i = 0; i < 60; ++i) holed.triangles.pop_back();
  Model doubled = shape("sphere");
  for (std::size_t i = 0; i < 500; ++i) doubled.triangles.push_back(doubled.triangles[i * 3]);
  const Model* models[] = {&holed, &doubled};
  for (const Model* model : models) {
    const InsideTest test(*model);
    EXPECT_FALSE(diagnose(*model).closed);
    for (const Vec3 p : random_points(model->box(), 5000)) {
      const float d = length(p - Vec3{0, 1, 0}) - 1;
      if (std::abs(d) < 0.25f) continue;
      EXPECT_EQ(test.inside(p), d < 0);
    }
  }
  Model crossing = box_model({-1, -1, -1}, {1, 1, 1});
  add_box(crossing, {0, 0, 0}, {2, 2, 2});
  EXPECT_TRUE(InsideTest(crossing).inside({0.5f, 0.5f, 0.5f})) << "inside both";
  EXPECT_FALSE(InsideTest(crossing, InsideRule::kParity).inside({0.5f, 0.5f, 0.5f}))
      << "the report's rule";
}

TEST_P(BothRules, TouchingShellsAndCavitiesAreWhatTheyEnclose) {
  // Two boxes share a whole side, both in place twice; a third touches them in an edge; one holds
  // a cavity.
  Model model = box_model({0, 0, 0}, {4, 4, 4});
  add_box(model, {4, 0, 0}, {8, 4, 4});
  add_box(model, {8, 4, 0}, {9, 5, 4});
  add_box(model, {1, 1, 1}, {3, 3, 3}, true);
  const InsideTest test(model, GetParam());
  for (const Vec3 p : random_points(model.box(), 4000)) {
    const auto in = [&](Vec3 low, Vec3 high) {
      return p.x > low.x && p.x < high.x && p.y > low.y && p.y < high.y && p.z > low.z &&
             p.z < high.z;
    };
    const bool expected =
        (in({0, 0, 0}, {8, 4, 4}) && !in({1, 1, 1}, {3, 3, 3})) || in({8, 4, 0}, {9, 5, 4});
    EXPECT_EQ(test.inside(p), expected) << p.x << " " << p.y << " " << p.z;
  }
}

TEST_P(BothRules, AnInvertedPartIsInsideForTheRayButNotForTheWinding) {
  Model model = box_model({0, 0, 0}, {1, 1, 1});
  add_box(model, {2, 0, 0}, {3, 1, 1}, true);
  const InsideTest test(model, GetParam());
  EXPECT_TRUE(test.inside({0.5f, 0.5f, 0.5f}));
  EXPECT_EQ(test.inside({2.5f, 0.5f, 0.5f}), GetParam() == InsideRule::kParity);
  EXPECT_FALSE(test.inside({1.5f, 0.5f, 0.5f}));
}

TEST(Winding, CountsTheTurnsOfManyCoatsAroundOnePoint) {
  // The sum is three turns, which products of complex numbers only give if turns are counted; each
  // coat may be off by the 0.08 of one.
  Model coats = shape("sphere");
  const std::vector<Triangle> once = coats.triangles;
  for (int coat = 0; coat < 2; ++coat)
    coats.triangles.insert(coats.triangles.end(), once.begin(), once.end());
  EXPECT_NEAR(InsideTest(coats).winding_number({0, 1, 0}), 3, 0.24);
  EXPECT_NEAR(InsideTest(coats).winding_number({0, 1.9f, 0.1f}), 3, 0.24);
  Model inward = coats;
  for (Triangle& t : inward.triangles) std::swap(t.v[1], t.v[2]);
  EXPECT_NEAR(InsideTest(inward).winding_number({0, 1.9f, 0.1f}), -3, 0.24);
  // A corner of the model itself is an answer, not a NaN.
  EXPECT_TRUE(std::isfinite(InsideTest(coats).winding_number(coats.points[17])));
}

TEST(Winding, OfLongThinTrianglesAgreesWithTheSumOverAll) {
  // An open tube of slivers, 2 x 0.003: no group of them is ever far away.
  Model tube;
  constexpr int kSlats = 1000;
  for (int i = 0; i < kSlats; ++i) {
    const double u = 2 * M_PI * i / kSlats;
    for (const float y : {-1.0f, 1.0f})
      tube.points.push_back(
          {static_cast<float>(std::cos(u)) / 2, y, static_cast<float>(-std::sin(u)) / 2});
  }
  for (std::uint32_t i = 0; i < kSlats; ++i) {
    const std::uint32_t a = 2 * i, b = 2 * ((i + 1) % kSlats);
    tube.triangles.push_back({{a, b, b + 1}});
    tube.triangles.push_back({{a, b + 1, a + 1}});
  }
  const InsideTest test(tube);
  for (const Vec3 p : random_points(tube.box(), 1000)) {
    if (std::abs(std::hypot(p.x, p.z) - 0.5f) < 0.01f) continue;
    double sum = 0;
    for (const Triangle& t : tube.triangles) {
      const HalfAngle half = half_solid_angle(Vec3d(tube.points[t.v[0]]) - Vec3d(p),
                                              Vec3d(tube.points[t.v[1]]) - Vec3d(p),
                                              Vec3d(tube.points[t.v[2]]) - Vec3d(p));
      sum += std::atan2(half.num, half.den) / (2 * M_PI);
    }
    EXPECT_NEAR(test.winding_number(p), sum, 0.02);
  }
}

TEST(Winding, AnEmptyModelHasNoInside) {
  EXPECT_FALSE(InsideTest(Model{}).inside(Vec3{}));
  EXPECT_FALSE(InsideTest(Model{}, InsideRule::kParity).inside(Vec3{}));
}

/// So many long triangles that their corners are gathered in cells before anything is asked.
TEST(Inside, AFanOfManyTrianglesIsAskedInAFewOfThem) {
  constexpr std::uint32_t kEdges = 30000;
  Model fan;
  fan.points = {{0, 0, 1}, {0, 0, -1}};
  for (std::uint32_t i = 0; i < kEdges; ++i) {
    const double angle = 2 * M_PI * i / kEdges;
    fan.points.push_back(
        {static_cast<float>(std::cos(angle)), static_cast<float>(std::sin(angle)), 0});
  }
  for (std::uint32_t i = 0; i < kEdges; ++i) {
    const std::uint32_t a = 2 + i, b = 2 + (i + 1) % kEdges;
    fan.triangles.push_back({{0, a, b}});
    fan.triangles.push_back({{1, b, a}});
  }
  const InsideTest inside(fan);
  for (float x = -1.15f; x < 1.2f; x += 0.1f)
    for (float z = -1.15f; z < 1.2f; z += 0.1f) {
      const float outside = std::hypot(x, 0.05f) + std::abs(z) - 1;
      if (std::abs(outside) < 0.005f) continue;
      EXPECT_NEAR(inside.winding_number({x, 0.05f, z}), outside > 0 ? 0 : 1, 0.02) << x << " " << z;
    }
}

/// Tetrahedra within each other, each a thousandth smaller: one question concerns all of them.
Model nested_tetrahedra(std::uint32_t shells) {
  Model model;
  for (std::uint32_t i = 0; i < shells; ++i) {
    const float s = 1 - 0.9f * static_cast<float>(i) / static_cast<float>(shells);
    for (const Vec3 p : {Vec3{s, s, s}, Vec3{s, -s, -s}, Vec3{-s, s, -s}, Vec3{-s, -s, s}})
      model.points.push_back(p);
    const std::uint32_t b = 4 * i;
    for (const Triangle& t : {Triangle{{b, b + 1, b + 2}}, Triangle{{b, b + 3, b + 1}},
                              Triangle{{b, b + 2, b + 3}}, Triangle{{b + 1, b + 3, b + 2}}})
      model.triangles.push_back(t);
  }
  return model;
}

TEST(Inside, ShellsThatBecomeOneCountAsOftenAsTheyAre) {
  constexpr std::uint32_t kShells = 5000;
  const Model nest = nested_tetrahedra(kShells);
  const auto few = cluster_long_triangles(MeshView(nest));
  ASSERT_TRUE(few);
  EXPECT_LT(few->mesh.triangles.size(), 5000u);
  EXPECT_GT(*std::max_element(few->multiplicity.begin(), few->multiplicity.end()), 1);
  const double turn = InsideTest(nested_tetrahedra(1)).winding_number({});  // 1 or -1
  const InsideTest inside(nest);
  EXPECT_NEAR(inside.winding_number({}), turn * kShells, 1);
  // Half of them go around this point: the plane (-1, -1, -1) . x = s has it at s = 0.55.
  EXPECT_NEAR(inside.winding_number(Vec3{-1, -1, -1} * (0.55f / 3)), turn * kShells / 2,
              0.02 * kShells);
  for (const Vec3 p :
       {Vec3{2, 0, 0}, Vec3{-1, -1, -1}, Vec3{0.9f, 0.9f, 0}, Vec3{-0.5f, -0.5f, -0.5f}})
    EXPECT_NEAR(inside.winding_number(p), 0, 2e-4 * kShells) << p.x;
}

TEST(Winding, NumbersOfPointsTogetherAreThoseOfEachAlone) {
  // Points beside each other, which share a walk, and points far from each other.
  std::vector<Vec3> points;
  for (int i = 0; i < 61; ++i) {
    const float x = 0.02f * static_cast<float>(i) - 0.6f;
    points.push_back({x, 0.3f + 0.1f * x, 0.2f});
    if (i % 3 == 0) points.push_back({-x, 1.3f - x, -0.7f});
  }
  // Triangles of the second model have multiplicities.
  for (const Model& model : {shape("torus"), nested_tetrahedra(5000)}) {
    const InsideTest test(model);
    for (const std::size_t first : {std::size_t{0}, std::size_t{1}, std::size_t{2}}) {
      const std::span<const Vec3> some = std::span(points).subspan(first);
      std::vector<double> numbers(some.size());
      test.winding_numbers(some, numbers);
      const std::vector<std::uint8_t> inside = test.inside(some);
      for (std::size_t i = 0; i < some.size(); ++i) {
        EXPECT_EQ(numbers[i], test.winding_number(some[i])) << i;
        EXPECT_EQ(inside[i] != 0, test.inside(some[i])) << i;
      }
      EXPECT_GT(std::count(inside.begin(), inside.end(), 1), 0);
      EXPECT_GT(std::count(inside.begin(), inside.end(), 0), 0);
    }
  }
}

/// Long triangles at random.
Model strewn_triangles(std::uint32_t count) {
  Model strewn;
  for (std::uint32_t i = 0; i < count; ++i) {
    for (std::uint64_t k = 0; k < 3; ++k)
      strewn.points.push_back({random_float(1, 3 * k, i), random_float(1, 3 * k + 1, i),
                               random_float(1, 3 * k + 2, i)});
    strewn.triangles.push_back({{3 * i, 3 * i + 1, 3 * i + 2}});
  }
  return strewn;
}

TEST(VertexClustering, StrewnTrianglesAreFewOfThemSeveralTimes) {
  const Model strewn = strewn_triangles(20000);
  const auto few = cluster_long_triangles(MeshView(strewn));
  ASSERT_TRUE(few);
  EXPECT_TRUE(few->thinned);
  EXPECT_LT(few->mesh.triangles.size(), 3000u);
  const int all = std::accumulate(few->multiplicity.begin(), few->multiplicity.end(), 0);
  EXPECT_NEAR(all, 20000, 400);
  EXPECT_TRUE(has_many_long_triangles(diagnose(strewn).long_triangles));
  EXPECT_FALSE(cluster_long_triangles(MeshView(box_model({0, 0, 0}, {1, 1, 1}))));
}

TEST(SplitBvh, FewLongTrianglesAreCutWhereTheirBoxesOverlap) {
  const Model strewn = strewn_triangles(2000), few = strewn_triangles(1000);
  EXPECT_TRUE(build_split_bvh(strewn.points, strewn.triangles).is_split);
  EXPECT_FALSE(build_split_bvh(few.points, few.triangles).is_split);
  for (const char* shape : {"puddle", "torus", "cube"}) {  // side by side
    const Model model = *make_shape(shape);
    EXPECT_FALSE(build_split_bvh(model.points, model.triangles).is_split) << shape;
  }
}

/// Slivers around an apex at (0, 0, 1): an open cone of height and radius 1.
Model cone_of(std::uint32_t slivers) {
  Model cone;
  cone.points = {{0, 0, 1}};
  for (std::uint32_t i = 0; i < slivers; ++i) {
    const double angle = 2 * M_PI * i / slivers;
    cone.points.push_back(
        {static_cast<float>(std::cos(angle)), static_cast<float>(std::sin(angle)), 0});
    cone.triangles.push_back({{0, 1 + i, 1 + (i + 1) % slivers}});
  }
  return cone;
}

/// The distance of a point in its half plane to the segment that turns into the cone.
float distance_to_cone(Vec3 p) {
  const float r = std::hypot(p.x, p.y), t = std::clamp((r + 1 - p.z) / 2, 0.0f, 1.0f);
  return std::hypot(r - t, p.z - (1 - t));
}

TEST(SplitBvh, PiecesAnswerForTheirTriangles) {
  const Model fan = cone_of(6000);
  EXPECT_FALSE(build_triangle_bvh(fan.points, fan.triangles).is_split);
  EXPECT_TRUE(build_split_bvh(fan.points, fan.triangles).is_split);
  const ClosestPointQuery query(fan);
  for (std::uint64_t i = 0; i < 200; ++i) {
    const Vec3 p{3 * random_float(2, 0, i) - 1.5f, 3 * random_float(2, 1, i) - 1.5f,
                 3 * random_float(2, 2, i) - 1.5f};
    const float expected = distance_to_cone(p);
    EXPECT_NEAR(query.closest(p).distance, expected, 1e-4f * expected + 1e-5f);
  }
}

TEST(VertexClustering, OfSliversThatShareAPointFewAnswerForTheClosest) {
  const Model cone = cone_of(60000);
  const std::vector<std::uint32_t> few = list_representative_triangles(MeshView(cone));
  ASSERT_FALSE(few.empty());
  EXPECT_LT(few.size(), 8000u);
  EXPECT_TRUE(std::is_sorted(few.begin(), few.end()));
  const ClosestPointQuery query(cone);
  const float cell = cone.box().diagonal() / 2048;
  for (std::uint64_t i = 0; i < 200; ++i) {
    const Vec3 p{3 * random_float(2, 0, i) - 1.5f, 3 * random_float(2, 1, i) - 1.5f,
                 3 * random_float(2, 2, i) - 1.5f};
    const float expected = distance_to_cone(p);
    EXPECT_NEAR(query.closest(p).distance, expected, 1.8f * cell + 1e-4f * expected);
  }
}

TEST(VertexClustering, HairsThinnerThanACellStayInQueries) {
  Model hair = box_model({-20, 0, 0}, {-10, 10, 10});
  constexpr std::uint32_t kHairs = 100, kBlades = 300;
  for (std::uint32_t h = 0; h < kHairs; ++h)
    for (std::uint32_t b = 0; b < kBlades; ++b) {
      const auto x = static_cast<float>(h), off = 1e-6f * static_cast<float>(b);
      const auto first = static_cast<std::uint32_t>(hair.points.size());
      hair.points.insert(hair.points.end(),
                         {{x + off, 0, 0}, {x + off, 1e-5f, 0}, {x + off, 50, 0}});
      hair.triangles.push_back({{first, first + 1, first + 2}});
    }
  const std::size_t few = list_representative_triangles(MeshView(hair)).size();
  EXPECT_GE(few, kHairs);
  EXPECT_LT(few, 3 * kHairs);
  const ClosestPointQuery query(hair);
  for (std::uint32_t h = 0; h < kHairs; ++h)
    EXPECT_NEAR(query.closest({static_cast<float>(h), 20, 1}).distance, 1, 1e-3f) << h;
}

TEST(Diagnose, PartsWithoutThicknessAreSaid) {
  Model winged = box_model({-1, -1, -1}, {1, 1, 1});
  EXPECT_EQ(diagnose_fully(winged).sheet_fraction, 0);
  const auto says_so = [](const Model& model) {
    for (const std::string& line : describe_problems(diagnose_fully(model)))
      if (line.find("of its area has no thickness") != std::string::npos) return true;
    return false;
  };
  EXPECT_FALSE(says_so(winged));
  // Two wings of both faces, 2 x 1 each: 8 of 32 in area.
  for (const float side : {1.0f, -1.0f}) {
    const auto first = static_cast<std::uint32_t>(winged.points.size());
    for (const Vec3 p :
         {Vec3{side, 0, -1}, Vec3{side, 0, 1}, Vec3{2 * side, 0, 1}, Vec3{2 * side, 0, -1}})
      winged.points.push_back(p);
    for (const Triangle& t :
         {Triangle{{0, 1, 2}}, Triangle{{0, 2, 3}}, Triangle{{0, 2, 1}}, Triangle{{0, 3, 2}}})
      winged.triangles.push_back({{first + t.v[0], first + t.v[1], first + t.v[2]}});
  }
  EXPECT_NEAR(*diagnose_fully(winged).sheet_fraction, 0.25, 0.01);
  EXPECT_TRUE(says_so(winged));
}

}  // namespace
}  // namespace polymorph
