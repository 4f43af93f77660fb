// Input of the engine for a surface between two objects: their distance fields and the map to
// both (morph_field.h has the formula).
#pragma once

#include <memory>
#include <vector>

#include "types.h"

namespace polymorph {

/// Distances to a surface at the points of a grid (x fastest), positive inside. The points on the
/// border are outside.
struct DistanceGrid {
  Grid grid;
  std::vector<float> values;
  /// Lipschitz constant: two values differ by at most `lipschitz` times the distance of their
  /// points.
  float lipschitz = 1;
};

/// Four values attached to a ball or a sample, each a linear function of position: value[i] at the
/// centre plus slope[i] . (position - centre).
struct alignas(16) BallAttribute {  // a GPU loads four floats at once
  float value[4] = {0, 0, 0, 0};
  Vec3 slope[4];
};
/// The four values of an attribute, or of a regression's map, at a point.
struct AttributeValues {
  float v[4] = {0, 0, 0, 0};
};

/// Position and kernel of a regression sample.
struct RegressionSample {
  Vec3 center;
  float mass = 1;  ///< > 0
  float deviation =
      1;  ///< standard deviation of the narrowest of its three Gaussians, scene units, > 0
};

/// The affine map x -> R x + offset, where R has the rows `rows`; the identity by default.
struct AffineMap {
  Vec3 rows[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  Vec3 offset;
};

/// A point that a regression's maps take exactly to given goals.
struct RegressionLandmark {
  Vec3 position;
  /// Standard deviation of the Gaussian that bends the maps around the point, scene units, > 0.
  float deviation = 1;
  Vec3 goal[2];  ///< image of the point under each map, the affine map included
};

/// Input of a regression (regression.h), which makes a smooth function of space, a B-spline on a
/// lattice, from samples. Each sample has one or two quadruples of values, one per map.
struct Regression {
  std::vector<RegressionSample> samples;
  int maps = 1;  ///< 1 or 2
  /// The quadruples of each sample, sample by sample, `maps` per sample.
  std::vector<BallAttribute> values;
  bool sloped = false;  ///< whether any slope is not 0
  /// The image of x under map m is affine[m](x) plus the map's first three values.
  AffineMap affine[2];
  /// Nodes of the B-spline. It is defined between node 1 and the last but one along each axis.
  Grid lattice;
  std::vector<RegressionLandmark> landmarks;  ///< met after the regression (meet_landmarks.h)
  /// Thinness of both objects (field/thinness.h), in [0, 1], 0 beyond the grids. If given, the
  /// level's weight, the second map's fourth value, is not regressed but at each node
  /// ((1 - thinness[0]) (1 - thinness[1]))^2 (WeighLevel).
  std::shared_ptr<const DistanceGrid> thinness[2];
};

/// Progress at which an object begins to lose its detail (its distances less the smoothed ones),
/// and at which it has none left. In between, its share of detail falls as 1 - smoothstep.
struct DetailFade {
  float begin = 0.1f, end = 0.55f;
};

/// Input of a surface between two objects (morph_field.h).
struct MorphSurface {
  /// Two maps: to the source, whose fourth value is the progress, and to the target, whose fourth
  /// value is the level's weight.
  std::shared_ptr<const Regression> map;
  std::shared_ptr<const DistanceGrid> from, to;
  float from_scale = 1, to_scale = 1;  ///< scene units per unit of each object's distances
  float level = 0;  ///< c, scene units: moves the surface inwards by about this much
  /// The s of morph_field.h, scene units: a distance d much longer than s counts as sqrt(2 s d). 0:
  /// distances are not changed.
  float linear_range = 0;
  /// Smoothed distances of both objects, on the grids of `from` and `to`. If null, the object keeps
  /// its detail throughout.
  std::shared_ptr<const DistanceGrid> smooth_from = nullptr, smooth_to = nullptr;
  /// Fade of the source's detail by the progress, and of the target's detail by 1 - progress.
  DetailFade fade_from = {}, fade_to = {};
};

}  // namespace polymorph
