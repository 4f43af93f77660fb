// Indices of three-dimensional arrays. x varies fastest, as for the points of a Grid
// (kernels/types.h).
#pragma once

#include <cstddef>
#include <cstdint>

#include "kernels/types.h"

namespace polymorph {

/// Index of the element at (x, y, z) in an array of size.x * size.y * size.z elements.
constexpr std::size_t array3_index(Int3 size, int x, int y, int z) {
  return static_cast<std::size_t>(x) +
         static_cast<std::size_t>(size.x) *
             (static_cast<std::size_t>(y) +
              static_cast<std::size_t>(size.y) * static_cast<std::size_t>(z));
}
constexpr std::size_t array3_index(Int3 size, Int3 p) { return array3_index(size, p.x, p.y, p.z); }

/// Position (x, y, z) of the element with this index.
constexpr Int3 array3_position(Int3 size, std::int64_t index) {
  return {static_cast<int>(index % size.x), static_cast<int>(index / size.x % size.y),
          static_cast<int>(index / size.x / size.y)};
}

/// Number of elements: the index that the first element beyond the last layer would have.
constexpr std::size_t array3_count(Int3 size) { return array3_index(size, 0, 0, size.z); }

}  // namespace polymorph
