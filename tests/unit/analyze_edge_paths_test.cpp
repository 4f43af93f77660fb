#include "analyze/edge_paths.h"

#include <gtest/gtest.h>

#include <cmath>

#include "testing/model.h"

namespace polymorph {
namespace {

TEST(EdgePaths, GoAlongTheEdgesOfABox) {
  const Model box = box_model({0, 0, 0}, {1, 2, 4});
  const std::vector<double> lengths = edge_path_lengths(box, {{0, 0}, {0, 1}, {0, 2}, {0, 4}});
  EXPECT_EQ(lengths, (std::vector<double>{0, 1, 2, 4}));
}

TEST(EdgePaths, TakeTheShorterWayRound) {
  // A ring of eight triangles around a hole, flat: two squares of points, 1 and 2 wide.
  Model ring;
  for (const float size : {1.0f, 2.0f})
    for (const auto& [x, y] : {std::pair(-1, -1), {1, -1}, {1, 1}, {-1, 1}})
      ring.points.push_back({size * static_cast<float>(x), size * static_cast<float>(y), 0});
  for (std::uint32_t k = 0; k < 4; ++k) {
    const std::uint32_t next = (k + 1) % 4;
    ring.triangles.push_back({{k, 4 + k, 4 + next}});
    ring.triangles.push_back({{k, 4 + next, next}});
  }
  const std::vector<double> lengths = edge_path_lengths(ring, {{0, 2}, {2, 0}, {0, 3}, {4, 0}});
  EXPECT_NEAR(lengths[0], 4, 1e-6);
  EXPECT_EQ(lengths[0], lengths[1]);
  EXPECT_NEAR(lengths[2], 2, 1e-6);
  EXPECT_NEAR(lengths[3], std::sqrt(2.0), 1e-6);
}

TEST(EdgePaths, BetweenSeparatePartsAreInfinite) {
  Model two = box_model({0, 0, 0}, {1, 1, 1});
  add_box(two, {2, 0, 0}, {3, 1, 1});
  EXPECT_TRUE(std::isinf(edge_path_lengths(two, {{0, 8}}).front()));
}

}  // namespace
}  // namespace polymorph
