#include "base/frames.h"
#include "base/text.h"
#include "cli/command_line.h"
#include "cli/write_play_page.h"
#include "export/mesh_files.h"
#include "morph/timeline.h"
#include "sequence/prepare/engine_scene.h"

namespace polymorph {
namespace {

struct MeshOptions {
  std::string scene, output, html, frames, max_error, topology = "changing";
  bool quantize = false;
  std::vector<std::string> sets;
};

/// Parses --error, a fraction of the diagonal or a percentage. Errors: kUsage, unless the fraction
/// is above 0 and at most 10 %.
Result<double> parse_mesh_error(const std::string& text) {
  std::string_view number = text;
  const bool is_percent = number.ends_with('%');
  if (is_percent) number.remove_suffix(1);
  const double error = parse_number(number).value_or(0) * (is_percent ? 0.01 : 1);
  if (error > 0 && error <= 0.1) return error;
  return make_error(
      ErrorCode::kUsage,
      "--error: {} is not a share of the diagonal above 0 and up to 10%, such as 0.02%", text);
}

/// Checks that the options do not contradict each other. Errors: kUsage.
Status check_options(const MeshFileSettings& settings) {
  if (settings.quantize && settings.format != MeshFormat::kGlb)
    return make_error(ErrorCode::kUsage, "--quantize is for .glb files");
  if (settings.constant_topology &&
      (settings.error > 0 || settings.quantize || settings.format == MeshFormat::kBalls))
    return make_error(
        ErrorCode::kUsage,
        "--topology constant: a carried mesh is neither simplified nor quantized, and has no "
        "balls - leave out --error and --quantize, and write .glb, .usda, .obj or .ply");
  return Ok{};
}

/// Writes the page that plays the morph (--html).
Result<int> write_page(const CommandLine& line, const MeshOptions& options) {
  if (!options.frames.empty() || !options.max_error.empty() || options.quantize ||
      options.topology == "constant")
    return make_error(ErrorCode::kUsage,
                      "--html: a page has all frames and makes its own surfaces - leave out "
                      "--frames, --error, --quantize and --topology");
  PM_TRY_STATUS(check_play_page(line, options.html));
  PM_TRY(const std::vector<Override> overrides, parse_overrides(options.sets));
  PM_TRY(Scene scene, load_scene(options.scene, overrides));
  PM_TRY_STATUS(write_play_page(line, std::move(scene), options.html));
  return 0;
}

Result<int> run_mesh(const CommandLine& line, const MeshOptions& options) {
  if (options.output.empty() == options.html.empty())
    return make_error(ErrorCode::kUsage,
                      "give -o morph.usda (or another mesh) or --html play.html");
  if (!options.html.empty()) return write_page(line, options);
  MeshFileSettings settings;
  settings.output = options.output;
  PM_TRY(settings.format, parse_mesh_format(options.output));
  PM_TRY(const std::vector<Override> overrides, parse_overrides(options.sets));
  PM_TRY(Scene scene, load_scene(options.scene, overrides));
  PM_TRY(settings.frames, parse_frames_or_all(options.frames, 1, frame_count(scene)));
  if (!options.max_error.empty()) {
    PM_TRY(settings.error, parse_mesh_error(options.max_error));
  }
  settings.constant_topology = options.topology == "constant";
  settings.quantize = options.quantize;
  settings.overwrite = line.common.overwrite;
  settings.print = [](const std::string& text) { print_data("{}", text); };
  PM_TRY_STATUS(check_options(settings));
  PM_TRY_STATUS(complete_mesh_settings(settings));
  PM_TRY_STATUS(check_mesh_files(settings, /*actors=*/{}));
  request_mesh_attributes(scene, settings);
  PM_TRY(const EngineScene engine_scene, prepare_on_engine(scene, resources(line.common)));
  // Check again: now all input files are known, also those that models and materials name.
  PM_TRY_STATUS(check_mesh_files(settings, engine_scene.prepared.actors));
  PM_TRY_STATUS(write_mesh_files(settings, engine_scene.prepared, *engine_scene.engine));
  return 0;
}

}  // namespace

void add_mesh(CommandLine& line) {
  auto options = std::make_shared<MeshOptions>();
  Command command = add_command(
      line, "mesh", "Write the surface for other programs (USD, glTF, PLY, OBJ), or the balls.",
      "  polymorph mesh scene.json -o morph.usda\n"
      "  polymorph mesh scene.json -o morph.glb --quantize --error 0.02%\n"
      "  polymorph mesh scene.json -o 'surface.####.ply'\n"
      "  polymorph mesh scene.json --topology constant -o targets.glb\n"
      "  polymorph mesh scene.json -f 12 -o half.obj\n"
      "  polymorph mesh scene.json --html play.html\n"
      "  polymorph mesh scene.json -f 12 -o balls.json",
      "  0 written   2 usage   3 bad scene or model   4 cannot write\n"
      "  5 device or memory   130, 143 stopped by a signal");
  command.add_option("scene", options->scene, "SCENE", "the scene file").required();
  command.add_option("-o,--output", options->output, "FILE",
                     "morph.usda or morph.glb; surface.####.ply or .obj; .json for the balls");
  command.add_option("--html", options->html, "FILE",
                     "instead: a page that plays the morph in a browser");
  command
      .add_option("--topology", options->topology, "WHAT",
                  "constant: one mesh carried through a leg, for morph targets; default: changing")
      .choices({"changing", "constant"});
  command.add_option("-f,--frames", options->frames, "LIST",
                     "1-48, 1-48x2, 5-1, 1,5,10-20; default: all");
  command.add_option("--error", options->max_error, "E",
                     "simplify: maximum Hausdorff distance, a share of the diagonal, as 0.02%");
  command.add_flag("--quantize", options->quantize,
                   ".glb: 16 bits for positions, 8 for normals, no velocities");
  add_overwrite(command, line.common);
  add_overrides(command, options->sets);
  set_action(line, command, [&line, options] { return run_mesh(line, *options); });
}

}  // namespace polymorph
