// Carry target: the surface at one time, onto which a carried mesh is moved.
#pragma once

#include <memory>

#include "mesh/fans.h"
#include "mesh/mesh_query.h"

namespace polymorph {

/// A closed surface with normals, and the structures for queries on it.
struct CarryTarget {
  Mesh surface;
  Fans fans;
  std::shared_ptr<const ClosestPointQuery> tree;
  MeshQuery query() const { return {surface.positions, surface.triangles, *tree}; }
};
CarryTarget make_carry_target(Mesh surface);

/// Unit normal of the face on which `hit`, the point closest to `from`, lies. On an edge or at a
/// corner, where several faces are equally near, it is the one with the smallest dot product with
/// `facing`.
Vec3 face_normal_at(const CarryTarget& target, Vec3 from, const ClosestPoint& hit, Vec3 facing);

}  // namespace polymorph
