// Smoothness metrics of a morph that need no balls: roughness of the frames relative to the end
// models, and evenness of the steps. Formulas: docs/method.md, Quality.
#pragma once

#include <vector>

#include "analyze/analyze.h"

namespace polymorph {

/// Appends curvature, bumps, groove and detail, from the roughness of the frames.
void add_roughness_metrics(Analysis& analysis);

/// Appends first_step, last_step, source_step and target_step, from the steps between the frames
/// (which `analysis` has already) and those from and to the objects themselves. `size`: L.
void add_step_metrics(const MorphEnds& ends, const std::vector<MorphFrame>& frames, double size,
                      Analysis& analysis);

/// In units of L: what lies deeper inside a surface is not visible.
inline constexpr double kHiddenDepth = 0.01;

}  // namespace polymorph
