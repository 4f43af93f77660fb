#include "sequence/frame/paint_origins.h"

#include <algorithm>

#include "image/srgb.h"
#include "leg/leg_surface.h"
#include "leg/origin_colors.h"
#include "sequence/prepare/actor_poses.h"

namespace polymorph {
namespace {

/// Computes the paint of points from their positions on the actor's first object.
std::vector<Vec3> make_paint(const PreparedActor& actor, const std::vector<Vec3>& places) {
  std::vector<Vec3> paint = colors_by_position(places, object_of(actor, 0).model.box());
  for (Vec3& color : paint)
    color = {srgb_to_linear(color.x), srgb_to_linear(color.y), srgb_to_linear(color.z)};
  return paint;
}

/// Computes the paint of points on the last of `legs` at `time`; without legs, on the first object.
Result<std::vector<Vec3>> paint_at(const PreparedActor& actor,
                                   std::span<const std::shared_ptr<const Leg>> legs, float time,
                                   const std::vector<Vec3>& points, Engine& engine) {
  if (legs.empty()) return make_paint(actor, points);
  PM_TRY(const LegState state, leg_state(*legs.back(), time, engine));
  PM_TRY(const std::vector<Vec3> places, trace_back(legs, state, points, engine));
  return make_paint(actor, places);
}

/// Removes the actor's offset from points.
std::vector<Vec3> shift_back(const PreparedActor& actor, std::vector<Vec3> points) {
  for (Vec3& p : points) p = p - actor.offset;
  return points;
}

}  // namespace

Status paint_origins(const PreparedScene& prepared, Engine& engine, FrameGeometry& geometry) {
  for (std::size_t a = 0; a < prepared.actors.size(); ++a) {
    const PreparedActor& actor = prepared.actors[a];
    ActorGeometry& actor_geometry = geometry.actors[a];
    if (actor_geometry.mixture) {
      PM_TRY(const std::vector<Vec3> places,
             map_to_reference(*actor.space, actor_geometry.moment.weights, actor_geometry.lift,
                              actor_geometry.surface.positions, engine));
      actor_geometry.surface_paint = make_paint(actor, places);
      continue;
    }
    // Number of legs through which points are traced back. If an object is shown (object >= 0),
    // these lead from the first object to it.
    const int object = actor_geometry.moment.object,
              leg_count = object >= 0 ? object : actor_geometry.moment.leg + 1;
    // If three objects or more are mixed (actor.space), every leg begins at the first object, so
    // only the last leg is traced.
    std::vector<std::shared_ptr<const Leg>> legs;
    for (int i = actor.space ? std::max(leg_count - 1, 0) : 0; i < leg_count; ++i) {
      PM_TRY(std::shared_ptr<const Leg> leg, leg_at(actor, i, actor_geometry.moment.frame, engine));
      legs.push_back(std::move(leg));
    }
    const float time = object >= 0 ? 1 : actor_geometry.moment.time;
    if (!actor_geometry.surface.positions.empty()) {
      PM_TRY(
          actor_geometry.surface_paint,
          paint_at(actor, legs, time, shift_back(actor, actor_geometry.surface.positions), engine));
    }
    if (!actor_geometry.points.empty()) {
      PM_TRY(actor_geometry.point_paint,
             paint_at(actor, legs, time, shown_model(actor, actor_geometry).points, engine));
    }
  }
  return Ok{};
}

}  // namespace polymorph
