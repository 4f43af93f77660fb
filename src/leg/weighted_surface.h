// Weighted mixture of several objects (a barycentre of shapes; the idea of Solomon et al. 2015):
// the surface where the weighted sum of their signed distances is zero.
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

/// Objects that can be mixed: a reference (object 0), and a leg from it to each other object. All
/// maps go through the reference, so they compose: mapping A to B and then B to C is mapping A to
/// C.
struct ShapeSpace {
  /// Leg k leads from the reference to object k + 1. There is at least one; all are made of
  /// distances.
  std::vector<std::shared_ptr<const Leg>> legs;
  /// [object][ball]: positions of the reference's balls on each object.
  std::vector<std::vector<Vec3d>> places;
};

/// Makes the space of legs that have one source. Errors: kInput if an object is a shell or a vessel
/// (field/distance_cache.h); the engine's.
Result<ShapeSpace> make_shape_space(std::vector<std::shared_ptr<const Leg>> legs, Engine& engine);

/// An object whose weight in a mixture is above 0.
struct MixedObject {
  std::shared_ptr<const PreparedObject> object;
  float weight = 0;                       ///< (0, 1]
  std::shared_ptr<const Regression> map;  ///< map from the mixture to the object
  float scale = 1;                        ///< length in the mixture per length on the object
  Mat3 linear;                            ///< linear part of the map: rotation and scaling
};

/// Similarity transform from the reference to a mixture.
struct MeanSimilarity {
  double log_scale = 0;
  Mat3 rotation;
  Vec3d center;  ///< image of the centre of the reference's box
};

/// Mixture of a space's objects at some weights. The reference's balls are at the weighted mean of
/// their positions on all objects. The objects' rotations and scalings are averaged by their
/// logarithms. The maps to the objects are kernel regressions around the balls
/// (kernels/morph_surface.h).
struct Mixture {
  std::vector<MixedObject> objects;  ///< objects of weight above 0, in the order of the space
  MeanSimilarity mean;
  std::vector<RegressionSample> samples;  ///< one per ball of the reference
  Box box;                                ///< bounds of the surface
  float size = 0;                         ///< weighted mean of the objects' diagonals
  float floor = 0;                        ///< weighted mean of the heights of their lowest points
  LegSettings settings;
  bool stands = false;       ///< whether the surface is moved onto the common floor of its objects
  bool keeps_volume = true;  ///< whether it encloses the weighted mean of their volumes
};

/// Mixes the objects of a space. `weights`: the reference's, then one per leg, in [0, 1], with sum
/// 1. Errors: kInput for other weights.
Result<Mixture> mix_objects(const ShapeSpace& space, std::span<const float> weights);

/// Returns the similarity transform from the reference to an object of the space: rotation, scaling
/// and translation; the identity for the reference itself (object 0).
PathPart object_similarity(const ShapeSpace& space, std::size_t object);

/// Computes the part of RegressionSample::deviation that depends on the ball: 0.7 / sqrt(2 a),
/// scaled from the reference to the mixture. The squares of this part and of the other,
/// kMapDeviation (morph/smooth_map.h) of the size, are summed.
double ball_kernel_deviation(const Ball& ball, double scale);

/// Computes one object's limit for the components of a mixture. Components whose fraction of the
/// volume is below the maximum of the objects' limits are left out.
double min_mixture_component_share(const PreparedObject& object, const LegSettings& settings);

/// Surface of a mixture: where the weighted sum of its objects' distances, mapped to the mixture,
/// equals `level`.
struct WeightedSurface {
  Mesh mesh;
  float lift = 0;   ///< height by which the mesh was moved to the floor; negative: down
  float level = 0;  ///< level that keeps the volume, scene units
};
/// Extracts the surface of a mixture. An object of weight 1 is extracted from its own distances.
/// The result depends neither on objects of weight 0 nor on the number of threads. Errors:
/// kResource.
Result<WeightedSurface> weighted_surface(const Mixture& mixture, Engine& engine);

/// Evaluates, at points, the field whose zero set is the surface; it is positive inside. If one
/// object has all the weight, it is that object's signed distance. Errors: the engine's.
Result<std::vector<float>> weighted_field(const Mixture& mixture, const WeightedSurface& surface,
                                          const std::vector<Vec3>& points, Engine& engine);

/// Maps points of the mixture to one of its objects. `lift`: WeightedSurface::lift. Errors: the
/// engine's.
Result<std::vector<Vec3>> map_to_object(const MixedObject& object, float lift,
                                        const std::vector<Vec3>& points, Engine& engine);

/// Maps points of a mixture to the reference, whose weight may be 0. `lift`: WeightedSurface::lift.
/// Errors: as mix_objects(); the engine's.
Result<std::vector<Vec3>> map_to_reference(const ShapeSpace& space, std::span<const float> weights,
                                           float lift, const std::vector<Vec3>& points,
                                           Engine& engine);

/// Computes the motion of points of a mixture from the weights `now` to the weights `next`: points
/// move with the balls around them. Flow::progress is 1 minus the reference's weight. Errors: as
/// mix_objects(); the engine's.
Result<Flow> weighted_flow(const ShapeSpace& space, std::span<const float> now,
                           std::span<const float> next, const std::vector<Vec3>& points,
                           Engine& engine);

}  // namespace polymorph
