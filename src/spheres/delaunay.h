// Delaunay tetrahedralization of points (Qhull).
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "base/result.h"
#include "kernels/linear.h"

namespace polymorph {

struct Tetrahedron {
  static constexpr std::uint32_t kNone = 0xffffffffu;
  std::array<std::uint32_t, 4> points{};     ///< ascending
  std::array<std::uint32_t, 4> neighbors{};  ///< over any of its faces; kNone at the hull
  Vec3d center;                              ///< of the circumscribed sphere: a Voronoi vertex
  double radius = 0;
};

/// The tetrahedra whose circumscribed spheres hold no other point. Flat ones, which have no such
/// sphere in double precision, are left out. A function of the points alone.
/// Errors (kInput): fewer than five points, or all in one plane, with Qhull's reason.
Result<std::vector<Tetrahedron>> delaunay_tetrahedra(std::span<const Vec3d> points);

}  // namespace polymorph
