// Shell detection: models that bound no solid (open shells, loose sheets, faces turned at random).
#pragma once

#include "mesh/inside.h"
#include "model/model.h"

namespace polymorph {

/// Of the space that the faces go around at all (winding number beyond a quarter, either way), the
/// share where they do not enclose a point outward beyond doubt (below three quarters). 0 for a
/// closed model, and for an open one whose holes are small; 1 for loose sheets. From 4096 points of
/// the model's box; deterministic.
double undecided_share(const Model& model, const InsideTest& inside);

/// From this share on a model is taken for a shell: its faces are given thickness, and it has no
/// inside. Scanned and modelled figures with holes are below 0.25, cut or open shells from 0.35 on.
inline constexpr double kShellShare = 0.3;

}  // namespace polymorph
