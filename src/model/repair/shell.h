// Shell detection: models that bound no solid (open shells, loose sheets, faces flipped at random).
#pragma once

#include "mesh/inside.h"
#include "model/model.h"

namespace polymorph {

/// Measures how far a model is from bounding a solid: the fraction of the points with |w| > 1/4
/// that have w < 3/4, where w is the winding number. It is 0 for a closed model, nearly 0 for one
/// with small holes and 1 for loose sheets. Evaluates 4096 points of the model's box;
/// deterministic.
double measure_undecided_fraction(const Model& model, const InsideTest& inside);

/// Models with at least this fraction are treated as shells: they have no inside, and their faces
/// are given thickness. Scanned and modelled figures with holes are below 0.25, cut or open shells
/// above 0.35.
inline constexpr double kMinShellFraction = 0.3;

}  // namespace polymorph
