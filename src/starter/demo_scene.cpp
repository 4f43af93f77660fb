#include "starter/demo_scene.h"

#include <algorithm>
#include <system_error>

#include "base/file.h"
#include "base/json.h"
#include "base/text.h"
#include "model/load/load_model.h"
#include "scene/scene.h"
#include "starter/initial_scene.h"

namespace polymorph {
namespace {

namespace fs = std::filesystem;

/// Lists the files with this extension, sorted by name; their descriptions are empty.
std::vector<NamedFile> list_files(const fs::path& folder, const char* extension) {
  std::vector<NamedFile> files;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error))
    if (entry.path().extension() == extension)
      files.push_back({entry.path().stem().string(), /*description=*/"", entry.path()});
  std::sort(files.begin(), files.end(),
            [](const NamedFile& a, const NamedFile& b) { return a.name < b.name; });
  return files;
}

Result<JsonValue> read_effect(const fs::path& file) {
  PM_TRY(const std::string text, read_file(file, /*limit=*/1u << 20));
  auto document = parse_json(file.string(), text);
  if (!document || !document->root.is_object())
    return make_error(ErrorCode::kInput, "{}: is no scene", file.string());
  return std::move(document->root);
}

/// Tests whether an effect has a single chain and no settings for parts of its own models.
bool suits_any_objects(const JsonValue& effect) {
  const JsonValue& plan = effect.get("plan");
  return effect.contains("source") && effect.contains("target") && !plan.contains("labels") &&
         !plan.contains("landmarks");
}

std::vector<std::string> list_names(const std::vector<NamedFile>& files) {
  std::vector<std::string> names;
  for (const NamedFile& file : files) names.push_back(file.name);
  return names;
}

const NamedFile* find_named(const std::vector<NamedFile>& files, const std::string& name) {
  const auto match = std::find_if(files.begin(), files.end(),
                                  [&](const NamedFile& file) { return file.name == name; });
  return match == files.end() ? nullptr : &*match;
}

/// Finds the object of this name: a demo model, else a shape, else a model file. Files are named
/// relative to `folder`. Returns null if it is none of these.
JsonValue find_object(const std::vector<NamedFile>& models, const std::string& name,
                      const fs::path& folder) {
  if (const NamedFile* model = find_named(models, name)) return relative_name(model->file, folder);
  if (is_shape_name(name)) return name;
  std::error_code error;
  if (is_model_file(name) && fs::is_regular_file(name, error)) return relative_name(name, folder);
  return {};
}

/// Makes the error for an unknown name. `what` is "model" or "effect"; `names` are the known names.
Error unknown_name(const char* what, const std::string& name, std::vector<std::string> names) {
  return make_error(ErrorCode::kUsage, "{} \"{}\" is not known{} - known: {}; or name a model file",
                    what, name, did_you_mean(name, names), join_quoted(names));
}

/// Rewrites the name of an effect object's file: it is relative to the folder `from`, and becomes
/// relative to the folder `to`.
JsonValue relocate_object(JsonValue object, const fs::path& from, const fs::path& to) {
  if (object.is_string()) {
    const std::string& name = object.string;
    if (!is_shape_name(name)) return relative_name(from / name, to);
  } else if (object.contains("model")) {
    object["model"] = relative_name(from / object["model"].string, to);
  }
  return object;
}

/// Tests whether an end of an effect's chain is a shape, such as drops. A shape belongs to the
/// effect, and the demo's chain passes through it.
bool is_shape(const JsonValue& object) {
  return object.is_object() ? object.contains("shape") : is_shape_name(object.string);
}

/// Makes an intermediate object of a shape: a meta-object, which shows balls only.
JsonValue make_meta_object(JsonValue object) {
  if (object.is_string()) object = JsonValue{{"shape", object}};
  object["meta"] = true;
  return object;
}

/// Makes the frame settings of a chain of `legs` legs, with a few still frames at both ends.
JsonValue demo_frames(std::size_t legs) {
  // Numbers of frames: a film of one leg lasts 2.5 seconds.
  constexpr int kHoldStart = 3, kHoldEnd = 5, kFirstLeg = 22, kFurtherLeg = 10;
  const int moving = kFirstLeg + kFurtherLeg * (static_cast<int>(legs) - 1);
  return {{"count", kHoldStart + moving + kHoldEnd},
          {"fps", 12},
          {"hold_start", kHoldStart},
          {"hold_end", kHoldEnd}};
}

}  // namespace

std::vector<NamedFile> demo_models(const fs::path& data) {
  return list_files(data / "models", ".obj");
}

Result<std::vector<NamedFile>> demo_effects(const fs::path& data) {
  std::vector<NamedFile> effects;
  for (NamedFile& file : list_files(data / "effects", ".json")) {
    PM_TRY(const JsonValue effect, read_effect(file.file));
    if (!suits_any_objects(effect)) continue;
    file.description = effect.get("description").string;
    effects.push_back(std::move(file));
  }
  return effects;
}

Result<JsonValue> demo_scene(const fs::path& data, const std::string& from, const std::string& to,
                             const std::string& through, const fs::path& folder) {
  const std::vector<NamedFile> models = demo_models(data);
  PM_TRY(const std::vector<NamedFile> effects, demo_effects(data));
  std::vector<std::string> object_names = list_names(models);
  for (const std::string& shape : kShapeNames)
    if (!find_named(models, shape)) object_names.push_back(shape);
  // Find both ends of the chain.
  const JsonValue source = find_object(models, from, folder),
                  target = find_object(models, to, folder);
  if (source.is_null()) return unknown_name("model", from, object_names);
  if (target.is_null()) return unknown_name("model", to, object_names);
  // Find the intermediate objects and the settings that `through` names.
  JsonValue intermediate = JsonValue::array(), settings;
  if (!through.empty()) {
    if (const NamedFile* file = find_named(effects, through)) {
      PM_TRY(const JsonValue effect, read_effect(file->file));
      const fs::path effects_folder = file->file.parent_path();
      if (is_shape(effect.get("source")))
        intermediate.push_back(make_meta_object(effect.get("source")));
      for (const JsonValue& object : effect.get("intermediate").items)
        intermediate.push_back(relocate_object(object, effects_folder, folder));
      if (is_shape(effect.get("target")))
        intermediate.push_back(make_meta_object(effect.get("target")));
      for (const char* key :
           {"plan", "motion", "field", "boundary", "camera", "look", "lights", "ground"})
        if (effect.contains(key)) settings[key] = effect.get(key);
    } else if (const JsonValue object = find_object(models, through, folder); !object.is_null()) {
      intermediate.push_back(object);
    } else {
      std::vector<std::string> names = list_names(effects);
      for (const std::string& other : object_names)
        if (!find_named(effects, other)) names.push_back(other);
      return unknown_name("effect", through, names);
    }
  }
  // Assemble the scene.
  JsonValue scene;
  std::error_code error;
  if (const fs::path schema = data / "scene.schema.json"; fs::exists(schema, error))
    scene["$schema"] = relative_name(schema, folder);
  scene["source"] = source;
  if (!intermediate.empty()) scene["intermediate"] = intermediate;
  scene["target"] = target;
  scene.update(settings);
  scene["frames"] = demo_frames(1 + intermediate.size());
  scene["spheres"] = {{"balls", 96}};
  scene["surface"] = {{"resolution", 80}};
  scene["image"] = {{"width", 360}, {"height", 270}, {"samples", 10}, {"smooth", true}};
  return scene;
}

}  // namespace polymorph
