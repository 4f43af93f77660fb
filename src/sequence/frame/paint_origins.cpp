#include "sequence/frame/paint_origins.h"

#include "image/srgb.h"
#include "leg/leg_surface.h"
#include "leg/origin_colors.h"

namespace polymorph {
namespace {

/// Paint of points that have these places on the actor's first object.
std::vector<Vec3> make_paint(const PreparedActor& actor, const std::vector<Vec3>& places) {
  std::vector<Vec3> paint = colors_by_place(places, object_of(actor, 0).model.box());
  for (Vec3& color : paint)
    color = {srgb_to_linear(color.x), srgb_to_linear(color.y), srgb_to_linear(color.z)};
  return paint;
}

/// Paint of points of the first `legs` legs' surface, at a time of the last of them. Without legs
/// the points are the first object's.
Result<std::vector<Vec3>> paint_at(const PreparedActor& actor, int legs, float time,
                                   const std::vector<Vec3>& points, Engine& engine) {
  if (legs == 0) return make_paint(actor, points);
  const auto passed = std::span(actor.legs).first(static_cast<std::size_t>(legs));
  PM_TRY(const LegState state, leg_state(*passed.back(), time, engine));
  PM_TRY(const std::vector<Vec3> places, trace_back(passed, state, points, engine));
  return make_paint(actor, places);
}

}  // namespace

Status paint_origins(const PreparedScene& prepared, Engine& engine, FrameGeometry& geometry) {
  for (std::size_t a = 0; a < prepared.actors.size(); ++a) {
    const PreparedActor& actor = prepared.actors[a];
    ActorGeometry& shown = geometry.actors[a];
    // A model that shows lies at the end of the leg before it.
    const int object = shown.moment.object, legs = object >= 0 ? object : shown.moment.leg + 1;
    const float time = object >= 0 ? 1 : shown.moment.time;
    if (!shown.surface.positions.empty()) {
      PM_TRY(shown.surface_paint, paint_at(actor, legs, time, shown.surface.positions, engine));
    }
    if (!shown.points.empty()) {
      PM_TRY(shown.point_paint,
             paint_at(actor, legs, time, object_of(actor, object).model.points, engine));
    }
  }
  return Ok{};
}

}  // namespace polymorph
