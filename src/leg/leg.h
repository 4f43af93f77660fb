// Leg of a morph: two objects, the plan between them, and the kind of the surface in between
// (leg/leg_surface.h has it at a time).
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

/// Leg whose surface is that of the moving balls' field.
struct BallLeg {};

/// Leg whose surface is a mixture of both objects' distances, carried along a smooth map.
struct DistanceLeg {
  /// Levels that keep the volume at even eased times, nearly; empty: not known.
  std::vector<float> levels;
  /// The points furthest out along -x, x, -y, y, -z and z of the leg's surfaces; empty: not known.
  std::vector<Vec3> extremes;
};

/// A leg, complete once make_leg() has made it; then it does not change.
struct Leg {
  std::shared_ptr<const PreparedObject> from, to;
  std::shared_ptr<const Leg> before;  ///< leg whose balls in flight `from` is; else null
  MorphPlan plan;
  std::vector<std::string> landmark_names;  ///< one per landmark of the plan
  float until = 1;  ///< time of the motion at which the balls are left to the next leg
  LegSettings settings;
  std::variant<BallLeg, DistanceLeg> kind;
};

/// Calls the function for the leg's kind: the one place where it is decided.
template <class OnBalls, class OnDistances>
auto visit(const Leg& leg, const OnBalls& on_balls, const OnDistances& on_distances) {
  const auto* distances = std::get_if<DistanceLeg>(&leg.kind);
  return distances ? on_distances(*distances) : on_balls();
}

/// The balls of a leg at a time of their motion.
struct LegState {
  float time = 0;  ///< time of the motion, [0, 1]
  float u = 0;     ///< progress_at() that time
  BallSet balls;
  FrameMap map;  ///< map to both objects, where the leg is made of distances
};

/// The surface of a leg at a time.
struct LegSurface {
  LegState state;
  float iso = 1;  ///< level of the balls' field that the mesh shows
  Mesh mesh;
  MorphSurface field;  ///< field whose zero the mesh is, where the leg is made of distances
};
/// The share of the volume below which a component of the leg's surface is left out at the eased
/// progress u.
double min_component_share(const Leg& leg, float u);

/// Removes from the leg's surface at the eased progress u what min_component_share() leaves out. A
/// heap of small parts, together more than a twentieth of the volume, is no crumbs and stays.
void remove_crumbs(const Leg& leg, float u, Mesh& surface);

/// Removes components that enclose less than `fraction` of a surface's volume, likewise.
void remove_crumbs(double fraction, const LegSettings& settings, Mesh& surface);

/// The share of the volume below which a fragment that comes off between objects is left out, where
/// their smallest component encloses the share `smallest`: their components stay.
double fragment_share(double smallest);

/// Objects stand equally low whose lowest points differ by no more than this share of their size.
inline constexpr float kEquallyLow = 0.01f;

/// Diagonal of the objects at an eased time: the length by which a smooth map measures.
float object_size(const Leg& leg, float u);

}  // namespace polymorph
