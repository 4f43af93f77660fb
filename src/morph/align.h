// Rigid alignment (weighted Procrustes) of two objects before their balls are paired.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "base/matrix_decompositions.h"
#include "morph/cost.h"
#include "morph/transport.h"

namespace polymorph {

/// Axes that a rotation may have: the y axis only, which leaves a standing object upright, or any.
enum class RotationAxis : std::uint8_t { kVertical, kAny };

/// The rotation by an angle, in radians, that takes +z towards +x.
Mat3 about_vertical(double angle);

/// Computes the smallest rotation that takes one direction to another.
Mat3 rotation_between(Vec3d from, Vec3d to);

struct RotationResult {
  Mat3 rotation;
  RotationAxis axis = RotationAxis::kVertical;  ///< pass this to later calls of fit_rotation()
};

/// Finds the rotation of `a` with the cheapest transport plan to `b`. It alternates between
/// transport plan and weighted Procrustes, on 80 representatives of each object, starting from the
/// 24 rotations of a cube and from every 45 degrees about the vertical. It returns the identity
/// unless another rotation lowers the cost by the fraction `gain`. A rotation about another axis
/// than the vertical is taken only between near copies: it must cost at most 0.6 of the best
/// upright one, and the mean squared distance that it leaves between paired balls must be at most
/// `tip_residual` times the mean squared radius. Copies leave 0.04 to 0.13, different objects 0.16
/// or more. Of rotations with nearly the same cost, the smallest is chosen. The distances to
/// landmarks guide the plans, but do not depend on the rotation; the costs that are compared
/// exclude them.
RotationResult find_rotation(const CostSide& a, const CostSide& b, float label_cost, double gain,
                             double tip_residual);

/// Fits the rotation about the vertical that takes `from` to `to`, each relative to its centroid
/// (Procrustes). Returns nullopt for fewer than three points, and for points that determine no
/// rotation: all nearly on one vertical line, or with directions that disagree.
std::optional<Mat3> rotation_of_landmarks(std::span<const Vec3> from, std::span<const Vec3> to);

/// Fits the rotation, about `axis`, that minimizes the sum of squared distances of the flows, in
/// position and outward direction, weighted by amount. Both sides rotate about their origins.
Mat3 fit_rotation(const CostSide& a, const CostSide& b, std::span<const TransportFlow> flows,
                  RotationAxis axis);

}  // namespace polymorph
