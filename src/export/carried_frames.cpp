#include "export/carried_frames.h"

#include <algorithm>
#include <optional>

#include "base/activity.h"
#include "base/plural.h"
#include "export/surface_frames.h"
#include "leg/leg_surface.h"
#include "mesh/mesh_check.h"
#include "morph/motion.h"
#include "sequence/frame/frame_geometry.h"

namespace polymorph {
namespace {

/// Limit of the memory for the meshes that all actors store, in bytes.
constexpr std::size_t kMaxStoredBytes = std::size_t{256} << 20;

constexpr const char* kAdvice =
    "leave out --topology for a mesh of its own in each frame, or choose other frames with -f";

/// Formats a point of an actor's leg in scene coordinates.
std::string format_position(const PreparedActor& actor, Vec3 point) {
  const Vec3 p = point + actor.offset;
  return fmt::format("({:.3g}, {:.3g}, {:.3g})", p.x, p.y, p.z);
}

/// Tests whether the leg has boundary stages. A distance leg needs none: its surface begins and
/// ends as the objects' own surfaces.
bool has_boundary_stages(const Leg& leg) {
  return visit(
      leg, [] { return true; }, [](const DistanceLeg&) { return false; });
}

/// Lists the states of the leg that the frames show, each once. Errors: kInput if one mesh cannot
/// represent all of them.
Status list_states(const ActorFrames& actor_frames, CarriedActor& carried) {
  const auto& [scene, actor, frames] = actor_frames;
  if (actor.sequence || actor.poses)
    return make_error(ErrorCode::kInput,
                      "{}: plays meshes that are not one through all frames - {}", actor.name,
                      "leave out --topology");
  if (actor.space)
    return make_error(ErrorCode::kInput,
                      "{}: mixes {} objects, and one mesh goes through a morph between two - {}",
                      actor.name, actor.objects.size(), "leave out --topology");
  for (const int frame : frames) {
    const MorphState state = morph_state_at(actor.timeline, shown_frame(scene, frame));
    if (!carried.states.empty() && state.leg != carried.states.front().leg)
      return make_error(ErrorCode::kInput,
                        "{}: frames {} and {} belong to different legs, and one mesh goes through "
                        "one - choose the frames of a leg with -f",
                        actor.name, frames.front(), frame);
    if (state.object >= 0 && has_boundary_stages(*actor.legs[static_cast<std::size_t>(state.leg)]))
      return make_error(
          ErrorCode::kInput,
          "{}: frame {} shows a model ({}), which has a mesh of its own - choose the "
          "frames between the models with -f, or set motion.interpolate to \"distance\"",
          actor.name, frame, stage_name(state.stage));
    if (carried.states.empty() || carried.states.back().time != state.time)
      carried.states.push_back(state);
    carried.state_of_frame.push_back(carried.states.size() - 1);
  }
  return Ok{};
}

/// Describes the topology of a mesh, as "2 parts of genus 1".
std::string describe(const MeshReport& report) {
  return fmt::format("{} of genus {}", plural(report.components, "part"), report.genus);
}

/// Makes the surface of a leg at a time.
using MakeSurface = std::function<Result<std::shared_ptr<const LegSurface>>(float time)>;

/// Checks that the topology is the same in all states. Returns the index of the state with the
/// largest surface, which has the most area for the mesh to represent.
Result<std::size_t> check_topology(const ActorFrames& actor_frames, const CarriedActor& carried,
                                   const MakeSurface& make_surface) {
  const auto& [scene, actor, frames] = actor_frames;
  std::size_t largest = 0, first_frame = 0;
  double area = -1;
  MeshReport first;
  for (std::size_t k = 0; k < carried.states.size(); ++k) {
    // Find the first of the frames that show state k.
    while (carried.state_of_frame[first_frame] != k) ++first_frame;
    PM_TRY(const std::shared_ptr<const LegSurface> surface, make_surface(carried.states[k].time));
    if (surface->mesh.triangles.empty())
      return make_error(ErrorCode::kInput, "{}: frame {} shows no surface - {}", actor.name,
                        frames[first_frame], kAdvice);
    const MeshReport report = check_mesh(surface->mesh);
    if (report.area > area) area = report.area, largest = k;
    if (k == 0) first = report;
    if (report.components == first.components && report.genus == first.genus) continue;
    // The message names the point, of either surface, that is furthest from the other surface.
    PM_TRY(const std::shared_ptr<const LegSurface> previous,
           make_surface(carried.states[k - 1].time));
    const auto find_furthest = [](const Mesh& from, const Mesh& to) {
      const std::vector<ClosestPoint> hits =
          ClosestPointQuery(to.positions, to.triangles).closest(from.positions);
      const auto farthest_hit = std::max_element(
          hits.begin(), hits.end(),
          [](const ClosestPoint& a, const ClosestPoint& b) { return a.distance < b.distance; });
      return std::pair(farthest_hit->distance, from.positions[farthest_hit - hits.begin()]);
    };
    const auto from_present = find_furthest(surface->mesh, previous->mesh),
               from_previous = find_furthest(previous->mesh, surface->mesh);
    return make_error(
        ErrorCode::kInput,
        "{}: the topology changes: frame {} has {}, and frame {} has {}; they differ "
        "most at {} - {}",
        actor.name, frames[first_frame - 1], describe(first), frames[first_frame], describe(report),
        format_position(actor, from_present.first > from_previous.first ? from_present.second
                                                                        : from_previous.second),
        kAdvice);
  }
  return largest;
}

/// Checks that the carried mesh has no inverted triangles and no error above kCarriedError.
Status check_faults(const ActorFrames& actor_frames, const CarriedActor& carried) {
  const auto& [scene, actor, frames] = actor_frames;
  for (std::size_t k = 0; k < frames.size(); ++k) {
    const CarryFault& fault = carried.mesh.faults[carried.state_of_frame[k]];
    if (fault.inverted > 0)
      return make_error(ErrorCode::kInput,
                        "{}: one mesh cannot be carried to frame {}: {} would be "
                        "inverted, one of them at {} - {}",
                        actor.name, frames[k], plural(fault.inverted, "triangle"),
                        format_position(actor, fault.inverted_position), kAdvice);
    if (carried.errors[carried.state_of_frame[k]] > kCarriedError)
      return make_error(ErrorCode::kInput,
                        "{}: one mesh cannot be carried to frame {}: at {} it is {:.2f} % of the "
                        "diagonal off the surface, and {:.1f} % are allowed - {}",
                        actor.name, frames[k], format_position(actor, fault.position),
                        100 * static_cast<double>(carried.errors[carried.state_of_frame[k]]),
                        100 * static_cast<double>(kCarriedError), kAdvice);
  }
  return Ok{};
}

/// Interpolates values at the corners of a triangle.
Vec3 interpolate_in_triangle(const std::vector<Vec3>& values, const Triangle& t,
                             const TriangleWeights& w) {
  return values[t.v[0]] * static_cast<float>(w.a) + values[t.v[1]] * static_cast<float>(w.b) +
         values[t.v[2]] * static_cast<float>(w.c);
}

}  // namespace

Result<CarriedActor> carry_actor(const ActorFrames& actor_frames, Engine& engine,
                                 const std::function<Status()>& check_stop) {
  CarriedActor carried;
  PM_TRY_STATUS(list_states(actor_frames, carried));
  const Leg& leg = *actor_frames.actor.legs[static_cast<std::size_t>(carried.states.front().leg)];
  // Describe the moving surface: its mesh at a time, and the motion of points along it. Surfaces of
  // the frames' states are needed several times, surfaces at times between them once.
  carried.surfaces.resize(carried.states.size());
  const std::size_t max_bytes = kMaxStoredBytes / actor_frames.scene.actors.size();
  std::size_t stored_bytes = 0;
  const auto make_surface = [&](float time) -> Result<std::shared_ptr<const LegSurface>> {
    PM_TRY_STATUS(check_stop());
    const auto state =
        std::find_if(carried.states.begin(), carried.states.end(),
                     [&](const MorphState& candidate) { return candidate.time == time; });
    const bool is_frame = state != carried.states.end();
    const auto k = static_cast<std::size_t>(state - carried.states.begin());
    if (is_frame && carried.surfaces[k]) return carried.surfaces[k];
    PM_TRY(LegSurface new_surface, leg_surface(leg, time, engine));
    const std::size_t bytes = new_surface.mesh.positions.size() * 2 * sizeof(Vec3) +
                              new_surface.mesh.triangles.size() * sizeof(Triangle);
    auto kept = std::make_shared<const LegSurface>(std::move(new_surface));
    if (is_frame && stored_bytes + bytes <= max_bytes)
      carried.surfaces[k] = kept, stored_bytes += bytes;
    return kept;
  };
  MovingSurface surface;
  surface.at = [&](float time) -> Result<CarryTarget> {
    PM_TRY(const std::shared_ptr<const LegSurface> state_surface, make_surface(time));
    return make_carry_target(state_surface->mesh);
  };
  surface.flow = [&](std::span<const Vec3> from, float time,
                     float next) -> Result<std::vector<Vec3>> {
    std::vector<Vec3> points(from.begin(), from.end());
    LegState state;
    state.time = time;
    PM_TRY(state.balls, balls_at(leg.plan, time, engine));
    PM_TRY(const Flow flow, flow_until(leg, state, {leg, next}, points, engine));
    for (std::size_t i = 0; i < points.size(); ++i) points[i] = points[i] + flow.displacement[i];
    return points;
  };
  std::optional<Activity> activity(std::in_place, "comparing the topology of frames");
  PM_TRY(const std::size_t start, check_topology(actor_frames, carried, make_surface));
  activity.reset();
  // Carry the mesh of the state with the largest surface to the other states.
  const float size = std::min(object_size(leg, 0), object_size(leg, 1));
  std::vector<float> times;
  for (const MorphState& state : carried.states) times.push_back(state.time);
  CarrySettings settings;
  settings.limit = kCarriedError * size;
  settings.cell = leg.settings.cell;
  settings.name = "the mesh of " + actor_frames.actor.name;
  settings.check_stop = check_stop;
  PM_TRY(carried.mesh, carry(surface, times, start, settings));
  for (const CarryFault& fault : carried.mesh.faults)
    carried.errors.push_back(fault.distance / size);
  PM_TRY_STATUS(check_faults(actor_frames, carried));
  // Transfer the source's texture coordinates to the mesh in its first state.
  if (leg.from->model.corner_uvs.empty()) return carried;
  PM_TRY(const LegState state, leg_state(leg, times.front(), engine));
  PM_TRY(const PullBack pulled, pull_back(leg, state, carried.mesh.points.front(), engine));
  carried.corner_uvs =
      object_layer(leg.from, carried.mesh.triangles, {pulled.source}).materials->all().corner_uvs;
  return carried;
}

Result<SurfaceFrame> make_carried_frame(const ActorFrames& actor_frames,
                                        const CarriedActor& carried, std::size_t k,
                                        Engine& engine) {
  const auto& [scene, actor, frames] = actor_frames;
  const std::size_t state = carried.state_of_frame[k];
  const MorphState& moment = carried.states[state];
  const std::shared_ptr<const LegSurface>& kept = carried.surfaces[state];
  PM_TRY(ActorGeometry geometry,
         kept ? leg_geometry(actor, moment, actor.legs[static_cast<std::size_t>(moment.leg)], *kept,
                             engine)
              : leg_geometry(actor, moment, engine));
  geometry.moment.object = -1;  // the leg's surface, even if the frame shows a model
  if (includes_aov(scene.image.aovs, "label")) {
    PM_TRY(geometry.surface_labels, surface_labels(geometry, engine));
  }
  const SurfaceFrame extracted = extracted_frame(actor, geometry, scene.look);
  SurfaceFrame frame;
  frame.positions = carried.mesh.points[state];
  frame.triangles = carried.mesh.triangles;
  frame.corner_uvs = carried.corner_uvs;
  frame.is_mixed = true;
  // If only the common look shows, its material is in `materials` instead of `mixture`.
  frame.mixture = extracted.mixture;
  if (extracted.mixture.name.empty() && !extracted.materials.empty()) {
    frame.mixture = extracted.materials.front();
    frame.mixture.texture = nullptr;
    frame.mixture.color = {1, 1, 1};
  }
  frame.mixture.name = actor.name;
  // Transfer normals, colours and labels from the extracted surface.
  const std::vector<ClosestPoint> hits =
      ClosestPointQuery(extracted.positions, extracted.triangles).closest(frame.positions);
  for (const ClosestPoint& hit : hits) {
    const Triangle& t = extracted.triangles[hit.triangle];
    const TriangleWeights w =
        closest_on_triangle(hit.point, extracted.positions[t.v[0]], extracted.positions[t.v[1]],
                            extracted.positions[t.v[2]]);
    if (!extracted.normals.empty())
      frame.normals.push_back(normalized(interpolate_in_triangle(extracted.normals, t, w)));
    frame.colors.push_back(interpolate_in_triangle(extracted.colors, t, w));
    if (!extracted.labels.empty())  // the label of the corner with the largest weight
      frame.labels.push_back(extracted.labels[t.v[w.a >= w.b && w.a >= w.c ? 0
                                                  : w.b >= w.c             ? 1
                                                                           : 2]]);
  }
  frame.velocities.assign(frame.positions.size(), Vec3{});
  if (k + 1 < frames.size()) {
    const std::vector<Vec3>& next = carried.mesh.points[carried.state_of_frame[k + 1]];
    const float inv_seconds = scene.frames.fps / static_cast<float>(frames[k + 1] - frames[k]);
    for (std::size_t i = 0; i < next.size(); ++i)
      frame.velocities[i] = (next[i] - frame.positions[i]) * inv_seconds;
  }
  for (Vec3& p : frame.positions) p = p + actor.offset;
  return frame;
}

}  // namespace polymorph
