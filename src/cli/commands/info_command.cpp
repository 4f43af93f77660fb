#include <algorithm>

#include "base/text.h"
#include "cli/command_line.h"
#include "cli/progress.h"
#include "export/film_pictures.h"
#include "image/image_io.h"
#include "image/strip.h"
#include "inspect/inspection.h"
#include "model/load/load_model.h"
#include "morph/timeline.h"
#include "scene/mesh_numbers.h"

namespace polymorph {
namespace {

struct InfoOptions {
  std::string input, show, output;  ///< `show` is "plan" or empty
  std::vector<std::string> sets;
  bool timeline = false;
  JsonOutput json;
};

Result<int> print_inspection(const JsonOutput& json, const Result<Inspection>& inspection) {
  if (!inspection) return inspection.error();
  if (json.enabled) {
    PM_TRY_STATUS(write_json(json, inspection->json));
  } else {
    print_data("{}", inspection->text);
  }
  return 0;
}

/// Returns, for each object of the first actor in order, the frame that shows it or is nearest to
/// it.
std::vector<int> object_frames(const Scene& scene) {
  const Timeline timeline = make_timeline(scene, scene.actors.front());
  std::vector<int> frames;
  // Frames count from 1, steps from 0.
  for (const LegTiming& leg : timeline.legs)
    frames.push_back(1 + timeline.hold_start + leg.first_step);
  frames.push_back(frames.back() + timeline.legs.back().steps);
  return frames;
}

/// Draws the objects side by side, in colours that show which part becomes which.
Status write_plan(const CommandLine& line, const EngineScene& film_scene,
                  const std::filesystem::path& path) {
  std::vector<int> numbers = object_frames(film_scene.prepared.scene);
  std::vector<std::string> names;
  for (std::size_t i = 0; i < numbers.size(); ++i)
    names.push_back(film_scene.prepared.actors.front().objects[i]->name);
  StripSettings strip;
  strip.columns = static_cast<int>(numbers.size());
  PM_TRY(const Film film,
         render_film(film_scene, std::move(numbers),
                     {/*width=*/0, FilmContent::kPlan, make_progress(progress_mode(line.common))}));
  PM_TRY(const Image sheet, make_strip(film.images, names, strip));
  PngSettings png;
  png.effort = PngEffort::kSmall;
  return write_image(path, sheet, png);
}

/// Prints the plan of each leg, and draws it to `options.output` if that is given.
Result<int> show_plan(const CommandLine& line, const InfoOptions& options, Scene scene) {
  if (!options.output.empty()) PM_TRY_STATUS(check_sheet(options.output, line.common.overwrite));
  scene.frames.turntable = 0;  // frames of a turntable do not show the objects
  PM_TRY(const EngineScene film_scene, prepare_film(std::move(scene), resources(line.common)));
  PM_TRY_STATUS(check_has_plans(film_scene.prepared));
  if (!options.output.empty() && !film_scene.prepared.scene.actors.front().blend.empty())
    return make_error(ErrorCode::kInput,
                      "{}: a blend has no frames of its own for each object - leave out -o, or see "
                      "its frames with strip --show plan",
                      options.input);
  if (!options.output.empty()) PM_TRY_STATUS(write_plan(line, film_scene, options.output));
  return print_inspection(options.json, inspect_plan(film_scene.prepared, *film_scene.engine,
                                                     cache_folder(line.common)));
}

Result<int> run_info(const CommandLine& line, const InfoOptions& options) {
  if (options.show.empty() && !options.output.empty())
    return make_error(ErrorCode::kUsage, "-o is the picture of --show plan - add that");
  const std::string extension =
      lower_case(std::filesystem::path(options.input).extension().string());
  // A numbered model is a mesh sequence, which load_scene() takes as a scene.
  const bool is_scene =
      extension == ".json" || (is_model_file(options.input) && is_numbered(options.input));
  if (!is_scene) {
    if (options.timeline || !options.show.empty())
      return make_error(ErrorCode::kUsage, "{}: {} is for scenes (.json)", options.input,
                        options.timeline ? "--timeline" : "--show plan");
    const bool is_model = is_model_file(options.input) || is_unsupported_model(options.input);
    return print_inspection(options.json,
                            is_model ? inspect_model(options.input) : inspect_image(options.input));
  }
  PM_TRY(const std::vector<Override> overrides, parse_overrides(options.sets));
  PM_TRY(Scene scene, load_scene(options.input, overrides));
  if (!options.show.empty()) return show_plan(line, options, std::move(scene));
  if (options.timeline) return print_inspection(options.json, inspect_timeline(scene));
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
                  "  polymorph info scene.json\n  polymorph info scene.json --json\n"
                  "  polymorph info scene.json --timeline\n"
                  "  polymorph info scene.json --show plan -o plan.png\n"
                  "  polymorph info frame.0012.exr",
                  "  0 described   2 usage   3 unreadable   4 cannot write   5 device or memory");
  command
      .add_option("input", options->input, "FILE",
                  "a scene (.json), a model, a mesh sequence (seq.####.obj) or an image")
      .required();
  command.add_flag("--timeline", options->timeline,
                   "one line per frame of a scene on what it shows; --json: with all stages");
  command
      .add_option(
          "--show", options->show, "WHAT",
          "plan: for each leg of a scene, its rotation and balls, and which limb becomes which")
      .choices({"plan"});
  command.add_option(
      "-o,--output", options->output, "FILE",
      "picture of the objects for --show plan, .png or .exr: each point has the colour "
      "of the place that it comes from");
  add_overwrite(command, line.common);
  add_overrides(command, options->sets);
  add_json(command, options->json);
  set_action(line, command, [&line, options] { return run_info(line, *options); });
}

}  // namespace polymorph
