// Patch map: a disk of one mesh is laid onto a disk of another through a common plane.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "surface/carry_target.h"

namespace polymorph {

/// The triangles beside each triangle of a closed mesh, across its edges.
std::vector<Triangle> neighbours_of(std::span<const Triangle> triangles);

/// Lays the triangles around `seeds` (within `rings` of them) onto the part of `surface` that is
/// theirs: both are flattened by Tutte's embedding (1963; the surface with mean value weights,
/// Floater 2003), the mesh within the feet of its patch's border. What folds cannot be left
/// then, whatever the surface looks like there. `mesh_near`: of each point of the surface, the
/// triangle of the mesh nearest to it. Patches that are no disks stay as they are.
/// How many were laid.
std::size_t lay_patches(std::vector<Vec3>& points, std::span<const Triangle> triangles,
                        std::span<const std::uint32_t> seeds, int rings, const CarryTarget& target,
                        std::span<const std::uint32_t> mesh_near);

}  // namespace polymorph
