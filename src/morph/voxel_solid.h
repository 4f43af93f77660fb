// Voxels inside an object's surface, and geodesic distances within it: the shortest ways from voxel
// to voxel that do not leave the solid.
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "kernels/linear.h"
#include "kernels/types.h"

namespace polymorph {

/// The solid that a field of balls encloses, in one piece. Lengths within it are whole numbers of
/// 1 / kStepUnits of a voxel's edge, so that sums and comparisons are exact.
struct VoxelSolid {
  static constexpr std::uint32_t kStepUnits = 12;
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

  Grid grid;
  std::vector<std::uint32_t> cells;  ///< index of each voxel in the grid; rising
  std::vector<std::uint32_t> voxel;  ///< voxel of each point of the grid, or kNone
  /// The distance of each voxel from the nearest point of the grid outside.
  std::vector<std::uint32_t> depth;
  /// The 26-neighbourhood: voxel i is joined to neighbors[first[i]] ... neighbors[first[i + 1] -
  /// 1].
  std::vector<std::uint32_t> first, neighbors;
  std::vector<std::uint8_t> steps;  ///< length of each of these joints

  std::size_t size() const { return cells.size(); }
  Int3 point(std::uint32_t i) const;    ///< voxel i's place in the grid
  Vec3d center(std::uint32_t i) const;  ///< its place in the scene
  bool contains(Vec3d place) const;     ///< whether the voxel at a place is inside
  double unit() const { return static_cast<double>(grid.cell) / kStepUnits; }
};

/// The voxels in which the field of exponential balls (FieldKind::kGaussian) is at least 1: some
/// 20 000, unless that takes cells smaller than 1/96 of the longest side. Crumbs are left out, and
/// what lies apart is joined along the shortest straight lines. None where the field is below 1
/// everywhere. Parallel, deterministic.
VoxelSolid voxel_solid(const std::vector<Ball>& balls);

/// The geodesic distance of every voxel from the nearest of `sources`; across the grid it is up to
/// 13 % longer than the straight way.
std::vector<std::uint32_t> geodesic_distances(const VoxelSolid& solid,
                                              std::span<const std::uint32_t> sources);

/// The depth of the deepest voxel whose inscribed ball holds each voxel: half the thickness of the
/// part that it is in.
std::vector<std::uint32_t> local_radii(const VoxelSolid& solid);

/// The voxel nearest to a place; the solid has one.
std::uint32_t nearest_voxel(const VoxelSolid& solid, Vec3 place);

}  // namespace polymorph
