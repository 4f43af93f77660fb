// Voxels inside an object's surface, and geodesic distances: the lengths of the shortest paths
// within the solid.
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "kernels/linear.h"
#include "kernels/types.h"

namespace polymorph {

/// The solid that a field of balls encloses, as one connected component. Lengths are integer
/// multiples of 1 / kStepUnits of a voxel's edge, so that sums and comparisons are exact.
struct VoxelSolid {
  static constexpr std::uint32_t kStepUnits = 12;
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

  Grid grid;
  std::vector<std::uint32_t> cells;  ///< grid index of each voxel, increasing
  std::vector<std::uint32_t> voxel;  ///< voxel at each grid point, or kNone
  /// The distance of each voxel from the nearest grid point outside the solid.
  std::vector<std::uint32_t> depth;
  /// The 26-neighbourhood: the neighbours of voxel i are neighbors[first[i]] to neighbors[first[i +
  /// 1] - 1].
  std::vector<std::uint32_t> first, neighbors;
  std::vector<std::uint8_t> steps;  ///< distance to each of these neighbours

  std::size_t size() const { return cells.size(); }
  Int3 point(std::uint32_t i) const;    ///< voxel i's grid coordinates
  Vec3d center(std::uint32_t i) const;  ///< voxel i's position in the scene
  bool contains(Vec3d place) const;  ///< tests whether a scene position is in a voxel of the solid
  double unit() const { return static_cast<double>(grid.cell) / kStepUnits; }
};

/// Makes the solid where the field of exponential balls (FieldKind::kGaussian) is at least 1. It
/// has some 20 000 voxels, unless these would be smaller than 1/96 of the longest side. Tiny
/// components are removed, and the others are connected by the shortest straight lines. The solid
/// is empty if the field is below 1 everywhere. Parallel, deterministic.
VoxelSolid voxel_solid(const std::vector<Ball>& balls);

/// Computes the geodesic distance of every voxel from the nearest of `sources`. In directions
/// between those of the grid, it is up to 13 % longer than the Euclidean distance.
std::vector<std::uint32_t> geodesic_distances(const VoxelSolid& solid,
                                              std::span<const std::uint32_t> sources);

/// Computes the radius of the largest inscribed ball that contains each voxel: half the local
/// thickness.
std::vector<std::uint32_t> local_radii(const VoxelSolid& solid);

/// Finds the voxel nearest to `place`. The solid must not be empty.
std::uint32_t nearest_voxel(const VoxelSolid& solid, Vec3 place);

}  // namespace polymorph
