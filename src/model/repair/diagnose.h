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
  std::size_t shells = 0;          ///< components of faces connected by edges (not just by points)
  std::size_t open_shells = 0;     ///< shells with boundary edges
  std::size_t boundary_edges = 0;  ///< edges with one face
  std::size_t non_manifold_edges = 0;    ///< edges with three or more faces
  std::size_t flipped_edges = 0;         ///< edges that two faces traverse in the same direction
  std::size_t degenerate_triangles = 0;  ///< triangles without area
  std::size_t long_triangles = 0;        ///< triangles longer than a 64th of the box's diagonal
  /// Points at which several fans of faces meet without a common edge.
  std::size_t touching_points = 0;
  /// Closed shells that face inward without being a cavity of another shell. At most 64
  /// inward-facing shells are examined.
  std::size_t inverted_shells = 0;
  long long euler = 0;          ///< V - E + F over used points
  int genus = -1;               ///< sum over shells, split at touching points; -1 if not closed
  bool closed = false;          ///< true if every edge has exactly two faces, oppositely oriented
  double volume = 0, area = 0;  ///< `volume` is negative if the faces point inward
  Box box;
  /// The boundary edge with the lowest point indices, and its end points; 0 if there is none.
  std::array<std::uint32_t, 2> first_open_edge{0, 0};
  std::array<Vec3, 2> first_open_edge_points;
  std::optional<Thickness> thickness;          ///< diagnose_fully() only
  std::optional<SelfIntersections> crossings;  ///< diagnose_fully() only
  /// Fraction of the area with outside on both sides; diagnose_fully() only.
  std::optional<double> sheet_fraction;
};

/// Counts topological defects and measures volume and area.
Diagnosis diagnose(const Model& model);
/// Diagnoses the model, measures wall thickness and finds self-intersections, which takes longer.
Diagnosis diagnose_fully(const Model& model);

/// Derives the diagnosis of a model that differs from a diagnosed one only by a rotation, a uniform
/// scale and a translation.
Diagnosis transfer_diagnosis(Diagnosis diagnosis, const Model& similar);

/// Describes each problem in one line with what to do, worst first; empty for a closed, outward
/// oriented model.
std::vector<std::string> describe_problems(const Diagnosis& diagnosis);
/// Describes, in one line each, what is unusual about a model but has no effect.
std::vector<std::string> describe_oddities(const Diagnosis& diagnosis);
/// Describes self-intersections in one line, or returns "". They change the result of the parity
/// rule, but not of the winding number (mesh/inside.h).
std::string describe_crossings(const Diagnosis& diagnosis);

}  // namespace polymorph
