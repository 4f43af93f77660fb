#include "image/srgb.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <limits>

#include "base/exact_math.h"

namespace polymorph {
namespace {

double decode(double encoded) {
  return encoded <= 0.04045 ? encoded / 12.92 : exact::pow((encoded + 0.055) / 1.055, 2.4);
}

}  // namespace

float srgb_to_linear(float encoded) { return static_cast<float>(decode(encoded)); }

float linear_to_srgb(float linear) {
  if (!(linear > 0.0031308f)) return 12.92f * linear;
  return static_cast<float>(1.055 * exact::pow(static_cast<double>(linear), 1 / 2.4) - 0.055);
}

SrgbQuantizer::SrgbQuantizer() {
  constexpr std::uint32_t kFirstBucket = std::bit_cast<std::uint32_t>(kFirst) >> kShift;
  start_.resize((std::bit_cast<std::uint32_t>(1.0f) >> kShift) - kFirstBucket + 1);
  lowest_[0] = -std::numeric_limits<float>::infinity();
  for (std::size_t k = 1; k < 256; ++k) {
    // The smallest float that is not below the edge between two codes.
    const double edge = decode((static_cast<double>(k) - 0.5) / 255);
    lowest_[k] = static_cast<float>(edge);
    if (static_cast<double>(lowest_[k]) < edge)
      lowest_[k] = std::nextafter(lowest_[k], std::numeric_limits<float>::infinity());
  }
  lowest_[256] = std::numeric_limits<float>::infinity();
  std::uint8_t code = 0;
  for (std::uint32_t i = 0; i < start_.size(); ++i) {
    const auto value = std::bit_cast<float>((kFirstBucket + i) << kShift);
    while (value >= lowest_[code + std::size_t{1}]) ++code;
    start_[i] = code;
  }
  constexpr std::uint32_t kCurveEnd = std::bit_cast<std::uint32_t>(1.0f) >> kCurveShift;
  for (std::uint32_t i = kCurveStart; i <= kCurveEnd; ++i)
    curve_.push_back(255 * linear_to_srgb(std::bit_cast<float>(i << kCurveShift)));
}

const SrgbQuantizer& SrgbQuantizer::instance() {
  static const SrgbQuantizer quantizer;
  return quantizer;
}

std::uint8_t SrgbQuantizer::operator()(float linear, float offset) const {
  const float value = linear > 0 ? std::min(linear, 1.0f) : 0.0f;
  if (value >= kCurveFirst && value < 1) {
    const auto bits = std::bit_cast<std::uint32_t>(value);
    const std::uint32_t bucket = (bits >> kCurveShift) - kCurveStart;
    constexpr std::uint32_t kFractionMask = (1u << kCurveShift) - 1;
    const float fraction =
        static_cast<float>(bits & kFractionMask) / static_cast<float>(kFractionMask + 1);
    const float code = curve_[bucket] + (curve_[bucket + 1] - curve_[bucket]) * fraction + offset;
    const float whole_code = std::floor(code);
    // Closer to a whole number, interpolation cannot decide, and the curve itself is evaluated.
    if (code - whole_code > kCurveError && code - whole_code < 1 - kCurveError)
      return static_cast<std::uint8_t>(std::min(whole_code, 255.0f));
  }
  return static_cast<std::uint8_t>(std::min(linear_to_srgb(value) * 255.0f + offset, 255.0f));
}

namespace {

std::vector<float> decode_table(std::size_t count) {
  std::vector<float> values(count);
  for (std::size_t i = 0; i < count; ++i)
    values[i] = static_cast<float>(decode(static_cast<double>(i) / static_cast<double>(count - 1)));
  return values;
}

}  // namespace

const std::vector<float>& srgb_decode_table8() {
  static const std::vector<float> table = decode_table(256);
  return table;
}

const std::vector<float>& srgb_decode_table16() {
  static const std::vector<float> table = decode_table(65536);
  return table;
}

}  // namespace polymorph
