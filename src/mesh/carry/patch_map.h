// Patch mapping: maps a disk of one mesh onto a disk of another by a common planar
// parameterization.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "mesh/carry/carry_target.h"

namespace polymorph {

/// Triangles to map, and the number of rings around them that are mapped as well.
struct PatchSeeds {
  std::span<const std::uint32_t> triangles;
  int rings = 0;
};

/// Maps the triangles around `seeds` onto the region of the target's surface that is
/// nearest to them. The region is flattened onto a disk by mean value coordinates (Floater 2003),
/// the mesh patch by Tutte's embedding (1963) within the closest points of its border. That border
/// need not be convex, so triangles may fold: measure the result. `mesh_near`: nearest triangle of
/// the mesh per point of the surface. Patches that are no disks stay unchanged. Returns the number
/// of mapped patches.
std::size_t map_patches(std::vector<Vec3>& points, std::span<const Triangle> triangles,
                        const PatchSeeds& seeds, const CarryTarget& target,
                        std::span<const std::uint32_t> mesh_near);

}  // namespace polymorph
