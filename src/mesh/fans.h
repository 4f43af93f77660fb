// Triangle fans: the triangles around each point of a mesh.
#pragma once

#include <cstdint>
#include <numeric>
#include <span>
#include <vector>

#include "kernels/types.h"

namespace polymorph {

/// Lists the triangles around each point, ascending.
class Fans {
 public:
  Fans() = default;
  Fans(std::size_t points, std::span<const Triangle> triangles) : first_(points + 1, 0) {
    for (const Triangle& t : triangles)
      for (const std::uint32_t v : t.v) ++first_[v + 1];
    std::partial_sum(first_.begin(), first_.end(), first_.begin());
    triangles_.resize(3 * triangles.size());
    std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
    for (std::uint32_t t = 0; t < triangles.size(); ++t)
      for (const std::uint32_t v : triangles[t].v) triangles_[next[v]++] = t;
  }
  std::span<const std::uint32_t> around(std::size_t point) const {
    return {triangles_.data() + first_[point], triangles_.data() + first_[point + 1]};
  }
  std::size_t size() const { return first_.empty() ? 0 : first_.size() - 1; }

 private:
  /// The triangles around point p are triangles_[first_[p]] to triangles_[first_[p + 1] - 1].
  std::vector<std::uint32_t> first_, triangles_;
};

}  // namespace polymorph
