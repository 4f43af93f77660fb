#include "field/sample_field.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "base/activity.h"
#include "base/random.h"
#include "testing/field.h"
#include "testing/forwarding_engine.h"

namespace polymorph {
namespace {

/// Samples the field of at most the balls' first thousand, and notes what it is asked for at once.
class FewBallsEngine : public ForwardingEngine {
 public:
  using ForwardingEngine::ForwardingEngine;
  std::vector<std::size_t> counts;

  EngineStatus sample(const BallSet& balls, const std::vector<Vec3>& points,
                      const ExtractSettings& settings, std::vector<float>& values) override {
    counts.push_back(points.size());
    const auto few = static_cast<std::ptrdiff_t>(std::min<std::size_t>(balls.size(), 1000));
    return engine_.sample(std::vector<Ball>(balls.begin(), balls.begin() + few), points, settings,
                          values);
  }
};

TEST(SampleField, PartsGiveWhatOneCallGives) {
  // So many balls that not all points are sampled at once, each of which reaches everything.
  std::vector<Ball> balls;
  for (int i = 0; i < 216000; ++i)
    balls.push_back(gaussian_ball(
        {static_cast<float>(i % 10), static_cast<float>(i / 10 % 10), static_cast<float>(i / 100)},
        0.3f, 0.12f));
  ExtractSettings settings;
  settings.field = FieldKind::kInverseSquare;
  const std::size_t part = points_per_second(balls.size());
  std::vector<Vec3> points;
  for (std::size_t i = 0; i < 2 * part + 500; ++i)
    points.push_back(balls[13 * i % 1000].center +
                     Vec3{0.1f, 0.02f, 1e-5f * static_cast<float>(i)});
  const auto cpu = make_cpu_engine();
  FewBallsEngine engine(*cpu);
  std::vector<float> whole;
  ASSERT_EQ(engine.sample(balls, points, settings, whole).code, EngineCode::kOk);
  engine.counts.clear();
  const auto parts = sample_field(engine, balls, points, settings, "sampling");
  ASSERT_TRUE(parts.ok());
  EXPECT_EQ(*parts, whole);
  EXPECT_EQ(engine.counts, (std::vector<std::size_t>{part, part, 500}));
  EXPECT_GT(whole.front(), 0);
  EXPECT_EQ(current_activity(), "") << "the last part is over";
}

/// Notes how many pairs of a point and a ball it is asked for.
class CountingEngine : public ForwardingEngine {
 public:
  using ForwardingEngine::ForwardingEngine;
  std::size_t pairs = 0;

  EngineStatus sample(const BallSet& balls, const std::vector<Vec3>& points,
                      const ExtractSettings& settings, std::vector<float>& values) override {
    pairs += balls.size() * points.size();
    return engine_.sample(balls, points, settings, values);
  }
};

TEST(SampleField, ManyPointsAskOnlyForTheBallsThatReachThem) {
  // Balls of all sizes along a sheet, as those of an octree's cells; some add nothing anywhere.
  std::vector<Ball> balls;
  std::vector<Vec3> points;
  for (std::uint32_t i = 0; i < 12000; ++i) {
    const auto uniform = [i](std::uint64_t axis) { return 20 * random_float(1, axis, i); };
    const Vec3 center{uniform(0), uniform(1), 0.05f * uniform(2)};
    balls.push_back(gaussian_ball(center, i % 50 == 0 ? 0.4f : 0.02f, 0.12f));
    if (i % 9 == 0) balls.back().w = -30;
    points.push_back(i % 3 == 0 ? center : center + Vec3{0.01f, 0.1f, 0.003f});
  }
  const auto cpu = make_cpu_engine();
  for (const FieldKind kind : {FieldKind::kGaussian, FieldKind::kWyvill}) {
    ExtractSettings settings;
    settings.field = kind;
    settings.iso = 0.7f;
    std::vector<float> whole;
    ASSERT_EQ(cpu->sample(balls, points, settings, whole).code, EngineCode::kOk);
    CountingEngine engine(*cpu);
    const auto values = sample_field(engine, balls, points, settings, "sampling");
    ASSERT_TRUE(values.ok());
    EXPECT_EQ(*values, whole);
    EXPECT_LT(engine.pairs, balls.size() * points.size() / 10);
    // Round balls beside an ellipsoid are computed in another form.
    balls[77].shape.xy = 0.2f;
    ASSERT_EQ(cpu->sample(balls, points, settings, whole).code, EngineCode::kOk);
    const auto mixed = sample_field(engine, balls, points, settings, "sampling");
    ASSERT_TRUE(mixed.ok());
    EXPECT_EQ(*mixed, whole);
    balls[77].shape.xy = 0;
  }
  balls[11999].a = -1;
  EXPECT_FALSE(sample_field(*cpu, balls, points, {}, "sampling").ok());
}

}  // namespace
}  // namespace polymorph
