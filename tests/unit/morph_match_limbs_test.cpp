#include "morph/match_limbs.h"

#include <gtest/gtest.h>

#include <algorithm>
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
  for (const auto& [i, k] : match_limbs(from, to, 0, allowed).limbs)
    EXPECT_FALSE(i == head && k == head);
}

TEST(MatchLimbs, OfABallAreNotCertain) {
  const Limbs ball = find_limbs({ball_at({0, 0, 0}, 1)}), other = find_limbs(figure());
  EXPECT_FALSE(is_certain(match_limbs(ball, other)));
  EXPECT_FALSE(is_certain(match_limbs(other, ball)));
  EXPECT_FALSE(is_certain(match_limbs(Limbs{}, Limbs{})));
}

}  // namespace
}  // namespace polymorph
