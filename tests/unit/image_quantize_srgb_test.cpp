#include "image/quantize_srgb.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "base/random.h"
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

TEST(QuantizeSrgb, CodesWithOffsetsAreThoseOfOneValue) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  std::vector<float> values = {
      -1, 0, 1e-30f, -kInfinity, kInfinity, 0.5f, 1, 2, std::numeric_limits<float>::quiet_NaN()};
  for (int i = 0; i <= 100003; ++i) values.push_back(static_cast<float>(i) / 100000);
  std::vector<float> offsets(values.size());
  for (std::size_t i = 0; i < offsets.size(); ++i)
    offsets[i] = random_float(/*seed=*/1, /*stream=*/0, i);
  // At some of these offsets the code is next to a whole number.
  for (std::size_t i = 0; i < offsets.size(); i += 3)
    offsets[i] = 1 - std::fmod(255 * linear_to_srgb(std::min(values[i], 1.0f)), 1.0f);
  for (float& offset : offsets)
    if (!(offset >= 0 && offset < 1)) offset = 0;
  std::vector<std::uint8_t> codes(values.size());
  quantize_srgb(values, offsets, codes.data());
  for (std::size_t i = 0; i < values.size(); ++i)
    ASSERT_EQ(codes[i], SrgbQuantizer::instance()(values[i], offsets[i])) << values[i];
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
