// Longest-edge bisection: triangles are halved where they are too large.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "kernels/types.h"

namespace polymorph {

struct Division {
  std::vector<Triangle> triangles;
  /// The ends of each edge that was halved: its middle is a new point, after the old ones.
  std::vector<std::array<std::uint32_t, 2>> halved;
};

/// Halves the chosen triangles of a closed mesh at their longest edges, and on both sides of an
/// edge those whose own longest edge is longer first, so that shapes stay good (Rivara 1984).
Division halve_triangles(std::span<const Vec3> points, std::span<const Triangle> triangles,
                         std::span<const std::uint32_t> chosen);

}  // namespace polymorph
