// Mesh repair by voxelization: a closed solid from a model that is open, thin, hollow or made of
// many shells.
#pragma once

#include "base/result.h"
#include "model/model.h"

namespace polymorph {

struct SolidifySettings {
  int resolution = 128;  ///< cells along the longest side, 16..512
  /// Openings up to this width are closed, and the space behind them is filled; model units. 0
  /// selects the smallest width, up to 1.05 times the longest side, such that no larger width more
  /// than doubles the enclosed volume: a cup is filled up to its rim, while a solid stays as it is.
  float gap = 0;
};

/// Makes a solid of the space that a ball of the gap's diameter cannot reach from outside. Its
/// surface is closed, consistently oriented and manifold, with cavities filled and one shell per
/// body (components below a thousandth of the largest are dropped). Vertices within two cells of
/// the model lie on it; caps over openings are minimal surfaces. Materials, labels and texture
/// coordinates are those of the nearest faces. Walls thinner than two cells vanish unless they
/// enclose something. Deterministic. Memory: about 12 bytes per cell of the model's box extended by
/// half the gap on all sides. Errors (kInput): no faces; resolution or gap out of range; nothing
/// solid is left (the message says what to do).
Result<Model> solidify(const Model& model, const SolidifySettings& settings = {});

}  // namespace polymorph
