#include "image/srgb.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace polymorph {
namespace {

TEST(Srgb, EncodingIsTheInverseOfDecoding) {
  for (int i = -20; i <= 220; ++i) {
    const float linear = 0.01f * static_cast<float>(i);
    EXPECT_NEAR(srgb_to_linear(linear_to_srgb(linear)), linear, 2e-6f * (1 + std::fabs(linear)));
  }
  EXPECT_NEAR(linear_to_srgb(0.5f), 0.735357f, 1e-6f);  // IEC 61966-2-1
  EXPECT_FLOAT_EQ(linear_to_srgb(0.002f), 12.92f * 0.002f);
}

TEST(Srgb, CodesAreRoundedFromTheExactCurve) {
  const SrgbQuantizer& code_of = SrgbQuantizer::instance();
  for (int i = 0; i <= 100000; ++i) {
    const float linear = static_cast<float>(i) / 100000;
    const double exact = 255 * static_cast<double>(linear_to_srgb(linear));
    const double fraction = exact - std::floor(exact);
    if (std::fabs(fraction - 0.5) < 1e-4) continue;  // the float curve may fall on either side
    EXPECT_EQ(code_of(linear), std::lround(exact)) << linear;
  }
  for (int code = 0; code < 256; ++code) {
    const float linear = srgb_decode_table8()[static_cast<std::size_t>(code)];
    EXPECT_EQ(code_of(linear), code);
    EXPECT_EQ(srgb_decode_table16()[static_cast<std::size_t>(257 * code)], linear);
  }
}

TEST(Srgb, RandomRoundingIsThatOfTheExactCurve) {
  const SrgbQuantizer& code_of = SrgbQuantizer::instance();
  const float offsets[] = {0, 0.0004f, 0.25f, 0.5f, 0.731f, 0.9999f};
  for (int i = -10; i <= 100100; ++i) {
    const float linear = static_cast<float>(i) / 100000;
    const float exact = linear_to_srgb(std::clamp(linear, 0.0f, 1.0f)) * 255.0f;
    for (const float offset : offsets)
      ASSERT_EQ(code_of(linear, offset), static_cast<int>(std::min(exact + offset, 255.0f)))
          << linear << ' ' << offset;
  }
}

TEST(Srgb, WhatIsNoColourIsClamped) {
  const SrgbQuantizer& code_of = SrgbQuantizer::instance();
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  EXPECT_EQ(code_of(-0.1f), 0);
  EXPECT_EQ(code_of(-kInfinity), 0);
  EXPECT_EQ(code_of(std::numeric_limits<float>::quiet_NaN()), 0);
  EXPECT_EQ(code_of(1.5f), 255);
  EXPECT_EQ(code_of(kInfinity), 255);
}

}  // namespace
}  // namespace polymorph
