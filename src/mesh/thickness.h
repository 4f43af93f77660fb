// Wall thickness of a model (shape diameter function; Shapira, Shamir and Cohen-Or 2008): an
// estimate of the number of balls that it needs, and the positions of thin walls.
#pragma once

#include <cstddef>
#include <vector>

#include "mesh/mesh_view.h"
#include "mesh/sample_surface.h"
#include "mesh/triangle_bvh.h"

namespace polymorph {

/// Statistics of the distance from the surface along the inward normal to the opposite wall, in
/// model units; fractions are fractions of the area.
struct Thickness {
  double low = 0;        ///< 5th percentile
  double median = 0;     ///< median: the wall thickness of a shell
  double high = 0;       ///< 95th percentile
  double open = 0;       ///< fraction of the area without an opposite wall
  double balls = 0;      ///< area / median^2: roughly the number of balls that represent the walls
  std::size_t rays = 0;  ///< rays that hit a wall; if 0, the lengths are 0
};

/// Measures along `samples` rays opposite to the face normals; a model that is inside out gives
/// `open` near 1. Deterministic.
Thickness measure_thickness(MeshView mesh, const TriangleBvh& bvh, std::size_t samples = 4000);

/// Computes, for each sample, the distance along its inward normal to the opposite wall; infinite
/// if the ray hits no face, or the front of a face first.
std::vector<double> measure_wall_thicknesses(MeshView mesh, const TriangleBvh& bvh,
                                             const std::vector<SurfaceSample>& samples);

/// Finds midpoints of walls that are thinner than `max_thickness` and whose faces have normals n1,
/// n2 with dot(n1, -n2) > `min_cosine`. Two faces at a wider angle count only if a third face is as
/// near behind them, as in a wire. Rays go inward from points on every face, at most `spacing`
/// apart. The spacing is doubled until there are at most 2^20 points plus one per face. The result
/// is in the order of the faces.
std::vector<Vec3> find_thin_wall_midpoints(MeshView mesh, const TriangleBvh& bvh, double spacing,
                                           double max_thickness, double min_cosine);

/// Tests whether the walls need more than 1500 balls, several times the usual number.
bool is_thin(const Thickness& thickness);

}  // namespace polymorph
