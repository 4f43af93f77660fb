#include "image/quantize_srgb.h"

#include <bit>
#include <cstddef>
#include <cstring>
#include <vector>

#include "image/srgb.h"
#include "kernels/simd_math.h"

namespace polymorph {
namespace {

/// A bucket holds the floats of equal leading bits: 512 per power of two, which is fine enough that
/// the code changes at most once in it.
constexpr std::uint32_t kBucketShift = 14, kBucketSize = 1u << kBucketShift;
constexpr float kFirstValue = 0x1p-13f;  ///< smaller values have code 0
constexpr std::uint32_t kFirstEntry = std::bit_cast<std::uint32_t>(kFirstValue) >> kBucketShift;

/// Makes a table of one entry per bucket: the code of its first float in the lowest 8 bits, and
/// above them the number of its floats that have this code.
std::vector<float> make_entries() {
  const SrgbQuantizer& code_of = SrgbQuantizer::instance();
  const std::uint32_t end = (std::bit_cast<std::uint32_t>(1.0f) >> kBucketShift) + 1;
  std::vector<float> entries;
  for (std::uint32_t bucket = kFirstEntry; bucket < end; ++bucket) {
    const auto code_at = [&](std::uint32_t i) {
      return code_of(std::bit_cast<float>((bucket << kBucketShift) + i));
    };
    const std::uint32_t code = code_at(0);
    // Bisection: float `low` has the code, and float `high` the next one or none.
    std::uint32_t low = 0, high = kBucketSize;
    if (code_at(kBucketSize - 1) == code) low = kBucketSize - 1;
    while (high - low > 1) {
      const std::uint32_t middle = (low + high) / 2;
      (code_at(middle) == code ? low : high) = middle;
    }
    entries.push_back(std::bit_cast<float>(high << 8 | code));
  }
  return entries;
}

#if defined(PM_PACKS)
/// Writes the codes of eight values.
void quantize_pack(const float* entries, const float* linear, std::uint8_t* codes) {
  typedef std::uint8_t Bytes __attribute__((vector_size(8)));
  const Pack v = Lanes<Pack>::load(linear);
  const Pack first = broadcast<Pack>(kFirstValue);
  // Comparisons in this order take NaN for 0.
  const Pack value = select(v >= first, min(v, broadcast<Pack>(1)), first);
  const PackBits bits = float_bits(value);
  const PackBits entry = float_bits(gather(entries, (bits >> kBucketShift) - kFirstEntry));
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
