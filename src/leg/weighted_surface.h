// Weighted mixture of several objects (a barycentre of shapes; the idea of Solomon et al. 2015):
// the surface where the weighted sum of their distances is zero.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "base/box.h"
#include "base/matrix_decompositions.h"
#include "base/result.h"
#include "kernels/engine.h"
#include "leg/leg.h"
#include "morph/flow.h"

namespace polymorph {

/// Objects that can be mixed: a reference, and legs from it to each of the others. All maps go
/// through the reference, so that from one object over a second to a third is the direct way.
struct ShapeSpace {
  std::vector<std::shared_ptr<const Leg>> legs;  ///< one or more, from one object, of distances
  /// For each object, the reference first: where the reference's balls are on it.
  std::vector<std::vector<Vec3d>> places;
};

/// Makes the space of legs that have one source. Errors: kInput where an object has no inside (a
/// shell or a vessel); the engine's.
Result<ShapeSpace> make_shape_space(std::vector<std::shared_ptr<const Leg>> legs, Engine& engine);

/// An object that has a share in a mixture.
struct MixedObject {
  std::shared_ptr<const PreparedObject> object;
  float weight = 0;
  std::shared_ptr<const Regression> map;  ///< map from the mixture to it
  float scale = 1;                        ///< scene units per unit of its lengths
  Mat3 turn;                              ///< linear part of the map, for the whole
};

/// Scale and rotation of the whole from the reference to a mixture, and where its middle goes.
struct MeanSimilarity {
  double log_scale = 0;
  Mat3 rotation;
  Vec3d center;
};

/// Mixture of a space's objects at some weights. The reference's balls are at the weighted mean of
/// their places on all objects (rotations and scalings of the whole by their logarithms);
/// regressions around them are the maps to the objects.
struct Mixture {
  std::vector<MixedObject> objects;  ///< those with a weight above 0, in the space's order
  MeanSimilarity mean;
  std::vector<RegressionSample> samples;
  Box box;
  float size = 0;   ///< weighted mean of the objects' diagonals
  float floor = 0;  ///< weighted mean of the heights of their lowest points
  LegSettings settings;
  bool stands = false;       ///< whether all objects stand equally low, and the mixture is to
  bool keeps_volume = true;  ///< whether it encloses the weighted mean of their volumes
};

/// `weights`: that of the reference, then one per leg, in [0, 1], whose sum is 1. Errors: kInput
/// for weights that are no such.
Result<Mixture> mix_objects(const ShapeSpace& space, std::span<const float> weights);

/// Rotation and scaling of the whole from the reference to an object of the space; that of the
/// reference turns about its middle by nothing.
PathPart space_path(const ShapeSpace& space, std::size_t object);

/// A ball's own part in the deviation of its kernel in the maps, scene units, where the whole is
/// scaled so much.
double ball_deviation(const Ball& ball, double scale);

/// Share of the volume below which a part of a mixture is left out, as one object of it has it.
double least_component_share(const PreparedObject& object, const LegSettings& settings);

/// Surface of a mixture: where the sum of the objects' distances, pulled back, has the level that
/// keeps the volume.
struct WeightedSurface {
  Mesh mesh;
  float lift = 0;   ///< height by which it was raised to stand
  float level = 0;  ///< level of the sum of distances
};
/// An object of weight 1 has its own distances. The result depends neither on objects of weight 0
/// nor on the number of threads. Errors: kResource.
Result<WeightedSurface> weighted_surface(const Mixture& mixture, Engine& engine);

/// Evaluates the field whose zero the surface is at points: positive inside; the distance, where
/// one object has all the weight. Errors: the engine's.
Result<std::vector<float>> weighted_field(const Mixture& mixture, const WeightedSurface& surface,
                                          const std::vector<Vec3>& points, Engine& engine);

/// Places of points of the mixture on one of its objects. `lift`: that of the surface. Errors: the
/// engine's.
Result<std::vector<Vec3>> places_on(const MixedObject& object, float lift,
                                    const std::vector<Vec3>& points, Engine& engine);

/// Places of points of the space's mixture on the reference, which may have no share in it. Errors:
/// as mix_objects(); the engine's.
Result<std::vector<Vec3>> places_on_reference(const ShapeSpace& space,
                                              std::span<const float> weights, float lift,
                                              const std::vector<Vec3>& points, Engine& engine);

/// Motion of points of a mixture until the space is mixed by other weights: that of the balls
/// around them. Progress is 1 minus the reference's weight. Errors: as mix_objects(); the engine's.
Result<Flow> weighted_flow(const ShapeSpace& space, std::span<const float> now,
                           std::span<const float> next, const std::vector<Vec3>& points,
                           Engine& engine);

}  // namespace polymorph
