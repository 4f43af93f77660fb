// Leg of a morph: two objects, the plan between them, and the kind of surface in between.
// leg/leg_surface.h evaluates that surface at a time.
//
// A leg's motion runs over the time in [0, 1]. The eased progress u in [0, 1] is the mean of the
// balls' eased times at that time (morph/motion.h: progress_at).
#pragma once

#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "kernels/ball_set.h"
#include "kernels/mesh.h"
#include "kernels/morph_surface.h"
#include "leg/prepared_object.h"
#include "morph/plan.h"
#include "morph/smooth_map.h"

namespace polymorph {

/// Leg whose surface is a level set of the moving balls' field.
struct BallLeg {};

/// Leg whose surface is the zero set of a mixture of both objects' signed distances, with smooth
/// maps to both (kernels/morph_surface.h).
struct DistanceLeg {
  /// Values of MorphSurface::level that nearly keep the volume, at evenly spaced eased progress
  /// from 0 to 1; empty: unknown.
  std::vector<float> levels;
  /// Extreme points along -x, x, -y, y, -z and z of all of the leg's surfaces; empty: unknown.
  std::vector<Vec3> extremes;
};

/// A leg. It is complete, and does not change, once make_leg() returns it.
struct Leg {
  std::shared_ptr<const PreparedObject> from, to;
  /// The leg before, if it is left before its end and its balls in flight are `from`; else null.
  std::shared_ptr<const Leg> before;
  MorphPlan plan;
  std::vector<std::string> landmark_names;  ///< one per landmark of the plan
  float until = 1;  ///< time of the motion at which the next leg takes over the balls
  LegSettings settings;
  std::variant<BallLeg, DistanceLeg> kind;
};

/// Calls on_balls() for a leg of balls, or on_distances(DistanceLeg) for a leg made of distances,
/// and returns the result.
template <class OnBalls, class OnDistances>
auto visit(const Leg& leg, const OnBalls& on_balls, const OnDistances& on_distances) {
  const auto* distances = std::get_if<DistanceLeg>(&leg.kind);
  return distances ? on_distances(*distances) : on_balls();
}

/// The balls of a leg at a time of their motion.
struct LegState {
  float time = 0;  ///< time of the motion, [0, 1]
  float u = 0;     ///< eased progress at that time
  BallSet balls;
  FrameMap map;  ///< map to both objects; empty unless the leg is made of distances
};

/// The surface of a leg at a time.
struct LegSurface {
  LegState state;
  float iso = 1;  ///< level of the balls' field that the mesh shows; 1 if made of distances
  Mesh mesh;
  MorphSurface field;  ///< field whose zero set is the mesh; empty unless made of distances
};

/// Computes the fraction of the volume below which a component of the leg's surface is left out, at
/// the eased progress u.
double min_component_share(const Leg& leg, float u);

/// Removes the components of the leg's surface that enclose less than min_component_share() of its
/// volume at the eased progress u. If these together enclose more than a twentieth of the volume,
/// only those below LegSettings::min_component_share are removed.
void remove_fragments(const Leg& leg, float u, Mesh& surface);

/// Removes components as the other overload does, with the given `fraction` of the volume in place
/// of min_component_share().
void remove_fragments(double fraction, const LegSettings& settings, Mesh& surface);

/// Computes the fraction of the volume below which a fragment that separates from the surface
/// between two objects is left out. `smallest`: ObjectDistances::smallest_component_share of an
/// object; that component must stay.
double min_fragment_share(double smallest);

/// Maximum difference between the heights of two objects' lowest points, as a fraction of their
/// size, at which both count as standing on one floor.
inline constexpr float kMaxFloorDifference = 0.01f;

/// Computes the size of the leg's objects: interpolates the diagonals of their boxes at the eased
/// progress u.
float object_size(const Leg& leg, float u);

}  // namespace polymorph
