// Mesh view: non-owning reference to the points and triangles of a mesh or model, as the argument
// of geometric queries.
#pragma once

#include <span>

#include "base/box.h"
#include "kernels/mesh.h"

namespace polymorph {

/// Refers to points and triangles, which must outlive it; passed by value.
struct MeshView {
  std::span<const Vec3> points;
  std::span<const Triangle> triangles;

  MeshView() = default;
  MeshView(std::span<const Vec3> points_, std::span<const Triangle> triangles_)
      : points(points_), triangles(triangles_) {}
  MeshView(const Mesh& mesh) : points(mesh.positions), triangles(mesh.triangles) {}

  Box box() const { return bounding_box(points); }
};

}  // namespace polymorph
