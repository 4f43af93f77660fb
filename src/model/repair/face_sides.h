// Boundary faces: those of a model that bound its solid, and those that the solid hides.
#pragma once

#include <cstdint>
#include <vector>

#include "mesh/inside.h"
#include "model/model.h"

namespace polymorph {

enum class FaceSide : std::uint8_t {
  kBoundary,  ///< inside on one side
  kMixed,     ///< differs from place to place
  kSheet,     ///< outside on both, or neither in nor out
  kHidden,    ///< inside on both: a head within a helmet
};

/// The winding number from which on what lies behind a face is inside beyond doubt: a loose sheet
/// has half a turn on either side.
inline constexpr double kDecidedWinding = 0.75;

/// One per triangle, by the winding numbers `step` in front of and behind its middle and three
/// points near its corners.
std::vector<FaceSide> classify_faces(const Model& model, const InsideTest& inside, float step);

/// The triangles that are not hidden, ascending; all of them where every one is.
std::vector<std::uint32_t> outer_faces(const std::vector<FaceSide>& sides);

}  // namespace polymorph
