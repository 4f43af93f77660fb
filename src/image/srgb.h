// sRGB transfer function (IEC 61966-2-1): encoding, decoding, and fast exact rounding to 8 bits.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace polymorph {

/// Converts between encoded and linear values. Both curves continue beyond [0, 1]: the linear
/// section below, the power section above.
float srgb_to_linear(float encoded);
float linear_to_srgb(float linear);

/// Computes round(255 linear_to_srgb(v)) without a pow per pixel: a table over the leading bits of
/// `v` gives the code or the one below it, and a comparison decides. NaN and negative values give
/// 0, values above 1 give 255.
class SrgbQuantizer {
 public:
  static const SrgbQuantizer& instance();
  std::uint8_t operator()(float linear) const {
    // There are no branches, because mispredictions would take most of the time.
    const float value = linear >= kFirst ? (linear < 1.0f ? linear : 1.0f) : kFirst;
    constexpr std::uint32_t kFirstBucket = std::bit_cast<std::uint32_t>(kFirst) >> kShift;
    const std::uint8_t code =
        start_[(std::bit_cast<std::uint32_t>(value) >> kShift) - kFirstBucket];
    return static_cast<std::uint8_t>(code + (value >= lowest_[code + std::size_t{1}]));
  }
  /// Computes floor(min(255 linear_to_srgb(v) + offset, 255)), `v` clamped to [0, 1], for an
  /// `offset` in [0, 1); a random offset rounds randomly. A pow is rarely needed.
  std::uint8_t operator()(float linear, float offset) const;

  /// A bucket holds the floats of equal leading bits. The code changes at most once per bucket: the
  /// relative width of a bucket is 1/512, that of a code at least 1/110.
  static constexpr std::uint32_t kShift = 14;
  static constexpr float kFirst = 0x1p-13f;  ///< start of the table; smaller values have code 0
  /// Returns the smallest linear value of a code; infinity for 256.
  float lowest(std::size_t code) const { return lowest_[code]; }

  // Buckets of curve(), with a relative width of 1/128. Within one the curve is linear to 5e-4 of a
  // code; kCurveError is the tolerance.
  static constexpr std::uint32_t kCurveShift = 16;
  static constexpr float kCurveFirst = 0x1p-8f, kCurveError = 1e-3f;
  static constexpr std::uint32_t kCurveStart =
      std::bit_cast<std::uint32_t>(kCurveFirst) >> kCurveShift;
  /// Returns 255 linear_to_srgb() at the beginnings of the buckets of [kCurveFirst, 1], and at 1.
  const std::vector<float>& curve() const { return curve_; }

 private:
  SrgbQuantizer();
  std::array<float, 257> lowest_;    ///< the smallest linear value of each code; infinity after 255
  std::vector<std::uint8_t> start_;  ///< code of the smallest value of each bucket
  std::vector<float> curve_;
};

/// Tables of srgb_to_linear(i / 255) and srgb_to_linear(i / 65535).
const std::vector<float>& srgb_decode_table8();
const std::vector<float>& srgb_decode_table16();

}  // namespace polymorph
