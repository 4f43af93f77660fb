// Registration of a leg's map (non-rigid iterative closest points, Besl and McKay 1992, Chui and
// Rangarajan 2003): what lies on one object's surface is carried onto the other's.
#pragma once

#include <vector>

#include "base/result.h"
#include "kernels/engine.h"
#include "leg/leg.h"

namespace polymorph {

/// Offsets of the places that the map takes each pair's ball to (MorphPlan::from_offsets).
struct Registration {
  std::vector<Vec3> from_offsets, to_offsets;  ///< one per pair, scene units
};

/// Registers the two surfaces of a leg that is made of distances, whose plan has no offsets yet.
/// Points of either surface are carried to the other object and drawn to the closest point there
/// whose normal agrees; the pairs' offsets follow the mean around them (docs/method.md,
/// Registration). They are 0 where most normals disagree, and are halved around points of the
/// surface where they would turn the map inside out at a point of the surface. Deterministic.
/// Errors: the engine's.
Result<Registration> register_surfaces(const Leg& leg, Engine& engine);

}  // namespace polymorph
