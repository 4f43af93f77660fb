// Wall thickness of a model (shape diameter function; Shapira, Shamir and Cohen-Or 2008): how many
// balls it needs, and where its thin parts are.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "mesh/mesh_view.h"
#include "mesh/triangle_bvh.h"

namespace polymorph {

/// Lengths from surface samples straight inward to where the model ends; shares of the area.
struct Thickness {
  double low = 0;        ///< a twentieth of the area is thinner
  double median = 0;     ///< half of the area is thinner: the wall thickness of a shell
  double high = 0;       ///< a twentieth is thicker
  double open = 0;       ///< share of the area from which inward is outside: no wall at all
  double balls = 0;      ///< area / median^2: about as many balls it takes to show the walls
  std::size_t rays = 0;  ///< that met a wall; 0 = no wall was found and the lengths are 0
};

/// By `samples` rays against the faces' normals; a model that is inside out gives `open` near 1. A
/// function of its arguments alone.
Thickness measure_thickness(MeshView mesh, const TriangleBvh& bvh, std::size_t samples = 4000);

/// Middles of walls thinner than `max_thickness` whose two faces lie at an angle less than that of
/// cosine `min_cosine`: half way along rays straight inward from points of every face no further
/// than `spacing` apart, or twice that and so on until they are no more than 2^20 and one per face.
/// By faces, in their order.
std::vector<Vec3> thin_wall_middles(MeshView mesh, const TriangleBvh& bvh, double spacing,
                                    double max_thickness, double min_cosine);

/// Thin: it would take more than 1500 balls to show the walls, several times what is usual.
bool is_thin(const Thickness& thickness);

}  // namespace polymorph
