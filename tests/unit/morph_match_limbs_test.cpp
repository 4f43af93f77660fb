#include "morph/match_limbs.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <string>

#include "morph/limb_names.h"
#include "testing/figure.h"

namespace polymorph {
namespace {

/// "arm -> arm" and so on.
std::set<std::string> named(const Limbs& from, const Limbs& to, const LimbMatch& match) {
  const std::vector<std::string> a = limb_names(from), b = limb_names(to);
  std::set<std::string> names;
  for (const auto& [i, k] : match.limbs) names.insert(a[i] + " -> " + b[k]);
  return names;
}

const std::set<std::string> kAll{"head -> head", "left arm -> left arm", "right arm -> right arm",
                                 "left leg -> left leg", "right leg -> right leg"};

TEST(MatchLimbs, OfAnotherPoseAreTheSame) {
  const Limbs hanging = find_limbs(figure(-0.9f)), raised = find_limbs(figure(0.7f));
  const LimbMatch match = match_limbs(hanging, raised);
  EXPECT_EQ(named(hanging, raised, match), kAll);  // left stays left
  EXPECT_TRUE(is_certain(match));
  EXPECT_EQ(match.share, 1);
  EXPECT_NEAR(match.angle, 0, 0.1);
}

TEST(MatchLimbs, BackAreTheSame) {
  const Limbs a = find_limbs(figure(-0.9f)), b = find_limbs(figure(0.7f));
  LimbMatch there = match_limbs(a, b);
  const LimbMatch back = match_limbs(b, a);
  ASSERT_EQ(there.limbs.size(), back.limbs.size());
  for (const auto& [i, k] : there.limbs)
    EXPECT_TRUE(std::any_of(back.limbs.begin(), back.limbs.end(),
                            [&, i = i, k = k](const auto& m) { return m.from == k && m.to == i; }));
  EXPECT_EQ(there.share, back.share);
}

/// A running animal: a long trunk with a head and a tail, and four legs that swing by `angles`
/// (front left, front right, back left, back right) and cross below the trunk by `across`.
std::vector<Ball> runner(const std::array<float, 4>& angles, float across) {
  std::vector<Ball> balls;
  for (int i = -5; i <= 5; ++i)
    balls.push_back(ball_at({0, 1, 0.15f * static_cast<float>(i)}, 0.25f));
  for (int i = 1; i <= 6; ++i) {
    const auto t = static_cast<float>(i);
    balls.push_back(ball_at({0, 1 + 0.1f * t, 0.8f + 0.08f * t}, i < 4 ? 0.12f : 0.2f));
    balls.push_back(ball_at({0, 1.1f - 0.02f * t, -0.95f - 0.11f * t}, 0.08f));
  }
  for (int leg = 0; leg < 4; ++leg) {
    const float side = leg % 2 == 0 ? 1.0f : -1.0f, root = leg < 2 ? 0.65f : -0.65f;
    for (int i = 1; i <= 10; ++i) {
      const float t = 0.1f * static_cast<float>(i), angle = angles[static_cast<std::size_t>(leg)];
      balls.push_back(ball_at({side * (0.3f - across * t), 0.9f - 0.9f * t * std::cos(angle),
                               root + 0.9f * t * std::sin(angle)},
                              0.09f));
    }
  }
  return balls;
}

TEST(MatchLimbs, LeavesLegsThatCrossOnTheirSides) {
  const Limbs from = find_limbs(runner({0.7f, -0.3f, -0.7f, 0.3f}, 0.4f)),
              to = find_limbs(runner({-0.3f, 0.7f, 0.3f, -0.7f}, 0.4f));
  ASSERT_EQ(from.limbs.size(), 6u);
  ASSERT_EQ(to.limbs.size(), 6u);
  const LimbMatch match = match_limbs(from, to);
  EXPECT_TRUE(is_certain(match));
  EXPECT_NEAR(match.angle, 0, 0.2);
  EXPECT_EQ(match.limbs.size(), 6u);
  for (const auto& [i, k] : match.limbs) {
    const Vec3d a = from.limbs[i].root, b = to.limbs[k].root;
    EXPECT_GT(a.z * b.z, 0);
    if (std::fabs(a.x) > 0.05) {
      EXPECT_GT(a.x * b.x, 0);
    }
  }
}

/// A figure's legs under a cape: a limb on which both sit, of which only the last `visible` of
/// their lengths is seen.
struct CapedFigure {
  Limbs limbs;
  std::uint32_t legs[2] = {0, 0};
};
CapedFigure caped(const Limbs& whole, double visible) {
  const std::vector<std::string> names = limb_names(whole);
  const auto number = [&](const char* name) {
    return static_cast<std::uint32_t>(std::find(names.begin(), names.end(), name) - names.begin());
  };
  CapedFigure figure = {whole, {number("left leg"), number("right leg")}};
  Limbs& limbs = figure.limbs;
  Limb both = limbs.limbs[figure.legs[0]];
  both.nested = {figure.legs[0], figure.legs[1]};
  const Limb &left = whole.limbs[figure.legs[0]], &right = whole.limbs[figure.legs[1]];
  for (std::size_t k = 0; k < kLimbStations; ++k)
    both.line[k] = (left.line[k] + right.line[k]) * 0.5;
  both.root = (left.root + right.root) * 0.5;
  for (const std::uint32_t leg : figure.legs) {
    Limb& foot = limbs.limbs[leg];
    foot.stretch *= visible;
    foot.root_distance = foot.tip_distance - foot.stretch;
    for (Vec3d& p : foot.line) p = foot.tip() + (p - foot.tip()) * visible;
    foot.root = foot.tip() + (foot.root - foot.tip()) * visible;
  }
  limbs.limbs.push_back(both);
  for (auto& row : limbs.tip_distances) row.push_back(row[figure.legs[0]]);
  limbs.tip_distances.push_back(limbs.tip_distances[figure.legs[0]]);
  return figure;
}

TEST(MatchLimbs, LeavesBothOfAPairAlone) {
  // Two legs that hang together down to short feet: the first of them is as far from the other's
  // right leg as from its left one.
  const Limbs from = find_limbs(figure());
  const LimbMatch match = match_limbs(from, caped(from, 0.02).limbs);
  EXPECT_EQ(match.limbs.size(), 3u);
  for (const auto& [i, k] : match.limbs) EXPECT_EQ(i, k);
  EXPECT_FALSE(is_certain(match));
}

TEST(MatchLimbs, ShortLegsUnderACapeAreLegs) {
  const Limbs from = find_limbs(figure());
  for (const double visible : {0.08, 0.15, 0.5}) {
    const LimbMatch match = match_limbs(from, caped(from, visible).limbs);
    EXPECT_EQ(match.limbs.size(), 5u) << visible;
    for (const auto& [i, k] : match.limbs) EXPECT_EQ(i, k) << visible;
    EXPECT_TRUE(is_complete(match)) << visible;
  }
}

TEST(MatchLimbs, FindsTheTurnOfATurnedFigure) {
  const double quarter = 1.5707963267948966;
  const Limbs from = find_limbs(figure()),
              to = find_limbs(moved(figure(0.3f), exp_rotation({0, quarter, 0}), 1, {}));
  const LimbMatch match = match_limbs(from, to);
  EXPECT_EQ(match.limbs.size(), 5u);
  EXPECT_NEAR(match.angle, quarter, 0.1);  // feet point the way they did
}

TEST(MatchLimbs, LeavesLimbsWithoutACounterpart) {
  std::vector<Ball> armless = figure();
  std::erase_if(armless, [](const Ball& ball) { return std::abs(ball.center.x) > 0.25f; });
  const Limbs from = find_limbs(armless), to = find_limbs(figure());
  ASSERT_EQ(from.limbs.size(), 3u);
  const LimbMatch match = match_limbs(from, to);
  EXPECT_EQ(match.limbs.size(), 3u);
  EXPECT_LT(match.share, 0.8);
  EXPECT_GT(match.share, 0.5);
}

TEST(MatchLimbs, HeedsWhatIsNotAllowed) {
  const Limbs from = find_limbs(figure()), to = find_limbs(figure());
  const std::vector<std::string> names = limb_names(from);
  const auto head =
      static_cast<std::size_t>(std::find(names.begin(), names.end(), "head") - names.begin());
  AllowedLimbs allowed(from.limbs.size(), std::vector<std::uint8_t>(to.limbs.size(), 1));
  allowed[head][head] = 0;
  for (const auto& [i, k] : match_limbs(from, to, 0, {allowed, {}}).limbs)
    EXPECT_FALSE(i == head && k == head);
}

TEST(MatchLimbs, WhatTheUserChoosesIsMatched) {
  const Limbs from = find_limbs(figure()), to = find_limbs(figure());
  const std::vector<std::string> names = limb_names(from);
  const auto find = [&](const char* name) {
    return static_cast<std::uint32_t>(std::find(names.begin(), names.end(), name) - names.begin());
  };
  const std::uint32_t head = find("head"), arm = find("left arm");
  const LimbMatch match = match_limbs(from, to, 0, {{}, {{{head}, {arm}}}});
  EXPECT_TRUE(is_certain(match));
  EXPECT_TRUE(std::any_of(match.limbs.begin(), match.limbs.end(),
                          [&](const auto& pair) { return pair.from == head && pair.to == arm; }));
}

TEST(MatchLimbs, OfSeveralChosenLimbsTheCheapestAreMatched) {
  const Limbs from = find_limbs(figure(-0.3f)), to = find_limbs(figure());
  const std::vector<std::string> names = limb_names(from), others = limb_names(to);
  const auto find = [](const std::vector<std::string>& all, const char* name) {
    return static_cast<std::uint32_t>(std::find(all.begin(), all.end(), name) - all.begin());
  };
  // More limbs on the one side, then on the other.
  const ChosenLimbs several{
      {find(names, "head"), find(names, "left arm"), find(names, "right leg")},
      {find(others, "right arm"), find(others, "left leg")}};
  const auto count = [](const LimbMatch& match, const std::vector<std::uint32_t>& a,
                        const std::vector<std::uint32_t>& b) {
    return std::count_if(match.limbs.begin(), match.limbs.end(), [&](const MatchedLimbs& pair) {
      return std::find(a.begin(), a.end(), pair.from) != a.end() &&
             std::find(b.begin(), b.end(), pair.to) != b.end();
    });
  };
  const LimbMatch there = match_limbs(from, to, 0, {{}, {several}}),
                  back = match_limbs(to, from, 0, {{}, {{several.to, several.from}}});
  EXPECT_EQ(count(there, several.from, several.to), 2);
  EXPECT_EQ(count(back, several.to, several.from), 2);
  const std::set<std::string> matched = named(from, to, there);
  // The head is not like either, and stays alone.
  EXPECT_TRUE(matched.contains("left arm -> right arm"));
  EXPECT_TRUE(matched.contains("right leg -> left leg"));
  for (const MatchedLimbs& pair : there.limbs) EXPECT_NE(names[pair.from], "head");
}

TEST(MatchLimbs, OfABallAreNotCertain) {
  const Limbs ball = find_limbs({ball_at({0, 0, 0}, 1)}), other = find_limbs(figure());
  EXPECT_FALSE(is_certain(match_limbs(ball, other)));
  EXPECT_FALSE(is_certain(match_limbs(other, ball)));
  EXPECT_FALSE(is_certain(match_limbs(Limbs{}, Limbs{})));
}

}  // namespace
}  // namespace polymorph
