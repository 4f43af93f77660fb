// Limbs of an object (merge tree of the geodesic distance from its centre): heads, arms, legs,
// tails, horns (docs/method.md, Limbs).
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "kernels/linear.h"
#include "kernels/types.h"

namespace polymorph {

/// Points along a limb's centre line.
inline constexpr std::size_t kLimbStations = 7;
/// The place of station `k` between the limb's root (0) and its tip (1).
constexpr double limb_station(std::size_t k) {
  return 0.05 + 0.9 * static_cast<double>(k) / static_cast<double>(kLimbStations - 1);
}

/// A part that sticks out: what is farther from the object's centre than the place where the ways
/// from its tip and from another limb's meet.
struct Limb {
  std::array<Vec3d, kLimbStations> line;     ///< middles of its sections, from root to tip
  std::array<double, kLimbStations> radius;  ///< half its thickness there
  Vec3d root;                                ///< middle of its first tenth
  double root_distance = 0;                  ///< geodesic distance of the root from the centre
  double tip_distance = 0;
  double stretch = 0;  ///< its own length: without the limbs that sit on it
  double volume = 0;   ///< share of the object's
  /// The limbs that sit on it, theirs included: a head's horns. None: its tip is its own.
  std::vector<std::uint32_t> inner;

  double length() const { return tip_distance - root_distance; }
  Vec3d tip() const { return line.back(); }
};

/// Points spread over an object, each for the part of it that is nearest, with the geodesic
/// distances between them: a metric measure space (Memoli 2011).
struct BodySample {
  std::vector<Vec3d> points;
  std::vector<double> shares;                  ///< shares of the surface, about; sum 1
  std::vector<std::vector<double>> distances;  ///< [point][point]
};

/// Vertical plane in which an object is nearly its own mirror image.
struct MirrorPlane {
  double azimuth = 0;  ///< direction of its normal, radians from +z towards +x, in [0, pi)
  double overlap = 0;  ///< share of the object that its mirror image covers
  int swapped = 0;     ///< pairs of limbs whose tips are each other's mirror images
};
/// Likelihood that a plane parts left from right: a body stretched out flat has another plane that
/// is nearly as good, but only this one swaps its limbs.
double rank_plane(const MirrorPlane& plane);

/// Least angle between two mirror planes that are told apart, radians.
inline constexpr double kPlanesApart = 0.44;

/// An object's limbs. Lengths in scene units.
struct Limbs {
  std::vector<Limb> limbs;
  BodySample sample;
  std::vector<MirrorPlane> mirror_planes;  ///< planes at least kPlanesApart apart, by rank
  Vec3d middle;                            ///< centre of the volume
  double rms = 0;                          ///< root of the mean squared distance from it
  Vec3d center;              ///< the place from which the mean way along the body is the shortest
  double size = 0;           ///< mean geodesic distance from there
  double reach = 0;          ///< the longest way from there
  double low = 0, high = 0;  ///< the solid's lowest and highest points
  /// tip_distances[i][k]: from the tip of limb i to that of limb k, along the body.
  std::vector<std::vector<double>> tip_distances;
  /// The distance of each ball along the body, from the centre and from each limb's root.
  std::vector<double> ball_distances;
  std::vector<std::vector<double>> ball_root_distances;  ///< [limb][ball]
  /// One mask a ball: bit i is set where it belongs to limb i.
  std::vector<std::uint32_t> ball_limbs;

  bool holds(std::uint32_t limb, std::size_t ball) const {
    return (ball_limbs[ball] >> limb & 1) != 0;
  }
};

/// Finds the limbs of what exponential balls (FieldKind::kGaussian) enclose: leaves of the merge
/// tree of superlevel sets of the geodesic distance from the centre that are at least a tenth as
/// prominent as the farthest tip is far and half as long as they are thick at their roots, at most
/// 14 of them; and the tree's inner arcs where these have a length of their own. No limbs where
/// nothing is inside. Parallel, deterministic.
Limbs find_limbs(const std::vector<Ball>& balls);

}  // namespace polymorph
