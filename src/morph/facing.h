// Facing: the turn about the vertical that lays one object's front on another's (docs/method.md,
// Facing).
#pragma once

#include <optional>

#include "morph/limb_plan.h"
#include "morph/limbs.h"

namespace polymorph {

/// Tests whether an object is symmetric enough for its mirror plane to have an exact direction.
bool is_symmetric(const Limbs& limbs);

/// Finds the azimuth of the mirror plane, radians from +z towards +x in [pi/2, 3 pi/2). The front
/// lies in that direction or opposite to it. Returns nullopt unless there is exactly one plane.
std::optional<double> find_front_line(const Limbs& limbs);

/// The angle from one azimuth to another, radians in [-pi, pi].
double turn_between(double from, double to);

/// Finds the rotation about the vertical, in radians, after which `from` faces as `to` does. Two
/// rotations take one mirror plane to the other. Where the limbs match for certain at both, the one
/// with the cheaper match is returned. Elsewhere it is the one with the smaller fused
/// Gromov-Wasserstein discrepancy between the bodies' samples (Vayer et al. 2019), or the smaller
/// rotation if both are nearly as good. An angle near `plan_angle` is replaced by `plan_angle`.
/// Returns nullopt unless each object has exactly one mirror plane. `from_front`, `to_front`: known
/// azimuths of the fronts, radians from +z towards +x; if both are given, the result is the angle
/// between them. Deterministic.
std::optional<double> find_facing(LimbPlan& limbs, double plan_angle,
                                  std::optional<double> from_front = {},
                                  std::optional<double> to_front = {});

}  // namespace polymorph
