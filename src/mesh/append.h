// Concatenation of meshes.
#pragma once

#include <cstdint>
#include <span>

#include "kernels/mesh.h"

namespace polymorph {

/// Appends another mesh's vertices and triangles to those of `mesh`. If either has no normals (flat
/// shading), the result has none.
inline void append(Mesh& mesh, std::span<const Vec3> positions, std::span<const Vec3> normals,
                   std::span<const Triangle> triangles) {
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  mesh.positions.insert(mesh.positions.end(), positions.begin(), positions.end());
  mesh.normals.insert(mesh.normals.end(), normals.begin(), normals.end());
  for (const Triangle& t : triangles)
    mesh.triangles.push_back({{t.v[0] + first, t.v[1] + first, t.v[2] + first}});
  if (mesh.normals.size() != mesh.positions.size()) mesh.normals.clear();
}
inline void append(Mesh& mesh, const Mesh& other) {
  append(mesh, other.positions, other.normals, other.triangles);
}

}  // namespace polymorph
