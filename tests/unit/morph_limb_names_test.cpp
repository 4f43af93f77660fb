#include "morph/limb_names.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "testing/figure.h"

namespace polymorph {
namespace {

std::set<std::string> names_of(const std::vector<Ball>& balls) {
  const std::vector<std::string> names = limb_names(find_limbs(balls));
  const std::set<std::string> set(names.begin(), names.end());
  EXPECT_EQ(set.size(), names.size());
  return set;
}

TEST(LimbNames, OfAFigure) {
  const std::set<std::string> wanted{"head", "left arm", "right arm", "left leg", "right leg"};
  EXPECT_EQ(names_of(figure()), wanted);
  EXPECT_EQ(names_of(figure(0.9f)), wanted);   // raised arms are none
  EXPECT_EQ(names_of(figure(-0.7f)), wanted);  // and hanging ones
}

TEST(LimbNames, OfAQuadruped) {
  std::vector<Ball> balls;
  const auto limb = [&](Vec3 from, Vec3 to, float radius) {
    for (int i = 0; i <= 12; ++i)
      balls.push_back(ball_at(lerp(from, to, static_cast<float>(i) / 12), radius));
  };
  limb({-0.6f, 1, 0}, {0.6f, 1, 0}, 0.3f);
  for (const float x : {-0.6f, 0.6f})
    for (const float z : {-0.2f, 0.2f}) limb({x, 0.9f, z}, {x, 0.1f, z}, 0.1f);
  limb({0.7f, 1.2f, 0}, {1.3f, 1.7f, 0}, 0.18f);
  limb({-0.7f, 1.1f, 0}, {-1.5f, 1.2f, 0}, 0.07f);
  const std::set<std::string> wanted{
      "head", "tail", "front left leg", "back left leg", "front right leg", "back right leg"};
  EXPECT_EQ(names_of(balls), wanted);
}

}  // namespace
}  // namespace polymorph
