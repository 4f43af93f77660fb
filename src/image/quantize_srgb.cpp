#include "image/quantize_srgb.h"

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstring>
#include <vector>

#include "base/result.h"
#include "image/srgb.h"
#include "kernels/simd_math.h"

namespace polymorph {
namespace {

constexpr std::uint32_t kShift = SrgbQuantizer::kShift, kBucketSize = 1u << kShift;
constexpr float kFirst = SrgbQuantizer::kFirst;
constexpr std::uint32_t kFirstBucket = std::bit_cast<std::uint32_t>(kFirst) >> kShift;

/// Makes a table of one entry per bucket of SrgbQuantizer: the code of its first float in the
/// lowest 8 bits, and above them the number of its floats that have this code.
std::vector<float> make_entries() {
  const SrgbQuantizer& code_of = SrgbQuantizer::instance();
  const std::uint32_t end = (std::bit_cast<std::uint32_t>(1.0f) >> kShift) + 1;
  std::vector<float> entries;
  for (std::uint32_t bucket = kFirstBucket; bucket < end; ++bucket) {
    const std::uint32_t first = bucket << kShift;
    const std::uint32_t code = code_of(std::bit_cast<float>(first));
    const auto next = std::bit_cast<std::uint32_t>(code_of.lowest(code + 1));
    entries.push_back(std::bit_cast<float>(std::min(next - first, kBucketSize) << 8 | code));
  }
  return entries;
}

#if defined(PM_PACKS)
/// Writes the codes of eight values.
void quantize_pack(const float* entries, const float* linear, std::uint8_t* codes) {
  typedef std::uint8_t Bytes __attribute__((vector_size(8)));
  const Pack v = Lanes<Pack>::load(linear);
  const Pack first = broadcast<Pack>(kFirst);
  // Comparisons in this order take NaN for 0.
  const Pack value = select(v >= first, min(v, broadcast<Pack>(1)), first);
  const PackBits bits = float_bits(value);
  const PackBits entry = float_bits(gather(entries, (bits >> kShift) - kFirstBucket));
  const PackBits above = reinterpret_cast<PackBits>((bits & (kBucketSize - 1)) >= entry >> 8) & 1u;
  const Bytes bytes = __builtin_convertvector((entry & 255u) + above, Bytes);
  std::memcpy(codes, &bytes, sizeof bytes);
}

/// Writes the codes of eight values with an offset each. As in SrgbQuantizer, values that the
/// interpolated curve cannot decide are left to the curve itself.
void quantize_pack(const SrgbQuantizer& code_of, const float* linear, const float* offsets,
                   std::uint8_t* codes) {
  typedef std::uint8_t Bytes __attribute__((vector_size(8)));
  constexpr std::uint32_t kBucket = 1u << SrgbQuantizer::kCurveShift;
  constexpr float kError = SrgbQuantizer::kCurveError;
  const Pack value = Lanes<Pack>::load(linear);
  const PackMask is_inside = (value >= SrgbQuantizer::kCurveFirst) & (value < 1.0f);
  const PackBits bits = float_bits(select(is_inside, value, broadcast<Pack>(0.5f)));
  const PackBits bucket = (bits >> SrgbQuantizer::kCurveShift) - SrgbQuantizer::kCurveStart;
  const float* curve = code_of.curve().data();
  const Pack low = gather(curve, bucket), high = gather(curve + 1, bucket);
  const Pack fraction = signed_to_float(bits & (kBucket - 1)) * (1.0f / kBucket);
  const Pack code = low + (high - low) * fraction + Lanes<Pack>::load(offsets);
  const PackMask number = __builtin_convertvector(code, PackMask);  // rounds down
  const Pack fraction_of_code = code - __builtin_convertvector(number, Pack);
  const PackMask is_decided =
      is_inside & (fraction_of_code > kError) & (fraction_of_code < 1 - kError);
  const Bytes bytes = __builtin_convertvector(number < 255 ? number : PackMask{} + 255, Bytes);
  std::memcpy(codes, &bytes, sizeof bytes);
  for (std::uint32_t left = ~Lanes<Pack>::bits(is_decided) & 0xff; left != 0; left &= left - 1) {
    const int l = countr_zero(left);
    codes[l] = code_of(linear[l], offsets[l]);
  }
}
#endif

}  // namespace

void quantize_srgb(std::span<const float> linear, std::uint8_t* codes) {
  std::size_t i = 0;
#if defined(PM_PACKS)
  static const std::vector<float> entries = make_entries();
  for (constexpr std::size_t kCount = Lanes<Pack>::kCount; i + kCount <= linear.size(); i += kCount)
    quantize_pack(entries.data(), &linear[i], codes + i);
#endif
  const SrgbQuantizer& code_of = SrgbQuantizer::instance();
  for (; i < linear.size(); ++i) codes[i] = code_of(linear[i]);
}

void quantize_srgb(std::span<const float> linear, std::span<const float> offsets,
                   std::uint8_t* codes) {
  PM_CHECK(offsets.size() == linear.size());
  const SrgbQuantizer& code_of = SrgbQuantizer::instance();
  std::size_t i = 0;
#if defined(PM_PACKS)
  for (constexpr std::size_t kCount = Lanes<Pack>::kCount; i + kCount <= linear.size(); i += kCount)
    quantize_pack(code_of, &linear[i], &offsets[i], codes + i);
#endif
  for (; i < linear.size(); ++i) codes[i] = code_of(linear[i], offsets[i]);
}

}  // namespace polymorph
