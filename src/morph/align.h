// Rigid alignment (weighted Procrustes) of two objects before their balls are paired.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "base/matrix_decompositions.h"
#include "morph/cost.h"
#include "morph/transport.h"

namespace polymorph {

/// The rotations that are admitted: those about the y axis, which leave a standing object upright,
/// or all.
enum class RotationAxis : std::uint8_t { kVertical, kAny };

/// The rotation by an angle, in radians, that takes +z towards +x.
Mat3 about_vertical(double angle);

/// Computes the smallest rotation that takes one direction to another.
Mat3 rotation_between(Vec3d from, Vec3d to);

struct FoundRotation {
  Mat3 rotation;
  RotationAxis axis = RotationAxis::kVertical;  ///< the axis that fit_rotation() goes on with
};

/// The rotation of `a` at which it is carried to `b` most cheaply: plan and weighted Procrustes in
/// turns, from the identity, the 24 rotations of a cube and every 45 degrees about the vertical, on
/// a few dozen representatives. The identity where none makes the plan `gain` cheaper, and one
/// about the vertical unless the objects are as good as copies of each other: another makes it a
/// good deal cheaper than the best of those and leaves a mean squared distance of at most
/// `tip_residual` between what it pairs, over the mean squared radius. Copies are at 0.04 to 0.13,
/// different objects from 0.16 on. Among rotations that are as good, the smallest. Distances to
/// landmarks lead the plans, but they are the same however `a` is turned: of the costs that are
/// compared they are no part.
FoundRotation find_rotation(const CostSide& a, const CostSide& b, float label_cost, double gain,
                            double tip_residual);

/// The rotation about the vertical that lays `from` on `to` best, both about their centres
/// (Procrustes). Nothing where there are fewer than three points, or they say nothing of a turn:
/// all above each other, or each pointing elsewhere.
std::optional<Mat3> rotation_of_landmarks(std::span<const Vec3> from, std::span<const Vec3> to);

/// The admitted rotation that makes the flows' distances least, both sides about their origins.
Mat3 fit_rotation(const CostSide& a, const CostSide& b, std::span<const TransportFlow> flows,
                  RotationAxis axis);

}  // namespace polymorph
