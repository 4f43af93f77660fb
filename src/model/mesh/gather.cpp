#include "model/mesh/gather.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <numeric>
#include <unordered_map>
#include <vector>

#include "kernels/linear.h"

namespace polymorph {
namespace {

constexpr double kLong = 1.0 / 64;
constexpr std::size_t kManyLong = 16384, kFewStrewn = 2048, kFewNested = 1024;
constexpr double kFineCells = 2048, kCoarseCells = 256;  // along the diagonal

bool is_long(const Model& model, const Triangle& t, double diagonal) {
  const Vec3d a(model.points[t.v[0]]), b(model.points[t.v[1]]), c(model.points[t.v[2]]);
  return std::max({length(b - a), length(c - b), length(a - c)}) > kLong * diagonal;
}

std::size_t count_long(const Model& model, double diagonal) {
  return static_cast<std::size_t>(
      std::count_if(model.triangles.begin(), model.triangles.end(),
                    [&](const Triangle& t) { return is_long(model, t, diagonal); }));
}

Gathered gathered(const Model& model, double cell) {
  const Vec3d low(model.box().low);
  std::unordered_map<std::uint64_t, std::uint32_t> first_in;
  std::vector<std::uint32_t> stands_for(model.points.size());
  for (std::uint32_t i = 0; i < stands_for.size(); ++i) {
    const Vec3d at = (Vec3d(model.points[i]) - low) * (1 / cell);
    const std::uint64_t key = static_cast<std::uint64_t>(at.x) << 40 |
                              static_cast<std::uint64_t>(at.y) << 20 |
                              static_cast<std::uint64_t>(at.z);
    stands_for[i] = first_in.try_emplace(key, i).first->second;
  }
  struct Turned {
    std::array<std::uint32_t, 3> corners;  // ascending
    int times = 1;                         // as a triangle of them; less those of its reverse
  };
  std::vector<Turned> all;
  for (const Triangle& t : model.triangles) {
    std::array<std::uint32_t, 3> c{stands_for[t.v[0]], stands_for[t.v[1]], stands_for[t.v[2]]};
    if (c[0] == c[1] || c[1] == c[2] || c[2] == c[0]) continue;
    std::rotate(c.begin(), std::min_element(c.begin(), c.end()), c.end());
    const bool reverse = c[1] > c[2];
    if (reverse) std::swap(c[1], c[2]);
    all.push_back({c, reverse ? -1 : 1});
  }
  std::sort(all.begin(), all.end(),
            [](const Turned& a, const Turned& b) { return a.corners < b.corners; });
  Gathered result;
  result.model.points = model.points;
  for (std::size_t i = 0; i < all.size();) {
    const std::array<std::uint32_t, 3> c = all[i].corners;
    int times = 0;
    for (; i < all.size() && all[i].corners == c; ++i) times += all[i].times;
    if (times == 0) continue;
    result.model.triangles.push_back(times > 0 ? Triangle{{c[0], c[1], c[2]}}
                                               : Triangle{{c[0], c[2], c[1]}});
    result.times.push_back(std::abs(times));
  }
  return result;
}

/// Every n-th of the long triangles, n times, so that they are few.
void thin_out(Gathered& gathered, std::size_t count, double diagonal) {
  const std::size_t n = (count + kFewStrewn - 1) / kFewStrewn;
  Gathered kept;
  std::size_t seen = 0;
  for (std::size_t i = 0; i < gathered.times.size(); ++i) {
    const Triangle& t = gathered.model.triangles[i];
    const bool long_one = is_long(gathered.model, t, diagonal);
    if (long_one && seen++ % n != 0) continue;
    kept.model.triangles.push_back(t);
    kept.times.push_back(gathered.times[i] * (long_one ? static_cast<int>(n) : 1));
  }
  gathered.model.triangles = std::move(kept.model.triangles);
  gathered.times = std::move(kept.times);
  gathered.thinned = true;
}

}  // namespace

std::size_t count_long_triangles(const Model& model) {
  return count_long(model, static_cast<double>(model.box().diagonal()));
}

bool has_many_long_triangles(std::size_t count) { return count > kManyLong; }

std::optional<Gathered> gathered_if_long(const Model& model) {
  if (model.triangles.size() <= kManyLong) return std::nullopt;
  const double diagonal = static_cast<double>(model.box().diagonal());
  if (count_long(model, diagonal) <= kManyLong) return std::nullopt;
  for (double cells = kFineCells;; cells /= 2) {
    Gathered result = gathered(model, diagonal / cells);
    if (result.model.triangles.empty())
      result = {model, std::vector<int>(model.triangles.size(), 1),
                false};  // walls thinner than a cell
    const std::size_t count = count_long(result.model, diagonal);
    // Of shells within each other, how many there are says more than where exactly each is.
    const long long times = std::accumulate(result.times.begin(), result.times.end(), 0LL);
    const bool nested = times > 4 * static_cast<long long>(result.times.size());
    if (count > (nested ? kFewNested : kManyLong) && cells > kCoarseCells) continue;
    if (count > kManyLong) thin_out(result, count, diagonal);
    result.model.name = model.name;
    return result;
  }
}

}  // namespace polymorph
