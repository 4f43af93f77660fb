// Smoothness metrics of a morph that need no balls: bending, pops and hand-overs, roughness of the
// frames relative to the end models, and uniformity of the steps. A pop is a step much larger than
// the steps before and after it. A hand-over is the change from the last mesh of a boundary stage
// to the surface of the balls. Formulas: docs/method.md, Quality.
#pragma once

#include <vector>

#include "analyze/analyze.h"

namespace polymorph {

/// Appends bending, pop and handover, from the frames and the boundary stages. `size` is L, the
/// diagonal of the bounding box of both objects.
void add_smoothness_metrics(const MorphEnds& ends, const std::vector<MorphFrame>& frames,
                            double size, Analysis& analysis);

/// Appends curvature, least_curvature, bumps, groove and detail, from the roughness of the frames.
void add_roughness_metrics(Analysis& analysis);

/// Appends first_step, last_step, source_step and target_step, from the steps between the frames,
/// which `analysis` already contains, and from the steps between the objects themselves and the end
/// frames. `size` is L.
void add_step_metrics(const MorphEnds& ends, const std::vector<MorphFrame>& frames, double size,
                      Analysis& analysis);

}  // namespace polymorph
