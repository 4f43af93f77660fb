// Mesh validation: closedness, manifoldness, orientation, volume (docs/method.md, Surface).
#pragma once

#include <cstddef>
#include <string>

#include "kernels/mesh.h"

namespace polymorph {

struct MeshReport {
  std::size_t vertices = 0, triangles = 0;
  std::size_t open_edges = 0;        ///< edges without exactly two triangles
  std::size_t flipped_edges = 0;     ///< edges that two triangles traverse in the same direction
  std::size_t pinched_vertices = 0;  ///< vertices whose triangles form more than one fan
  std::size_t degenerate_triangles = 0;  ///< triangles without area
  std::size_t components = 0;
  long long euler = 0;  ///< V - E + F
  long long genus = 0;  ///< components - euler / 2: the number of handles if the mesh is closed
  double volume = 0, area = 0;
  std::string digest;  ///< mesh_digest()
  bool is_closed() const { return open_edges == 0 && flipped_edges == 0; }
  bool is_manifold() const { return is_closed() && pinched_vertices == 0; }
};

/// Counts a mesh's defects and measures it.
MeshReport check_mesh(const Mesh& mesh);

/// Volume enclosed by a closed mesh (positive when oriented outward), and its area.
double volume_of(const Mesh& mesh);
double area_of(const Mesh& mesh);
/// Estimates the volume between the facets and a smooth surface through their vertices with the
/// mesh's normals. Added to volume_of(), it gives the volume below the smooth surface. It is
/// positive where the surface is convex, and 0 without normals.
double faceting_loss(const Mesh& mesh);
/// Hash of positions, normals and indices, in hexadecimal digits.
std::string mesh_digest(const Mesh& mesh);

}  // namespace polymorph
