#include "mesh/polygon.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "kernels/linear.h"

namespace polymorph {
namespace {

/// Area vector of each triangle, checked to turn like the polygon, summed; equal to the polygon's
/// when the triangles cover it exactly once.
double covered_area(const std::vector<Vec3>& corners, Vec3d up) {
  const PolygonTriangles result = triangulate(corners);
  EXPECT_EQ(result.triangles.size(), corners.size() - 2);
  EXPECT_TRUE(result.simple);
  double area = 0;
  for (const auto& t : result.triangles) {
    const Vec3d a(corners[t[0]]), b(corners[t[1]]), c(corners[t[2]]);
    const double part = dot(cross(b - a, c - a), up) / 2;
    EXPECT_GE(part, -1e-9) << "a triangle is turned over";
    area += part;
  }
  return area;
}

double polygon_area(const std::vector<Vec3>& corners, Vec3d up) {
  Vec3d sum;
  for (std::size_t i = 0; i < corners.size(); ++i)
    sum = sum + cross(Vec3d(corners[i]), Vec3d(corners[(i + 1) % corners.size()]));
  return dot(sum, up) / 2;
}

const Vec3d kUp(0, 0, 1);

TEST(Triangulate, ConcavePentagonFromEveryStart) {
  std::vector<Vec3> dart{{0, 0, 0}, {4, 0, 0}, {4, 4, 0}, {2, 1, 0}, {0, 4, 0}};
  for (int start = 0; start < 5; ++start) {
    EXPECT_NEAR(covered_area(dart, kUp), 10, 1e-9) << start;
    std::rotate(dart.begin(), dart.begin() + 1, dart.end());
  }
}

TEST(Triangulate, ConcaveQuadUsesTheInnerDiagonal) {
  std::vector<Vec3> dart{{0, 0, 0}, {4, 0, 0}, {1, 1, 0}, {0, 4, 0}};
  for (int start = 0; start < 4; ++start) {
    EXPECT_NEAR(covered_area(dart, kUp), 4, 1e-9) << start;
    std::rotate(dart.begin(), dart.begin() + 1, dart.end());
  }
}

TEST(Triangulate, StarInAnObliquePlane) {
  std::vector<Vec3> star;
  const Vec3d u = normalized(Vec3d(1, 2, 3)), v = normalized(cross(Vec3d(0, 1, 0), u));
  for (int i = 0; i < 20; ++i) {
    const double a = 2 * std::numbers::pi * i / 20, r = i % 2 ? 1 : 3;
    star.push_back(to_float(Vec3d(100, -50, 7) + u * (r * std::cos(a)) + v * (r * std::sin(a))));
  }
  const Vec3d up = cross(u, v);
  EXPECT_NEAR(covered_area(star, up), polygon_area(star, up), 1e-3);
  EXPECT_TRUE(triangulate(star).planar);
}

TEST(Triangulate, SpiralOf4096CornersIsRightAndQuick) {
  std::vector<Vec3> spiral;
  for (int side = 0; side < 2; ++side)
    for (int i = 0; i < 2048; ++i) {
      const int k = side ? 2047 - i : i;
      const double a = 0.02 * k, r = 1 + 0.05 * a * 4 + (side ? 0.2 : 0);
      spiral.push_back(
          {static_cast<float>(r * std::cos(a)), static_cast<float>(r * std::sin(a)), 0});
    }
  const double area = polygon_area(spiral, kUp);
  const Vec3d up = area > 0 ? kUp : kUp * -1;
  EXPECT_NEAR(covered_area(spiral, up), std::abs(area), 1e-4 * std::abs(area));
}

TEST(Triangulate, PolygonWithABridgeToItsHole) {
  const std::vector<Vec3> keyhole{{0, 0, 0}, {6, 0, 0}, {6, 6, 0}, {0, 6, 0}, {0, 0, 0},
                                  {2, 2, 0}, {2, 4, 0}, {4, 4, 0}, {4, 2, 0}, {2, 2, 0}};
  EXPECT_NEAR(covered_area(keyhole, kUp), 32, 1e-9);
}

TEST(Triangulate, CornersInOneLineAreKept) {
  const std::vector<Vec3> square{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {2, 1, 0},
                                 {2, 2, 0}, {1, 2, 0}, {0, 2, 0}, {0, 1, 0}};
  EXPECT_NEAR(covered_area(square, kUp), 4, 1e-9);
}

TEST(Triangulate, SaysThatAPolygonCrossesItselfOrIsBent) {
  const std::vector<Vec3> bow_tie{{0, 0, 0}, {2, 2, 0}, {2, 0, 0}, {0, 2.5f, 0}};
  EXPECT_FALSE(triangulate(bow_tie).simple);
  EXPECT_EQ(triangulate(bow_tie).triangles.size(), 2u);
  const std::vector<Vec3> bent{{0, 0, 0}, {1, 0, 1}, {1, 1, 0}, {0, 1, 1}};
  EXPECT_FALSE(triangulate(bent).planar);
  const std::vector<Vec3> line{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}, {4, 0, 0}};
  EXPECT_EQ(triangulate(line).triangles.size(), 3u);
}

TEST(Triangulate, LargePolygonsAreCoveredOnce) {
  for (const bool spiky : {false, true}) {
    std::vector<Vec3> corners;
    for (int i = 0; i < 3000; ++i) {
      const double angle = 2 * std::numbers::pi * i / 3000, radius = spiky && i % 2 ? 0.2 : 1;
      corners.push_back({static_cast<float>(radius * std::cos(angle)),
                         static_cast<float>(radius * std::sin(angle)), 0});
    }
    EXPECT_NEAR(covered_area(corners, kUp), polygon_area(corners, kUp), 1e-6);
  }
}

TEST(Triangulate, WhatCrossesItselfEverywhereComesToAnEnd) {
  std::vector<Vec3> corners;
  for (int i = 0; i < 4096; ++i)
    corners.push_back({static_cast<float>(i * 1453 % 4096), static_cast<float>(i * 911 % 4093), 0});
  const PolygonTriangles result = triangulate(corners);
  EXPECT_FALSE(result.simple);
  EXPECT_EQ(result.triangles.size(), corners.size() - 2);
}

}  // namespace
}  // namespace polymorph
