// Carry target: the surface at one moment, which a carried mesh is to lie on.
#pragma once

#include <memory>

#include "surface/mesh_query.h"

namespace polymorph {

/// A surface, closed and with normals, and its hierarchy.
struct CarryTarget {
  Mesh surface;
  std::shared_ptr<const ClosestPointQuery> tree;
  MeshQuery query() const { return {surface.positions, surface.triangles, *tree}; }
};
inline CarryTarget make_carry_target(Mesh surface) {
  CarryTarget target{std::move(surface), nullptr};
  target.tree =
      std::make_shared<const ClosestPointQuery>(target.surface.positions, target.surface.triangles);
  return target;
}

}  // namespace polymorph
