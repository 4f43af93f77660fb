// Mesh validation: closedness, manifoldness, orientation, volume (docs/method.md, Surface).
#pragma once

#include <cstddef>
#include <string>

#include "kernels/mesh.h"

namespace polymorph {

struct MeshReport {
  std::size_t vertices = 0, triangles = 0;
  std::size_t open_edges = 0;        ///< not exactly two triangles
  std::size_t flipped_edges = 0;     ///< two triangles that run the same way along it
  std::size_t pinched_vertices = 0;  ///< whose triangles form more than one fan
  std::size_t degenerate_triangles = 0;
  std::size_t components = 0;
  long long euler = 0;  ///< V - E + F
  long long genus = 0;  ///< components - euler / 2, for a closed mesh
  double volume = 0, area = 0;
  std::string digest;  ///< of positions, normals and indices
  bool closed() const { return open_edges == 0 && flipped_edges == 0; }
  bool manifold() const { return closed() && pinched_vertices == 0; }
};

MeshReport check_mesh(const Mesh& mesh);

double volume_of(const Mesh& mesh);
double area_of(const Mesh& mesh);
/// The volume between the facets and the smooth surface through their vertices that has the mesh's
/// normals there: what `volume_of` lacks, positive where the surface is convex. 0 without normals.
double faceting_loss(const Mesh& mesh);
std::string mesh_digest(const Mesh& mesh);

}  // namespace polymorph
