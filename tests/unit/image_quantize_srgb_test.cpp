#include "image/quantize_srgb.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "image/srgb.h"

namespace polymorph {
namespace {

void expect_codes_of_the_quantizer(const std::vector<float>& values) {
  std::vector<std::uint8_t> codes(values.size());
  quantize_srgb(values, codes.data());
  for (std::size_t i = 0; i < values.size(); ++i)
    ASSERT_EQ(codes[i], SrgbQuantizer::instance()(values[i])) << values[i];
}

TEST(QuantizeSrgb, CodesAreThoseOfOneValue) {
  std::vector<float> values;
  for (int i = -100; i <= 100100; ++i) values.push_back(static_cast<float>(i) / 100000);
  expect_codes_of_the_quantizer(values);
}

TEST(QuantizeSrgb, CodesChangeAtTheSameFloats) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  const SrgbQuantizer& code_of = SrgbQuantizer::instance();
  std::vector<float> values;
  for (int code = 1; code < 256; ++code) {
    float below = 0, above = 1;  // bisection of the first float with the code
    for (float middle; middle = 0.5f * (below + above), middle > below && middle < above;)
      (code_of(middle) < code ? below : above) = middle;
    for (const float v :
         {below, above, std::nextafter(below, 0.0f), std::nextafter(above, kInfinity)})
      values.push_back(v);
  }
  expect_codes_of_the_quantizer(values);
}

TEST(QuantizeSrgb, WhatIsNoColourIsClamped) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  // Thirteen values: a pack of eight, and five behind it.
  expect_codes_of_the_quantizer({-1, 0, 1e-30f, -kInfinity, kInfinity, 2, 1,
                                 std::numeric_limits<float>::quiet_NaN(), 0.5f, -kInfinity,
                                 kInfinity, 3, std::numeric_limits<float>::quiet_NaN()});
}

}  // namespace
}  // namespace polymorph
