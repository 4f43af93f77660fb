#include "image/blue_noise.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "base/exact_math.h"
#include "base/random.h"

namespace polymorph {
namespace {

constexpr int kSize = kBlueNoiseSize;
constexpr std::size_t kCount = std::size_t{kSize} * kSize;

/// A set of pixels on a torus and, at each pixel, how crowded it is there.
struct Pattern {
  std::vector<char> set = std::vector<char>(kCount);
  std::vector<float> energy = std::vector<float>(kCount);

  void flip(std::size_t at) {
    // Ulichney's sigma of 1.5 pixels; beyond 6 pixels the weight is below 4e-4.
    constexpr int kReach = 6;
    static const std::vector<float> weights = [] {
      std::vector<float> all;
      for (int square = 0; square <= 2 * kReach * kReach; ++square)
        all.push_back(static_cast<float>(exact::exp(-square / 4.5)));
      return all;
    }();
    const float sign = set[at] ? -1.0f : 1.0f;
    set[at] = !set[at];
    const int x = static_cast<int>(at) % kSize, y = static_cast<int>(at) / kSize;
    for (int dy = -kReach; dy <= kReach; ++dy)
      for (int dx = -kReach; dx <= kReach; ++dx) {
        const auto u = static_cast<std::size_t>((x + dx + kSize) % kSize);
        const auto v = static_cast<std::size_t>((y + dy + kSize) % kSize);
        energy[u + v * kSize] += sign * weights[static_cast<std::size_t>(dx * dx + dy * dy)];
      }
  }
  std::size_t tightest_cluster() const { return extreme(1); }
  std::size_t largest_void() const { return extreme(0); }

 private:
  std::size_t extreme(char member) const {
    std::size_t best = kCount;
    for (std::size_t i = 0; i < kCount; ++i) {
      if (set[i] != member) continue;
      if (best == kCount || (member ? energy[i] > energy[best] : energy[i] < energy[best]))
        best = i;
    }
    return best;
  }
};

Pattern initial_pattern() {
  Pattern pattern;
  for (std::size_t n = 0; n < kCount / 10; ++n) {
    const std::size_t at = random_below(kCount, 1, 0, n);
    pattern.flip(pattern.set[at] ? pattern.largest_void() : at);
  }
  // Moves the most crowded pixel into the largest void until it would come back to where it was.
  for (std::size_t step = 0; step < kCount; ++step) {
    const std::size_t from = pattern.tightest_cluster();
    pattern.flip(from);
    const std::size_t to = pattern.largest_void();
    pattern.flip(to);
    if (to == from) break;
  }
  return pattern;
}

std::vector<std::uint16_t> compute_ranks() {
  std::vector<std::uint16_t> ranks(kCount);
  const Pattern start = initial_pattern();
  const auto members = static_cast<std::size_t>(std::count(start.set.begin(), start.set.end(), 1));
  Pattern shrinking = start;
  for (std::size_t rank = members; rank-- > 0;) {
    const std::size_t at = shrinking.tightest_cluster();
    ranks[at] = static_cast<std::uint16_t>(rank);
    shrinking.flip(at);
  }
  Pattern growing = start;
  for (std::size_t rank = members; rank < kCount; ++rank) {
    const std::size_t at = growing.largest_void();
    ranks[at] = static_cast<std::uint16_t>(rank);
    growing.flip(at);
  }
  return ranks;
}

}  // namespace

const std::vector<std::uint16_t>& blue_noise_ranks() {
  static const std::vector<std::uint16_t> ranks = compute_ranks();
  return ranks;
}

}  // namespace polymorph
