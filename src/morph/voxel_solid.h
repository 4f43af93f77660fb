// Voxels of the solid inside a surface of balls, and geodesic distances: lengths of shortest paths
// that stay inside the solid.
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "kernels/linear.h"
#include "kernels/types.h"

namespace polymorph {

/// The solid that a field of balls encloses: one connected component of voxels, which are numbered
/// from 0. A voxel is a cube around a point of `grid`. Lengths (`depth`, `steps` and distances
/// between voxels) are in units of 1 / kStepUnits of a voxel's edge. They are integers, so that
/// sums and comparisons are exact.
struct VoxelSolid {
  static constexpr std::uint32_t kStepUnits = 12;
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();  ///< no voxel

  Grid grid;
  std::vector<std::uint32_t> grid_indices;  ///< per voxel, the index of its grid point; increasing
  std::vector<std::uint32_t> voxels;        ///< per grid point, its voxel, or kNone
  /// Per voxel, the distance from the nearest grid point outside the solid.
  std::vector<std::uint32_t> depth;
  /// Neighbours of voxel i among the 26 around it: neighbors[k] at the distance steps[k], for k
  /// from first_neighbor[i] to first_neighbor[i + 1] - 1.
  std::vector<std::uint32_t> first_neighbor, neighbors;
  std::vector<std::uint8_t> steps;

  std::size_t size() const { return grid_indices.size(); }
  Int3 point(std::uint32_t i) const;    ///< voxel i's grid coordinates
  Vec3d center(std::uint32_t i) const;  ///< voxel i's position in the scene
  bool contains(Vec3d place) const;  ///< tests whether a scene position is in a voxel of the solid
  /// Length of the unit of distances, in scene units.
  double unit() const { return static_cast<double>(grid.cell) / kStepUnits; }
};

/// Makes the solid where the field of exponential balls (FieldKind::kGaussian) is at least 1. It
/// has some 20 000 voxels, unless these would be smaller than 1/96 of the longest side. Tiny
/// components are removed, and the others are connected by the shortest straight lines. The solid
/// is empty if the field is below 1 everywhere. Parallel, deterministic.
VoxelSolid voxel_solid(const std::vector<Ball>& balls);

/// Computes the geodesic distance of every voxel from the nearest of the voxels `sources`. Paths go
/// from voxel to voxel in 26 directions; in other directions, the distance is up to 13 % longer
/// than the Euclidean one.
std::vector<std::uint32_t> geodesic_distances(const VoxelSolid& solid,
                                              std::span<const std::uint32_t> sources);

/// Computes for each voxel the radius of the largest ball inside the solid that contains it: half
/// the local thickness. Unit: as VoxelSolid::depth.
std::vector<std::uint32_t> local_radii(const VoxelSolid& solid);

/// Finds the voxel nearest to `place`. The solid must not be empty.
std::uint32_t nearest_voxel(const VoxelSolid& solid, Vec3 place);

}  // namespace polymorph
