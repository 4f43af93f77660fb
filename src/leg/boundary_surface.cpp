#include "leg/boundary_surface.h"

#include "base/log.h"
#include "field/extract_surface.h"
#include "field/level.h"
#include "leg/crossfade.h"
#include "mesh/inside.h"
#include "mesh/normals.h"
#include "morph/motion.h"

namespace polymorph {
namespace {

/// Returns the object whose boundary stage shows.
const PreparedObject& end_object(const Leg& leg, const BoundaryState& moment) {
  return moment.leaving ? *leg.from : *leg.to;
}

}  // namespace

Result<BoundaryStage> make_boundary_stage(const PreparedObject& object, BoundaryMethod method,
                                          Mesh surface, const LegSettings& settings,
                                          Engine& engine) {
  constexpr double kMinArrived = 0.98;  // fraction of the visible area
  const FieldKind kind = settings.measured.field;
  if (method == BoundaryMethod::kCut) return BoundaryStage{};
  if (method == BoundaryMethod::kCrossfade)
    return BoundaryStage{CrossfadeStage{shrink_targets(object.model, object.balls, kind)}};
  const InsideTest inside(object.model);
  if (method == BoundaryMethod::kProject) {
    Projection projection = project_model(object.model, inside, object.balls, kind);
    const double arrived = projection.arrived;
    if (arrived >= kMinArrived) {
      log_debug("{}: {:.1f} % of its mesh arrives on the balls' surface", object.name,
                100 * arrived);
      return BoundaryStage{std::move(projection)};
    }
    log_info("{}: only {:.1f} % of its mesh arrives on the balls' surface - blended instead",
             object.name, 100 * arrived);
  }
  PM_TRY(BlendField field,
         make_blend_field({object.model, inside, object.closest, object.balls, std::move(surface)},
                          settings.cell, settings.measured, engine));
  return BoundaryStage{std::move(field)};
}

Result<BoundarySurface> boundary_surface(const Leg& leg, const BoundaryState& moment,
                                         Engine& engine) {
  const PreparedObject& object = end_object(leg, moment);
  BoundarySurface surface;
  const float progress = 1 - moment.boundary;  // 0: the model; 1: its balls
  if (progress <= 0 || std::holds_alternative<std::monostate>(object.boundary)) {
    surface.points = object.model.points;
  } else if (const auto* blend = std::get_if<BlendField>(&object.boundary)) {
    PM_TRY(surface.surface,
           blend_surface(*blend, object.model, progress, leg.settings.measured, engine));
  } else if (const auto* projection = std::get_if<Projection>(&object.boundary)) {
    MovingMesh mesh = projected_mesh(object.model, *projection, progress);
    surface.points = std::move(mesh.points);
    surface.corner_normals = std::move(mesh.corner_normals);
  } else {
    const auto& crossfade = std::get<CrossfadeStage>(object.boundary);
    if (moment.boundary > 0)
      surface.points = shrunk_points(object.model, crossfade.targets, moment.boundary);
    PM_TRY(const BallSet balls, balls_at(leg.plan, moment.leaving ? 0.0f : 1.0f, engine));
    surface.balls =
        grow_balls(balls.balls(), leg.settings.measured.field, moment.growth, object.field_maximum);
    PM_TRY(surface.surface,
           extract_surface(engine, surface.balls, leg.settings.cell, leg.settings.measured));
  }
  return surface;
}

std::vector<Vec3> boundary_displacement(const PreparedObject& object,
                                        const std::vector<Vec3>& points, float boundary) {
  const auto* projection = std::get_if<Projection>(&object.boundary);
  if (!projection) return {};
  std::vector<Vec3> displacement = projected_mesh(object.model, *projection, 1 - boundary).points;
  for (std::size_t i = 0; i < points.size(); ++i) displacement[i] = displacement[i] - points[i];
  return displacement;
}

Mesh model_mesh(const Model& model, const std::vector<Vec3>& points) {
  Model moved_model = model;
  moved_model.points = points;
  return {moved_model.points, point_normals(moved_model), moved_model.triangles};
}

}  // namespace polymorph
