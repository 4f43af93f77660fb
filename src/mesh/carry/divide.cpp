#include "mesh/carry/divide.h"

#include <algorithm>
#include <optional>
#include <unordered_map>

#include "mesh/edges.h"

namespace polymorph {
namespace {

std::uint64_t edge_key(std::uint32_t a, std::uint32_t b) {
  return std::uint64_t{std::min(a, b)} << 32 | std::max(a, b);
}

/// Index k of the longest side (from corner k to corner k + 1 mod 3). Of equally long ones, that of
/// the lowest key, so that both triangles at an edge agree.
int find_longest_side(std::span<const Vec3> points, const Triangle& t) {
  int best = 0;
  float max_length = -1;
  for (int k = 0; k < 3; ++k) {
    const std::uint32_t a = t.v[k], b = t.v[(k + 1) % 3];
    const float d = length(points[std::min(a, b)] - points[std::max(a, b)]);
    if (d > max_length ||
        (d == max_length && edge_key(a, b) < edge_key(t.v[best], t.v[(best + 1) % 3])))
      max_length = d, best = k;
  }
  return best;
}

}  // namespace

Division halve_triangles(std::span<const Vec3> points, std::span<const Triangle> triangles,
                         std::span<const std::uint32_t> chosen) {
  Division division;
  const std::vector<Triangle> neighbours = find_neighbours(triangles);
  std::unordered_map<std::uint64_t, std::uint32_t> middles;  // index of the midpoint per edge key
  std::vector<std::uint32_t> queue(chosen.begin(), chosen.end());
  for (std::size_t q = 0; q < queue.size(); ++q) {
    const Triangle& t = triangles[queue[q]];
    const int k = find_longest_side(points, t);
    const std::uint32_t a = t.v[k], b = t.v[(k + 1) % 3];
    const auto new_point = static_cast<std::uint32_t>(points.size() + division.halved.size());
    if (!middles.try_emplace(edge_key(a, b), new_point).second) continue;
    division.halved.push_back({a, b});
    queue.push_back(neighbours[queue[q]].v[k]);
  }
  const auto find_middle = [&](std::uint32_t a, std::uint32_t b) -> std::optional<std::uint32_t> {
    const auto entry = middles.find(edge_key(a, b));
    if (entry == middles.end()) return std::nullopt;
    return entry->second;
  };
  std::vector<Triangle>& result = division.triangles;
  for (const Triangle& t : triangles) {
    const int k = find_longest_side(points, t);
    const std::uint32_t a = t.v[k], b = t.v[(k + 1) % 3], c = t.v[(k + 2) % 3];
    const auto m = find_middle(a, b);
    if (!m) {  // no other side is halved without the longest one
      result.push_back(t);
      continue;
    }
    // Split at the longest edge, then split both halves at their other edges.
    for (const auto& [p, q] : {std::array{b, c}, std::array{c, a}}) {
      if (const auto n = find_middle(p, q)) {
        result.push_back({{*m, p, *n}});
        result.push_back({{*m, *n, q}});
      } else {
        result.push_back({{*m, p, q}});
      }
    }
  }
  return division;
}

}  // namespace polymorph
