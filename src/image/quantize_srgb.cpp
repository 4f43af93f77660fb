#include "image/quantize_srgb.h"

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstring>
#include <vector>

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

}  // namespace polymorph
