// Facing: the turn about the vertical that lays one object's front on another's (docs/method.md,
// Facing).
#pragma once

#include <optional>

#include "morph/limb_plan.h"
#include "morph/limbs.h"

namespace polymorph {

/// Tests whether an object is so much its own mirror image that the plane's direction is exact.
bool is_symmetric(const Limbs& limbs);

/// Finds the azimuth of the line on which an object's front lies, radians from +z towards +x in
/// [pi/2, 3 pi/2): that of its mirror plane. Nothing where it has none, or more than one.
std::optional<double> find_front_line(const Limbs& limbs);

/// The turn from one azimuth to another, in radians, half a turn at most.
double turn_between(double from, double to);

/// Finds the turn, in radians, by which `from` faces as `to` does. It lays the mirror plane of the
/// one on that of the other, either way round: the way at which their limbs match better, or, where
/// these are not certain, the bodies are more alike by the fused Gromov-Wasserstein discrepancy of
/// their samples (Vayer et al. 2019). Of two ways that are nearly as good, the smaller turn; near
/// `plan_angle`, that itself. Nothing where an object has no mirror plane, or more than one.
/// `from_front`, `to_front`: azimuths of the fronts where these are known, radians from +z towards
/// +x; with both the turn is the one between these. Deterministic.
std::optional<double> find_facing(LimbPlan& limbs, double plan_angle,
                                  std::optional<double> from_front = {},
                                  std::optional<double> to_front = {});

}  // namespace polymorph
