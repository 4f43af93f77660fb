#include "field/sample_field.h"

#include <gtest/gtest.h>

#include "base/activity.h"
#include "testing/field.h"

namespace polymorph {
namespace {

TEST(SampleField, PartsGiveWhatOneCallGives) {
  // Many balls that are far apart: a point meets few of them.
  constexpr int kSide = 60;
  std::vector<Ball> balls;
  for (int i = 0; i < kSide * kSide * kSide; ++i)
    balls.push_back(
        gaussian_ball({static_cast<float>(i % kSide), static_cast<float>(i / kSide % kSide),
                       static_cast<float>(i / (kSide * kSide))},
                      0.3f, 0.12f));
  std::vector<Vec3> points;
  for (std::size_t i = 0; i < sampled_at_once(balls.size()) + 500; ++i)
    points.push_back(balls[13 * i].center + Vec3{0.1f, 0.02f, 0});
  const auto engine = make_cpu_engine();
  std::vector<float> whole;
  ASSERT_EQ(engine->sample(balls, points, {}, whole).code, EngineCode::kOk);
  const auto parts = sample_field(*engine, balls, points, {}, "sampling");
  ASSERT_TRUE(parts.ok());
  EXPECT_EQ(*parts, whole);
  EXPECT_GT(whole.front(), 0);
  EXPECT_EQ(current_activity(), "") << "the last part is over";
}

}  // namespace
}  // namespace polymorph
