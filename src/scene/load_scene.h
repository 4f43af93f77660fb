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

/// One `--set path=value`.
using Override = std::pair<std::string, std::string>;

struct SceneFinding {
  int line = 0, column = 0;  ///< 0 = not in the file (missing key, or from --set)
  std::string pointer;       ///< JSON pointer: "/frames/count"
  std::string message;
};

/// "FILE:LINE:COL: /pointer: message".
std::string to_string(const SceneFinding& finding, const std::string& file);

/// Everything that is wrong with a scene file, or the scene. Unknown keys, wrong types, values out
/// of range, missing models and contradictions are all found in one go; syntax errors stop at the
/// first.
struct SceneReading {
  Scene scene;
  std::vector<SceneFinding> findings;
};

/// Reads a scene file, or makes the scene that shows a mesh sequence, seq.####.obj, alone. Errors
/// (kInput): unreadable file or JSON syntax; (kUsage): a bad override.
Result<SceneReading> read_scene(const std::filesystem::path& path,
                                std::span<const Override> overrides = {});

/// Reads a scene that is in no file: `text` is its JSON, `path` its name in messages.
Result<SceneReading> read_scene_text(const std::filesystem::path& path, std::string text,
                                     std::span<const Override> overrides = {});

/// read_scene, with findings turned into one error of up to 20 lines.
Result<Scene> load_scene(const std::filesystem::path& path,
                         std::span<const Override> overrides = {});

/// Loads a scene that is in no file, as read_scene_text() does.
Result<Scene> load_scene_text(const std::filesystem::path& path, std::string text,
                              std::span<const Override> overrides = {});

/// A model by itself, on a turntable of 72 frames (frames.turntable). Errors (kInput): no such
/// file.
Result<Scene> turntable_of_model(const std::filesystem::path& model,
                                 std::span<const Override> overrides = {});

/// The published JSON Schema (draft 2020-12) of the scene format, as committed in
/// scenes/scene.schema.json.
std::string scene_schema();

/// The scene with every default spelled out, as JSON; paths relative to `folder`.
std::string scene_to_json(const Scene& scene, const std::filesystem::path& folder);

/// One object with every default spelled out, and the keyframes of its settings, which are at
/// `pointer`.
std::string object_to_json(const ObjectSettings& object, const std::vector<KeyframeTrack>& tracks,
                           const std::string& pointer);

/// Every object of an actor in chain order: source, intermediate..., target. A mesh sequence that
/// plays is alone; those of a blend have the order of their names.
std::vector<const ObjectSettings*> chain_objects(const ActorSettings& actor);

/// An object of a scene's chains, with its actor.
struct ChainObject {
  const ActorSettings* actor;
  const ObjectSettings* settings;
};
/// Objects of all actors, actor by actor in chain order. Borrows from the scene.
std::vector<ChainObject> chain_objects(const Scene& scene);
/// Cuts the list into one part per actor.
std::vector<std::span<const ChainObject>> actor_chains(std::span<const ChainObject> chain);

/// True if a key of plan.landmarks names the object: by its file's name, that without its suffix,
/// or its name in the scene.
bool is_named(const ObjectSettings& object, const std::string& key);
/// The object's landmarks; null if it has none.
const ObjectLandmarks* find_landmarks(const PlanSettings& plan, const ObjectSettings& object);

/// Tests whether balls are fitted to an object of these settings. Fits are Gaussian.
bool is_fitted(const Scene& scene, const SphereSettings& spheres);

}  // namespace polymorph
