
#include "base/data_folder.h"
#include "base/file.h"
#include "base/json.h"
#include "base/log.h"
#include "cli/command_line.h"
#include "model/load/load_model.h"
#include "scene/commented_scene.h"

namespace polymorph {
namespace {

namespace fs = std::filesystem;

struct InitOptions {
  std::vector<std::string> models;
  std::string output = "scene.json";
};

/// The settings that most scenes change, in the order in which one thinks of them.
const std::vector<std::pair<const char*, std::vector<const char*>>> kKeys{
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

/// A model's name as the scene file writes it. Errors (kInput): no such file, or a name that JSON
/// cannot hold.
Result<std::string> model_name(const std::string& file, const fs::path& folder) {
  std::error_code error;
  if (!fs::is_regular_file(file, error))
    return make_error(ErrorCode::kInput, "{}: no such file - name the files of your models", file);
  if (!is_model_file(file))
    return make_error(ErrorCode::kInput,
                      "{}: is no model file - use OBJ, glTF, FBX, PLY, STL, DAE, OFF or 3DS", file);
  const std::string name = fs::absolute(file).lexically_normal().lexically_proximate(folder);
  // Bytes that are not UTF-8 are replaced, and another name would be read.
  PM_TRY(const JsonDocument document, parse_json("", format_json(name)));
  if (document.root.string != name)
    return make_error(ErrorCode::kInput, "{}: the name is not UTF-8 - rename the file", file);
  return name;
}

Result<JsonValue> initial_scene(const std::vector<std::string>& models, const fs::path& folder) {
  std::vector<std::string> names;
  for (const std::string& model : models) {
    PM_TRY(std::string name, model_name(model, folder));
    names.push_back(std::move(name));
  }
  JsonValue scene;
  if (const auto data = find_data_folder())
    scene["$schema"] = (*data / "scene.schema.json").string();
  scene["source"] = names.front();
  if (names.size() > 2)
    scene["intermediate"] = std::vector<std::string>(names.begin() + 1, names.end() - 1);
  scene["target"] = names.back();
  PM_TRY(const JsonDocument document, parse_json("the schema", scene_schema()));
  const JsonValue& schema = document.root;
  for (const auto& [section, keys] : kKeys)
    for (const char* key : keys)
      scene[section][key] =
          schema.get("properties").get(section).get("properties").get(key).get("default");
  scene["frames"]["count"] = 24 * (static_cast<int>(names.size()) - 1);
  scene["output"] = {{"file", "out/frame.####.exr"}, {"png", true}};
  return scene;
}

Result<int> run_init(const CommandLine& line, const InitOptions& options) {
  const fs::path file = options.output;
  PM_TRY_STATUS(check_output(file, line.common.overwrite));
  PM_TRY(const JsonValue scene,
         initial_scene(options.models, fs::absolute(file).lexically_normal().parent_path()));
  JsonValue suggestions;
  if (!scene.contains("intermediate"))
    suggestions["target"]["intermediate"] =
        JsonValue::array({JsonValue{{"shape", "puddle"}, {"meta", true}}});
  PM_TRY_STATUS(write_file(
      file, commented_scene(scene,
                            "A scene of polymorph, with the settings that most scenes change and "
                            "their defaults. What is left out keeps its default; `polymorph "
                            "schema` knows every key. Comments may stand anywhere.",
                            suggestions)));
  PM_TRY_STATUS([&]() -> Status {
    PM_TRY(const Scene loaded, load_scene(file));
    return Ok{};
  }());
  const std::string word = quote_for_shell(options.output);
  print_data("{}\n", options.output);
  log_info(
      "next:\n  {0} check {1}\n  {0} render {1} -o look.png -f 12 --preview\n"
      "  {0} render {1} --dry-run\n  {0} render {1}\n"
      "  {0} strip 'out/frame.####.exr' -o strip.png --gif morph.gif",
      line.program, word);
  return 0;
}

}  // namespace

void add_init(CommandLine& line) {
  auto options = std::make_shared<InitOptions>();
  Command command =
      add_command(line, "init", "Write a commented scene for models of your own.",
                  "  polymorph init first.obj second.obj\n"
                  "  polymorph init a.obj b.obj c.obj -o scenes/abc.json",
                  "  0 written   2 usage   3 a model is missing   4 cannot write, exists");
  command
      .add_option("models", options->models,
                  "model files: the source, any objects on the way, the target")
      .required()
      .count(2, 100)
      .type_name("MODEL MODEL...")
      .group("Main");
  command.add_option("-o,--output", options->output, "the scene file (scene.json)")
      .type_name("FILE")
      .group("Main");
  add_overwrite(command, line.common).group("Main");
  set_action(line, command, [&line, options] { return run_init(line, *options); });
}

}  // namespace polymorph
