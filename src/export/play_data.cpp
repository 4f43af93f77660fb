#include "export/play_data.h"

#include <algorithm>
#include <cmath>

#include "export/surface_frames.h"
#include "field/extract_surface.h"
#include "field/level.h"
#include "leg/leg_surface.h"
#include "leg/surface_look.h"
#include "morph/motion.h"
#include "render/materials/materials.h"

namespace polymorph {
namespace {

/// Limits of the number of keys of a leg: states between which the page interpolates. Within these
/// limits there is a key per frame.
constexpr int kMinKeys = 17, kMaxKeys = 49;

/// Lists the times of a leg's keys: of the frames that show the leg, and of its ends. If there are
/// too many, keeps every n-th; if there are too few, subdivides the intervals evenly.
std::vector<float> list_key_times(const Timeline& timeline, int leg, float until) {
  std::vector<float> times{0};
  for (int frame = 1; frame <= timeline.count; ++frame) {
    const MorphState morph_state = morph_state_at(timeline, frame);
    if (morph_state.leg == leg && morph_state.object < 0 && morph_state.time > times.back() &&
        morph_state.time < until)
      times.push_back(morph_state.time);
  }
  times.push_back(until);
  const int steps = static_cast<int>(times.size()) - 1;
  std::vector<float> keys;
  if (steps >= kMaxKeys) {
    const int stride = (steps + kMaxKeys - 2) / (kMaxKeys - 1);  // steps per interval, rounded up
    for (int i = 0; i < steps; i += stride) keys.push_back(times[static_cast<std::size_t>(i)]);
  } else {
    const int subdivisions = (kMinKeys - 1 + steps - 1) / steps;  // rounded up
    for (std::size_t i = 0; i + 1 < times.size(); ++i)
      for (int step = 0; step < subdivisions; ++step)
        keys.push_back(lerp(times[i], times[i + 1],
                            static_cast<float>(step) / static_cast<float>(subdivisions)));
  }
  keys.push_back(until);
  return keys;
}

/// Makes a regression that maps points to the source and to the target. Each ball is a sample with
/// the affine map of its neighbourhood. The page weights the samples by the balls' fractions of the
/// field, so their masses and deviations are not used.
std::shared_ptr<const Regression> make_ball_map(const MorphPlan& plan, float time,
                                                const BallSet& balls) {
  auto map = std::make_shared<Regression>();
  map->maps = 2;
  map->sloped = true;
  const std::vector<PairMaps> maps = pair_maps(plan, time);
  for (std::size_t e = 0; e < balls.size(); ++e) {
    map->samples.push_back({balls[e].center, /*mass=*/1, /*deviation=*/1});
    for (const bool is_target : {false, true}) {
      const Mat3& rotation = is_target ? maps[e].to_target : maps[e].to_source;
      const Vec3 end =
          is_target ? plan.to[plan.pairs[e].to].center : plan.from[plan.pairs[e].from].center;
      BallAttribute attribute{{end.x, end.y, end.z, 0}, /*slope=*/{}};
      for (int i = 0; i < 3; ++i)
        attribute.slope[i] = to_float({rotation.at(i, 0), rotation.at(i, 1), rotation.at(i, 2)});
      map->values.push_back(attribute);
    }
  }
  return map;
}

/// Makes the key of a leg at a time: its balls, maps and level.
Result<PlayKey> make_key(const Leg& leg, float time, Engine& engine) {
  PlayKey key;
  key.time = time;
  key.progress = std::clamp(progress_at(leg.plan, time), 0.0f, 1.0f);
  key.min_component_share = static_cast<float>(min_component_share(leg, key.progress));
  const auto set_from_balls = [&]() -> Status {
    PM_TRY(const LegState state, leg_state(leg, time, engine));
    PM_TRY(const float iso, volume_iso(leg, state, engine));
    key.balls = rescale_balls(state.balls.balls(), leg.plan.kind, iso);
    key.between.map = make_ball_map(leg.plan, time, state.balls);
    key.box = surface_bounds(key.balls, leg.settings.measured);
    return Ok{};
  };
  const auto set_from_distances = [&](const DistanceLeg&) -> Status {
    PM_TRY(LegSurface surface, leg_surface(leg, time, engine));
    key.balls = rescale_balls(surface.state.balls.balls(), leg.plan.kind, surface.iso);
    key.between = std::move(surface.field);
    key.box = surface.state.map.box;
    return Ok{};
  };
  PM_TRY_STATUS(visit(leg, set_from_balls, set_from_distances));
  return key;
}

/// Gives all keys the level -1 if one of them has it, so that the page can interpolate between
/// them. Legs of shells have this level; its weight in the map is the amount by which the surface
/// is thickened (make_shortfall_regression(), morph/smooth_map.h). Their keys at the ends of the
/// leg have no level: they get the level -1 with the weight 0.
void unify_levels(std::vector<PlayKey>& keys) {
  const bool has_shell = std::any_of(keys.begin(), keys.end(),
                                     [](const PlayKey& key) { return key.between.level == -1; });
  if (!has_shell) return;
  for (PlayKey& key : keys) {
    if (key.between.level == -1) continue;
    auto map = std::make_shared<Regression>(*key.between.map);
    // The level's weight is the fourth value of the second map.
    for (std::size_t i = 1; i < map->values.size(); i += 2) map->values[i].value[3] = 0;
    key.between.map = std::move(map);
    key.between.level = -1;
  }
}

/// Returns the index of one of the actor's objects.
int object_index(const PreparedActor& actor, const PreparedObject& object) {
  for (std::size_t i = 0; i < actor.objects.size(); ++i)
    if (actor.objects[i].get() == &object) return static_cast<int>(i);
  PM_CHECK(false);
  return -1;
}

Result<PlayLeg> make_play_leg(const PreparedActor& actor, int leg_index, Engine& engine) {
  const Leg& leg = *actor.legs[static_cast<std::size_t>(leg_index)];
  PlayLeg play;
  play.from = object_index(actor, *leg.from);
  play.to = object_index(actor, *leg.to);
  play.distance = visit(
      leg, [] { return false; }, [](const DistanceLeg&) { return true; });
  for (const float time : list_key_times(actor.timeline, leg_index, leg.until)) {
    PM_TRY(PlayKey key, make_key(leg, time, engine));
    play.keys.push_back(std::move(key));
  }
  unify_levels(play.keys);
  return play;
}

/// Makes the shape space of an actor that mixes three objects or more.
PlaySpace make_play_space(const PreparedActor& actor) {
  const ShapeSpace& shapes = *actor.space;
  const MorphPlan& plan = shapes.legs.front()->plan;
  PlaySpace space;
  space.middle = actor.objects.front()->model.box().center();
  space.keeps_volume = plan.motion.keep_volume;
  space.contact = actor.settings.contact;
  space.look = actor.timeline.own_look ? 0.0f : 1.0f;
  for (std::size_t b = 0; b < plan.from.size(); ++b) {
    space.masses.push_back(static_cast<float>(plan.from_masses[b]));
    space.deviations.push_back(
        static_cast<float>(ball_kernel_deviation(plan.from[b], /*scale=*/1)));
  }
  for (std::size_t i = 0; i < actor.objects.size(); ++i) {
    const PreparedObject& object = *actor.objects[i];
    const PathPart similarity = object_similarity(shapes, i);
    PlaySpaceObject& space_object = space.objects.emplace_back(
        PlaySpaceObject{object.model.box(), object.distances.volume,
                        static_cast<float>(min_mixture_component_share(object, actor.settings)),
                        similarity.from_center, similarity.to_center, similarity.rotation_vector,
                        similarity.log_scale,
                        /*balls=*/{}});
    for (const Vec3d center : shapes.places[i]) space_object.balls.push_back(to_float(center));
  }
  return space;
}

/// Interpolates an object's colour trilinearly between the points of its colour grid. An object
/// without colours on a grid has the same colour everywhere.
Vec3 color_at(const PlayObject& object, Vec3 p) {
  return object.colors.empty() ? object.color : ColorVolume{object.color_grid, object.colors}.at(p);
}

/// Colours an object, an element of `objects`, that is the unfinished morph of `leg` at the time
/// when the leg was left. The colours are those of the leg's surface at that time.
Status color_in_flight(const PreparedActor& actor, const Leg& leg, Engine& engine,
                       std::vector<PlayObject>& objects, PlayObject& object) {
  constexpr float kCellsAlongDiagonal = 64;
  constexpr int kMarginCells = 3;
  const std::size_t index = static_cast<std::size_t>(&object - objects.data());
  const Box box = actor.objects[index]->model.box();
  Grid& grid = object.color_grid;
  grid.cell = box.diagonal() / kCellsAlongDiagonal;
  grid.origin = box.low - Vec3{kMarginCells, kMarginCells, kMarginCells} * grid.cell;
  const auto count = [&](float extent) {
    return static_cast<int>(std::ceil(extent / grid.cell)) + 2 * kMarginCells + 1;
  };
  const Vec3 size = box.size();
  grid.points = {count(size.x), count(size.y), count(size.z)};
  std::vector<Vec3> points;
  for (int z = 0; z < grid.points.z; ++z)
    for (int y = 0; y < grid.points.y; ++y)
      for (int x = 0; x < grid.points.x; ++x) points.push_back(grid_point(grid, {x, y, z}));
  PM_TRY(const LegState state, leg_state(leg, leg.until, engine));
  PM_TRY(const PullBack pulled, pull_back(leg, state, points, engine));
  const float target_weight = color_fade(progress_at(leg.plan, leg.until)).color;
  const auto find_index = [&](const PreparedObject& end) {
    return static_cast<std::size_t>(object_index(actor, end));
  };
  const PlayObject &from = objects[find_index(*leg.from)], &to = objects[find_index(*leg.to)];
  for (std::size_t i = 0; i < points.size(); ++i)
    object.colors.push_back(
        lerp(color_at(from, pulled.source[i]), color_at(to, pulled.target[i]), target_weight));
  return Ok{};
}

Result<std::vector<PlayObject>> make_play_objects(const PreparedActor& actor, Engine& engine) {
  std::vector<PlayObject> objects(actor.objects.size());
  for (std::size_t i = 0; i < objects.size(); ++i) {
    const PreparedObject& from = *actor.objects[i];
    PlayObject& object = objects[i];
    object.name = from.name;
    object.distances = from.distances.grid;
    object.smooth = from.distances.smooth;
    if (!actor.space) object.thinness = from.distances.thinness;
    if (!from.model.materials.empty()) object.color = from.model.materials.front().color;
    if (!from.colors) continue;
    object.color_grid = from.colors->grid;
    object.colors = from.colors->colors;
  }
  for (const auto& leg : actor.legs)
    if (leg->before && actor.timeline.own_look)
      PM_TRY_STATUS(
          color_in_flight(actor, *leg->before, engine, objects,
                          objects[static_cast<std::size_t>(object_index(actor, *leg->from))]));
  return objects;
}

}  // namespace

Status check_has_no_mesh_sequence(const PreparedScene& prepared) {
  for (const PreparedActor& actor : prepared.actors)
    if (actor.sequence || actor.poses)
      return make_error(ErrorCode::kInput,
                        "{}: has a mesh sequence - the pages are for morphs between objects that "
                        "stand still",
                        actor.name);
  return Ok{};
}

Result<PlayPage> make_play_page(const PreparedScene& prepared, Engine& engine) {
  const Scene& scene = prepared.scene;
  PlayPage page;
  page.fps = scene.frames.fps;
  page.field = scene.field.kind;
  const Shading look = look_shading(scene.look);
  page.look.color = look.color;
  page.look.roughness = look.roughness;
  page.look.metallic = look.metallic;
  page.camera = surface_sequence(prepared, 1, 1).cameras.front();
  page.box = prepared.box;
  page.has_ground = scene.ground.enabled;
  page.ground = scene.ground.height.value_or(prepared.box.low.y);
  // Add the actors: objects, legs or shape space, states in all frames.
  std::vector<std::string> names;  // one per actor, for the title
  for (const PreparedActor& actor : prepared.actors) {
    PlayActor& play_actor = page.actors.emplace_back();
    play_actor.name = actor.name;
    play_actor.cell = actor.settings.cell;
    PM_TRY(play_actor.objects, make_play_objects(actor, engine));
    if (actor.space) play_actor.space = make_play_space(actor);
    const int legs = actor.space ? 0 : static_cast<int>(actor.legs.size());
    for (int leg = 0; leg < legs; ++leg) {
      PM_TRY(PlayLeg play_leg, make_play_leg(actor, leg, engine));
      play_actor.legs.push_back(std::move(play_leg));
    }
    for (int frame = 1; frame <= actor.timeline.count; ++frame) {
      const MorphState morph_state = morph_state_at(actor.timeline, frame);
      play_actor.frames.push_back(
          {morph_state.leg, morph_state.time, morph_state.look, morph_state.weights});
    }
    std::vector<std::string> chain;
    // The title leaves out unfinished morphs, which are called "A -> B at 0.5".
    for (const auto& object : actor.objects)
      if (!object->name.empty() && object->name.find("->") == std::string::npos)
        chain.push_back(object->name);
    names.push_back(fmt::format("{}", fmt::join(chain, actor.space ? " + " : " to ")));
  }
  page.title = fmt::format("{}", fmt::join(names, ", "));
  return page;
}

}  // namespace polymorph
