// Correspondence metrics of a morph: whether corresponding points become each other, whether limbs
// survive between the ends, and whether the body stays on the ground. Formulas: docs/method.md,
// Quality.
#pragma once

#include "analyze/analyze.h"

namespace polymorph {

/// Appends points, plan_within_5, plan_within_10, plan_error, map_within_5, map_within_10,
/// map_error, map_geodesic, true_facing, facing, registration and pose_step, from the members of
/// `ends`.
void add_correspondence_metrics(const MorphEnds& ends, Analysis& analysis);

/// Appends hull_dip, floating, sinking and distortion, from the measures of the frames.
void add_body_metrics(Analysis& analysis);

}  // namespace polymorph
