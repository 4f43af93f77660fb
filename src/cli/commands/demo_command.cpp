#include "base/data_folder.h"
#include "base/file.h"
#include "base/json.h"
#include "base/log.h"
#include "base/stopwatch.h"
#include "cli/command_line.h"
#include "cli/progress.h"
#include "export/film_pictures.h"
#include "morph/timeline.h"
#include "scene/commented_scene.h"
#include "scene/override.h"
#include "starter/demo_scene.h"

namespace polymorph {
namespace {

namespace fs = std::filesystem;

struct DemoOptions {
  std::string from = "teapot", to = "penguin";  ///< names of models or shapes, or files
  std::string through;                          ///< effect, or a further object; empty: none
  std::string output;                           ///< empty: a folder named after the models
  std::vector<std::string> sets;
  bool list = false;
};

Result<int> list_names(const fs::path& data) {
  print_data("models:\n");
  for (const NamedFile& model : demo_models(data)) print_data("  {}\n", model.name);
  print_data("effects, for --through:\n");
  PM_TRY(const std::vector<NamedFile> effects, demo_effects(data));
  for (const NamedFile& effect : effects)
    print_data("  {:<20} {}\n", effect.name, effect.description);
  return 0;
}

/// Returns the name of a model or a file without folders and suffix: "teapot" for both "teapot" and
/// "models/teapot.obj".
std::string stem(const std::string& object) { return fs::path(object).stem().string(); }

/// Files that a demo writes, and the pattern for frames that it suggests.
struct DemoFiles {
  fs::path scene, strip, gif, frames;
};

/// Returns the names of the demo's files. `output` is a folder or the name of one of them, from
/// which the others get their names (out.png, out.gif, out.json). Errors (kUsage): `output` is a
/// file of another format.
Result<DemoFiles> demo_files(const fs::path& output) {
  const std::string extension = output.extension().string();
  if (extension == ".png" || extension == ".gif" || extension == ".json") {
    const auto with_suffix = [&](const char* suffix) {
      return fs::path(output).replace_extension(suffix);
    };
    return DemoFiles{with_suffix(".json"), with_suffix(".png"), with_suffix(".gif"),
                     with_suffix(".####.exr")};
  }
  for (const char* unsupported : {".exr", ".mp4", ".jpg", ".jpeg", ".webp", ".apng"})
    if (extension == unsupported)
      return make_error(ErrorCode::kUsage,
                        "--output {}: a demo is a PNG, a GIF and a scene - name a folder, or one "
                        "of them; frames and movies come from the scene",
                        output.string());
  return DemoFiles{output / "scene.json", output / "strip.png", output / "morph.gif",
                   output / "frame.####.exr"};
}

/// Makes a scene, writes it, renders all of its frames, and writes them as a strip and a GIF.
Result<int> run_demo(const CommandLine& line, const DemoOptions& options) {
  const Stopwatch stopwatch;
  PM_TRY(const fs::path data, find_data_folder());
  if (options.list) return list_names(data);
  const std::string through = options.through.empty() ? "" : "-" + stem(options.through);
  PM_TRY(const DemoFiles files,
         demo_files(options.output.empty() ? stem(options.from) + through + "-" + stem(options.to)
                                           : options.output));
  PM_TRY(JsonValue json,
         demo_scene(data, options.from, options.to, options.through, files.scene.parent_path()));
  PM_TRY(const std::vector<Override> overrides, parse_overrides(options.sets));
  JsonDocument document{files.scene.string(), /*text=*/"", std::move(json)};
  for (const auto& [path, value] : overrides) PM_TRY_STATUS(apply_override(document, path, value));
  for (const fs::path& file : {files.scene, files.strip, files.gif})
    PM_TRY_STATUS(check_output(file, line.common.overwrite));
  const std::string text = commented_scene(
      document.root,
      "Made by polymorph demo. Edit it and render it; `polymorph schema` knows every key.",
      /*suggestions=*/{});
  PM_TRY(Scene scene, load_scene_text(files.scene, text));
  PM_TRY_STATUS(write_file(files.scene, text));
  std::vector<int> numbers;
  for (int frame = 1; frame <= frame_count(scene); ++frame) numbers.push_back(frame);
  PM_TRY(const EngineScene film_scene, prepare_film(std::move(scene), resources(line.common)));
  PM_TRY(const Film film, render_film(film_scene, std::move(numbers),
                                      {.progress = make_progress(progress_mode(line.common))}));
  SheetSettings sheet;
  sheet.label = "t";
  sheet.by_change = true;
  PM_TRY_STATUS(write_sheet(files.strip, film, sheet));
  PM_TRY_STATUS(write_gif(files.gif, film));
  print_data("{}", text);
  std::fflush(stdout);  // the log's next steps come last if both streams go to one file
  const std::string scene_word = quote_for_shell(files.scene.string());
  log_info("made {} and {} in {}, from the scene printed here: {}", files.gif.string(),
           files.strip.string(), format_seconds(stopwatch.seconds()), files.scene.string());
  log_info("edit the scene, then:\n  {0} check {1}\n  {0} render {1} -o {2} --png", line.program,
           scene_word, quote_for_shell(files.frames.string()));
  return 0;
}

}  // namespace

void add_demo(CommandLine& line) {
  auto options = std::make_shared<DemoOptions>();
  Command command =
      add_command(line, "demo", "Morph any two of the models that come with polymorph, in seconds.",
                  "  polymorph demo\n  polymorph demo monkey spider\n"
                  "  polymorph demo teapot penguin --through puddle\n  polymorph demo --list",
                  "  0 made   2 usage, unknown name   3 bad model   4 cannot write, exists\n"
                  "  5 device or memory, no models   130, 143 stopped by a signal");
  command.add_option("from", options->from, "FROM",
                     "a model by name, a shape or a model file (teapot)");
  command.add_option("to", options->to, "TO", "likewise (penguin)");
  command.add_option("--through", options->through, "EFFECT",
                     "an effect by name, or one more object to become on the way");
  command.add_option("-o,--output", options->output, "DIR|FILE",
                     "folder for scene.json, strip.png and morph.gif, or a file: X.png makes "
                     "X.json and X.gif, too; default: FROM-TO or FROM-EFFECT-TO");
  command.add_flag("-l,--list", options->list, "list models and effects");
  add_overrides(command, options->sets);
  add_overwrite(command, line.common);
  set_action(line, command, [&line, options] { return run_demo(line, *options); });
}

}  // namespace polymorph
