// Longest-edge bisection of triangles.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "kernels/types.h"

namespace polymorph {

struct Division {
  std::vector<Triangle> triangles;
  /// End points of each bisected edge. The midpoints are new points, which follow the old ones in
  /// this order.
  std::vector<std::array<std::uint32_t, 2>> halved;
};

/// Bisects the chosen triangles of a closed mesh at their longest edges. If the triangle across
/// such an edge has a longer one, that is bisected as well, and so on, so that shapes stay good
/// (Rivara 1984).
Division halve_triangles(std::span<const Vec3> points, std::span<const Triangle> triangles,
                         std::span<const std::uint32_t> chosen);

}  // namespace polymorph
