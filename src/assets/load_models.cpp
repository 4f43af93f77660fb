#include "assets/load_models.h"

#include <fmt/format.h>

#include <initializer_list>
#include <map>
#include <utility>

#include "assets/check_plan.h"
#include "assets/load_object.h"
#include "assets/mesh_sequence.h"
#include "assets/place_landmarks.h"
#include "base/activity.h"
#include "base/exact_math.h"
#include "base/parallel.h"
#include "image/image_io.h"
#include "model/transform.h"
#include "morph/timeline.h"
#include "scene/mesh_numbers.h"
#include "spheres/spheres.h"

namespace polymorph {
namespace {

/// Tests whether a landmark of the object names a vertex.
bool names_vertices(const ChainObject& object) {
  const ObjectLandmarks* landmarks = find_landmarks(object.actor->plan, *object.settings);
  return landmarks && std::any_of(landmarks->begin(), landmarks->end(),
                                  [](const auto& entry) { return !entry.second.point; });
}

/// Key of an object's file or built-in shape, and of the settings that decide how it is read.
std::string file_key(const ObjectSettings& object) {
  return fmt::format("{}\n{}\n{}\n{}", object.model.string(), object.shape,
                     static_cast<int>(object.up), fmt::join(object.range, " "));
}
/// Key of an object's reading: objects of equal keys share one (Readings). The key of a mesh
/// sequence is unique, because its outermost points depend on the object's transform.
std::string reading_key(const ChainObject& object) {
  return is_mesh_sequence(*object.settings) ? fmt::format("{}", fmt::ptr(object.settings))
                                            : file_key(*object.settings);
}
/// Key of an object's shape, sphere settings and `arrange`. `placing`: rotations and scales that
/// become part of the key.
std::string shape_key(const ObjectSettings& object, std::initializer_list<Vec3> placing) {
  std::string key = file_key(object);
  for (const Vec3& v : placing) key += fmt::format("\n{} {} {}", v.x, v.y, v.z);
  const auto& [method, balls, error, resolution, root_margin, fit, inside, solidify, coarse] =
      object.spheres;
  return key + fmt::format("\n{} {} {} {} {} {} {} {} {} {}", static_cast<int>(method), balls,
                           error, resolution, root_margin, static_cast<int>(fit),
                           static_cast<int>(inside), solidify, coarse, object.arrange);
}
/// Key of an object's shape, sphere settings, rotation and size, for find_first_congruent().
std::string congruence_key(const ChainObject& chained) {
  const ObjectSettings& object = *chained.settings;
  const ActorSettings& actor = *chained.actor;
  return shape_key(object, {object.rotate, object.scale, actor.rotate, actor.scale});
}
/// Key for find_first_similar(), without rotation and uniform scale. Some objects' spheres depend
/// on these: mesh sequences, objects with other scales, and spheres made of cells, which are
/// aligned with the axes. Their key is congruence_key().
std::string similarity_key(const ChainObject& chained) {
  const ObjectSettings& object = *chained.settings;
  const auto is_uniform = [](Vec3 scale) {
    return scale.x > 0 && scale == Vec3{scale.x, scale.x, scale.x};
  };
  const bool has_cells = object.spheres.method == SphereMethod::kOctree ||
                         object.spheres.method == SphereMethod::kActive;
  if (is_mesh_sequence(object) || has_cells || !is_uniform(object.scale) ||
      !is_uniform(chained.actor->scale))
    return congruence_key(chained);
  return shape_key(object, /*placing=*/{});
}

/// Returns for each object the index of the first one with the same key. `key(object)` returns an
/// object's key.
template <class Key>
std::vector<std::size_t> first_with_key(std::span<const ChainObject> chain, const Key& key) {
  std::map<std::string, std::size_t> firsts;
  std::vector<std::size_t> result;
  for (std::size_t i = 0; i < chain.size(); ++i)
    result.push_back(firsts.try_emplace(key(chain[i]), i).first->second);
  return result;
}

/// Objects as they were read. Each file is read once, for the first object that uses it.
struct Readings {
  struct Reading {
    std::vector<std::string> warnings;
    Result<LoadedObject> object = LoadedObject{};  ///< the object, or the error of reading it
    std::shared_ptr<MeshSequence> meshes;  ///< set if `object` is the stand-in of a mesh sequence
    std::size_t uses = 0;         ///< number of objects that have yet to take() this reading
    bool needs_vertices = false;  ///< a landmark of one of these objects names a vertex
  };
  /// For each object the index of its reading: the first object with the same reading_key().
  std::vector<std::size_t> first;
  std::vector<Reading> readings;  ///< one per object; readings[i] is unused unless first[i] == i

  explicit Readings(std::span<const ChainObject> chain)
      : first(first_with_key(chain, reading_key)), readings(chain.size()) {
    for (std::size_t i = 0; i < chain.size(); ++i) {
      ++readings[first[i]].uses;
      readings[first[i]].needs_vertices |= names_vertices(chain[i]);
    }
  }
  /// Reads the file of an object, or surveys the meshes of a sequence. `object`: an index with
  /// first[object] == object.
  void read(const Scene& scene, std::span<const ChainObject> chain, std::size_t object,
            bool textures) {
    Reading& reading = readings[object];
    const ObjectSettings& settings = *chain[object].settings;
    if (!is_mesh_sequence(settings)) {
      reading.object = load_object(settings, textures, reading.needs_vertices, reading.warnings);
      return;
    }
    auto survey = survey_meshes(scene, chain[object], textures, reading.warnings);
    if (!survey) {
      reading.object = std::move(survey).error();
      return;
    }
    reading.object = std::move(survey->stand_in);
    reading.meshes = std::make_shared<MeshSequence>(std::move(survey->sequence));
  }
  /// Sets the transforms of the object's mesh sequence, which no other object shares, and returns
  /// the sequence; null if the object is none.
  std::shared_ptr<const MeshSequence> place_meshes(std::size_t object,
                                                   const ObjectPlacement& placing) {
    const std::shared_ptr<MeshSequence>& meshes = readings[object].meshes;
    if (meshes) meshes->steps = placing.steps;
    return meshes;
  }
  /// Returns an object as it was read. The first object of a reading also adds its warnings, so
  /// that each is reported once. Call once per object.
  Result<LoadedObject> take(std::size_t object, std::vector<std::string>& warnings) {
    Reading& reading = readings[first[object]];
    if (first[object] == object)
      warnings.insert(warnings.end(), reading.warnings.begin(), reading.warnings.end());
    if (--reading.uses > 0) return reading.object;
    return std::move(reading.object);  // the last object needs no copy
  }
};

/// Transforms an object into the scene. If `stand`, the object is rotated, scaled to the diagonal
/// `size` (<= 0: not scaled), centred on the y axis and put with its lowest point on y = 0. Its own
/// scale, about the origin, and its translation follow. Otherwise only its own scale, rotation and
/// translation apply, in this order. `actor`: transform of the actor, applied last.
void arrange(LoadedObject& read, const ObjectSettings& object, bool stand, float size,
             const Transform& actor) {
  Model& model = read.model;
  const auto transform_by = [&read](const Transform& step) {
    read.placing.to_scene = compose(step, read.placing.to_scene);
    read.placing.steps.push_back(step);
    return transformed(read.model, step);
  };
  if (!stand) {
    model =
        transform_by(compose(actor, make_transform(object.translate, object.rotate, object.scale)));
    return;
  }
  const float diagonal = model.box().diagonal();  // unrotated, so that no rotation changes the size
  model = transform_by(make_transform({}, object.rotate, {1, 1, 1}));
  const Box box = model.box();
  const float factor = size > 0 && diagonal > 0 ? size / diagonal : 1;
  const Vec3 bottom_center{box.center().x, box.low.y, box.center().z};
  const Transform to_origin = make_transform(-factor * bottom_center, {}, {factor, factor, factor});
  const Transform user_transform = make_transform(object.translate, {}, object.scale);
  model = transform_by(compose(actor, compose(user_transform, to_origin)));
}

/// Applies the scene's materials and transforms to an object as it was read. `size`: diagonal of
/// the scene's first object, to which the others are scaled; 0 makes this object the first one and
/// sets `size` to its diagonal.
void place_object(const Scene& scene, const ChainObject& chained, LoadedObject& read, float& size) {
  const ObjectSettings& object = *chained.settings;
  const ActorSettings& actor = *chained.actor;
  Model& model = read.model;
  apply_materials(model, object);
  const bool is_first = size == 0;
  if (is_first) size = model.box().diagonal();
  const bool stand = scene.arrange == Arrange::kStand && object.arrange;
  arrange(read, object, stand, is_first ? 0 : size,
          make_transform(actor.translate, actor.rotate, actor.scale));
}

/// Reads the reference mesh of a sequence that takes part in a morph: the mesh that balls are
/// fitted to. Returns an empty model for all other objects. If landmarks name vertices, sets
/// placing.vertices to those of this mesh. Errors: as load_mesh().
Result<Model> load_reference(const ChainObject& chained, const MeshSequence* sequence,
                             ObjectPlacement& placing) {
  if (!sequence || plays_sequence_alone(*chained.actor)) return Model{};
  if (names_vertices(chained)) {
    PM_TRY(placing.vertices, read_mesh_vertices(*sequence, sequence->reference));
  }
  return load_mesh(*sequence, sequence->reference);
}

}  // namespace

Model rotate_upright(Model model, UpAxis up) {
  return up == UpAxis::kY ? model : transformed(model, upright(up));
}

std::string find_turntable_problem(const Scene& scene) {
  const int count = film_frame_count(scene);
  if (scene.frames.turntable == 0 || scene.frames.still <= count) return "";
  return fmt::format("/frames/still: is {}, but the film has {} frames", scene.frames.still, count);
}

std::vector<std::string> find_weight_problems(const Scene& scene) {
  std::vector<std::string> problems;
  for (const ActorSettings& actor : scene.actors)
    if (const auto frame = find_weightless_frame(make_timeline(scene, actor)))
      problems.push_back(
          fmt::format("{}: all weights are 0 in frame {} - in each, one object has more at least",
                      actor.name, *frame));
  return problems;
}

Result<std::shared_ptr<const Image>> load_environment(const Scene& scene) {
  if (scene.lights.environment.empty()) return std::shared_ptr<const Image>();
  PM_TRY(Image image, read_image(scene.lights.environment));
  return std::make_shared<const Image>(std::move(image));
}

Result<LoadedScene> load_models(const Scene& scene, std::span<const ChainObject> chain,
                                bool textures) {
  Readings readings(chain);
  parallel_for(
      static_cast<std::int64_t>(chain.size()),
      [&](std::int64_t index) {
        const auto i = static_cast<std::size_t>(index);
        if (readings.first[i] == i) readings.read(scene, chain, i, textures);
      },
      /*grain=*/1);
  LoadedScene loaded;
  float size = 0;  // diagonal of the first object (place_object())
  for (std::size_t i = 0; i < chain.size(); ++i) {
    PM_TRY(LoadedObject object, readings.take(i, loaded.warnings));
    place_object(scene, chain[i], object, size);
    loaded.sequences.push_back(readings.place_meshes(i, object.placing));
    PM_TRY(Model reference, load_reference(chain[i], loaded.sequences[i].get(), object.placing));
    loaded.references.push_back(std::move(reference));
    loaded.models.push_back(std::move(object.model));
    loaded.placements.push_back(std::move(object.placing));
  }
  return loaded;
}

std::optional<double> front_azimuth(const ChainObject& object) {
  // In the order of the enumerators of Front; the first is kAuto.
  static constexpr Vec3 kDirections[] = {{},         {1, 0, 0}, {-1, 0, 0}, {0, 1, 0},
                                         {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  const ObjectSettings& settings = *object.settings;
  const Vec3 in_file = kDirections[static_cast<std::size_t>(settings.front)];
  const Vec3 in_scene = apply(make_transform({}, object.actor->rotate, object.actor->scale),
                              apply(make_transform({}, settings.rotate, settings.scale),
                                    apply(upright(settings.up), in_file)));
  constexpr float kMinHorizontal = 1e-3f;  // sine of the angle to the vertical
  if (length(Vec3{in_scene.x, 0, in_scene.z}) < kMinHorizontal * length(in_scene) ||
      in_file == Vec3{})  // kAuto
    return std::nullopt;
  return exact::atan2(static_cast<double>(in_scene.x), static_cast<double>(in_scene.z));
}

std::vector<std::size_t> find_first_congruent(std::span<const ChainObject> chain) {
  return first_with_key(chain, congruence_key);
}

std::vector<std::size_t> find_first_similar(std::span<const ChainObject> chain) {
  return first_with_key(chain, similarity_key);
}

std::vector<std::string> find_problems(const Scene& scene, std::span<const ChainObject> chain,
                                       const std::filesystem::path& cache_folder,
                                       LoadedScene& loaded) {
  std::vector<std::string> problems;
  float size = 0;  // diagonal of the first object (place_object())
  Readings readings(chain);
  const std::vector<std::size_t> first_similar = find_first_similar(chain);
  for (std::size_t i = 0; i < chain.size(); ++i) {
    const ObjectSettings& object = *chain[i].settings;
    if (readings.first[i] == i) readings.read(scene, chain, i, /*textures=*/true);
    // Read and place the object as load_models() does, but go on after an error.
    auto read_object = readings.take(i, loaded.warnings);
    if (read_object) place_object(scene, chain[i], *read_object, size);
    loaded.sequences.push_back(
        readings.place_meshes(i, read_object ? read_object->placing : ObjectPlacement{}));
    loaded.models.push_back(read_object ? std::move(read_object->model) : Model{});
    loaded.placements.push_back(read_object ? std::move(read_object->placing) : ObjectPlacement{});
    const MeshSequence* meshes = loaded.sequences.back().get();
    auto reference = load_reference(chain[i], meshes, loaded.placements.back());
    loaded.references.push_back(reference ? std::move(*reference) : Model{});
    if (meshes) {
      for (std::string& problem : find_mesh_problems(*meshes))
        problems.push_back(std::move(problem));
      // A sequence without a reference mesh plays alone, without balls, or is reported above.
      if (loaded.references.back().triangles.empty()) continue;
    }
    if (first_similar[i] != i) continue;
    // Check with unfitted spheres: a fit takes seconds, and fails only if the spheres fail, too.
    const Activity activity("looking at " + object.name);
    SphereSettings unfitted = object.spheres;
    unfitted.fit = FitKind::kNone;
    unfitted.error = 0;
    unfitted.coarse = true;
    if (!read_object) {
      problems.push_back(read_object.error().message);
    } else if (const auto spheres =
                   approximate_cached(loaded.fitted_model(i), unfitted, cache_folder);
               !spheres) {
      problems.push_back(fmt::format("{}: {}", object.name, spheres.error().message));
    }
  }
  // Labels and landmarks can be checked only if all models were read.
  if (problems.empty()) {
    problems = find_plan_problems(chain, loaded.models);
    place_landmarks(scene, chain, loaded, problems);
  }
  if (const std::string problem = find_turntable_problem(scene); !problem.empty())
    problems.push_back(problem);
  for (std::string& problem : find_weight_problems(scene)) problems.push_back(std::move(problem));
  if (!scene.lights.environment.empty())
    if (const auto image = read_image(scene.lights.environment); !image)
      problems.push_back(image.error().message);
  return problems;
}

}  // namespace polymorph
