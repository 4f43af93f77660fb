#include "morph/easing.h"

#include <gtest/gtest.h>

#include <cmath>

namespace polymorph {
namespace {

MotionSettings with(Easing easing) {
  MotionSettings motion;
  motion.easing = easing;
  return motion;
}

TEST(Ease, RunsFromZeroToOne) {
  for (const Easing easing :
       {Easing::kLinear, Easing::kSmoothstep, Easing::kQuintic, Easing::kBezier, Easing::kSpring}) {
    const MotionSettings motion = with(easing);
    EXPECT_EQ(ease(motion, 0), 0);
    EXPECT_EQ(ease(motion, 1), 1);
    EXPECT_EQ(ease(motion, -1), 0);
    EXPECT_EQ(ease(motion, 2), 1);
    EXPECT_NEAR(ease(motion, 1e-4f), 0, 1e-3);
    EXPECT_NEAR(ease(motion, 1 - 1e-4f), 1, 1e-3);
  }
}

TEST(Ease, AllButTheSpringNeverTurnBack) {
  for (const Easing easing :
       {Easing::kLinear, Easing::kSmoothstep, Easing::kQuintic, Easing::kBezier}) {
    EXPECT_NEAR(ease(with(easing), 0.5f), 0.5f, 1e-6);
    for (int i = 0; i < 100; ++i)
      EXPECT_LE(ease(with(easing), static_cast<float>(i) / 100),
                ease(with(easing), static_cast<float>(i + 1) / 100));
  }
}

TEST(Ease, ABezierWithItsPointsOnTheDiagonalIsLinear) {
  MotionSettings motion = with(Easing::kBezier);
  motion.bezier = {0.2f, 0.2f, 0.9f, 0.9f};
  for (int i = 0; i <= 20; ++i)
    EXPECT_NEAR(ease(motion, static_cast<float>(i) / 20), static_cast<float>(i) / 20, 1e-6);
}

/// CSS "ease-in", cubic-bezier(0.42, 0, 1, 1): x(s) = 0.42*3s(1-s)^2 + 3s^2(1-s) + s^3, y = 3s^2 -
/// 2s^3.
TEST(Ease, ABezierIsTheCurveOfItsPoints) {
  MotionSettings motion = with(Easing::kBezier);
  motion.bezier = {0.42f, 0, 1, 1};
  for (const double s : {0.1, 0.3, 0.5, 0.8}) {
    const double x = 3 * 0.42 * s * (1 - s) * (1 - s) + 3 * s * s * (1 - s) + s * s * s;
    EXPECT_NEAR(ease(motion, static_cast<float>(x)), 3 * s * s - 2 * s * s * s, 1e-5);
  }
}

/// The three solutions of m x'' + b x' + k x = 0, put back into the equation.
TEST(Ease, ASpringObeysItsEquationUnderCriticallyAndOverDamped) {
  // Stiff enough that next to nothing of the spring is left at the end, which would be blended
  // away.
  constexpr double kStiffness = 900;
  for (const float damping : {12.0f, 60.0f, 150.0f}) {  // critical is 60
    MotionSettings motion = with(Easing::kSpring);
    motion.spring = {1, static_cast<float>(kStiffness), damping, 0};
    const double h = 2e-3;
    const auto x = [&](double t) {
      return 1 - static_cast<double>(ease(motion, static_cast<float>(t)));
    };
    for (const double t : {0.02, 0.05, 0.1, 0.2, 0.3}) {
      const double first = (x(t + h) - x(t - h)) / (2 * h);
      const double second = (x(t + h) - 2 * x(t) + x(t - h)) / (h * h);
      const double sum = second + static_cast<double>(damping) * first + kStiffness * x(t);
      EXPECT_NEAR(sum / kStiffness, 0, 0.02) << damping << " at " << t;
    }
  }
}

TEST(Ease, AnUnderdampedSpringOvershootsAndADampedOneDoesNot) {
  const auto highest = [](float damping) {
    MotionSettings motion = with(Easing::kSpring);
    motion.spring = {1, 400, damping, 0};
    float largest = 0;
    for (int i = 0; i < 200; ++i)
      largest = std::max(largest, ease(motion, static_cast<float>(i) / 200));
    return largest;
  };
  // The first overshoot of an oscillator of damping ratio z is exp(-pi z / sqrt(1 - z^2)).
  const double z = 8.0 / (2 * 20);
  EXPECT_NEAR(static_cast<double>(highest(8)) - 1, std::exp(-3.14159265 * z / std::sqrt(1 - z * z)),
              0.02);
  EXPECT_LE(highest(40), 1.0001f);
  EXPECT_LE(highest(90), 1.0001f);
}

TEST(Ease, AHeavyBallLagsBehindALightOne) {
  MotionSettings motion = with(Easing::kSpring);
  for (const float t : {0.05f, 0.1f, 0.15f})
    EXPECT_LT(ease(motion, t, 3), ease(motion, t, 0.5f) - 0.01f);
}

}  // namespace
}  // namespace polymorph
