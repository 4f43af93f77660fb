// Facing: the rotation about the vertical after which one object's front faces as another's does
// (docs/method.md, Facing).
#pragma once

#include <optional>

#include "morph/limb_plan.h"
#include "morph/limbs.h"

namespace polymorph {

/// Tests whether an object is so symmetric that the direction of its best mirror plane is exact:
/// its mirror image covers at least 0.8 of its volume.
bool is_symmetric(const Limbs& limbs);

/// Finds the horizontal direction that lies in an object's mirror plane. The object's front faces
/// that way or the opposite way. Returns the azimuth, radians from +z towards +x in [pi/2, 3 pi/2),
/// or nullopt if no plane is good enough or two are nearly equally good. (MirrorPlane::azimuth is
/// the plane's normal.)
std::optional<double> find_front_axis(const Limbs& limbs);

/// Computes the angle from one azimuth to another, radians in [-pi, pi].
double azimuth_difference(double from, double to);

/// Finds the rotation about the vertical, in radians, after which the object `limbs.from` faces as
/// `limbs.to` does. Two rotations, half a turn apart, take one mirror plane to the other. The
/// rotation with the smaller fused Gromov-Wasserstein discrepancy between the bodies' samples
/// (Vayer et al. 2019) is returned, or the smaller rotation if both are nearly as good. If the
/// limbs match for certain at both (is_certain()), each discrepancy is multiplied by the cost of
/// the match; if the user has chosen matches, the costs decide alone.
/// `plan_angle`: the rotation that find_rotation() found; it replaces an angle within 25 degrees of
/// it. `from_front`, `to_front`: known azimuths of the fronts, radians from +z towards +x; if both
/// are given, the result is the angle between them. Returns nullopt if an object's front is unknown
/// and find_front_axis() finds none. `limbs` stores the matches (match_at()). Deterministic.
std::optional<double> find_facing(LimbPlan& limbs, double plan_angle,
                                  std::optional<double> from_front = {},
                                  std::optional<double> to_front = {});

}  // namespace polymorph
