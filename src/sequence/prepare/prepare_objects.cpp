#include "sequence/prepare/prepare_objects.h"

#include <algorithm>

#include "assets/load_models.h"
#include "base/activity.h"
#include "base/log.h"
#include "base/side_by_side.h"
#include "field/extract_surface.h"
#include "field/level.h"
#include "leg/boundary_surface.h"
#include "mesh/mesh_check.h"
#include "morph/labels.h"
#include "scene/mesh_numbers.h"
#include "spheres/quality.h"

namespace polymorph {
namespace {

/// Describes the making of balls for the progress display.
std::string fit_activity(const std::string& name, const SphereSettings& spheres) {
  if (spheres.fit == FitKind::kNone) return "filling " + name + " with spheres";
  const bool counted =
      spheres.method == SphereMethod::kMedial || spheres.method == SphereMethod::kHubbard;
  return counted ? fmt::format("fitting {} balls to {}", spheres.balls, name)
                 : "fitting balls to " + name;
}

/// Returns the settings by which the object's balls are made. If its fit is not cached and must not
/// be made (Fits::kCached), chooses unfitted balls and sets object.missing_balls.
SphereSettings choose_spheres(const Preparation& preparation, const ObjectSettings& settings,
                              PreparedObject& object) {
  SphereSettings spheres = settings.spheres;
  if (!is_fitted(preparation.scene, spheres)) {
    spheres.fit = FitKind::kNone;
  } else if (preparation.fits == Fits::kCached &&
             !is_cached(object.model, spheres, preparation.cache)) {
    object.missing_balls = std::max(spheres.balls, 1);
    spheres.fit = FitKind::kNone;
    spheres.error = 0;
  }
  return spheres;
}

/// An object that is being made, and the results of the steps that run side by side.
struct ObjectInMaking {
  const ObjectSettings& chosen;  ///< the object in the scene file
  const LegSettings& settings;   ///< ActorOutline::settings
  LegKinds kinds;                ///< kinds of the legs that begin or end at it
  bool morphs = true;  ///< false: it plays a mesh sequence, and has neither balls nor distances
  SphereSettings spheres = {};  ///< choose_spheres()
  PreparedObject object = {};
  Result<Approximation> approximation = Approximation{};
  Status measured = Ok{};  ///< result of measure_objects()
};

/// Approximates the objects' models by spheres and fitted balls. Stops at the first that fails.
void approximate_models(const Preparation& preparation, std::span<ObjectInMaking> objects) {
  for (ObjectInMaking& making : objects) {
    if (!making.morphs) continue;
    const PreparedObject& object = making.object;
    const Activity activity(fit_activity(object.name, making.spheres));
    making.approximation = approximate_cached(object.model, making.spheres, preparation.cache);
    if (!making.approximation) return;
  }
}

/// Makes the object's balls from the approximation of its model.
Result<std::vector<Ball>> make_balls(const Preparation& preparation, ObjectInMaking& making) {
  const PreparedObject& object = making.object;
  Result<Approximation>& approximation = making.approximation;
  if (!approximation)
    return make_error(approximation.error().code, "{}: {}", object.name,
                      approximation.error().message);
  if (!approximation->balls.empty()) return std::move(approximation->balls);
  const LegSettings& settings = making.settings;
  const VolumeMeasure measure{solid_volume(object.model, InsideTest(object.model)), settings.cell,
                              settings.measured};
  return make_unfitted_balls(approximation->tree.leaves(), making.spheres.method,
                             preparation.scene.field, measure, preparation.engine);
}

/// Extracts the surface of the object's balls.
Result<Mesh> extract_balls(const PreparedObject& object, const LegSettings& settings,
                           Engine& engine) {
  PM_TRY(Mesh mesh, extract_surface(engine, object.balls, settings.cell, settings.measured));
  if (mesh.triangles.empty())
    return make_error(ErrorCode::kInput,
                      "{}: its {} balls have no surface at this threshold - lower report.threshold "
                      "or raise spheres.resolution",
                      object.name, object.balls.size());
  return mesh;
}

/// Makes the settings of an actor's objects and legs. `box`: box around all its objects.
LegSettings leg_settings(const Scene& scene, const Box& box, bool one_color) {
  LegSettings settings;
  const Vec3 size = box.size();
  settings.resolution = scene.surface.resolution;
  settings.cell = std::max({size.x, size.y, size.z}) / static_cast<float>(settings.resolution);
  settings.measured.field = scene.field.kind;
  settings.measured.sample_stride = scene.surface.influence;
  settings.shown = settings.measured;
  settings.shown.method = scene.surface.method;
  settings.shown.placement = scene.surface.placement;
  settings.shown.flat = scene.surface.flat;
  settings.min_component_share = scene.surface.min_component_share;
  settings.contact = scene.ground.contact;
  settings.has_colors = scene.look.kind == LookKind::kOwn && !one_color;
  return settings;
}

/// Returns the settings of the object's distances.
DistanceMeasure distance_measure(const ObjectSettings& chosen, const LegSettings& settings) {
  return {settings.cell, kThinnestPart * settings.cell,
          static_cast<double>(settings.min_component_share), chosen.spheres.solidify};
}

/// Calls prepare_transfer() with the scene's look.
void prepare_look(const Preparation& preparation, PreparedObject& object) {
  const bool with_colors =
      preparation.scene.look.kind == LookKind::kOwn && !is_one_color(object.model);
  prepare_transfer(object, with_colors, preparation.cache);
}

/// Sets the members that depend on the objects' models, but not on their balls: distances and
/// colours. Distances are loaded or measured one object after another, because both take memory,
/// and because an object may load what an equal one has just stored. Stops at the first object that
/// fails.
void measure_objects(const Preparation& preparation, std::span<ObjectInMaking> objects) {
  const auto& [scene, engine, cache, fits] = preparation;
  const auto count = static_cast<std::int64_t>(objects.size());
  run_all_side_by_side(count, [&](std::int64_t index) {
    ObjectInMaking& making = objects[static_cast<std::size_t>(index)];
    PreparedObject& object = making.object;
    if (making.morphs) object.closest = std::make_shared<const ClosestPointQuery>(object.model);
  });
  for (std::size_t i = 0; i < objects.size(); ++i) {
    ObjectInMaking& making = objects[i];
    if (!making.morphs || !making.kinds.distances) continue;
    const DistanceMeasure measure = distance_measure(making.chosen, making.settings);
    auto distances = measure_distances(making.object, measure, engine, cache);
    if (!distances) {
      making.measured = std::move(distances).error();
      return;
    }
    making.object.distances = std::move(*distances);
  }
  run_all_side_by_side(count, [&](std::int64_t index) {
    ObjectInMaking& making = objects[static_cast<std::size_t>(index)];
    if (making.morphs) prepare_look(preparation, making.object);
  });
}

/// Sets the members that depend on the object's balls. `measured`: the result of measure_objects().
Status add_ball_surface(const Preparation& preparation, const LegSettings& settings, LegKinds kinds,
                        const Status& measured, PreparedObject& object) {
  Engine& engine = preparation.engine;
  PM_TRY(Mesh surface, extract_balls(object, settings, engine));
  object.ball_volume = volume_of(surface);
  PM_TRY(object.field_maximum, find_field_maximum(engine, object.balls, settings.measured));
  PM_TRY_STATUS(measured);
  if (object.meta || !kinds.balls) return Ok{};
  PM_TRY(object.boundary, make_boundary_stage(object, preparation.scene.boundary.method,
                                              std::move(surface), settings, engine));
  return Ok{};
}

}  // namespace

Status finish_object(const Preparation& preparation, const ObjectSettings& chosen,
                     const LegSettings& settings, LegKinds kinds, PreparedObject& object) {
  const auto& [scene, engine, cache, fits] = preparation;
  object.closest = std::make_shared<const ClosestPointQuery>(object.model);
  if (kinds.distances) {
    const DistanceMeasure measure = distance_measure(chosen, settings);
    PM_TRY(object.distances, measure_distances(object, measure, engine, cache));
  }
  prepare_look(preparation, object);
  return add_ball_surface(preparation, settings, kinds, Ok{}, object);
}

Result<std::vector<ActorOutline>> outline_actors(const Scene& scene,
                                                 std::span<const ChainObject> chain,
                                                 const LoadedScene& loaded,
                                                 std::span<const SharedActor> shared) {
  std::vector<ActorOutline> outlines;
  // `models`: models of the actors that follow; `own`: models of this actor, from index `first` on.
  std::span<const Model> models = loaded.models;
  for (const std::span<const ChainObject> objects : actor_chains(chain)) {
    const std::span<const Model> own = models.first(objects.size());
    models = models.subspan(objects.size());
    const std::size_t first = loaded.models.size() - models.size() - objects.size();
    const auto& [shared_actor, offset] = shared[outlines.size()];
    ActorOutline& outline = outlines.emplace_back();
    outline.first_object = first;
    outline.shared_actor = shared_actor;
    outline.offset = offset;
    if (plays_sequence_alone(*objects.front().actor)) outline.sequence = loaded.sequences[first];
    bool one_color = true;
    for (std::size_t i = first; !outline.sequence && i < first + own.size(); ++i)
      one_color &= is_one_color(loaded.fitted_model(i));
    outline.name = objects.front().actor->name;
    outline.timeline = make_timeline(scene, *objects.front().actor);
    for (const Model& model : own) {
      outline.box = unite(outline.box, model.box());
      for (const std::string& name : model.label_names)
        if (std::find(outline.label_names.begin(), outline.label_names.end(), name) ==
            outline.label_names.end())
          outline.label_names.push_back(name);
    }
    outline.settings = leg_settings(scene, outline.box, one_color);
    if (!(outline.settings.cell > 0))
      return make_error(ErrorCode::kInput, "{}: the objects have no extent - check their scale",
                        scene.path.string());
  }
  return outlines;
}

Result<std::vector<ObjectList>> make_objects(const Preparation& preparation,
                                             std::span<const ChainObject> chain,
                                             LoadedScene& loaded,
                                             std::span<const PlacedLandmarks> landmarks,
                                             std::span<const ActorOutline> outlines) {
  if (std::any_of(chain.begin(), chain.end(), [&](const ChainObject& object) {
        const SphereSettings& spheres = object.settings->spheres;
        return spheres.coarse && is_fitted(preparation.scene, spheres) &&
               !plays_sequence_alone(*object.actor);
      }))
    log_info("the balls are coarse, as previews have them: a full render fits finer ones");
  // Free copies of shared models first: the memory estimate counts them or the objects, not both.
  // An actor has one object more than legs; `next` is the object's index in the chain.
  std::size_t next = 0;
  for (std::size_t a = 0; a < outlines.size(); ++a)
    for (std::size_t i = 0; i <= outlines[a].timeline.legs.size(); ++i, ++next)
      if (outlines[a].shared_actor != a) loaded.models[next] = {};
  // List the objects to be made.
  std::vector<ObjectInMaking> all;
  next = 0;
  for (std::size_t a = 0; a < outlines.size(); ++a) {
    const ActorOutline& outline = outlines[a];
    for (std::size_t i = 0; i <= outline.timeline.legs.size(); ++i, ++next) {
      if (outlines[a].shared_actor != a) continue;  // has the objects of an earlier actor
      const ObjectSettings& settings = *chain[next].settings;
      ObjectInMaking making{settings, outline.settings, leg_kinds(outline.timeline, i),
                            !outline.sequence};
      PreparedObject& object = making.object;
      object.name = settings.name;
      object.meta = settings.meta;
      object.front = front_azimuth(chain[next]);
      const bool is_moving = !outline.sequence && loaded.sequences[next];
      object.model = std::move(is_moving ? loaded.references[next] : loaded.models[next]);
      object.to_scene = loaded.placements[next].to_scene;
      object.landmarks = landmarks[next];
      object.label_numbers = label_numbers(object.model.label_names, outline.label_names);
      if (making.morphs) making.spheres = choose_spheres(preparation, settings, object);
      all.push_back(std::move(making));
    }
  }
  // Make balls and distances side by side.
  run_side_by_side([&] { approximate_models(preparation, all); },
                   [&] { measure_objects(preparation, all); });
  // Complete the objects, and list those of each actor.
  std::vector<ObjectList> lists(outlines.size());
  auto making = all.begin();
  for (std::size_t a = 0; a < outlines.size(); ++a) {
    if (outlines[a].shared_actor != a) {
      lists[a] = lists[outlines[a].shared_actor];
      continue;
    }
    for (std::size_t i = 0; i <= outlines[a].timeline.legs.size(); ++i, ++making) {
      PreparedObject& object = making->object;
      if (making->morphs) {
        PM_TRY(object.balls, make_balls(preparation, *making));
        object.ball_labels = face_labels(object.model, object.balls);
        PM_TRY_STATUS(add_ball_surface(preparation, making->settings, making->kinds,
                                       making->measured, object));
      }
      lists[a].push_back(std::make_shared<const PreparedObject>(std::move(object)));
    }
  }
  return lists;
}

}  // namespace polymorph
