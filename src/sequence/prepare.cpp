#include "sequence/prepare.h"

#include <algorithm>
#include <cmath>
#include <string_view>
#include <unordered_set>

#include "base/activity.h"
#include "base/log.h"
#include "field/extract_surface.h"
#include "field/level.h"
#include "image/image_io.h"
#include "leg/crossfade.h"
#include "mesh/components.h"
#include "mesh/mesh_check.h"
#include "mesh/normals.h"
#include "morph/labels.h"
#include "morph/motion.h"
#include "morph/smooth_map.h"
#include "scene/load_scene.h"
#include "sequence/check_plan.h"
#include "sequence/content_hash.h"
#include "sequence/film_settings.h"
#include "sequence/geometry/leg_surface.h"
#include "sequence/load_models.h"
#include "sequence/pacing.h"
#include "spheres/quality.h"

namespace polymorph {
namespace {

/// What turns the model into its balls' surface and back.
Status make_boundary(PreparedObject& object, const InsideTest& inside, Mesh surface,
                     const Scene& scene, float cell, const ExtractSettings& extract,
                     Engine& engine) {
  constexpr double kArrived = 0.98;
  object.boundary = scene.boundary.method;
  if (object.boundary == BoundaryMethod::kCrossfade)
    object.shrink_targets = shrink_targets(object.model, object.balls, scene.field.kind);
  if (object.boundary == BoundaryMethod::kProject) {
    object.projection = project_model(object.model, inside, object.balls, scene.field.kind);
    const double arrived = object.projection.arrived;
    if (arrived >= kArrived) {
      log_debug("{}: {:.1f} % of its mesh arrives on the balls' surface", object.name,
                100 * arrived);
    } else {
      log_info("{}: only {:.1f} % of its mesh arrives on the balls' surface - blended instead",
               object.name, 100 * arrived);
      object.boundary = BoundaryMethod::kBlend;
    }
  }
  if (object.boundary == BoundaryMethod::kBlend) {
    PM_TRY(object.blend, make_blend_field(object.model, inside, *object.closest, object.balls,
                                          std::move(surface), cell, extract, engine));
  }
  return Ok{};
}

/// What the legs to and from an object are made of.
struct ObjectLegs {
  bool distances = false, balls = false;
};
ObjectLegs legs_of(const Timeline& timeline, std::size_t object) {
  ObjectLegs legs;
  for (std::size_t i = object == 0 ? 0 : object - 1; i <= object && i < timeline.legs.size(); ++i)
    (timeline.legs[i].distance ? legs.distances : legs.balls) = true;
  return legs;
}

/// The object's distances, and what is measured on their surface.
Status add_distances(PreparedObject& object, float cell, float thinnest, double min_component_share,
                     bool solidified, Engine& engine, const std::filesystem::path& cache) {
  const Activity activity("measuring distances to " + object.name);
  PM_TRY(ObjectDistances distances,
         object_distances(object.model, *object.closest, cell, thinnest, min_component_share,
                          solidified, engine, cache));
  if (is_shell(distances))
    log_info(
        "{}: its faces leave {:.0f} % of what they go around undecided (open, or turned at "
        "random), so it is taken for a shell and given thickness; spheres.solidify fills it",
        object.name, 100 * distances.undecided);
  if (!(distances.volume > 0))
    return make_error(ErrorCode::kInput,
                      "{}: the model encloses nothing that cells of {:.3g} show "
                      "- raise surface.resolution or set spheres.solidify",
                      object.name, cell);
  object.distances = std::move(distances);
  return Ok{};
}

/// What gives a surface the object's colours. Faces that its solid hides are left out, where the
/// distances know them.
void add_colors(PreparedObject& object, bool own_look) {
  object.outer = object.closest;
  object.charts = texture_charts(object.model);
  std::vector<FaceSide> sides = object.distances.sides;
  if (sides.empty()) sides.assign(object.model.triangles.size(), FaceSide::kBoundary);
  const std::vector<std::uint32_t> outer = outer_faces(sides);
  if (outer.size() < sides.size())
    object.outer = std::make_shared<const ClosestPointQuery>(object.model, outer);
  if (own_look && !is_one_color(object.model))
    object.colors = std::make_shared<const ColorVolume>(make_color_volume(object.model, sides));
}

std::string stage_of_fit(const std::string& name, const SphereSettings& spheres) {
  if (spheres.fit == FitKind::kNone) return "filling " + name + " with spheres";
  const bool counted =
      spheres.method == SphereMethod::kMedial || spheres.method == SphereMethod::kHubbard;
  return counted ? fmt::format("fitting {} balls to {}", spheres.balls, name)
                 : "fitting balls to " + name;
}

bool is_fitted_coarsely(const Scene& scene) {
  for (const ActorSettings& actor : scene.actors)
    for (const ObjectSettings* object : chain_objects(actor))
      if (object->spheres.coarse && is_fitted(scene, object->spheres)) return true;
  return false;
}

/// Balls of one object, their surface's volume, and what the boundary stages need.
Status make_balls(PreparedObject& object, const ObjectSettings& settings, const Scene& scene,
                  float cell, ObjectLegs legs, const ExtractSettings& extract, Engine& engine,
                  const std::filesystem::path& cache) {
  SphereSettings spheres = settings.spheres;
  if (!is_fitted(scene, spheres)) spheres.fit = FitKind::kNone;
  auto approximation = [&] {
    const Activity activity(stage_of_fit(object.name, spheres));
    return approximate_cached(object.model, spheres, cache);
  }();
  if (!approximation)
    return make_error(approximation.error().code, "{}: {}", object.name,
                      approximation.error().message);
  object.sphere_count = approximation->tree.leaves().size();
  if (!approximation->balls.empty()) {
    object.balls = std::move(approximation->balls);
  } else {
    PM_TRY(object.balls, unfitted_balls(approximation->tree.leaves(), spheres.method,
                                        solid_volume(object.model, InsideTest(object.model)),
                                        scene.field, cell, extract, engine));
  }
  PM_TRY(Mesh mesh, extract_surface(engine, object.balls, cell, extract));
  object.ball_volume = volume_of(mesh);
  if (mesh.triangles.empty())
    return make_error(ErrorCode::kInput,
                      "{}: its {} balls have no surface at this threshold - lower report.threshold "
                      "or raise spheres.resolution",
                      object.name, object.balls.size());
  PM_TRY(object.field_maximum, field_maximum(engine, object.balls, extract));
  object.ball_labels = face_labels(object.model, object.balls);
  object.closest = std::make_shared<const ClosestPointQuery>(object.model);
  if (legs.distances)
    PM_TRY_STATUS(add_distances(object, cell, kThinnestPart * cell,
                                static_cast<double>(scene.surface.min_component_share),
                                spheres.solidify, engine, cache));
  add_colors(object, scene.look.kind == LookKind::kOwn);
  if (object.meta || !legs.balls) return Ok{};
  return make_boundary(object, InsideTest(object.model), std::move(mesh), scene, cell, extract,
                       engine);
}

/// The object as it is prepared where its fit is not cached and none is to be made: with the balls
/// straight from its spheres. Says so in `prepared`.
ObjectSettings without_fit(const ObjectSettings& settings, const Scene& scene,
                           const std::filesystem::path& cache, PreparedObject& prepared) {
  ObjectSettings plain = settings;
  SphereSettings& spheres = plain.spheres;
  if (!is_fitted(scene, spheres) || is_cached(prepared.model, spheres, cache)) return plain;
  prepared.missing_balls = std::max(spheres.balls, 1);
  spheres.fit = FitKind::kNone;
  spheres.error = 0;
  return plain;
}

PlanSide plan_side(const PreparedObject& object, const std::vector<std::int32_t>& classes) {
  PlanSide side;
  side.name = object.name;
  side.balls = object.balls;
  for (const std::uint32_t label : object.ball_labels) side.labels.push_back(classes[label]);
  return side;
}

std::uint32_t to_index(std::vector<std::string>& names, const std::string& name) {
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end()) names.push_back(name);
  return static_cast<std::uint32_t>(std::find(names.begin(), names.end(), name) - names.begin());
}

/// What the balls of the actor's last leg are at the moment at which it is left: the source of the
/// next.
Result<PreparedObject> object_in_flight(const PreparedScene& prepared, const PreparedActor& actor,
                                        bool distances, Engine& engine,
                                        const std::filesystem::path& cache) {
  const PreparedLeg& leg = actor.legs.back();
  const PreparedObject &from = actor.objects[leg.from], &to = actor.objects[leg.to];
  const int number = static_cast<int>(actor.legs.size()) - 1;
  PM_TRY(const ActorGeometry moment, volume_at(prepared, actor, engine, number, leg.until));
  PreparedObject object;
  object.name = fmt::format("{} -> {} at {:.3g}", from.name, to.name, leg.until);
  object.meta = true;
  object.balls = rescaled(moment.balls.balls(), leg.plan.kind, moment.iso);
  Mesh mesh = moment.surface;
  if (!leg.distance) {
    PM_TRY(mesh, extract_surface(engine, object.balls, actor.cell, prepared.extract));
  }
  if (mesh.triangles.empty())
    return make_error(ErrorCode::kInput, "{}: the balls have no surface to go on from",
                      object.name);
  object.ball_volume = volume_of(mesh);
  object.model.name = object.name;
  object.model.points = mesh.positions;
  object.model.triangles = mesh.triangles;
  if (distances) {
    object.closest = object.outer = std::make_shared<const ClosestPointQuery>(object.model);
    PM_TRY_STATUS(add_distances(object, actor.cell, 0,
                                static_cast<double>(prepared.scene.surface.min_component_share),
                                false, engine, cache));
  }
  // A ball belongs to what it is more of.
  const bool near = moment.moment.u < 0.5f;
  for (const Pair& pair : leg.plan.pairs)
    object.ball_labels.push_back(to_index(object.model.label_names,
                                          near ? from.model.label_names[from.ball_labels[pair.from]]
                                               : to.model.label_names[to.ball_labels[pair.to]]));
  return object;
}

/// Says by how much an object turns as a whole on its way.
void log_rotation_of(const MorphPlan& plan, const std::string& from, const std::string& to) {
  constexpr double kDegrees = 57.29577951308232;
  if (plan.motion.path == Path::kStraight) return;
  const double angle = length(plan.alignment.turn) * kDegrees;
  if (angle < 5) return;
  const double vertical = std::fabs(plan.alignment.turn.y) * kDegrees;
  if (vertical > 0.999 * angle)
    log_info("{} -> {}: turns by {:.0f} degrees about the vertical", from, to, angle);
  else
    log_info("{} -> {}: turns by {:.0f} degrees about a tilted axis (see plan.align)", from, to,
             angle);
}

/// The correspondence of balls on each of the actor's legs.
Status make_legs(PreparedActor& actor, const ActorSettings& settings, const PreparedScene& prepared,
                 Engine& engine, const std::filesystem::path& cache) {
  const auto labels_of = [&](std::size_t object) {
    return LabelledObject{actor.objects[object].name, actor.objects[object].model.label_names};
  };
  std::vector<LabelledObject> labels;
  for (std::size_t i = 0; i < actor.objects.size(); ++i) labels.push_back(labels_of(i));
  PM_TRY_STATUS(check_label_map(labels, settings.plan.labels));
  std::size_t source = 0;
  for (std::size_t i = 0; i < actor.timeline.legs.size(); ++i) {
    const Leg& leg = actor.timeline.legs[i];
    const LabelMatch match =
        match_labels(labels_of(source), labels_of(i + 1), settings.plan.labels);
    PlanSide from = plan_side(actor.objects[source], match.from);
    PlanSide to = plan_side(actor.objects[i + 1], match.to);
    for (const LandmarkSettings& landmark : settings.plan.landmarks)
      if (landmark.leg == static_cast<int>(i) + 1) {
        from.landmarks.push_back(landmark.from);
        to.landmarks.push_back(landmark.to);
      }
    const Activity activity("planning " + actor.objects[source].name + " -> " +
                            actor.objects[i + 1].name);
    MorphPlan plan = plan_morph(std::move(from), std::move(to), prepared.scene.field.kind,
                                settings.plan, leg.motion, cache);
    if (leg.distance) plan.leads = pair_leads(plan);
    log_rotation_of(plan, actor.objects[source].name, actor.objects[i + 1].name);
    actor.legs.push_back({source, i + 1, std::move(plan), leg.distance, leg.until, {}});
    PreparedLeg& made = actor.legs.back();
    if (leg.distance && move_together(made.plan)) {
      PM_TRY(Pacing pacing, even_pacing(prepared, actor, made, engine, cache));
      made.plan.pacing = std::move(pacing.times);
      made.levels = std::move(pacing.levels);
    }
    if (source != i) {
      const Leg& before = actor.timeline.legs[i - 1];
      carry_on(made.plan, actor.legs[i - 1].plan, before.until, pace_of(before) / pace_of(leg));
    }
    source = i + 1;
    if (leg.until < 1) {
      const bool goes_on = i + 1 < actor.timeline.legs.size();
      PM_TRY(PreparedObject object,
             object_in_flight(prepared, actor, goes_on && actor.timeline.legs[i + 1].distance,
                              engine, cache));
      source = actor.objects.size();
      actor.objects.push_back(std::move(object));
    }
  }
  std::unordered_set<std::string_view> known;
  for (const PreparedObject& object : actor.objects)
    for (const std::string& name : object.model.label_names)
      if (known.insert(name).second) actor.label_names.push_back(name);
  return Ok{};
}

/// An actor's balls and plans, from its models.
Result<PreparedActor> make_actor(const PreparedScene& prepared, const ActorSettings& settings,
                                 std::span<Model> models, Engine& engine,
                                 const std::filesystem::path& cache) {
  const Scene& scene = prepared.scene;
  PreparedActor actor;
  actor.name = settings.name;
  actor.timeline = make_timeline(scene, settings);
  for (const Model& model : models) actor.box = unite(actor.box, model.box());
  const Vec3 size = actor.box.size();
  actor.cell = std::max({size.x, size.y, size.z}) / static_cast<float>(scene.surface.resolution);
  if (!(actor.cell > 0))
    return make_error(ErrorCode::kInput, "{}: the objects have no extent - check their scale",
                      scene.path.string());
  const auto objects = chain_objects(settings);
  for (std::size_t i = 0; i < objects.size(); ++i) {
    PreparedObject object;
    object.name = objects[i]->name;
    object.meta = objects[i]->meta;
    object.model = std::move(models[i]);
    const ObjectSettings settings_of_it = prepared.fits == Fits::kCached
                                              ? without_fit(*objects[i], scene, cache, object)
                                              : *objects[i];
    PM_TRY_STATUS(make_balls(object, settings_of_it, scene, actor.cell, legs_of(actor.timeline, i),
                             prepared.extract, engine, cache));
    actor.objects.push_back(std::move(object));
  }
  PM_TRY_STATUS(make_legs(actor, settings, prepared, engine, cache));
  return actor;
}

void place_camera(PreparedScene& prepared) {
  const Scene& scene = prepared.scene;
  std::vector<Vec3> points;  // the models themselves: their common box has empty corners
  for (const PreparedActor& actor : prepared.actors)
    for (const PreparedObject& object : actor.objects)
      points.insert(points.end(), object.model.points.begin(), object.model.points.end());
  if (camera_moves(scene)) {
    prepared.framing =
        prepared.hashes.framing ? prepared.hashes.framing : film_framing(scene, points);
    prepared.camera = make_camera(scene_at(scene, 1.0).camera, *prepared.framing);
  } else {
    prepared.camera = make_camera(scene.camera, points, scene.image.width, scene.image.height);
  }
}

}  // namespace

Result<PreparedScene> prepare_scene(const Scene& scene, Engine& engine,
                                    const std::filesystem::path& cache, const MemoryLimit& limit,
                                    Fits fits) {
  PM_TRY_STATUS(check_model_files(scene, limit.bytes));
  PM_TRY(LoadedScene loaded, load_models(scene, true));
  if (const auto problems = plan_problems(scene, loaded.models); !problems.empty())
    return make_error(ErrorCode::kInput, "{}", fmt::join(problems, "\n"));
  if (const std::string problem = turntable_problem(scene); !problem.empty())
    return make_error(ErrorCode::kInput, "{}: {}", scene.path.string(), problem);
  PreparedScene prepared;
  prepared.scene = scene;
  prepared.memory = estimate_memory(scene, loaded.models, limit.pictures);
  PM_TRY_STATUS(check_memory(prepared.memory, limit.bytes));
  prepared.fits = fits;
  prepared.frame_count = frame_count(scene);
  if (!scene.lights.environment.empty()) {
    PM_TRY(Image image, read_image(scene.lights.environment));
    prepared.environment = std::make_shared<const Image>(std::move(image));
  }
  prepared.hashes = hash_sequence(scene, loaded.models, prepared.environment.get());
  prepared.warnings = std::move(loaded.warnings);
  prepared.extract.field = scene.field.kind;
  prepared.extract.sample_stride = scene.surface.influence;
  if (is_fitted_coarsely(scene))
    log_info("the balls are coarse, as previews have them: a full render fits finer ones");
  std::span<Model> models(loaded.models);
  for (const ActorSettings& settings : scene.actors) {
    const std::size_t count = chain_objects(settings).size();
    PM_TRY(PreparedActor actor, make_actor(prepared, settings, models.first(count), engine, cache));
    models = models.subspan(count);
    prepared.box = unite(prepared.box, actor.box);
    prepared.actors.push_back(std::move(actor));
  }
  place_camera(prepared);
  return prepared;
}

}  // namespace polymorph
