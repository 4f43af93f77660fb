#include "field/sample_field.h"

#include <gtest/gtest.h>

#include "base/activity.h"
#include "testing/field.h"
#include "testing/forwarding_engine.h"

namespace polymorph {
namespace {

/// Samples the field of the balls' first thousand alone, and notes how many points it is asked for
/// at once.
class FewBallsEngine : public ForwardingEngine {
 public:
  using ForwardingEngine::ForwardingEngine;
  std::vector<std::size_t> counts;

  EngineStatus sample(const BallSet& balls, const std::vector<Vec3>& points,
                      const ExtractSettings& settings, std::vector<float>& values) override {
    counts.push_back(points.size());
    const std::vector<Ball> few(balls.begin(), balls.begin() + 1000);
    return engine_.sample(few, points, settings, values);
  }
};

TEST(SampleField, PartsGiveWhatOneCallGives) {
  // So many balls that not all points are sampled at once; most are far from each other.
  std::vector<Ball> balls;
  for (int i = 0; i < 216000; ++i)
    balls.push_back(gaussian_ball(
        {static_cast<float>(i % 10), static_cast<float>(i / 10 % 10), static_cast<float>(i / 100)},
        0.3f, 0.12f));
  const std::size_t part = sampled_at_once(balls.size());
  std::vector<Vec3> points;
  for (std::size_t i = 0; i < 2 * part + 500; ++i)
    points.push_back(balls[13 * i % 1000].center +
                     Vec3{0.1f, 0.02f, 1e-5f * static_cast<float>(i)});
  const auto cpu = make_cpu_engine();
  FewBallsEngine engine(*cpu);
  std::vector<float> whole;
  ASSERT_EQ(engine.sample(balls, points, {}, whole).code, EngineCode::kOk);
  engine.counts.clear();
  const auto parts = sample_field(engine, balls, points, {}, "sampling");
  ASSERT_TRUE(parts.ok());
  EXPECT_EQ(*parts, whole);
  EXPECT_EQ(engine.counts, (std::vector<std::size_t>{part, part, 500}));
  EXPECT_GT(whole.front(), 0);
  EXPECT_EQ(current_activity(), "") << "the last part is over";
}

}  // namespace
}  // namespace polymorph
