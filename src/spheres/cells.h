// Octree cells around a model, and sphere trees of selected cells.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "mesh/inside.h"
#include "model/model.h"
#include "spheres/spheres.h"

namespace polymorph {

/// The root cell of an octree: a cube around a model.
struct RootCube {
  double low[3] = {0, 0, 0};
  double side = 0;
};
/// Minimum margin, as a fraction of the side. It keeps sample points off the faces of models that
/// fill their box: a cube's corners would lie exactly on its surface, where the inside test depends
/// on rounding.
inline constexpr double kMinRootMargin = 1e-4;
/// Makes the cube around the centre of the model's bounding box whose side is the box's longest
/// side times 1 + the larger of `margin` and kMinRootMargin.
RootCube make_root_cube(const Model& model, double margin = 0);

/// A cell of the octree. The cells of level l divide the root cube into 2^l cells per axis.
struct Cell {
  int level = 0;
  std::int32_t x = 0, y = 0, z = 0;
  std::size_t index() const {  ///< x + n (y + n z), with n = 2^level
    return static_cast<std::size_t>(x) +
           ((static_cast<std::size_t>(y) + (static_cast<std::size_t>(z) << level)) << level);
  }
  Cell child(int octant) const {  ///< bit 0: x, bit 1: y, bit 2: z
    return {level + 1, 2 * x + (octant & 1), 2 * y + (octant >> 1 & 1), 2 * z + (octant >> 2)};
  }
};

/// Returns the point (x, y, z) of a lattice with `steps` steps along each side of the root cube;
/// half-integers give cell centres.
inline Vec3 lattice_point(const RootCube& root, int steps, double x, double y, double z) {
  const double step = root.side / steps;
  return {static_cast<float>(root.low[0] + step * x), static_cast<float>(root.low[1] + step * y),
          static_cast<float>(root.low[2] + step * z)};
}

/// Makes the sphere with the cell's centre and volume. Its radius is (3 / (4 pi))^(1/3) h = 0.6204
/// h for a cell of edge h.
Sphere make_sphere(const RootCube& root, const Cell& cell);

/// Builds the sphere tree of the cells that `is_leaf` selects and of their ancestors. Searches
/// depth first from the root down to the level `finest`, but not below a leaf, children in Morton
/// order (x fastest). The order of the nodes therefore depends on the selection only. Without a
/// leaf the tree is empty.
SphereTree build_cell_tree(const RootCube& root, int finest,
                           const std::function<bool(const Cell&)>& is_leaf);

/// Builds the sphere trees of the methods `octree` and `active` (spheres.h: approximate()), with
/// cells down to the level `finest`, which is SphereSettings::resolution - 1. The tree is empty if
/// no cell counts as inside the model.
SphereTree build_octree(const InsideTest& test, const RootCube& root, int finest);
SphereTree build_active_tree(const InsideTest& test, const RootCube& root, int finest);

/// Builds the sphere tree for the settings' method, `octree` or `active`, and resolution;
/// resolution 0 selects the finest one with at most `max_count` spheres. Errors (kInput): no cell
/// counts as inside at this resolution; the message says what to change.
Result<SphereTree> build_cell_spheres(const Model& model, const InsideTest& test,
                                      const SphereSettings& settings, std::size_t max_count);

}  // namespace polymorph
