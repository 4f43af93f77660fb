// Facing: the turn about the vertical that lays one object's front on another's (docs/method.md,
// Facing).
#pragma once

#include <optional>

#include "morph/limb_plan.h"
#include "morph/limbs.h"

namespace polymorph {

/// Tests whether an object is so symmetric that the direction of its best mirror plane is exact:
/// the mirror image covers at least 0.8 of the object.
bool is_symmetric(const Limbs& limbs);

/// Finds the horizontal direction that lies in an object's mirror plane; its front faces that way
/// or the opposite one. Returns the azimuth, radians from +z towards +x in [pi/2, 3 pi/2), or
/// nullopt unless there is exactly one plane. (MirrorPlane::azimuth is the plane's normal.)
std::optional<double> find_front_axis(const Limbs& limbs);

/// The angle from one azimuth to another, radians in [-pi, pi].
double turn_between(double from, double to);

/// Finds the rotation about the vertical, in radians, after which the object `limbs.from` faces as
/// `limbs.to` does. Two rotations, half a turn apart, take one mirror plane to the other. If the
/// limbs match for certain at both (is_certain()), the one with the cheaper match is returned.
/// Otherwise it is the one with the smaller fused Gromov-Wasserstein discrepancy between the
/// bodies' samples (Vayer et al. 2019), or the smaller rotation if both are nearly as good.
/// `plan_angle`: the rotation that find_rotation() found; it replaces an angle within 25 degrees of
/// it. `from_front`, `to_front`: known azimuths of the fronts, radians from +z towards +x; if both
/// are given, the result is the angle between them. Returns nullopt if a front is unknown and its
/// object has not exactly one mirror plane. Deterministic.
std::optional<double> find_facing(LimbPlan& limbs, double plan_angle,
                                  std::optional<double> from_front = {},
                                  std::optional<double> to_front = {});

}  // namespace polymorph
