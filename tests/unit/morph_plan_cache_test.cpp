#include "morph/plan_cache.h"

#include <gtest/gtest.h>

#include <cstring>
#include <fstream>

#include "base/cache_file.h"
#include "morph/plan.h"
#include "testing/model.h"

namespace polymorph {
namespace {

/// Balls along a bent line, with sizes of their own.
std::vector<Ball> line_of(int count, float bend) {
  std::vector<Ball> balls;
  for (int i = 0; i < count; ++i) {
    const float t = static_cast<float>(i) / static_cast<float>(count);
    Ball ball;
    ball.center = {t, bend * t * t, 0.1f * static_cast<float>(i % 3)};
    ball.a = 20 + 3 * static_cast<float>(i % 5);
    ball.w = ball.a * 0.01f;
    balls.push_back(ball);
  }
  return balls;
}

std::size_t plans_in(const std::filesystem::path& folder) {
  std::size_t count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    count += entry.path().extension() == kPlanFiles.extension ? 1 : 0;
  return count;
}

/// No bit may differ: frames would.
void expect_same(const MorphPlan& a, const MorphPlan& b) {
  ASSERT_EQ(a.pairs.size(), b.pairs.size());
  EXPECT_EQ(std::memcmp(a.pairs.data(), b.pairs.data(), a.pairs.size() * sizeof(Pair)), 0);
  EXPECT_EQ(std::memcmp(&a.alignment, &b.alignment, sizeof(Alignment)), 0);
  EXPECT_EQ(a.from_masses, b.from_masses);
  EXPECT_EQ(a.to_masses, b.to_masses);
}

TEST(PlanCache, GivesTheSamePlanToTheBit) {
  const TemporaryFolder folder;
  const PlanSide from{line_of(40, 0.8f), {}, {}, {}}, to{line_of(55, -0.5f), {}, {}, {}};
  for (const PlanMethod method : {PlanMethod::kTransport, PlanMethod::kNearest}) {
    PlanSettings settings;
    settings.method = method;
    const auto plan = [&](const PlanSide& a, const PlanSide& b, const std::filesystem::path& in) {
      return plan_morph(a, b, FieldKind::kGaussian, settings, {}, in);
    };
    const std::size_t before = plans_in(folder.path());
    expect_same(plan(from, to, folder.path()), plan(from, to, {}));
    EXPECT_EQ(plans_in(folder.path()), before + 1);
    expect_same(plan(from, to, folder.path()), plan(from, to, {}));  // read
    expect_same(plan(to, from, folder.path()),
                plan(to, from, {}));  // the way back has the same file
    EXPECT_EQ(plans_in(folder.path()), before + 1);
  }
}

TEST(PlanCache, AnythingElseIsAnotherPlan) {
  const PlanSide from{line_of(12, 1), {}, {}, {}}, to{line_of(9, 0), {}, {}, {}};
  const auto key = [&](const PlanSettings& settings) {
    return correspondence_key(from, to, FieldKind::kGaussian, settings);
  };
  PlanSettings other;
  other.weights.size *= 2;
  EXPECT_NE(key(other), key({}));
  PlanSide labelled = from;
  labelled.labels.assign(12, 1);
  EXPECT_NE(correspondence_key(labelled, to, FieldKind::kGaussian, {}), key({}));
  PlanSide moved = from;
  moved.balls[3].center.x += 1e-6f;
  EXPECT_NE(correspondence_key(moved, to, FieldKind::kGaussian, {}), key({}));
}

TEST(PlanCache, WhatDoesNotFitIsMadeAnew) {
  const TemporaryFolder folder;
  const PlanSide from{line_of(12, 1), {}, {}, {}}, to{line_of(9, 0), {}, {}, {}};
  const std::string key = correspondence_key(from, to, FieldKind::kGaussian, {});
  EXPECT_FALSE(load_correspondence(folder.path(), key, from, to));
  Correspondence found;
  found.from_masses.assign(12, 1.0 / 12);
  found.to_masses.assign(9, 1.0 / 9);
  found.pairs = {{11, 8, 1, 1, 1}};
  store_correspondence(folder.path(), key, "", found);
  EXPECT_TRUE(load_correspondence(folder.path(), key, from, to));
  found.pairs = {{12, 8, 1, 1, 1}};  // there is no such ball
  store_correspondence(folder.path(), key, "", found);
  EXPECT_FALSE(load_correspondence(folder.path(), key, from, to));
  std::ofstream(cache_path(folder.path(), key, kPlanFiles)) << "damaged";
  EXPECT_FALSE(load_correspondence(folder.path(), key, from, to));
}

}  // namespace
}  // namespace polymorph
