// Mesh normals, volume and area, computed from the triangles.
#pragma once

#include <vector>

#include "mesh/mesh_view.h"

namespace polymorph {

/// Unit normal of each triangle (zero for a degenerate one).
std::vector<Vec3> face_normals(MeshView mesh);
/// Area- and angle-weighted mean of the adjacent face normals, one per point (report 5.1.1).
std::vector<Vec3> point_normals(MeshView mesh);

/// The angle between faces from which an edge is shown sharp: a cube's 90 stays, a 12-sided
/// cylinder's 30 does not.
inline constexpr float kCreaseDegrees = 50;
/// Normals of corners (3 per triangle): the weighted mean, as in point_normals(), of those faces
/// around the point that can be reached without crossing a sharp, open or non-manifold edge. Unit
/// length, also at degenerate triangles.
std::vector<Vec3> creased_normals(MeshView mesh, float crease_degrees = kCreaseDegrees);

/// Signed volume (positive when oriented outward) and area, summed in double.
double volume_of(MeshView mesh);
double area_of(MeshView mesh);

}  // namespace polymorph
