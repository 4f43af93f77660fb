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

/// Fills a vessel to the brim; returns nothing if the model is no vessel. An opening is a loop of
/// boundary edges (edges of one triangle) that spans at least a twentieth of the model's area. The
/// winding number at its centre is between 0.2 and 0.8, so that no other part of the model closes
/// it. A model whose walls are single faces is a vessel if it has openings and encloses a space
/// when they are filled, unlike a plate. The filled model has the original triangles, followed by
/// fans around the centres of the openings. A closed model is a vessel if it has thin walls only
/// and solidify() makes a solid of it that has more than twice its volume.
std::optional<FilledVessel> fill_vessel(const Model& model, const InsideTest& inside);

}  // namespace polymorph
