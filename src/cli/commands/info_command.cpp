#include <algorithm>

#include "base/text.h"
#include "cli/command_line.h"
#include "inspect/inspection.h"
#include "model/load/load_model.h"
#include "scene/mesh_numbers.h"

namespace polymorph {
namespace {

struct InfoOptions {
  std::string input;
  std::vector<std::string> sets;
  bool timeline = false;
  JsonOutput json;
};

Result<int> print(const JsonOutput& json, const Result<Inspection>& inspection) {
  if (!inspection) return inspection.error();
  if (json.enabled) {
    PM_TRY_STATUS(write_json(json, inspection->json));
  } else {
    print_data("{}", inspection->text);
  }
  return 0;
}

Result<int> run_info(const InfoOptions& options) {
  std::string extension = std::filesystem::path(options.input).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return std::tolower(c); });
  const bool is_scene =
      extension == ".json" || (is_model_file(options.input) && is_numbered(options.input));
  if (!is_scene) {
    if (options.timeline)
      return make_error(ErrorCode::kUsage, "{}: --timeline is for scenes (.json)", options.input);
    const bool model = is_model_file(options.input) || is_unread_model(options.input);
    return print(options.json, model ? inspect_model(options.input) : inspect_image(options.input));
  }
  PM_TRY(const std::vector<Override> overrides, parse_overrides(options.sets));
  PM_TRY(const Scene scene, load_scene(options.input, overrides));
  if (options.timeline) return print(options.json, inspect_timeline(scene));
  if (options.json.enabled) {
    const auto folder = std::filesystem::absolute(options.input).parent_path();
    PM_TRY_STATUS(write_text(options.json, scene_to_json(scene, folder)));
    return 0;
  }
  print_data("{}--json prints every setting with its value.\n",
             inspect_scene(options.input, scene).text);
  return 0;
}

}  // namespace

void add_info(CommandLine& line) {
  auto options = std::make_shared<InfoOptions>();
  Command command =
      add_command(line, "info", "Describe a scene, a model or an image.",
                  "  polymorph info scene.json\n  polymorph info scene.json "
                  "--json\n  polymorph info scene.json --timeline\n  polymorph info frame.0012.exr",
                  "  0 described   2 usage   3 unreadable");
  command
      .add_option("input", options->input,
                  "a scene (.json), a model, a mesh sequence (seq.####.obj) or an image")
      .required()
      .type_name("FILE")
      .group("Main");
  command
      .add_flag("--timeline", options->timeline,
                "scene: content of each frame, a line per frame; --json: with all stages")
      .group("Main");
  add_overrides(command, options->sets);
  add_json(command, options->json);
  set_action(line, command, [options] { return run_info(*options); });
}

}  // namespace polymorph
