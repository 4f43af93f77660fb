#include "image/blue_noise.h"

#include <algorithm>
#include <cstddef>

#include "base/exact_math.h"
#include "base/random.h"

namespace polymorph {
namespace {

constexpr int kSize = kBlueNoiseSize;
constexpr std::size_t kCount = std::size_t{kSize} * kSize;

/// A set of pixels on a torus, and the density of the set around each pixel.
struct Pattern {
  std::vector<char> set = std::vector<char>(kCount);       ///< 1: the pixel is a member
  std::vector<float> energy = std::vector<float>(kCount);  ///< sum of Gaussians at the members

  /// Adds a pixel to the set, or removes it if it is a member, and updates the energies around it.
  void flip(std::size_t pixel) {
    // exp(-distance^2 / (2 sigma^2)) by squared distance, with Ulichney's sigma of 1.5 pixels.
    // Beyond 6 pixels the weight is below 4e-4.
    constexpr int kRadius = 6;
    static const std::vector<float> weights = [] {
      std::vector<float> table;
      for (int distance2 = 0; distance2 <= 2 * kRadius * kRadius; ++distance2)
        table.push_back(static_cast<float>(exact::exp(-distance2 / 4.5)));
      return table;
    }();
    const float sign = set[pixel] ? -1.0f : 1.0f;
    set[pixel] = !set[pixel];
    const int x = static_cast<int>(pixel) % kSize, y = static_cast<int>(pixel) / kSize;
    for (int dy = -kRadius; dy <= kRadius; ++dy)
      for (int dx = -kRadius; dx <= kRadius; ++dx) {
        const auto u = static_cast<std::size_t>((x + dx + kSize) % kSize);
        const auto v = static_cast<std::size_t>((y + dy + kSize) % kSize);
        energy[u + v * kSize] += sign * weights[static_cast<std::size_t>(dx * dx + dy * dy)];
      }
  }
  std::size_t find_tightest_cluster() const { return find_extreme(1); }
  std::size_t find_largest_void() const { return find_extreme(0); }

 private:
  /// Finds the member of largest energy (`member` is 1), or the non-member of smallest energy (0).
  std::size_t find_extreme(char member) const {
    std::size_t best = kCount;
    for (std::size_t i = 0; i < kCount; ++i) {
      if (set[i] != member) continue;
      if (best == kCount || (member ? energy[i] > energy[best] : energy[i] < energy[best]))
        best = i;
    }
    return best;
  }
};

/// Makes a set of a tenth of all pixels that are evenly distributed.
Pattern make_initial_pattern() {
  Pattern pattern;
  for (std::size_t n = 0; n < kCount / 10; ++n) {
    const std::size_t pixel = random_below(kCount, /*seed=*/1, /*stream=*/0, n);
    // A pixel that is drawn twice is replaced.
    pattern.flip(pattern.set[pixel] ? pattern.find_largest_void() : pixel);
  }
  // Move the pixel of the tightest cluster into the largest void, until that void is where the
  // pixel was.
  for (std::size_t step = 0; step < kCount; ++step) {
    const std::size_t from = pattern.find_tightest_cluster();
    pattern.flip(from);
    const std::size_t to = pattern.find_largest_void();
    pattern.flip(to);
    if (to == from) break;
  }
  return pattern;
}

/// Ranks the members of the initial set by removing the tightest clusters, which get the highest
/// ranks, and all other pixels by filling the largest voids.
std::vector<std::uint16_t> compute_ranks() {
  std::vector<std::uint16_t> ranks(kCount);
  const Pattern start = make_initial_pattern();
  const auto members = static_cast<std::size_t>(std::count(start.set.begin(), start.set.end(), 1));
  Pattern shrinking = start;
  for (std::size_t rank = members; rank-- > 0;) {
    const std::size_t pixel = shrinking.find_tightest_cluster();
    ranks[pixel] = static_cast<std::uint16_t>(rank);
    shrinking.flip(pixel);
  }
  Pattern growing = start;
  for (std::size_t rank = members; rank < kCount; ++rank) {
    const std::size_t pixel = growing.find_largest_void();
    ranks[pixel] = static_cast<std::uint16_t>(rank);
    growing.flip(pixel);
  }
  return ranks;
}

}  // namespace

const std::vector<std::uint16_t>& blue_noise_ranks() {
  static const std::vector<std::uint16_t> ranks = compute_ranks();
  return ranks;
}

}  // namespace polymorph
