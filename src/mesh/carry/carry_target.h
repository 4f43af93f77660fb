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
  float edge = 0;  ///< edge of an equilateral triangle of the mean area
  MeshQuery query() const { return {surface.positions, surface.triangles, *tree, &fans}; }
};
CarryTarget make_carry_target(Mesh surface);

/// Finds the point of the surface that is closest to `from` among those reached from triangle
/// `hint` by a walk over neighbouring triangles, each of which is nearer than the one before. If
/// the walk ends at a distance of more than twice CarryTarget::edge from `from`, or there is no
/// hint (kNoTriangle), finds the closest point of the whole surface instead.
ClosestPoint closest_near(const CarryTarget& target, Vec3 from, std::uint32_t hint);

/// Unit normal of the face on which `hit`, the point closest to `from`, lies. On an edge or at a
/// corner, where several faces are equally near, it is the normal that differs most from `facing`,
/// the carried face's normal, so that a face turned over is not missed.
Vec3 face_normal_at(const CarryTarget& target, Vec3 from, const ClosestPoint& hit, Vec3 facing);

}  // namespace polymorph
