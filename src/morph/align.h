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

/// Returns the rotation about the y axis by `angle` radians. Positive angles take +z towards +x.
Mat3 about_vertical(double angle);

/// Computes the smallest rotation that takes one direction to another; the identity if either
/// vector is zero. The vectors may have any length.
Mat3 rotation_between(Vec3d from, Vec3d to);

struct RotationResult {
  Mat3 rotation;
  RotationAxis axis =
      RotationAxis::kVertical;  ///< axes about which fit_rotation() may refit `rotation`
};

/// Finds the rotation of `a` with the cheapest transport plan to `b`. The search alternates between
/// transport plan and weighted Procrustes, on 80 representatives of each object (coarsen_side()).
/// It starts from the 24 rotations of a cube and from every 45 degrees about the vertical. The
/// result is the identity unless another rotation lowers the cost by the fraction `gain`. A
/// rotation about another axis than the vertical tips the object over. It is taken only between
/// near copies: it must cost at most 0.6 times as much as the best rotation about the vertical, and
/// leave a mean squared distance between paired balls of at most `tip_residual` times the squared
/// RMS size of the objects. (Copies leave 0.04 to 0.13, different objects 0.16 or more.) Of
/// rotations with nearly the same cost, the smallest is chosen. The costs that are compared exclude
/// the distances to landmarks, which guide the plans but do not depend on the rotation.
/// `label_cost`: as for cost_row().
RotationResult find_rotation(const CostSide& a, const CostSide& b, float label_cost, double gain,
                             double tip_residual);

/// Fits the rotation about the vertical that takes `from` to `to`, each relative to its centroid
/// (Procrustes). from[i] corresponds to to[i]. Returns nullopt if there are fewer than three points
/// or they determine no rotation: they lie nearly on one vertical line, or no single rotation fits
/// most of them.
std::optional<Mat3> fit_landmark_rotation(std::span<const Vec3> from, std::span<const Vec3> to);

/// Fits the rotation of `a` about its origin, and about `axis`, that minimizes the sum over the
/// flows of amount times squared distance, in position and outward direction, to `b`.
Mat3 fit_rotation(const CostSide& a, const CostSide& b, std::span<const TransportFlow> flows,
                  RotationAxis axis);

}  // namespace polymorph
