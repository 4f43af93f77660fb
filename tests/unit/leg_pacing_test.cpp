#include "leg/pacing.h"

#include <gtest/gtest.h>

#include "base/hash.h"
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
  EXPECT_EQ(kPacingVersion, 15u);
  EXPECT_EQ(Hasher()
                .add(std::span<const float>(leg->plan.pacing))
                .add(std::span<const float>(levels))
                .add(std::span<const float>(leg->plan.lifts))
                .add(std::span<const Vec3>(leg->plan.from_offsets))
                .add(std::span<const Vec3>(leg->plan.to_offsets))
                .hex(),
            "fa9d653625b79a95e728e58635095056");
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
