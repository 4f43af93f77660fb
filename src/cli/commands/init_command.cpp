#include "base/file.h"
#include "base/json.h"
#include "base/log.h"
#include "cli/command_line.h"
#include "scene/commented_scene.h"
#include "starter/initial_scene.h"

namespace polymorph {
namespace {

namespace fs = std::filesystem;

struct InitOptions {
  std::vector<std::string> models;
  std::string output = "scene.json";
};

Result<int> run_init(const CommandLine& line, const InitOptions& options) {
  const fs::path file = options.output;
  PM_TRY_STATUS(check_output(file, line.common.overwrite));
  PM_TRY(const JsonValue scene, initial_scene(options.models, file.parent_path()));
  // A scene of two models shows, commented out, how to add a puddle between them.
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
  // Load the written scene to report errors in it now.
  PM_TRY_STATUS([&]() -> Status {
    PM_TRY(const Scene loaded, load_scene(file));
    return Ok{};
  }());
  const std::string scene_word = quote_for_shell(options.output);
  print_data("{}\n", options.output);
  log_info(
      "next:\n  {0} check {1}\n  {0} render {1} -o look.png -f 12 --preview\n"
      "  {0} render {1} --dry-run\n  {0} render {1}\n"
      "  {0} strip 'out/frame.####.exr' -o strip.png --gif morph.gif",
      line.program, scene_word);
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
      .add_option("models", options->models, "MODEL MODEL...",
                  "model files: the source, any objects on the way, the target")
      .required()
      .count(2, 100);
  command.add_option("-o,--output", options->output, "FILE", "the scene file (scene.json)");
  add_overwrite(command, line.common);
  set_action(line, command, [&line, options] { return run_init(line, *options); });
}

}  // namespace polymorph
