#include "leg/make_leg.h"

#include <algorithm>

#include "field/extract_surface.h"
#include "field/level.h"
#include "leg/leg_surface.h"
#include "leg/pacing.h"
#include "leg/registration.h"
#include "mesh/mesh_check.h"
#include "morph/motion.h"
#include "morph/posed_plan.h"
#include "morph/smooth_map.h"

namespace polymorph {
namespace {

/// Returns the index of the name in the list, to which it is added if missing.
std::uint32_t find_or_add_name(std::vector<std::string>& names, const std::string& name) {
  const auto found = std::find(names.begin(), names.end(), name);
  const auto index = static_cast<std::uint32_t>(found - names.begin());
  if (found == names.end()) names.push_back(name);
  return index;
}

/// Gives balls in flight the labels of the object that they are nearer to by the eased progress u.
void add_flight_labels(const Leg& leg, float u, PreparedObject& object) {
  const PreparedObject& nearer_end = u < 0.5f ? *leg.from : *leg.to;
  for (const Pair& pair : leg.plan.pairs) {
    const std::uint32_t label = nearer_end.ball_labels[u < 0.5f ? pair.from : pair.to];
    std::vector<std::string>& names = object.model.label_names;
    const std::uint32_t index = find_or_add_name(names, nearer_end.model.label_names[label]);
    if (index == object.label_numbers.size())
      object.label_numbers.push_back(nearer_end.label_numbers[label]);
    object.ball_labels.push_back(index);
  }
}

}  // namespace

Result<std::shared_ptr<const Leg>> make_leg(LegParts parts, const LegTiming& timing,
                                            const LegSettings& settings, Engine& engine,
                                            const std::filesystem::path& cache) {
  Leg leg{std::move(parts.from),
          std::move(parts.to),
          std::move(parts.before),
          std::move(parts.plan),
          std::move(parts.landmark_names),
          timing.until,
          settings,
          BallLeg{}};
  if (timing.interpolation == Interpolation::kDistance) {
    leg.plan.leads = compute_leads(leg.plan);
    DistanceLeg distances;
    leg.kind = distances;  // still without levels: measure_pacing() needs a leg of this kind
    Registration registration;
    if (move_together(leg.plan)) {
      PM_TRY(Pacing pacing, measure_pacing(leg, engine, cache));
      registration = std::move(pacing.registration);
      leg.plan.pacing = std::move(pacing.times);
      leg.plan.lifts = std::move(pacing.lifts);
      distances.levels = std::move(pacing.levels);
      distances.extremes = std::move(pacing.extremes);
    } else {
      PM_TRY(registration, register_surfaces(leg, engine));
    }
    leg.plan.from_offsets = std::move(registration.from_offsets);
    leg.plan.to_offsets = std::move(registration.to_offsets);
    leg.kind = std::move(distances);
  }
  if (leg.before) continue_motion(leg.plan, leg.before->plan, leg.before->until, parts.pace);
  return std::make_shared<const Leg>(std::move(leg));
}

std::shared_ptr<const Leg> pose_leg(const Leg& reference,
                                    std::shared_ptr<const PreparedObject> from,
                                    std::shared_ptr<const PreparedObject> to) {
  Leg leg = reference;
  leg.plan = posed_plan(reference.plan, {from->balls, from->ball_rotations},
                        {to->balls, to->ball_rotations});
  for (std::size_t l = 0; l < leg.landmark_names.size(); ++l) {
    leg.plan.landmarks[l].from = from->landmarks.at(leg.landmark_names[l]);
    leg.plan.landmarks[l].to = to->landmarks.at(leg.landmark_names[l]);
  }
  leg.from = std::move(from);
  leg.to = std::move(to);
  return std::make_shared<const Leg>(std::move(leg));
}

Result<PreparedObject> make_flight_object(const Leg& leg, bool with_distances, Engine& engine,
                                          const std::filesystem::path& cache) {
  PM_TRY(LegSurface last_surface, leg_surface(leg, leg.until, engine));
  PreparedObject object;
  object.name = fmt::format("{} -> {} at {:.3g}", leg.from->name, leg.to->name, leg.until);
  object.meta = true;
  // Rescaled, so that their surface is where their field is 1 again.
  object.balls = rescale_balls(last_surface.state.balls.balls(), leg.plan.kind, last_surface.iso);
  // The surface of the balls or, in a leg made of distances, the leg's own.
  PM_TRY(const Mesh mesh,
         visit(
             leg,
             [&] {
               return extract_surface(engine, object.balls, leg.settings.cell,
                                      leg.settings.measured);
             },
             [&](const DistanceLeg&) -> Result<Mesh> { return std::move(last_surface.mesh); }));
  if (mesh.triangles.empty())
    return make_error(ErrorCode::kInput, "{}: the balls have no surface to go on from",
                      object.name);
  object.ball_volume = volume_of(mesh);
  object.model.name = object.name;
  object.model.points = mesh.positions;
  object.model.triangles = mesh.triangles;
  if (with_distances) {
    object.closest = object.outer = std::make_shared<const ClosestPointQuery>(object.model);
    const DistanceMeasure measure = {leg.settings.cell, /*thinnest=*/0,
                                     static_cast<double>(leg.settings.min_component_share),
                                     /*solidified=*/false};
    PM_TRY(object.distances, measure_distances(object, measure, engine, cache));
  }
  add_flight_labels(leg, last_surface.state.u, object);
  const std::vector<Vec3> positions =
      landmark_positions(leg.plan, leg.until, last_surface.state.balls);
  for (std::size_t l = 0; l < positions.size(); ++l)
    object.landmarks[leg.landmark_names[l]] = positions[l];
  return object;
}

}  // namespace polymorph
