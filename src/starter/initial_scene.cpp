#include "starter/initial_scene.h"

#include "base/data_folder.h"
#include "model/load/load_model.h"
#include "scene/load_scene.h"

namespace polymorph {
namespace {

namespace fs = std::filesystem;

/// The settings that most scenes change: sections of a scene file and their keys, the most common
/// first.
const std::vector<std::pair<const char*, std::vector<const char*>>> kCommonKeys{
    {"frames", {"count", "fps", "hold_start", "hold_end"}},
    {"image", {"width", "height", "samples", "noise", "exposure", "transparent"}},
    {"look", {"kind", "color", "roughness"}},
    {"camera", {"azimuth", "elevation", "fov", "margin"}},
    {"lights", {"key_azimuth", "key_elevation", "key_size", "key_intensity", "sky"}},
    {"ground", {"enabled", "color"}},
    {"motion", {"path", "easing", "stagger"}},
    {"plan", {"align", "label_mode"}},
    {"spheres", {"balls", "solidify"}},
    {"surface", {"resolution"}}};

/// Returns the name by which the scene file refers to a model. Errors (kInput): no such file, not a
/// model, or a name that is not UTF-8.
Result<std::string> model_name(const std::string& file, const fs::path& folder) {
  std::error_code error;
  if (!fs::is_regular_file(file, error))
    return make_error(ErrorCode::kInput, "{}: no such file - name the files of your models", file);
  if (!is_model_file(file))
    return make_error(ErrorCode::kInput,
                      "{}: is no model file - use OBJ, glTF, FBX, PLY, STL, DAE, OFF or 3DS", file);
  const std::string name = relative_name(file, folder);
  // Bytes that are not UTF-8 are replaced in JSON, which would then name another file.
  PM_TRY(const JsonDocument document, parse_json(/*name=*/"", format_json(name)));
  if (document.root.string != name)
    return make_error(ErrorCode::kInput, "{}: the name is not UTF-8 - rename the file", file);
  return name;
}

}  // namespace

std::string relative_name(const fs::path& file, const fs::path& folder) {
  std::error_code ignored;  // the folder may not exist yet, or the working folder no longer
  const fs::path absolute_folder =
      fs::weakly_canonical(fs::absolute(folder.empty() ? "." : folder, ignored), ignored);
  return fs::absolute(file, ignored)
      .lexically_normal()
      .lexically_proximate(absolute_folder)
      .string();
}

Result<JsonValue> initial_scene(const std::vector<std::string>& models, const fs::path& folder) {
  std::vector<std::string> names;
  for (const std::string& model : models) {
    PM_TRY(std::string name, model_name(model, folder));
    names.push_back(std::move(name));
  }
  JsonValue scene;
  if (const auto data = find_data_folder())
    scene["$schema"] = relative_name(*data / "scene.schema.json", folder);
  scene["source"] = names.front();
  if (names.size() > 2)
    scene["intermediate"] = std::vector<std::string>(names.begin() + 1, names.end() - 1);
  scene["target"] = names.back();
  // Write the common settings with their defaults.
  PM_TRY(const JsonDocument document, parse_json("the schema", scene_schema()));
  const JsonValue& schema = document.root;
  for (const auto& [section, keys] : kCommonKeys)
    for (const char* key : keys)
      scene[section][key] =
          schema.get("properties").get(section).get("properties").get(key).get("default");
  // The number of frames depends on the number of legs: 24 frames per leg.
  scene["frames"]["count"] = 24 * (static_cast<int>(names.size()) - 1);
  scene["output"] = {{"file", "out/frame.####.exr"}, {"png", true}};
  return scene;
}

}  // namespace polymorph
