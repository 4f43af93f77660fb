// Cycle consistency of plans (Huang and Guibas 2013; Solomon et al. 2015). Mass goes from object to
// object and back to the first one; the error is the distance from where it started to where it
// ends.
#pragma once

#include <optional>
#include <vector>

#include "morph/plan.h"

namespace polymorph {

/// Errors of a cycle, relative to the RMS distance of the first object's mass from its centre. Both
/// are 0 if all mass returns to the ball that it left, and 1 if it returns to all balls alike.
struct CycleError {
  double drift = 0;   ///< RMS distance from a ball to the mean position of its returned mass
  double spread = 0;  ///< RMS distance of the returned mass from that mean
};

/// Measures plans that lead from an object back to itself. Returns nullopt if they are no cycle, or
/// if all balls of the first object are at one point. In a cycle, each plan begins with as many
/// balls as the previous one ends with, and the last ends with the balls that the first begins
/// with.
std::optional<CycleError> cycle_error(const std::vector<const MorphPlan*>& plans);

}  // namespace polymorph
