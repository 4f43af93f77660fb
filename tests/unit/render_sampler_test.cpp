#include "render/math/sampler.h"

#include <gtest/gtest.h>

#include <set>
#include <vector>

namespace polymorph {
namespace {

/// Does each of the 2^m boxes of every shape hold exactly one of the 2^m points? (A (0, m, 2)-net.)
::testing::AssertionResult is_net(const std::vector<std::pair<float, float>>& points) {
  const auto count = static_cast<int>(points.size());
  for (int columns = 1; columns <= count; columns *= 2) {
    const int rows = count / columns;
    std::set<int> boxes;
    for (const auto& [x, y] : points)
      boxes.insert(static_cast<int>(x * static_cast<float>(columns)) +
                   columns * static_cast<int>(y * static_cast<float>(rows)));
    if (static_cast<int>(boxes.size()) != count)
      return ::testing::AssertionFailure() << columns << " x " << rows << " boxes: only "
                                           << boxes.size() << " of " << count << " are hit";
  }
  return ::testing::AssertionSuccess();
}

TEST(Sampler, SamplesOfAPixelFillTheSquareEvenly) {
  const FrameSampler frame = make_frame_sampler(7, 3, 16);
  for (std::uint32_t set : {0u, 1u, 4u}) {
    std::vector<std::pair<float, float>> first, second;
    for (std::uint32_t s = 0; s < 16; ++s) {
      const Sample4 r = PathSampler(frame, 101, 57, s).get(set);
      first.emplace_back(r.a, r.b);
      second.emplace_back(r.c, r.d);
    }
    EXPECT_TRUE(is_net(first));
    EXPECT_TRUE(is_net(second));
  }
}

TEST(Sampler, NeighbouringPixelsShareOneNet) {
  const FrameSampler frame = make_frame_sampler(0, 0, 4);
  std::vector<std::pair<float, float>> points;
  for (int pixel = 0; pixel < 4; ++pixel)
    for (std::uint32_t s = 0; s < 4; ++s) {
      const Sample4 r = PathSampler(frame, 10 + pixel % 2, 20 + pixel / 2, s).get(2);
      points.emplace_back(r.c, r.d);
    }
  EXPECT_TRUE(is_net(points));
}

TEST(Sampler, PairsAreIndependent) {
  const FrameSampler frame = make_frame_sampler(1, 0, 1024);
  double product = 0;
  for (std::uint32_t s = 0; s < 1024; ++s) {
    const Sample4 r = PathSampler(frame, 3, 4, s).get(1);
    product += (r.a - 0.5) * (r.c - 0.5);
  }
  EXPECT_NEAR(product / 1024, 0.0, 0.01);  // 1/12 would be full correlation
}

TEST(Sampler, EveryKeyMatters) {
  const auto draw = [](std::uint64_t seed, int number, int x, std::uint32_t s, std::uint32_t set) {
    return PathSampler(make_frame_sampler(seed, number, 16), x, 5, s).get(set).a;
  };
  const float base = draw(1, 2, 3, 4, 5);
  EXPECT_EQ(base, draw(1, 2, 3, 4, 5));
  EXPECT_NE(base, draw(2, 2, 3, 4, 5));
  EXPECT_NE(base, draw(1, 3, 3, 4, 5));
  EXPECT_NE(base, draw(1, 2, 4, 4, 5));
  EXPECT_NE(base, draw(1, 2, 3, 5, 5));
  EXPECT_NE(base, draw(1, 2, 3, 4, 6));
}

TEST(Sampler, NumbersStayBelowOneBeyondThirtyTwoBitsOfIndex) {
  const FrameSampler frame = make_frame_sampler(0, 0, 65536);
  for (int x : {0, 4095, 16383})
    for (std::uint32_t s : {0u, 65535u}) {
      const Sample4 r = PathSampler(frame, x, x, s).get(0);
      for (float value : {r.a, r.b, r.c, r.d}) {
        EXPECT_GE(value, 0.0f);
        EXPECT_LT(value, 1.0f);
      }
    }
  EXPECT_NE(PathSampler(frame, 0, 0, 0).get(0).a, PathSampler(frame, 16383, 16383, 0).get(0).a);
}

}  // namespace
}  // namespace polymorph
