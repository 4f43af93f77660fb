// Mesh repair by voxelization: a closed solid from a model that is open, thin, hollow or made of
// many shells.
#pragma once

#include "base/result.h"
#include "model/model.h"

namespace polymorph {

struct SolidifySettings {
  int resolution = 128;  ///< cells along the longest side, 16..512
  /// Openings up to this wide are closed, and what lies behind them is filled; lengths in model
  /// units. 0 = the smallest of some widths, up to 1.05 of the longest side, from which on no wider
  /// one would double the volume: a cup is filled up to its rim, while a solid stays as it is.
  float gap = 0;
};

/// What a ball of the gap's diameter cannot reach from outside, as a surface: closed, consistently
/// oriented and manifold, cavities filled, one shell per body (components below a thousandth of the
/// largest are dropped). Vertices within two cells of the model lie on it; caps over openings are
/// minimal surfaces. Materials, labels and texture coordinates are those of the nearest faces.
/// Walls thinner than two cells that close nothing vanish. A function of its arguments alone.
/// Memory: about 12 bytes per cell of the model's box grown by half the gap on all sides. Errors
/// (kInput): no faces; resolution or gap out of range; nothing solid is left - says what to do.
Result<Model> solidify(const Model& model, const SolidifySettings& settings = {});

}  // namespace polymorph
