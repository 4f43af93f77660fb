// Limbs of an object, such as heads, arms, legs, tails and horns, from the merge tree of the
// geodesic distance from its centre (docs/method.md, Limbs).
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "kernels/linear.h"
#include "kernels/types.h"

namespace polymorph {

/// Number of points (stations) on a limb's centre line.
inline constexpr std::size_t kLimbStations = 7;
/// Position of station `k` along the limb, as a fraction of its length from root (0) to tip (1).
constexpr double limb_station(std::size_t k) {
  return 0.05 + 0.9 * static_cast<double>(k) / static_cast<double>(kLimbStations - 1);
}

/// A protruding part of an object. It joins the rest at a saddle of the geodesic distance from the
/// object's centre, which is a node of the merge tree. It consists of connected points that are
/// farther from the centre than this saddle.
struct Limb {
  std::array<Vec3d, kLimbStations> line;     ///< centres of the cross-sections at the stations
  std::array<double, kLimbStations> radius;  ///< half the limb's thickness at the stations
  Vec3d root;                                ///< centroid of the first 12 % of the limb, by length
  double root_distance = 0;                  ///< geodesic distance of the root from Limbs::center
  double tip_distance = 0;                   ///< geodesic distance of the tip from Limbs::center
  /// Length from the root to the limbs that sit on this one or, if there are none, to the tip.
  double stretch = 0;
  double volume = 0;  ///< fraction of the object's volume
  /// Indices in Limbs::limbs of the limbs that sit on this one, directly or on one another, such as
  /// a head's horns. It is empty for a leaf of the merge tree, on which no other limb sits.
  std::vector<std::uint32_t> nested;

  double length() const { return tip_distance - root_distance; }
  Vec3d tip() const { return line.back(); }  ///< the last station
};

/// Sample points of an object, each weighted by the area of the surface nearest to it, with the
/// geodesic distances between them: a metric measure space (Memoli 2011).
struct BodySample {
  std::vector<Vec3d> points;
  std::vector<double> shares;  ///< the points' fractions of the surface area, roughly; sum 1
  std::vector<std::vector<double>> distances;  ///< [point][point]
};

/// Vertical plane in which an object is nearly its own mirror image.
struct MirrorPlane {
  double azimuth = 0;  ///< direction of its normal, radians from +z towards +x, in [0, pi)
  double overlap = 0;  ///< fraction of the object's volume that its mirror image covers
  int swapped = 0;     ///< number of pairs of limb tips that mirror each other
};
/// Score of a mirror plane as the one between left and right: its overlap, plus 0.05 for each pair
/// of limbs that it swaps, two pairs at most. A figure with stretched arms has a second plane of
/// nearly the same overlap, but that plane swaps no limbs.
double score_plane(const MirrorPlane& plane);

/// Minimum angle between two mirror planes in Limbs::mirror_planes, radians. Of planes closer
/// together, only the best is listed.
inline constexpr double kMinPlaneAngle = 0.44;

/// An object's limbs and the measures by which they are compared. Lengths are in scene units.
struct Limbs {
  std::vector<Limb> limbs;
  BodySample sample;
  std::vector<MirrorPlane> mirror_planes;  ///< sorted by score_plane(), highest first
  Vec3d middle;                            ///< centroid of the volume
  double rms = 0;                          ///< RMS distance from `middle`
  Vec3d center;              ///< the point with the smallest mean geodesic distance to all others
  double mean_distance = 0;  ///< mean geodesic distance from `center`
  double max_distance = 0;   ///< largest geodesic distance from `center`
  double low = 0, high = 0;  ///< lowest and highest y of the volume
  /// tip_distances[i][k]: geodesic distance from the tip of limb i to the tip of limb k.
  std::vector<std::vector<double>> tip_distances;
  std::vector<double> ball_distances;  ///< geodesic distance of each ball from `center`
  /// ball_root_distances[limb][ball]: geodesic distance of the ball from the limb's root.
  std::vector<std::vector<double>> ball_root_distances;
  /// One mask per ball: bit i is set if the ball belongs to limb i.
  std::vector<std::uint32_t> ball_limbs;

  /// Tests whether a ball belongs to a limb.
  bool holds(std::uint32_t limb, std::size_t ball) const {
    return (ball_limbs[ball] >> limb & 1) != 0;
  }
};

/// Finds the limbs of the body that Gaussian balls (FieldKind::kGaussian) enclose. The merge tree
/// is that of the superlevel sets of the geodesic distance from the centre. A leaf of the tree is a
/// limb if its prominence is at least a tenth of the largest distance and half the local radius at
/// its root; there are at most 14 such limbs. An inner arc of the tree, on which other limbs sit,
/// is a limb if it is long and slim enough. Returns no limbs if the balls enclose nothing.
/// Parallel, deterministic.
Limbs find_limbs(const std::vector<Ball>& balls);

}  // namespace polymorph
