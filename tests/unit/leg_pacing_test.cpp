#include "leg/pacing.h"

#include <gtest/gtest.h>

#include "base/box.h"
#include "base/hash.h"
#include "leg/leg_surface.h"
#include "testing/leg.h"

namespace polymorph {
namespace {

/// Where this fails although the pace is meant to have changed: raise kPacingVersion, and put the
/// new digest here. Else files of an older program would be taken for this one's. Where only what
/// the pace is measured on has changed (balls, plans, maps, distances), which the files' keys hold,
/// the new digest is enough.
TEST(Pacing, TheVersionBelongsToThisPace) {
  const auto engine = make_cpu_engine();
  const auto leg = make_test_leg(Interpolation::kDistance, *engine);
  const std::vector<float>& levels = std::get<DistanceLeg>(leg->kind).levels;
  ASSERT_GE(leg->plan.pacing.size(), 3u);
  ASSERT_GE(levels.size(), 3u);
  EXPECT_EQ(kPacingVersion, 17u);
  EXPECT_EQ(Hasher()
                .add(std::span<const float>(leg->plan.pacing))
                .add(std::span<const float>(levels))
                .add(std::span<const float>(leg->plan.lifts))
                .add(std::span<const Vec3>(leg->plan.from_offsets))
                .add(std::span<const Vec3>(leg->plan.to_offsets))
                .hex(),
            "40b9781928bde3daddb10824edbbc8ec");
}

/// Frames lie between the measured moments, so that they may be larger by a little.
TEST(Pacing, ExtremesHoldEverySurface) {
  const auto engine = make_cpu_engine();
  const auto leg = make_test_leg(Interpolation::kDistance, *engine);
  const Box all = bounding_box(std::get<DistanceLeg>(leg->kind).extremes);
  const float margin = 0.02f * object_size(*leg, 0.5f);
  for (const float time : {0.0f, 0.3f, 0.45f, 0.55f, 0.8f, 1.0f}) {
    const auto surface = leg_surface(*leg, time, *engine);
    ASSERT_TRUE(surface.ok());
    const Box box = bounding_box(surface->mesh.positions);
    for (float Vec3::*axis : {&Vec3::x, &Vec3::y, &Vec3::z}) {
      EXPECT_GT(box.low.*axis, all.low.*axis - margin) << time;
      EXPECT_LT(box.high.*axis, all.high.*axis + margin) << time;
    }
  }
}

TEST(Pacing, IsMeasuredOnALegWithoutPace) {
  const auto engine = make_cpu_engine();
  const auto leg = make_test_leg(Interpolation::kDistance, *engine);
  Leg plain = *leg;
  plain.plan.pacing.clear();
  plain.plan.from_offsets.clear(), plain.plan.to_offsets.clear();
  plain.kind = DistanceLeg{};
  const auto pacing = measure_pacing(plain, *engine, {});
  ASSERT_TRUE(pacing.ok());
  EXPECT_EQ(pacing->times, leg->plan.pacing);
  EXPECT_EQ(pacing->levels, std::get<DistanceLeg>(leg->kind).levels);
}

}  // namespace
}  // namespace polymorph
