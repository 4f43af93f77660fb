// Vessels: models whose walls surround a space, such as a cup, a bowl or a vase.
#pragma once

#include <optional>

#include "mesh/inside.h"
#include "model/model.h"

namespace polymorph {

/// A filled vessel.
struct FilledVessel {
  Model model;            ///< closed
  bool is_sheet = false;  ///< its walls are single faces, without thickness
};

/// Fills a vessel to the brim; returns nothing if the model is no vessel. A model whose walls are
/// single faces is a vessel if
/// - loops of its boundary edges (with one triangle each) span at least a twentieth of its area
///   each;
/// - the winding number at the centre of such a loop is between 0.2 and 0.8, so that no other part
///   of the model closes the loop;
/// - the filled model encloses a space, unlike a plate.
/// The filled model has the original triangles, followed by fans around the centres of these loops.
/// A closed model is a vessel if it has thin walls only and solidify() makes a solid of it that has
/// more than twice its volume.
std::optional<FilledVessel> fill_vessel(const Model& model, const InsideTest& inside);

}  // namespace polymorph
