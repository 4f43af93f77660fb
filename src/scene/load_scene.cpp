#include "scene/load_scene.h"

#include <algorithm>
#include <set>

#include "base/file.h"
#include "base/json.h"
#include "base/text.h"
#include "scene/animated_model.h"
#include "scene/blends.h"
#include "scene/contradictions.h"
#include "scene/mesh_numbers.h"
#include "scene/override.h"
#include "scene/read_fields.h"

namespace polymorph {
namespace {

constexpr std::size_t kMaxFindings = 20;  // listed in one error

/// Gives default names to objects and actors, and makes the actors' names unique. All names become
/// printable.
void name_objects(Scene& scene) {
  const auto set_name = [](ObjectSettings& object) {
    if (object.name.empty())
      object.name = is_mesh_sequence(object) ? sequence_name(object.model)
                    : object.model.empty()   ? object.shape
                                             : object.model.stem().string();
    object.name = printable(object.name);
  };
  std::set<std::string> names;
  for (ActorSettings& actor : scene.actors) {
    for (ObjectSettings& object : actor.blend) set_name(object);
    if (actor.blend.empty()) {
      set_name(actor.source);
      for (ObjectSettings& object : actor.intermediate) set_name(object);
      set_name(actor.target);
    }
    if (actor.name.empty()) actor.name = actor.blend.empty() ? actor.source.name : "blend";
    actor.name = printable(actor.name);  // headers of meshes and images contain it
    const std::string base_name = actor.name;
    for (int n = 2; !names.insert(actor.name).second; ++n)
      actor.name = fmt::format("{} {}", base_name, n);
  }
}

/// Protects input files from being overwritten by outputs, even before they are read.
void remember_inputs(const Scene& scene) {
  for (const ChainObject& object : chain_objects(scene)) remember_input(object.settings->model);
  remember_input(scene.lights.environment);
}

}  // namespace

std::string to_string(const SceneFinding& finding, const std::string& file) {
  // Values without a position in the file are reported as overrides by the command line.
  if (finding.line == 0)
    return fmt::format("{}: --set {}: {}", file, finding.pointer, finding.message);
  return fmt::format("{}:{}:{}: {}: {}", file, finding.line, finding.column, finding.pointer,
                     finding.message);
}

Result<SceneReading> read_scene(const std::filesystem::path& path,
                                std::span<const Override> overrides) {
  constexpr const char* kModelSuffixes[] = {".obj", ".glb", ".gltf", ".ply", ".stl",
                                            ".fbx", ".dae", ".off",  ".3ds"};
  const std::string name = path.string();
  std::string suffix = path.extension().string();
  for (char& c : suffix) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c;  // 'A' to 'a'
  const bool is_model = std::find(std::begin(kModelSuffixes), std::end(kModelSuffixes), suffix) !=
                        std::end(kModelSuffixes);
  const bool is_animated = is_model && !is_numbered(path) && pose_count(path) > 0;
  // Make a scene that plays the mesh sequence or the animated model.
  if (is_model && (is_animated || is_numbered(path))) {
    const std::filesystem::path meshes = is_animated ? pose_pattern(path) : path;
    PM_TRY([[maybe_unused]] const std::vector<int> range, find_mesh_range(meshes));
    JsonValue json{{"source", {{"model", std::filesystem::absolute(meshes).string()}}}};
    if (const auto rate = find_pose_rate(meshes)) json["frames"] = {{"fps", *rate}};
    return read_scene_text(path, format_json(json), overrides);
  }
  // A pose, walk@0012.glb, looks like an animation's path, too.
  if (const auto animation_pose = parse_animation_path(path);
      animation_pose && !parse_pose_path(path))
    return make_error(ErrorCode::kInput, "{}", describe_missing_poses(*animation_pose));
  if (is_model)
    return make_error(ErrorCode::kInput,
                      "{0}: is a model, not a scene - a scene names two of them: polymorph init "
                      "{0} OTHER; to see this one alone: polymorph render {0} --turntable",
                      name);
  PM_TRY(std::string text, read_file(path, /*limit=*/64u << 20));
  remember_input(path);
  return read_scene_text(path, std::move(text), overrides);
}

Result<SceneReading> read_scene_text(const std::filesystem::path& path, std::string text,
                                     std::span<const Override> overrides) {
  if (text.find_first_not_of(" \t\r\n") == std::string::npos)
    return make_error(ErrorCode::kInput,
                      "{}: is empty - a scene needs at least {{\"source\": ..., \"target\": ...}}",
                      path.string());
  PM_TRY(JsonDocument document, parse_json(path.string(), std::move(text)));
  for (const auto& [key, value] : overrides) PM_TRY_STATUS(apply_override(document, key, value));
  if (document.root.kind != JsonValue::Kind::kObject)
    return make_error(ErrorCode::kInput, "{}:1:1: a scene must be an object {{...}} (is {})",
                      path.string(), kind_name(document.root.kind));

  SceneReading reading;
  reading.scene.path = path;
  const SceneDocument scene_document{document, std::filesystem::absolute(path).parent_path(),
                                     reading.findings, reading.scene.tracks};
  FieldReader fields(scene_document, document.root, "");
  describe(fields, reading.scene);
  fields.finish();
  find_contradictions(document, reading.scene, reading.findings);
  name_objects(reading.scene);
  sort_blends(reading.scene);
  remember_inputs(reading.scene);
  std::stable_sort(reading.findings.begin(), reading.findings.end(),
                   [](const SceneFinding& a, const SceneFinding& b) {
                     return std::pair(a.line, a.column) < std::pair(b.line, b.column);
                   });
  return reading;
}

namespace {

/// Returns the scene or, if there are findings, one error that lists them.
Result<Scene> scene_or_error(SceneReading reading, const std::filesystem::path& path) {
  if (reading.findings.empty()) return std::move(reading.scene);
  std::string message;
  for (std::size_t i = 0; i < std::min(reading.findings.size(), kMaxFindings); ++i)
    message += fmt::format("{}{}", i ? "\n" : "", to_string(reading.findings[i], path.string()));
  if (reading.findings.size() > kMaxFindings)
    message += fmt::format("\n... and {} more", reading.findings.size() - kMaxFindings);
  const bool only_overrides =
      std::all_of(reading.findings.begin(), reading.findings.end(),
                  [](const SceneFinding& finding) { return finding.line == 0; });
  return Error{only_overrides ? ErrorCode::kUsage : ErrorCode::kInput, message};
}

}  // namespace

Result<Scene> load_scene(const std::filesystem::path& path, std::span<const Override> overrides) {
  PM_TRY(SceneReading reading, read_scene(path, overrides));
  return scene_or_error(std::move(reading), path);
}

Result<Scene> load_scene_text(const std::filesystem::path& path, std::string text,
                              std::span<const Override> overrides) {
  PM_TRY(SceneReading reading, read_scene_text(path, std::move(text), overrides));
  return scene_or_error(std::move(reading), path);
}

Result<Scene> turntable_of_model(const std::filesystem::path& model,
                                 std::span<const Override> overrides) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(model, error))
    return make_error(ErrorCode::kInput, "{}: no such file", model.string());
  // The morph from the model to itself is never shown, so few balls suffice.
  const std::string object = std::filesystem::absolute(model).string();
  const JsonValue json{
      {"source", {{"model", object}}},        {"target", {{"model", object}}},
      {"frames", {{"turntable", 72}}},        {"spheres", {{"balls", 16}, {"fit", "none"}}},
      {"motion", {{"interpolate", "balls"}}}, {"boundary", {{"method", "cut"}}}};
  return load_scene_text(model, format_json(json), overrides);
}

std::vector<const ObjectSettings*> chain_objects(const ActorSettings& actor) {
  if (!actor.blend.empty()) {
    std::vector<const ObjectSettings*> blend_objects;
    for (const ObjectSettings& object : actor.blend) blend_objects.push_back(&object);
    return blend_objects;
  }
  std::vector<const ObjectSettings*> objects{&actor.source};
  for (const ObjectSettings& object : actor.intermediate) objects.push_back(&object);
  if (!plays_sequence_alone(actor)) objects.push_back(&actor.target);
  return objects;
}

std::vector<ChainObject> chain_objects(const Scene& scene) {
  std::vector<ChainObject> chain;
  for (const ActorSettings& actor : scene.actors)
    for (const ObjectSettings* object : chain_objects(actor)) chain.push_back({&actor, object});
  return chain;
}

std::vector<std::span<const ChainObject>> actor_chains(std::span<const ChainObject> chain) {
  std::vector<std::span<const ChainObject>> chains;
  for (std::size_t first = 0, end = 0; first < chain.size(); first = end) {
    while (end < chain.size() && chain[end].actor == chain[first].actor) ++end;
    chains.push_back(chain.subspan(first, end - first));
  }
  return chains;
}

bool is_named(const ObjectSettings& object, const std::string& key) {
  const std::string shown_key = printable(key);
  const std::string name = object.name.empty() ? object.shape : object.name;
  return shown_key == printable(name) ||
         (!object.model.empty() && (shown_key == printable(object.model.filename().string()) ||
                                    shown_key == printable(object.model.stem().string())));
}

const ObjectLandmarks* find_landmarks(const PlanSettings& plan, const ObjectSettings& object) {
  for (const auto& [key, landmarks] : plan.landmarks)
    if (is_named(object, key)) return &landmarks;
  return nullptr;
}

bool is_fitted(const Scene& scene, const SphereSettings& spheres) {
  return scene.field.kind == FieldKind::kGaussian && spheres.fit != FitKind::kNone;
}

}  // namespace polymorph
