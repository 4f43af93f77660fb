#include "spheres/medial.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <queue>

#include "base/parallel.h"
#include "kernels/simd_math.h"

namespace polymorph {
namespace {

/// Selects `count` of the samples at equal steps of the list, which is in Morton order.
std::vector<BoundarySample> select_evenly(const std::vector<BoundarySample>& samples,
                                          std::size_t count) {
  if (samples.size() <= count) return samples;
  std::vector<BoundarySample> selection(count);
  for (std::size_t i = 0; i < count; ++i) selection[i] = samples[i * samples.size() / count];
  return selection;
}

/// Samples that each candidate ball covers, one bit per sample.
struct Coverage {
  std::size_t words = 0;
  std::vector<std::uint64_t> bits;
  const std::uint64_t* row(std::size_t candidate) const { return bits.data() + candidate * words; }
};

/// Computes the samples that each candidate covers when its radius is enlarged by `dilation`.
Coverage compute_coverage(const std::vector<BoundarySample>& samples,
                          const std::vector<Sphere>& candidates, float dilation) {
  Coverage coverage{(samples.size() + 63) / 64, {}};
  coverage.bits.assign(candidates.size() * coverage.words, 0);
  // Coordinates by axis, as many as there are bits; bits beyond the samples stay 0.
  constexpr float kNowhere = std::numeric_limits<float>::infinity();
  std::vector<float> x(64 * coverage.words, kNowhere), y = x, z = x;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    x[i] = samples[i].point.x;
    y[i] = samples[i].point.y;
    z[i] = samples[i].point.z;
  }
  parallel_for(
      static_cast<std::int64_t>(candidates.size()),
      [&](std::int64_t k) {
        const auto c = static_cast<std::size_t>(k);
        const float radius = candidates[c].radius + dilation, radius2 = radius * radius;
        std::uint64_t* row = coverage.bits.data() + c * coverage.words;
        const Vec3 center = candidates[c].center;
        constexpr std::size_t kCount = Lanes<Pack>::kCount;  // divides 64
        for (std::size_t i = 0; i < x.size(); i += kCount) {
          const Pack dx = Lanes<Pack>::load(&x[i]) - center.x,
                     dy = Lanes<Pack>::load(&y[i]) - center.y,
                     dz = Lanes<Pack>::load(&z[i]) - center.z;
          const std::uint64_t covered = Lanes<Pack>::bits(dx * dx + dy * dy + dz * dz <= radius2);
          row[i / 64] |= covered << (i % 64);
        }
      },
      /*grain=*/16);
  return coverage;
}

/// Chooses candidates by the number of samples that they newly cover, until all samples are covered
/// or `max_count` are chosen.
std::vector<std::size_t> greedy_cover(const Coverage& coverage, std::size_t candidate_count,
                                      std::size_t sample_count, std::size_t max_count) {
  std::vector<std::uint64_t> uncovered_bits(coverage.words, ~0ull);
  if (sample_count % 64) uncovered_bits.back() = (1ull << (sample_count % 64)) - 1;
  const auto compute_gain = [&](std::size_t c) {
    std::size_t gain = 0;
    const std::uint64_t* row = coverage.row(c);
    for (std::size_t w = 0; w < coverage.words; ++w)
      gain += static_cast<std::size_t>(std::popcount(row[w] & uncovered_bits[w]));
    return gain;
  };
  // Gains only decrease, so an old gain is an upper bound and only the top entry must be updated
  // (lazy greedy; Minoux 1978).
  struct Entry {
    std::size_t gain, candidate;
    bool operator<(const Entry& o) const {
      return gain != o.gain ? gain < o.gain : candidate > o.candidate;
    }
  };
  std::priority_queue<Entry> queue;
  for (std::size_t c = 0; c < candidate_count; ++c) queue.push({compute_gain(c), c});
  std::vector<std::size_t> chosen;
  while (chosen.size() < max_count && !queue.empty()) {
    Entry top = queue.top();
    queue.pop();
    if (top.gain == 0) break;  // all samples are covered
    const std::size_t gain = compute_gain(top.candidate);
    if (gain < top.gain) {
      queue.push({gain, top.candidate});
      continue;
    }
    chosen.push_back(top.candidate);
    const std::uint64_t* row = coverage.row(top.candidate);
    for (std::size_t w = 0; w < coverage.words; ++w) uncovered_bits[w] &= ~row[w];
  }
  return chosen;
}

}  // namespace

std::vector<Sphere> make_medial_cover(const std::vector<BoundarySample>& all_samples,
                                      std::size_t count) {
  constexpr int kBisectionSteps = 8;  // of the logarithm of the dilation
  if (all_samples.empty() || count == 0) return {};
  const std::vector<BoundarySample> samples =
      select_evenly(all_samples, std::clamp<std::size_t>(12 * count, 3000, 12000));
  std::vector<Sphere> candidates;  // one per sample
  float largest = 0;
  for (const BoundarySample& s : samples) {
    candidates.push_back({s.point - s.normal * s.inner_radius, s.inner_radius});
    largest = std::max(largest, s.inner_radius);
  }
  // Finds the largest dilation for which `count` balls do not suffice. The last balls of its cover,
  // which cover the fewest samples, are dropped, so that exactly `count` remain.
  float low = 1e-4f * largest, high = largest;
  std::vector<std::size_t> best = greedy_cover(compute_coverage(samples, candidates, low),
                                               candidates.size(), samples.size(), count + 1);
  for (int step = 0; step < kBisectionSteps && best.size() > count; ++step) {
    const float dilation = std::sqrt(low * high);
    auto chosen = greedy_cover(compute_coverage(samples, candidates, dilation), candidates.size(),
                               samples.size(), count + 1);
    if (chosen.size() > count) {
      low = dilation;
      best = std::move(chosen);
    } else {
      high = dilation;
    }
  }
  best.resize(std::min(best.size(), count));
  std::vector<Sphere> spheres;
  for (const std::size_t c : best) spheres.push_back(candidates[c]);
  return spheres;
}

SphereTree build_medial_tree(const std::vector<BoundarySample>& samples, std::size_t count) {
  std::vector<std::size_t> counts{count};  // balls per level
  while (counts.back() > 8) counts.push_back(counts.back() / 8);
  std::reverse(counts.begin(), counts.end());
  SphereTree tree;
  std::size_t parents_begin = 0, parents_end = 0;
  for (std::size_t level = 0; level < counts.size(); ++level) {
    const bool finest = level + 1 == counts.size();
    for (const Sphere& sphere : make_medial_cover(samples, counts[level])) {
      SphereNode node{sphere, /*parent=*/-1, static_cast<std::int16_t>(level), finest};
      float smallest = std::numeric_limits<float>::infinity();
      for (std::size_t p = parents_begin; p < parents_end; ++p) {
        const Sphere& parent = tree.nodes[p].sphere;
        const float signed_distance = length(parent.center - sphere.center) - parent.radius;
        if (signed_distance < smallest)
          smallest = signed_distance, node.parent = static_cast<std::int32_t>(p);
      }
      tree.nodes.push_back(node);
    }
    parents_begin = parents_end;
    parents_end = tree.nodes.size();
  }
  return tree;
}

}  // namespace polymorph
