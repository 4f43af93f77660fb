// Octree cells around a model, and the sphere tree made of the chosen ones.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "mesh/inside.h"
#include "model/model.h"
#include "spheres/spheres.h"

namespace polymorph {

/// The root: a cube around the middle of the model's bounding box, longer than its longest side by
/// a margin. At least kMinRootMargin keeps sample points off the faces of models that fill their
/// box (a cube's corners would lie exactly on its surface, where inside is a matter of rounding).
struct RootCube {
  double low[3] = {0, 0, 0};
  double side = 0;
};
inline constexpr double kMinRootMargin = 1e-4;  // share of the side
RootCube root_cube(const Model& model, double margin = 0);

/// A cell of level l: the root cube cut into 2^l per axis.
struct Cell {
  int level = 0;
  std::int32_t x = 0, y = 0, z = 0;
  std::size_t index() const {  ///< within its level
    return static_cast<std::size_t>(x) +
           ((static_cast<std::size_t>(y) + (static_cast<std::size_t>(z) << level)) << level);
  }
  Cell child(int octant) const {  ///< bit 0: x, bit 1: y, bit 2: z
    return {level + 1, 2 * x + (octant & 1), 2 * y + (octant >> 1 & 1), 2 * z + (octant >> 2)};
  }
};

/// Point (x, y, z) of a lattice of `steps` steps along each side of the root cube; halves are cell
/// centres.
inline Vec3 lattice_point(const RootCube& root, int steps, double x, double y, double z) {
  const double step = root.side / steps;
  return {static_cast<float>(root.low[0] + step * x), static_cast<float>(root.low[1] + step * y),
          static_cast<float>(root.low[2] + step * z)};
}

/// The ball with the cell's volume around its centre: radius (3 / (4 pi))^(1/3) h = 0.6204 h.
Sphere sphere_of(const RootCube& root, const Cell& cell);

/// The tree of all cells that `is_leaf` chooses, searched from the root down to `finest`, and of
/// their ancestors. Depth first, children in Morton order (x fastest), so the order is a function
/// of the choice alone. Nothing below a leaf. No leaf: no nodes.
SphereTree tree_of_cells(const RootCube& root, int finest,
                         const std::function<bool(const Cell&)>& is_leaf);

/// The two methods; `finest` = resolution - 1. Empty when nothing is inside.
SphereTree octree_spheres(const InsideTest& test, const RootCube& root, int finest);
SphereTree active_spheres(const InsideTest& test, const RootCube& root, int finest);

/// Of the settings' method and resolution, 0 chosen so that at most `max_count` spheres come out.
/// Errors (kInput): nothing is inside at this resolution - says which to raise.
Result<SphereTree> cell_spheres(const Model& model, const InsideTest& test,
                                const SphereSettings& settings, std::size_t max_count);

}  // namespace polymorph
