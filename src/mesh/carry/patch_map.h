// Patch mapping: maps a disk of one mesh onto a disk of another by a common planar
// parameterization.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "mesh/carry/carry_target.h"

namespace polymorph {

/// A mesh whose patches are moved and divided in place.
struct PatchMesh {
  std::vector<Vec3>& points;
  std::vector<Triangle>& triangles;
  /// End points of each bisected edge, in the order of the new points, which follow the old ones.
  std::vector<std::array<std::uint32_t, 2>> halved = {};
};

struct PatchSettings {
  int rings = 0;  ///< rings of triangles around the given ones that are mapped as well
  /// Inner triangles of a mapped patch are bisected where they are further than `deviation` from
  /// the surface that they stand for, or have longer edges than `longest_edge`.
  float deviation = 0, longest_edge = 0;
  std::size_t max_triangles = 0;  ///< approximate: no bisection begins that would exceed it
  /// Called before each patch and before each round of bisections, unless it is null; map_patches()
  /// ends once it returns false.
  const std::function<bool()>* keep_going = nullptr;
};

/// Maps the patches around the triangles `seeds` onto the regions of the target's surface that are
/// nearest to them. The region is flattened onto a disk by mean value coordinates (Floater 2003).
/// The border of the patch is placed there at its closest points, and its inner points by Tutte's
/// embedding (1963). The border need not be convex, so triangles may fold; then points are moved in
/// the plane, and a patch that stays folded is left as it was. Bisected edges get their midpoints
/// in the plane. `mesh_near`: nearest triangle of the mesh per point of the surface. Patches that
/// are not disks stay unchanged. Returns the number of mapped patches.
std::size_t map_patches(PatchMesh& mesh, std::span<const std::uint32_t> seeds,
                        const PatchSettings& settings, const CarryTarget& target,
                        std::span<const std::uint32_t> mesh_near);

}  // namespace polymorph
