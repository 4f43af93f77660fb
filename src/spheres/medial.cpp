#include "spheres/medial.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <queue>

#include "base/parallel.h"

namespace polymorph {
namespace {

std::vector<BoundarySample> every_nth(const std::vector<BoundarySample>& samples,
                                      std::size_t count) {
  if (samples.size() <= count) return samples;
  std::vector<BoundarySample> some(count);
  for (std::size_t i = 0; i < count; ++i) some[i] = samples[i * samples.size() / count];
  return some;
}

/// Which samples each candidate ball holds, one bit per sample.
struct Holds {
  std::size_t words = 0;
  std::vector<std::uint64_t> bits;
  const std::uint64_t* of(std::size_t candidate) const { return bits.data() + candidate * words; }
};

Holds holds_at(const std::vector<BoundarySample>& samples, const std::vector<Sphere>& candidates,
               float dilation) {
  Holds holds{(samples.size() + 63) / 64, {}};
  holds.bits.assign(candidates.size() * holds.words, 0);
  parallel_for(
      static_cast<std::int64_t>(candidates.size()),
      [&](std::int64_t k) {
        const auto c = static_cast<std::size_t>(k);
        const float reach = candidates[c].radius + dilation, reach2 = reach * reach;
        std::uint64_t* row = holds.bits.data() + c * holds.words;
        for (std::size_t i = 0; i < samples.size(); ++i) {
          const Vec3 d = samples[i].point - candidates[c].center;
          row[i / 64] |= static_cast<std::uint64_t>(dot(d, d) <= reach2) << (i % 64);
        }
      },
      16);
  return holds;
}

/// Candidates in the order in which they add most, until all samples are held or `max_count` are
/// chosen.
std::vector<std::size_t> greedy_cover(const Holds& holds, std::size_t candidates,
                                      std::size_t sample_count, std::size_t max_count) {
  std::vector<std::uint64_t> open(holds.words, ~0ull);
  if (sample_count % 64) open.back() = (1ull << (sample_count % 64)) - 1;
  const auto gain_of = [&](std::size_t c) {
    std::size_t gain = 0;
    const std::uint64_t* row = holds.of(c);
    for (std::size_t w = 0; w < holds.words; ++w)
      gain += static_cast<std::size_t>(std::popcount(row[w] & open[w]));
    return gain;
  };
  // A gain only falls while others are chosen, so an old one is an upper bound: look again only at
  // the top (lazy greedy; Minoux 1978).
  struct Entry {
    std::size_t gain, candidate;
    bool operator<(const Entry& o) const {
      return gain != o.gain ? gain < o.gain : candidate > o.candidate;
    }
  };
  std::priority_queue<Entry> queue;
  for (std::size_t c = 0; c < candidates; ++c) queue.push({gain_of(c), c});
  std::vector<std::size_t> chosen;
  while (chosen.size() < max_count && !queue.empty()) {
    Entry top = queue.top();
    queue.pop();
    if (top.gain == 0) break;
    const std::size_t gain = gain_of(top.candidate);
    if (gain < top.gain) {
      queue.push({gain, top.candidate});
      continue;
    }
    chosen.push_back(top.candidate);
    const std::uint64_t* row = holds.of(top.candidate);
    for (std::size_t w = 0; w < holds.words; ++w) open[w] &= ~row[w];
  }
  return chosen;
}

}  // namespace

std::vector<Sphere> medial_cover(const std::vector<BoundarySample>& all, std::size_t count) {
  if (all.empty() || count == 0) return {};
  const std::vector<BoundarySample> samples =
      every_nth(all, std::clamp<std::size_t>(12 * count, 3000, 12000));
  std::vector<Sphere> candidates;
  float largest = 0;
  for (const BoundarySample& s : samples) {
    candidates.push_back({s.point - s.normal * s.inner_radius, s.inner_radius});
    largest = std::max(largest, s.inner_radius);
  }
  // The dilation at which `count` balls are just not enough: the last balls of that cover, which
  // hold the fewest samples, are left out. So there are exactly `count`.
  float low = 1e-4f * largest, high = largest;
  std::vector<std::size_t> best =
      greedy_cover(holds_at(samples, candidates, low), samples.size(), samples.size(), count + 1);
  for (int step = 0; step < 8 && best.size() > count; ++step) {
    const float dilation = std::sqrt(low * high);
    auto chosen = greedy_cover(holds_at(samples, candidates, dilation), samples.size(),
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

SphereTree medial_tree(const std::vector<BoundarySample>& samples, std::size_t count) {
  std::vector<std::size_t> budgets{count};
  while (budgets.back() > 8) budgets.push_back(budgets.back() / 8);
  std::reverse(budgets.begin(), budgets.end());
  SphereTree tree;
  std::size_t parents_begin = 0, parents_end = 0;
  for (std::size_t level = 0; level < budgets.size(); ++level) {
    const bool finest = level + 1 == budgets.size();
    for (const Sphere& sphere : medial_cover(samples, budgets[level])) {
      SphereNode node{sphere, -1, static_cast<std::int16_t>(level), finest};
      float deepest = std::numeric_limits<float>::infinity();
      for (std::size_t p = parents_begin; p < parents_end; ++p) {
        const Sphere& parent = tree.nodes[p].sphere;
        const float depth = length(parent.center - sphere.center) - parent.radius;
        if (depth < deepest) deepest = depth, node.parent = static_cast<std::int32_t>(p);
      }
      tree.nodes.push_back(node);
    }
    parents_begin = parents_end;
    parents_end = tree.nodes.size();
  }
  return tree;
}

}  // namespace polymorph
