// Mesh diagnosis: finds open edges, inverted shells, self-intersections and the like. Used by
// `check` and before sphere approximation.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "mesh/self_intersections.h"
#include "mesh/thickness.h"
#include "model/model.h"

namespace polymorph {

struct Diagnosis {
  std::size_t points = 0, triangles = 0;
  std::size_t shells = 0;              ///< parts joined by edges; touching in a point does not join
  std::size_t open_shells = 0;         ///< shells with boundary edges
  std::size_t boundary_edges = 0;      ///< edges of one face
  std::size_t non_manifold_edges = 0;  ///< edges of three or more
  std::size_t flipped_edges = 0;       ///< two faces that run the same way along the edge
  std::size_t degenerate_triangles = 0;  ///< without area
  std::size_t long_triangles = 0;        ///< longer than a 64th of the box's diagonal
  std::size_t touching_points = 0;       ///< points where faces meet that no edge joins there
  /// Closed shells that face inward and lie in no other shell, where they would be a cavity. Up to
  /// 64 inward-facing shells are examined.
  std::size_t inverted_shells = 0;
  long long euler = 0;  ///< V - E + F over used points
  int genus = -1;       ///< sum over shells, touching points taken apart; -1 where it is not closed
  bool closed = false;  ///< every edge has exactly two faces, oppositely oriented
  double volume = 0, area = 0;
  Box box;
  /// The open edge of lowest point indices, and where it is; meaningful if boundary_edges > 0.
  std::array<std::uint32_t, 2> first_open_edge{0, 0};
  std::array<Vec3, 2> first_open_edge_points;
  std::optional<Thickness> thickness;          ///< diagnose_fully() only
  std::optional<SelfIntersections> crossings;  ///< diagnose_fully() only
  /// Share of the area with outside on both sides; diagnose_fully() only.
  std::optional<double> sheet_share;
};

Diagnosis diagnose(const Model& model);
/// With wall thickness and faces that cross, which take rays and a search.
Diagnosis diagnose_fully(const Model& model);

/// One line per finding, in plain words with what to do, worst first; empty for a closed, outward
/// oriented model.
std::vector<std::string> describe_problems(const Diagnosis& diagnosis);
/// A line on faces that cross, or nothing: a problem with the parity rule, none with the winding
/// number.
std::string describe_crossings(const Diagnosis& diagnosis);

}  // namespace polymorph
