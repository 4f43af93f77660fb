// Scene file loading and validation: JSON to Scene.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "base/result.h"
#include "scene/scene.h"

namespace polymorph {

/// The path and the value of one `--set path=value` (scene/override.h).
using Override = std::pair<std::string, std::string>;

/// An error in a scene.
struct SceneFinding {
  int line = 0, column = 0;  ///< 0 = not in the file (missing key, or from --set)
  std::string pointer;       ///< JSON pointer: "/frames/count"
  std::string message;
};

/// Formats a finding as "FILE:LINE:COL: /pointer: message".
std::string to_string(const SceneFinding& finding, const std::string& file);

/// A scene and all errors in it: unknown keys, wrong types, values out of range, missing models and
/// contradictions.
struct SceneReading {
  Scene scene;  ///< valid only if there are no findings
  std::vector<SceneFinding> findings;
};

/// Reads a scene file. For a mesh sequence (seq.####.obj) or an animated model, makes a scene that
/// plays it alone. Errors (kInput): an unreadable file, JSON syntax, or a model that does not move;
/// (kUsage): a bad override.
Result<SceneReading> read_scene(const std::filesystem::path& path,
                                std::span<const Override> overrides = {});

/// Reads a scene from JSON text. `path` is its name in messages; file names are relative to its
/// folder.
Result<SceneReading> read_scene_text(const std::filesystem::path& path, std::string text,
                                     std::span<const Override> overrides = {});

/// Reads a scene as read_scene() does, and turns findings into one error of up to 20 lines.
Result<Scene> load_scene(const std::filesystem::path& path,
                         std::span<const Override> overrides = {});

/// Reads a scene as read_scene_text() does, and turns findings into one error as load_scene() does.
Result<Scene> load_scene_text(const std::filesystem::path& path, std::string text,
                              std::span<const Override> overrides = {});

/// Makes a scene of one model on a turntable of 72 frames. Errors (kInput): no such file.
Result<Scene> turntable_of_model(const std::filesystem::path& model,
                                 std::span<const Override> overrides = {});

/// The published JSON Schema (draft 2020-12) of the scene format, as committed in
/// scenes/scene.schema.json.
std::string scene_schema();

/// The reference of the scene format in Markdown, as committed in docs/scene.md.
std::string scene_markdown();

/// The scene with every default spelled out, as JSON; paths are relative to `folder`.
std::string scene_to_json(const Scene& scene, const std::filesystem::path& folder);

/// One object with every default spelled out, as JSON, and with the keyframes of its settings.
/// `pointer` is the JSON pointer by which `tracks` name the object.
std::string object_to_json(const ObjectSettings& object, const std::vector<KeyframeTrack>& tracks,
                           const std::string& pointer);

/// Lists an actor's objects in chain order: source, intermediate..., target. A mesh sequence that
/// plays alone is the only object. The objects of a blend are in the order of ActorSettings::blend.
std::vector<const ObjectSettings*> chain_objects(const ActorSettings& actor);

/// An object of a scene's chains, with its actor.
struct ChainObject {
  const ActorSettings* actor;
  const ObjectSettings* settings;
};
/// Lists the objects of all actors, actor by actor in chain order. Pointers are into the scene.
std::vector<ChainObject> chain_objects(const Scene& scene);
/// Splits a list of chain_objects(scene) into one span per actor.
std::vector<std::span<const ChainObject>> actor_chains(std::span<const ChainObject> chain);

/// Tests whether a key of plan.landmarks names the object: by its file's name or stem, or by its
/// name in the scene.
bool is_named(const ObjectSettings& object, const std::string& key);
/// The object's landmarks; null if it has none.
const ObjectLandmarks* find_landmarks(const PlanSettings& plan, const ObjectSettings& object);

/// Tests whether balls are fitted to an object with these settings. Only Gaussian balls are fitted.
bool is_fitted(const Scene& scene, const SphereSettings& spheres);

}  // namespace polymorph
