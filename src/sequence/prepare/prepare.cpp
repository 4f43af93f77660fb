#include "sequence/prepare/prepare.h"

#include "assets/alike_actors.h"
#include "assets/check_plan.h"
#include "assets/load_models.h"
#include "assets/place_landmarks.h"
#include "scene/provenance.h"
#include "sequence/prepare/actor_poses.h"
#include "sequence/prepare/film_settings.h"
#include "sequence/prepare/prepare_legs.h"
#include "sequence/prepare/prepare_objects.h"

namespace polymorph {
namespace {

/// Checks the scene against its models and places the landmarks of all objects. Errors: kInput for
/// landmarks, labels or a turntable that do not fit the models, or a blend without weights.
Result<std::vector<PlacedLandmarks>> check_scene(const Scene& scene,
                                                 std::span<const ChainObject> chain,
                                                 const LoadedScene& loaded) {
  std::vector<std::string> problems = find_plan_problems(chain, loaded.models);
  std::vector<PlacedLandmarks> landmarks = place_landmarks(scene, chain, loaded, problems);
  for (std::string& problem : find_weight_problems(scene)) problems.push_back(std::move(problem));
  if (!problems.empty()) return make_error(ErrorCode::kInput, "{}", fmt::join(problems, "\n"));
  if (const std::string problem = find_turntable_problem(scene); !problem.empty())
    return make_error(ErrorCode::kInput, "{}: {}", scene.path.string(), problem);
  return landmarks;
}

/// Places the camera so that the models and the surfaces between them are in the picture.
void place_camera(PreparedScene& prepared) {
  const Scene& scene = prepared.scene;
  // The models' points fit a picture more tightly than the corners of their common box.
  std::vector<Vec3> points;
  for (const PreparedActor& actor : prepared.actors)
    for (std::size_t i = 0; i < actor.objects.size(); ++i) {
      const bool is_moving = actor.poses && actor.poses->objects[i].sequence;
      const std::vector<Vec3>& object_points =
          is_moving ? actor.poses->objects[i].outermost : actor.objects[i]->model.points;
      for (const Vec3 p : object_points) points.push_back(p + actor.offset);
    }
  // A surface between two objects may be larger than both. Points outside the models' box by less
  // than the picture's margin do not change the camera.
  const Box models = bounding_box(points);
  const Box framed = widened(models, scene.camera.margin * models.diagonal());
  bool has_outliers = false;
  for (const PreparedActor& actor : prepared.actors)
    for (const auto& leg : actor.legs)
      if (const auto* distances = std::get_if<DistanceLeg>(&leg->kind))
        for (const Vec3 extreme : distances->extremes) {
          const Vec3 p = extreme + actor.offset;
          if (min(p, framed.low) == framed.low && max(p, framed.high) == framed.high) continue;
          points.push_back(p);
          has_outliers = true;
        }
  if (camera_moves(scene)) {
    const std::optional<Framing>& models_framing = prepared.hashes.framing;
    prepared.framing =
        models_framing && !has_outliers ? models_framing : film_framing(scene, points);
    prepared.camera = make_camera(scene_at(scene, 1.0).camera, *prepared.framing);
  } else {
    prepared.camera = make_camera(scene.camera, points, scene.image.width, scene.image.height);
  }
}

}  // namespace

Result<PreparedScene> prepare_scene(const Scene& scene, Engine& engine,
                                    const PrepareSettings& settings) {
  const MemoryLimit& limit = settings.limit;
  PreparedScene prepared;
  prepared.scene = scene;
  prepared.frame_count = frame_count(scene);
  const Preparation preparation{scene, engine, settings.cache, settings.fits};
  // Resolve the actors' chains into one list, which all later stages use.
  const std::vector<ChainObject> chain = chain_objects(scene);
  // Reject model files that memory cannot hold, before any is read.
  PM_TRY_STATUS(check_model_files(chain, limit.bytes));
  // Read the models and place them in the scene, and record which files are read.
  InputRecorder recorder;
  PM_TRY(LoadedScene loaded, load_models(scene, chain, /*textures=*/true));
  prepared.warnings = std::move(loaded.warnings);
  // Reject labels and landmarks that do not fit the models.
  PM_TRY(const std::vector<PlacedLandmarks> landmarks, check_scene(scene, chain, loaded));
  // Find the actors that can share the objects of others.
  const std::vector<SharedActor> shared = settings.sharing == Sharing::kAlike
                                              ? find_shared_actors(scene, chain, loaded)
                                              : unshared_actors(scene);
  // Reject a scene that memory cannot hold, before search trees, distances and surfaces are made.
  prepared.memory = estimate_memory(scene, chain, loaded, shared, limit.pictures);
  PM_TRY_STATUS(check_memory(prepared.memory, limit.bytes));
  // Read the environment. Beyond this point, only the cache and meshes of sequences are read.
  PM_TRY(prepared.environment, load_environment(scene));
  // Record the provenance for the frames' headers.
  prepared.inputs = recorder.files();
  prepared.provenance = encode_provenance(make_provenance(scene, prepared.inputs));
  // Hash everything that decides the frames.
  prepared.hashes = hash_sequence({scene, chain, loaded.models, prepared.environment.get(),
                                   loaded.placements, loaded.sequences});
  // Outline each actor: its timeline, box, cells and labels.
  PM_TRY(const std::vector<ActorOutline> outlines, outline_actors(scene, chain, loaded, shared));
  for (const ActorOutline& outline : outlines) prepared.box = unite(prepared.box, outline.box);
  // Make the objects: balls, distances, colours, boundary stages.
  PM_TRY(const std::vector<ObjectList> objects,
         make_objects(preparation, chain, loaded, landmarks, outlines));
  // Make the legs: plans between the objects, pacing, balls in flight.
  PM_TRY(prepared.actors, make_actors(preparation, outlines, objects, prepared.warnings));
  // Set up the poses of mesh sequences.
  for (std::size_t a = 0; a < prepared.actors.size(); ++a)
    prepared.actors[a].poses = make_poses(preparation, outlines[a], chain, objects[a], loaded);
  // Place the camera so that all objects and the surfaces between them are in the picture.
  place_camera(prepared);
  return prepared;
}

}  // namespace polymorph
