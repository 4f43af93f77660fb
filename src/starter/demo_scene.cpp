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

std::vector<NamedFile> files_in(const fs::path& folder, const char* extension) {
  std::vector<NamedFile> files;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error))
    if (entry.path().extension() == extension)
      files.push_back({entry.path().stem().string(), "", entry.path()});
  std::sort(files.begin(), files.end(),
            [](const NamedFile& a, const NamedFile& b) { return a.name < b.name; });
  return files;
}

Result<JsonValue> read_effect(const fs::path& file) {
  PM_TRY(const std::string text, read_file(file, 1u << 20));
  auto document = parse_json(file.string(), text);
  if (!document || !document->root.is_object())
    return make_error(ErrorCode::kInput, "{}: is no scene", file.string());
  return std::move(document->root);
}

bool fits_any_objects(const JsonValue& effect) {
  const JsonValue& plan = effect.get("plan");
  return effect.contains("source") && effect.contains("target") && !plan.contains("labels") &&
         !plan.contains("landmarks");
}

std::vector<std::string> names_of(const std::vector<NamedFile>& files) {
  std::vector<std::string> names;
  for (const NamedFile& file : files) names.push_back(file.name);
  return names;
}

const NamedFile* find_named(const std::vector<NamedFile>& files, const std::string& name) {
  const auto found = std::find_if(files.begin(), files.end(),
                                  [&](const NamedFile& file) { return file.name == name; });
  return found == files.end() ? nullptr : &*found;
}

/// Finds the object of this name: a demo model, else a shape, else a model file, named relative to
/// `folder`; null if it is none of them.
JsonValue object_named(const std::vector<NamedFile>& models, const std::string& name,
                       const fs::path& folder) {
  if (const NamedFile* model = find_named(models, name)) return relative_name(model->file, folder);
  if (std::find(kShapeNames.begin(), kShapeNames.end(), name) != kShapeNames.end()) return name;
  std::error_code error;
  if (is_model_file(name) && fs::is_regular_file(name, error)) return relative_name(name, folder);
  return {};
}

Error unknown_name(const char* what, const std::string& name, std::vector<std::string> names) {
  return make_error(ErrorCode::kUsage, "{} \"{}\" is not known{} - known: {}; or name a model file",
                    what, name, did_you_mean(name, names), join_quoted(names));
}

/// Rewrites an object of an effect's scene in the folder `from` for a scene in the folder `to`.
JsonValue relocated(JsonValue object, const fs::path& from, const fs::path& to) {
  if (object.is_string()) {
    const std::string& name = object.string;
    if (std::find(kShapeNames.begin(), kShapeNames.end(), name) == kShapeNames.end())
      return relative_name(from / name, to);
  } else if (object.contains("model")) {
    object["model"] = relative_name(from / object["model"].string, to);
  }
  return object;
}

/// Tests whether an end of an effect's chain belongs to the effect: whether it is a shape, such as
/// drops. The demo's chain then passes through it, as balls.
bool is_shape(const JsonValue& object) {
  return object.is_object() ? object.contains("shape")
                            : std::find(kShapeNames.begin(), kShapeNames.end(), object.string) !=
                                  kShapeNames.end();
}

JsonValue passed_through(JsonValue object) {
  if (object.is_string()) object = JsonValue{{"shape", object}};
  object["meta"] = true;
  return object;
}

/// Frames of a chain of so many legs, with a moment of rest at both ends.
JsonValue demo_frames(std::size_t legs) {
  constexpr int kStart = 3, kEnd = 5, kFirstLeg = 22, kFurtherLeg = 10;
  const int moving = kFirstLeg + kFurtherLeg * (static_cast<int>(legs) - 1);
  return {
      {"count", kStart + moving + kEnd}, {"fps", 12}, {"hold_start", kStart}, {"hold_end", kEnd}};
}

}  // namespace

std::vector<NamedFile> demo_models(const fs::path& data) {
  return files_in(data / "models", ".obj");
}

Result<std::vector<NamedFile>> demo_effects(const fs::path& data) {
  std::vector<NamedFile> effects;
  for (NamedFile& file : files_in(data / "effects", ".json")) {
    PM_TRY(const JsonValue effect, read_effect(file.file));
    if (!fits_any_objects(effect)) continue;
    file.description = effect.get("description").string;
    effects.push_back(std::move(file));
  }
  return effects;
}

Result<JsonValue> demo_scene(const fs::path& data, const std::string& from, const std::string& to,
                             const std::string& through, const fs::path& folder) {
  const std::vector<NamedFile> models = demo_models(data);
  PM_TRY(const std::vector<NamedFile> effects, demo_effects(data));
  std::vector<std::string> objects = names_of(models);
  for (const std::string& shape : kShapeNames)
    if (!find_named(models, shape)) objects.push_back(shape);

  const JsonValue source = object_named(models, from, folder),
                  target = object_named(models, to, folder);
  if (source.is_null()) return unknown_name("model", from, objects);
  if (target.is_null()) return unknown_name("model", to, objects);
  JsonValue between = JsonValue::array(), settings;
  if (!through.empty()) {
    if (const NamedFile* file = find_named(effects, through)) {
      PM_TRY(const JsonValue effect, read_effect(file->file));
      const fs::path effects_folder = file->file.parent_path();
      if (is_shape(effect.get("source"))) between.push_back(passed_through(effect.get("source")));
      for (const JsonValue& object : effect.get("intermediate").items)
        between.push_back(relocated(object, effects_folder, folder));
      if (is_shape(effect.get("target"))) between.push_back(passed_through(effect.get("target")));
      for (const char* key :
           {"plan", "motion", "field", "boundary", "camera", "look", "lights", "ground"})
        if (effect.contains(key)) settings[key] = effect.get(key);
    } else if (const JsonValue object = object_named(models, through, folder); !object.is_null()) {
      between.push_back(object);
    } else {
      std::vector<std::string> names = names_of(effects);
      for (const std::string& other : objects)
        if (!find_named(effects, other)) names.push_back(other);
      return unknown_name("effect", through, names);
    }
  }
  JsonValue scene;
  std::error_code error;
  if (const fs::path schema = data / "scene.schema.json"; fs::exists(schema, error))
    scene["$schema"] = relative_name(schema, folder);
  scene["source"] = source;
  if (!between.empty()) scene["intermediate"] = between;
  scene["target"] = target;
  scene.update(settings);
  scene["frames"] = demo_frames(1 + between.size());
  scene["spheres"] = {{"balls", 96}};
  scene["surface"] = {{"resolution", 80}};
  scene["image"] = {{"width", 360}, {"height", 270}, {"samples", 10}};
  return scene;
}

}  // namespace polymorph
