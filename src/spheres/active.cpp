// Active nodes (Gilbert 2010, 5.1.3.2): large cells where the model fills them, small ones along
// its surface.
#include "base/parallel.h"
#include "spheres/cells.h"

namespace polymorph {
namespace {

/// Lattice of the corners of the finest cells; it includes the corners of coarser cells. Each
/// corner is tested once, when it is first needed.
class CornerLattice {
 public:
  CornerLattice(const InsideTest& test, const RootCube& root, int finest)
      : test_(test),
        root_(root),
        finest_(finest),
        side_((std::size_t{1} << finest) + 1),
        state_(side_ * side_ * side_, kUnknown) {}

  /// Tests those corners of the cells that have not been tested yet.
  void evaluate(const std::vector<Cell>& cells) {
    std::vector<std::size_t> requested;
    for (const Cell& cell : cells)
      for (int octant = 0; octant < 8; ++octant) {
        const std::size_t i = index(cell, octant);
        if (state_[i] != kUnknown) continue;
        state_[i] = kRequested;
        requested.push_back(i);
      }
    const int steps = 1 << finest_;
    parallel_for(
        static_cast<std::int64_t>(requested.size()),
        [&](std::int64_t k) {
          const std::size_t i = requested[static_cast<std::size_t>(k)];
          const Vec3 p = lattice_point(root_, steps, static_cast<double>(i % side_),
                                       static_cast<double>(i / side_ % side_),
                                       static_cast<double>(i / side_ / side_));
          state_[i] = test_.inside(p) ? kInside : kOutside;
        },
        /*grain=*/64);
  }

  int count_corners_inside(const Cell& cell) const {
    int count = 0;
    for (int octant = 0; octant < 8; ++octant) count += state_[index(cell, octant)] == kInside;
    return count;
  }

 private:
  static constexpr std::uint8_t kOutside = 0, kInside = 1, kUnknown = 2, kRequested = 3;
  /// Index of a cell's corner in the lattice, x fastest.
  std::size_t index(const Cell& cell, int octant) const {
    const int scale_bits = finest_ - cell.level;
    const auto lattice_index = [&](std::int32_t cell_index, int bit) {
      return static_cast<std::size_t>(cell_index + (octant >> bit & 1)) << scale_bits;
    };
    return lattice_index(cell.x, 0) +
           side_ * (lattice_index(cell.y, 1) + side_ * lattice_index(cell.z, 2));
  }

  const InsideTest& test_;
  const RootCube& root_;
  int finest_;
  std::size_t side_;                 ///< lattice points per axis
  std::vector<std::uint8_t> state_;  ///< one of the four constants per lattice point
};

}  // namespace

SphereTree build_active_tree(const InsideTest& test, const RootCube& root, int finest) {
  CornerLattice corners(test, root, finest);
  // Cells are tested level by level, so that all corners of a level are tested in parallel. A cell
  // with more than 4 corners inside is active and becomes a leaf. All others are divided down to
  // the finest level, even those without an inside corner, because something thin may lie between
  // their corners.
  std::vector<std::vector<std::uint8_t>> active(static_cast<std::size_t>(finest) + 1);
  std::vector<Cell> cells{Cell{}};
  for (int level = 0; level <= finest; ++level) {
    corners.evaluate(cells);
    auto& is_active = active[static_cast<std::size_t>(level)];
    is_active.assign(std::size_t{1} << (3 * level), 0);
    std::vector<Cell> next;
    for (const Cell& cell : cells) {
      if (corners.count_corners_inside(cell) > 4) {
        is_active[cell.index()] = 1;
      } else if (level < finest) {
        for (int octant = 0; octant < 8; ++octant) next.push_back(cell.child(octant));
      }
    }
    cells = std::move(next);
  }
  return build_cell_tree(root, finest, [&](const Cell& cell) {
    return active[static_cast<std::size_t>(cell.level)][cell.index()] != 0;
  });
}

}  // namespace polymorph
