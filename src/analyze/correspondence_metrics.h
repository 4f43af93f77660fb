// Correspondence metrics of a morph: whether corresponding points become each other, whether limbs
// survive between the ends, and whether the body stays on the ground. Formulas: docs/method.md,
// Quality.
#pragma once

#include "analyze/analyze.h"

namespace polymorph {

/// Appends the metrics of corresponding points, of facing and of poses, from the members of `ends`.
void add_correspondence_metrics(const MorphEnds& ends, Analysis& analysis);

/// Appends the metrics of hulls, of the ground and of distortion, from the measures of the frames.
void add_body_metrics(Analysis& analysis);

}  // namespace polymorph
