#include "model/mesh/gather.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <unordered_map>
#include <vector>

#include "kernels/linear.h"

namespace polymorph {
namespace {

constexpr double kLong = 1.0 / 64;
constexpr std::size_t kManyLong = 16384;

bool has_many_long_triangles(const Model& model, double diagonal) {
  std::size_t count = 0;
  for (const Triangle& t : model.triangles) {
    const Vec3d a(model.points[t.v[0]]), b(model.points[t.v[1]]), c(model.points[t.v[2]]);
    count += std::max({length(b - a), length(c - b), length(a - c)}) > kLong * diagonal;
  }
  return count > kManyLong;
}

Model gathered(const Model& model, double diagonal) {
  const double cell = diagonal / 2048;
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
  Model result;
  result.points = model.points;
  for (std::size_t i = 0; i < all.size();) {
    const std::array<std::uint32_t, 3> c = all[i].corners;
    int times = 0;
    for (; i < all.size() && all[i].corners == c; ++i) times += all[i].times;
    for (int k = 0; k < std::abs(times); ++k)
      result.triangles.push_back(times > 0 ? Triangle{{c[0], c[1], c[2]}}
                                           : Triangle{{c[0], c[2], c[1]}});
  }
  return result;
}

}  // namespace

std::optional<Model> gathered_if_long(const Model& model) {
  if (model.triangles.size() <= kManyLong) return std::nullopt;
  const double diagonal = static_cast<double>(model.box().diagonal());
  if (!has_many_long_triangles(model, diagonal)) return std::nullopt;
  return gathered(model, diagonal);
}

}  // namespace polymorph
