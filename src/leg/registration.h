// Registration of a leg's map (non-rigid iterative closest points, Besl and McKay 1992, Chui and
// Rangarajan 2003), so that it carries points of one object's surface onto the other's.
#pragma once

#include <vector>

#include "base/result.h"
#include "kernels/engine.h"
#include "leg/leg.h"

namespace polymorph {

/// Offsets added to the places to which the map takes each pair's ball (MorphPlan::from_offsets).
struct Registration {
  std::vector<Vec3> from_offsets, to_offsets;  ///< one per pair, scene units
};

/// Registers the two surfaces of a leg made of distances whose plan has no offsets yet. The map
/// carries points of either surface to the other object; each is compared with the closest point
/// there if the normals agree. A pair's offset follows the mean difference around its ball
/// (docs/method.md, Registration). All offsets of a map are 0 if too few normals agree at first.
/// Offsets are halved around points of the surface where they would fold the map. Deterministic.
/// Errors: the engine's.
Result<Registration> register_surfaces(const Leg& leg, Engine& engine);

}  // namespace polymorph
