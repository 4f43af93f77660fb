// Mesh view: the points and triangles of a mesh or model that lives elsewhere, as geometric queries
// take them.
#pragma once

#include <span>

#include "base/box.h"
#include "kernels/mesh.h"

namespace polymorph {

/// Refers to points and triangles; passed by value, and no longer valid than what it refers to.
struct MeshView {
  std::span<const Vec3> points;
  std::span<const Triangle> triangles;

  MeshView() = default;
  MeshView(std::span<const Vec3> points_, std::span<const Triangle> triangles_)
      : points(points_), triangles(triangles_) {}
  MeshView(const Mesh& mesh) : points(mesh.positions), triangles(mesh.triangles) {}

  Box box() const { return box_of(points); }
};

}  // namespace polymorph
