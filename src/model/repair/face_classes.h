// Face classification: separates the faces that bound a model's solid from loose sheets and from
// faces hidden inside the solid.
#pragma once

#include <cstdint>
#include <vector>

#include "mesh/inside.h"
#include "model/model.h"

namespace polymorph {

/// Classes of faces by whether their two sides are inside the solid.
enum class FaceClass : std::uint8_t {
  kBoundary,  ///< inside on exactly one side
  kMixed,     ///< different classes at the tested points of the face
  kSheet,     ///< outside on both sides, or undecided
  kHidden,    ///< inside on both sides, e.g. a head under a helmet
};

/// Points with at least this winding number are certainly inside. Behind a loose sheet, the winding
/// number is only 1/2.
inline constexpr double kDecidedWinding = 0.75;

/// Classifies each triangle by the winding numbers at the distance `step` (model units) on both
/// sides of its centroid and of three points near its corners. If more than 16384 triangles are
/// longer than a 64th of the box's diagonal, each winding number would visit nearly all of them, so
/// the triangles of a simpler model (cluster_long_triangles()) are classified instead. Each
/// original triangle then takes the class of the simpler model's triangle closest to its centroid.
std::vector<FaceClass> classify_faces(const Model& model, const InsideTest& inside, float step);

/// Lists the triangles that are not hidden, ascending; all of them if every one is hidden.
std::vector<std::uint32_t> list_outer_faces(const std::vector<FaceClass>& classes);

}  // namespace polymorph
