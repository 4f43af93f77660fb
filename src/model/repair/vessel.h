// Vessels: models whose walls surround a space, such as a cup, a bowl or a vase.
#pragma once

#include <optional>

#include "mesh/inside.h"
#include "model/model.h"

namespace polymorph {

/// A vessel when it is full.
struct FilledVessel {
  Model model;            ///< closed
  bool is_sheet = false;  ///< its walls are faces, without an inside
};

/// Fills a vessel to the brim; empty if the model is none. A vessel of faces is one if
/// - loops of its edges that have one triangle each span at least a twentieth of its area;
/// - the middle of such a loop is half inside (the winding number), so that no other part of the
///   model closes it;
/// - and it encloses a space, unlike a plate.
/// Its own triangles come first in the filled one, then fans around the loops' centres. A closed
/// model is a vessel if it has thin walls only and solidify() makes a solid of it that has more
/// than twice its volume.
std::optional<FilledVessel> fill_vessel(const Model& model, const InsideTest& inside);

}  // namespace polymorph
