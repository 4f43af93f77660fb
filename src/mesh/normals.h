// Mesh normals, volume and area, computed from the triangles.
#pragma once

#include <vector>

#include "mesh/mesh_view.h"

namespace polymorph {

/// Unit normal of each triangle (zero for a degenerate one).
std::vector<Vec3> face_normals(MeshView mesh);
/// Area- and angle-weighted mean of the adjacent face normals, one per point (Gilbert 2010, 5.1.1).
std::vector<Vec3> point_normals(MeshView mesh);

/// Minimum angle between the normals of two faces whose common edge is shaded as a crease. The
/// edges of a cube (90 degrees) are creases, those of a 12-sided cylinder (30 degrees) are not.
inline constexpr float kCreaseDegrees = 50;
/// Normals of corners (3 per triangle): the weighted mean, as in point_normals(), of those faces
/// around the point that can be reached without crossing a crease or an open or non-manifold edge.
/// Unit length, also at degenerate triangles.
std::vector<Vec3> creased_normals(MeshView mesh, float crease_degrees = kCreaseDegrees);

/// Signed volume (positive when oriented outward) and area, summed in double.
double volume_of(MeshView mesh);
double area_of(MeshView mesh);

}  // namespace polymorph
