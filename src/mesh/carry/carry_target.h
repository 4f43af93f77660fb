// Carry target: the surface at one moment, which a carried mesh is to lie on.
#pragma once

#include <memory>

#include "mesh/fans.h"
#include "mesh/mesh_query.h"

namespace polymorph {

/// A surface, closed and with normals, and what is asked of it again and again.
struct CarryTarget {
  Mesh surface;
  Fans fans;
  std::shared_ptr<const ClosestPointQuery> tree;
  MeshQuery query() const { return {surface.positions, surface.triangles, *tree}; }
};
CarryTarget make_carry_target(Mesh surface);

/// The unit normal of the face that `hit` (nearest to `from`) lies on; on an edge or at a corner,
/// where several faces are as near, of the one whose normal has the smallest dot product with
/// `facing`.
Vec3 face_normal_at(const CarryTarget& target, Vec3 from, const ClosestPoint& hit, Vec3 facing);

}  // namespace polymorph
