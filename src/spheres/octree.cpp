// Octree approximation (Gilbert 2010, 5.1.3): the finest cells whose centres are inside.
#include "base/parallel.h"
#include "spheres/cells.h"

namespace polymorph {

SphereTree build_octree(const InsideTest& test, const RootCube& root, int finest) {
  const int n = 1 << finest;
  std::vector<std::uint8_t> inside(static_cast<std::size_t>(n) * static_cast<std::size_t>(n) *
                                   static_cast<std::size_t>(n));
  // Only the finest level decides, so only its centres are tested, one row per task.
  parallel_for(std::int64_t{n} * n, [&](std::int64_t row) {
    Cell cell{finest, 0, static_cast<std::int32_t>(row % n), static_cast<std::int32_t>(row / n)};
    for (; cell.x < n; ++cell.x)
      inside[cell.index()] =
          test.inside(lattice_point(root, n, cell.x + 0.5, cell.y + 0.5, cell.z + 0.5)) ? 1 : 0;
  });
  return build_cell_tree(root, finest, [&](const Cell& cell) {
    return cell.level == finest && inside[cell.index()] != 0;
  });
}

}  // namespace polymorph
