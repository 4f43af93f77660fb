// Registration of a leg's map (non-rigid iterative closest points, Besl and McKay 1992, Chui and
// Rangarajan 2003), so that it carries points of one object's surface onto the other's.
#pragma once

#include <vector>

#include "base/result.h"
#include "kernels/engine.h"
#include "leg/leg.h"

namespace polymorph {

/// Offsets that are added to the images of each pair's ball: to its image on the source by the map
/// to the source, and on the target by the map to the target. MorphPlan::from_offsets
/// (morph/plan.h) says how they grow with the progress.
struct Registration {
  std::vector<Vec3> from_offsets, to_offsets;  ///< one per pair of MorphPlan::pairs, scene units
};

/// Registers the two surfaces of a leg made of distances whose plan has no offsets yet. At the ends
/// of the leg, the map carries points of either surface to the other object; each image is compared
/// with the closest point there if the normals agree. A pair's offset follows the mean difference
/// around its ball (docs/method.md, Registration). All offsets of a map are 0 if too few normals
/// agree at first. Offsets are halved around points of the surface where they would fold the map
/// (leg/map_fold.h). Deterministic. Errors: the engine's.
Result<Registration> register_surfaces(const Leg& leg, Engine& engine);

}  // namespace polymorph
