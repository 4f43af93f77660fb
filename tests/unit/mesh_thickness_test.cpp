#include "mesh/thickness.h"

#include <gtest/gtest.h>

#include <cmath>

#include "kernels/linear.h"
#include "mesh/self_intersections.h"
#include "model/repair/diagnose.h"
#include "model/shapes.h"
#include "testing/model.h"

namespace polymorph {
namespace {

Thickness thickness_of(const Model& model) {
  return measure_thickness(model, build_triangle_bvh(model.points, model.triangles));
}
SelfIntersections crossings_of(const Model& model, std::size_t max_pairs = 10000) {
  return count_self_intersections(model, build_triangle_bvh(model.points, model.triangles),
                                  max_pairs);
}

TEST(Thickness, OfSolidsIsTheirSize) {
  const Thickness cube = thickness_of(make_shape("cube").value());
  EXPECT_NEAR(cube.median, 2, 1e-5);
  EXPECT_NEAR(cube.low, 2, 1e-5);
  EXPECT_NEAR(cube.balls, 24.0 / 4, 0.01);
  EXPECT_EQ(cube.open, 0);
  const Thickness sphere = thickness_of(make_shape("sphere").value());
  EXPECT_NEAR(sphere.median, 2, 0.02);
  EXPECT_FALSE(is_thin(cube) || is_thin(sphere));
  EXPECT_FALSE(is_thin(thickness_of(make_shape("puddle").value())));
}

TEST(WallThicknesses, AreTheWaysStraightThroughABox) {
  const Model box = box_model({0, 0, 0}, {1, 2, 4});
  const std::vector<SurfaceSample> samples = sample_surface(box, 500);
  const std::vector<double> lengths =
      measure_wall_thicknesses(box, build_triangle_bvh(box.points, box.triangles), samples);
  ASSERT_EQ(lengths.size(), samples.size());
  for (std::size_t k = 0; k < samples.size(); ++k) {
    const Vec3 n = samples[k].normal;
    const float way = std::fabs(n.x) * 1 + std::fabs(n.y) * 2 + std::fabs(n.z) * 4;
    EXPECT_NEAR(lengths[k], static_cast<double>(way), 1e-5);
  }
  // Inside out, every ray leaves at once.
  Model inverted;
  add_box(inverted, {0, 0, 0}, {1, 2, 4}, true);
  for (const double length :
       measure_wall_thicknesses(inverted, build_triangle_bvh(inverted.points, inverted.triangles),
                                sample_surface(inverted, 50)))
    EXPECT_TRUE(std::isinf(length));
}

TEST(Thickness, OfAHollowBoxIsItsWalls) {
  Model model = box_model({0, 0, 0}, {4, 4, 4});
  add_box(model, {0.05f, 0.05f, 0.05f}, {3.95f, 3.95f, 3.95f}, true);
  const Thickness t = thickness_of(model);
  EXPECT_NEAR(t.median, 0.05, 1e-5);
  EXPECT_EQ(t.open, 0);
  EXPECT_NEAR(t.balls, 6 * (16 + 3.9 * 3.9) / (0.05 * 0.05), 1000);
  EXPECT_TRUE(is_thin(t));
  const std::vector<std::string> lines = describe_problems(diagnose_fully(model));
  EXPECT_TRUE(any_contains(lines, "it is thin: half of its walls are thinner than 0.05"));
  EXPECT_TRUE(any_contains(lines, "thicken it in the modeller"));
}

/// A closed prism of `sides` sides about the axis y, from 0 to `length`.
Model wire_model(int sides, float radius, float length) {
  Model wire;
  const auto n = static_cast<std::uint32_t>(sides);
  for (std::uint32_t k = 0; k < n; ++k) {
    const float angle = 6.2831853f * static_cast<float>(k) / static_cast<float>(n);
    for (const float y : {0.0f, length})
      wire.points.push_back({radius * std::cos(angle), y, radius * std::sin(angle)});
  }
  for (std::uint32_t k = 0; k < n; ++k) {
    const std::uint32_t a = 2 * k, b = 2 * ((k + 1) % n);
    wire.triangles.push_back({{a, a + 1, b}});
    wire.triangles.push_back({{b, a + 1, b + 1}});
    if (k == 0 || k + 1 == n) continue;
    wire.triangles.push_back({{0, a, b}});
    wire.triangles.push_back({{1, b + 1, a + 1}});
  }
  return wire;
}

TEST(ThinWalls, MiddlesAreHalfWayBetweenTheFacesOfAPlate) {
  const Model plate = box_model({-1, -0.05f, -1}, {1, 0.05f, 1});
  const TriangleBvh bvh = build_triangle_bvh(plate.points, plate.triangles);
  const std::vector<Vec3> middles = find_thin_wall_midpoints(plate, bvh, 0.06, 0.2, 0.9);
  EXPECT_GT(static_cast<double>(middles.size()), 2 * 4 / (0.06 * 0.06));
  for (const Vec3 p : middles) EXPECT_NEAR(p.y, 0, 1e-5);
  EXPECT_TRUE(find_thin_wall_midpoints(plate, bvh, 0.06, 0.08, 0.9).empty()) << "thicker than that";
}

TEST(ThinWalls, FacesThatMeetAtASharperAngleCountAndOthersDoNot) {
  // A wedge of 45 degrees between the floor and a slope.
  Model wedge = box_model({0, 0, 0}, {1, 1, 1});
  for (Vec3& p : wedge.points)
    if (p.y > 0) p.y = p.x > 0 ? 1.0f : 1e-3f;
  const TriangleBvh bvh = build_triangle_bvh(wedge.points, wedge.triangles);
  EXPECT_TRUE(find_thin_wall_midpoints(wedge, bvh, 0.03, 0.5, 0.9).empty());
  EXPECT_FALSE(find_thin_wall_midpoints(wedge, bvh, 0.03, 0.5, 0.6).empty());
}

TEST(ThinWalls, AWireOfThreeSidesIsThin) {
  // Its faces enclose 60 degrees, and the circle in its section has the radius 0.0289.
  const Model wire = wire_model(3, 0.0577f, 2);
  const TriangleBvh bvh = build_triangle_bvh(wire.points, wire.triangles);
  const std::vector<Vec3> middles = find_thin_wall_midpoints(wire, bvh, 0.02, 0.12, 0.9);
  std::vector<int> sections(20);
  for (const Vec3 p : middles) {
    EXPECT_LT(std::hypot(p.x, p.z), 0.03f);
    if (p.y > 0 && p.y < 2) ++sections[static_cast<std::size_t>(10 * p.y)];
  }
  for (const int count : sections) EXPECT_GT(count, 5);
  EXPECT_TRUE(find_thin_wall_midpoints(wire, bvh, 0.02, 0.05, 0.9).size() < middles.size() / 4);
}

TEST(Thickness, CountsWhatHasNothingBehindIt) {
  Model open = box_model({0, 0, 0}, {1, 1, 1});
  open.triangles.erase(open.triangles.begin(), open.triangles.begin() + 2);  // the side x = 0
  const Thickness t = thickness_of(open);
  EXPECT_NEAR(t.open, 0.2, 0.01) << "the side across from it";
  EXPECT_NEAR(t.median, 1, 1e-5);
  Model sheet;
  sheet.points = {{0, 0, 0}, {1, 0, 0}, {1, 0, 1}};
  sheet.triangles = {{{0, 1, 2}}};
  EXPECT_EQ(thickness_of(sheet).rays, 0u);
  EXPECT_EQ(thickness_of(sheet).open, 1);
  EXPECT_EQ(thickness_of(Model{}).rays, 0u);
}

TEST(SelfIntersections, CrossingBoxesAreFoundAndTouchingOnesAreNot) {
  EXPECT_EQ(crossings_of(box_model({0, 0, 0}, {1, 1, 1})).pairs, 0u);
  Model touching = box_model({0, 0, 0}, {1, 1, 1});
  add_box(touching, {1, 0, 0}, {2, 1, 1});
  add_box(touching, {1, 1, 1}, {2, 2, 2});
  add_box(touching, {0.25f, 1, 0.25f}, {0.75f, 2, 0.75f});
  EXPECT_EQ(crossings_of(touching).pairs, 0u);
  Model crossing = box_model({0, 0, 0}, {1, 1, 1});
  add_box(crossing, {0.4f, 0.3f, 0.35f}, {1.5f, 0.7f, 0.8f});  // a peg through one side
  const SelfIntersections found = crossings_of(crossing);
  EXPECT_GT(found.pairs, 0u);
  EXPECT_FALSE(found.stopped);
  EXPECT_LT(found.first[0], 12u);
  EXPECT_GE(found.first[1], 12u);
  EXPECT_NE(describe_crossings(diagnose_fully(crossing)).find("of its triangles cross, first"),
            std::string::npos);
  EXPECT_EQ(describe_crossings(diagnose_fully(touching)), "");
}

/// 200 000 triangles that all look at each other would be 20 000 million pairs.
TEST(SelfIntersections, WhatLiesUponEachOtherIsGivenUp) {
  Model equal = box_model({0, 0, 0}, {1, 1, 1});
  const std::vector<Triangle> box = equal.triangles;
  while (equal.triangles.size() < 200000)
    equal.triangles.insert(equal.triangles.end(), box.begin(), box.end());
  const SelfIntersections found = crossings_of(equal);
  EXPECT_EQ(found.pairs, 0u);
  EXPECT_TRUE(found.stopped);
  EXPECT_TRUE(found.crowded);
  Diagnosis diagnosis;
  diagnosis.crossings = found;
  EXPECT_NE(describe_crossings(diagnosis).find("lie upon each other"), std::string::npos);
}

TEST(SelfIntersections, AreAllPairsThatBruteForceFindsInTriangleSoup) {
  // Segments against triangles by another formula, in double.
  Model soup;
  std::uint32_t state = 5;
  const auto draw = [&] {
    state = state * 1664525 + 1013904223;
    return static_cast<float>(state >> 8) * 0x1p-24f;
  };
  for (std::uint32_t t = 0; t < 150; ++t) {
    const Vec3 at{draw(), draw(), draw()};
    for (int k = 0; k < 3; ++k) soup.points.push_back(at + Vec3{draw(), draw(), draw()} * 0.6f);
    soup.triangles.push_back({{3 * t, 3 * t + 1, 3 * t + 2}});
  }
  const auto hits = [&](Vec3d p, Vec3d q, const Triangle& t) {
    const Vec3d a(soup.points[t.v[0]]), ab = Vec3d(soup.points[t.v[1]]) - a,
                                        ac = Vec3d(soup.points[t.v[2]]) - a;
    const Vec3d n = cross(ab, ac);
    const double height = dot(p - a, n), fall = dot(p - q, n);
    if (fall == 0) return false;
    const double at = height / fall;
    if (at <= 0 || at >= 1) return false;
    const Vec3d r = p + (q - p) * at - a;
    const double u = dot(cross(r, ac), n) / dot(n, n), v = dot(cross(ab, r), n) / dot(n, n);
    return u > 0 && v > 0 && u + v < 1;
  };
  std::size_t expected = 0;
  for (std::size_t i = 0; i < soup.triangles.size(); ++i)
    for (std::size_t j = i + 1; j < soup.triangles.size(); ++j) {
      bool any = false;
      for (int k = 0; k < 3; ++k) {
        const auto edge = [&](std::size_t t, int corner) {
          return Vec3d(soup.points[soup.triangles[t].v[corner % 3]]);
        };
        any = any || hits(edge(i, k), edge(i, k + 1), soup.triangles[j]) ||
              hits(edge(j, k), edge(j, k + 1), soup.triangles[i]);
      }
      expected += any;
    }
  EXPECT_GT(expected, 50u);
  EXPECT_EQ(crossings_of(soup).pairs, expected);
  const SelfIntersections few = crossings_of(soup, 10);
  EXPECT_EQ(few.pairs, 10u);
  EXPECT_TRUE(few.stopped);
}

}  // namespace
}  // namespace polymorph
