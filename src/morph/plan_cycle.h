// Cycle consistency of plans (Huang and Guibas 2013; Solomon et al. 2015): whether mass that goes
// from object to object and back to the first one comes back to where it set out.
#pragma once

#include <optional>
#include <vector>

#include "morph/plan.h"

namespace polymorph {

/// Errors of a cycle, as shares of the RMS distance of the first object's mass from its centre.
/// Both are 0 where all mass comes back to the ball that it left, and 1 where it comes back to all
/// balls alike.
struct CycleError {
  double drift = 0;   ///< RMS distance from a ball to the mean of the places its mass comes back to
  double spread = 0;  ///< RMS distance of those places from that mean
};

/// Measures the plans from the first object around to it again. Nothing where they are no cycle:
/// each must begin with as many balls as the one before it ends with, and the last must end with
/// the balls that the first begins with.
std::optional<CycleError> cycle_error(const std::vector<const MorphPlan*>& plans);

}  // namespace polymorph
