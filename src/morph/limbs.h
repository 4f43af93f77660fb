// Limbs of an object (merge tree of the geodesic distance from its centre): heads, arms, legs,
// tails, horns (docs/method.md, Limbs).
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "kernels/linear.h"
#include "kernels/types.h"

namespace polymorph {

/// Number of points on a limb's centre line.
inline constexpr std::size_t kLimbStations = 7;
/// Position of point `k`, from 0 at the limb's root to 1 at its tip.
constexpr double limb_station(std::size_t k) {
  return 0.05 + 0.9 * static_cast<double>(k) / static_cast<double>(kLimbStations - 1);
}

/// A protruding part: the connected points that are farther from the object's centre than the
/// saddle at which the part joins another limb in the merge tree.
struct Limb {
  std::array<Vec3d, kLimbStations> line;     ///< centres of the cross-sections, from root to tip
  std::array<double, kLimbStations> radius;  ///< half the thickness at each of these points
  Vec3d root;                                ///< centre of the first 12 % of its length
  double root_distance = 0;                  ///< geodesic distance of the root from the centre
  double tip_distance = 0;
  double stretch = 0;  ///< length without the limbs that sit on it
  double volume = 0;   ///< fraction of the object's volume
  /// Indices of the limbs that sit on this one, directly or on each other, such as a head's horns.
  /// Empty for a leaf of the merge tree, which has a tip of its own.
  std::vector<std::uint32_t> inner;

  double length() const { return tip_distance - root_distance; }
  Vec3d tip() const { return line.back(); }
};

/// Sample points of an object, each weighted by the area of the surface nearest to it, with the
/// geodesic distances between them: a metric measure space (Memoli 2011).
struct BodySample {
  std::vector<Vec3d> points;
  std::vector<double> shares;                  ///< approximate fractions of the surface area; sum 1
  std::vector<std::vector<double>> distances;  ///< [point][point]
};

/// Vertical plane in which an object is nearly its own mirror image.
struct MirrorPlane {
  double azimuth = 0;  ///< direction of its normal, radians from +z towards +x, in [0, pi)
  double overlap = 0;  ///< fraction of the object that its mirror image covers
  int swapped = 0;     ///< pairs of limbs whose tips are each other's mirror images
};
/// Score of a plane as the one between left and right: its overlap, and 0.05 for each pair of limbs
/// that it swaps, two pairs at most. A figure that stretches its arms has a second plane with
/// nearly the same overlap, but that one swaps no limbs.
double rank_plane(const MirrorPlane& plane);

/// Min angle between two mirror planes that count as different, radians.
inline constexpr double kPlanesApart = 0.44;

/// An object's limbs. Lengths in scene units.
struct Limbs {
  std::vector<Limb> limbs;
  BodySample sample;
  std::vector<MirrorPlane> mirror_planes;  ///< best rank first; kPlanesApart or more apart
  Vec3d middle;                            ///< centre of the volume
  double rms = 0;                          ///< RMS distance from `middle`
  Vec3d center;                            ///< the point with the smallest mean geodesic distance
  double size = 0;                         ///< mean geodesic distance from `center`
  double reach = 0;                        ///< largest geodesic distance from `center`
  double low = 0, high = 0;                ///< the solid's lowest and highest points
  /// tip_distances[i][k]: geodesic distance from the tip of limb i to that of limb k.
  std::vector<std::vector<double>> tip_distances;
  std::vector<double> ball_distances;  ///< geodesic distance of each ball from `center`
  /// ball_root_distances[limb][ball]: geodesic distance of the ball from the limb's root.
  std::vector<std::vector<double>> ball_root_distances;
  /// One mask per ball: bit i is set if the ball belongs to limb i.
  std::vector<std::uint32_t> ball_limbs;

  bool holds(std::uint32_t limb, std::size_t ball) const {
    return (ball_limbs[ball] >> limb & 1) != 0;
  }
};

/// Finds the limbs of the body that Gaussian balls (FieldKind::kGaussian) enclose, in the merge
/// tree of superlevel sets of the geodesic distance from the centre. Limbs are at most 14 leaves of
/// the tree, whose prominence is at least a tenth of the largest distance and half the local radius
/// at the root. Inner arcs are limbs, too, if they are long and slim enough. Returns no limbs if
/// the balls enclose nothing. Parallel, deterministic.
Limbs find_limbs(const std::vector<Ball>& balls);

}  // namespace polymorph
