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

/// A part that sticks out: all that is farther from the object's centre than the point where the
/// shortest paths from its tip and from another limb's tip to the centre meet.
struct Limb {
  std::array<Vec3d, kLimbStations> line;     ///< middles of its sections, from root to tip
  std::array<double, kLimbStations> radius;  ///< half its thickness there
  Vec3d root;                                ///< middle of its first tenth
  double root_distance = 0;                  ///< geodesic distance of the root from the centre
  double tip_distance = 0;
  double stretch = 0;  ///< its own length: without the limbs that sit on it
  double volume = 0;   ///< share of the object's
  /// The limbs that sit on it, directly or on one another, as a head's horns; empty for a limb
  /// with a tip of its own.
  std::vector<std::uint32_t> inner;

  double length() const { return tip_distance - root_distance; }
  Vec3d tip() const { return line.back(); }
};

/// Sample points of an object, each weighted by the part of the surface that is nearest to it, with
/// the geodesic distances between them: a metric measure space (Memoli 2011).
struct BodySample {
  std::vector<Vec3d> points;
  std::vector<double> shares;                  ///< approximate shares of the surface; sum 1
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
  Vec3d center;                            ///< the point with the smallest mean geodesic distance
  double size = 0;                         ///< mean geodesic distance from there
  double reach = 0;                        ///< largest geodesic distance from there
  double low = 0, high = 0;                ///< the solid's lowest and highest points
  /// tip_distances[i][k]: from the tip of limb i to that of limb k, along the body.
  std::vector<std::vector<double>> tip_distances;
  /// The distance of each ball along the body, from the centre and from each limb's root.
  std::vector<double> ball_distances;
  std::vector<std::vector<double>> ball_root_distances;  ///< [limb][ball]
  /// One mask per ball: bit i is set where it belongs to limb i.
  std::vector<std::uint32_t> ball_limbs;

  bool holds(std::uint32_t limb, std::size_t ball) const {
    return (ball_limbs[ball] >> limb & 1) != 0;
  }
};

/// Finds the limbs of the body that Gaussian balls (FieldKind::kGaussian) enclose, in the merge
/// tree of superlevel sets of the geodesic distance from the centre. Limbs are at most 14 of its
/// leaves, whose prominence is at least a tenth of the distance of the farthest tip, and which are
/// at least half as long as they are thick at their roots; and inner arcs that have a length of
/// their own. Returns no limbs if nothing is inside. Parallel, deterministic.
Limbs find_limbs(const std::vector<Ball>& balls);

}  // namespace polymorph
