#include "spheres/cells.h"

#include <algorithm>
#include <numbers>

#include "base/result.h"
#include "kernels/linear.h"

namespace polymorph {
namespace {

class TreeBuilder {
 public:
  TreeBuilder(const RootCube& root, int finest, const std::function<bool(const Cell&)>& is_leaf)
      : root_(root), finest_(finest), is_leaf_(is_leaf) {}

  /// Adds the cell if it contains a leaf; returns whether it does.
  bool add(const Cell& cell, std::int32_t parent) {
    const auto index = static_cast<std::int32_t>(tree.nodes.size());
    tree.nodes.push_back(
        {make_sphere(root_, cell), parent, static_cast<std::int16_t>(cell.level), false});
    if (is_leaf_(cell)) {
      tree.nodes.back().leaf = true;
      return true;
    }
    bool has_leaf = false;
    if (cell.level < finest_)
      for (int octant = 0; octant < 8; ++octant)
        has_leaf = add(cell.child(octant), index) || has_leaf;
    // Children without a leaf have removed their nodes, so the last node is this cell's.
    if (!has_leaf) tree.nodes.pop_back();
    return has_leaf;
  }

  SphereTree tree;

 private:
  const RootCube& root_;
  int finest_;
  const std::function<bool(const Cell&)>& is_leaf_;
};

}  // namespace

RootCube make_root_cube(const Model& model, double margin) {
  const Box box = model.box();
  const double low[3] = {box.low.x, box.low.y, box.low.z},
               high[3] = {box.high.x, box.high.y, box.high.z};
  RootCube root;
  for (int k = 0; k < 3; ++k) root.side = std::max(root.side, high[k] - low[k]);
  root.side *= 1 + std::max(margin, kMinRootMargin);
  for (int k = 0; k < 3; ++k) root.low[k] = (low[k] + high[k] - root.side) / 2;
  return root;
}

Sphere make_sphere(const RootCube& root, const Cell& cell) {
  const int cells = 1 << cell.level;
  const double h = root.side / cells;
  return {lattice_point(root, cells, cell.x + 0.5, cell.y + 0.5, cell.z + 0.5),
          static_cast<float>(h * cube_root(3 / (4 * std::numbers::pi)))};
}

SphereTree build_cell_tree(const RootCube& root, int finest,
                           const std::function<bool(const Cell&)>& is_leaf) {
  TreeBuilder builder(root, finest, is_leaf);
  builder.add(Cell{}, -1);
  return std::move(builder.tree);
}

}  // namespace polymorph
