#include <algorithm>

#include "analyze/analysis_report.h"
#include "base/file.h"
#include "base/frames.h"
#include "base/log.h"
#include "cli/command_line.h"
#include "cli/report_options.h"
#include "inspect/analyze_sequence.h"
#include "scene/animated_model.h"
#include "sequence/prepare/engine_scene.h"

namespace polymorph {
namespace {

struct AnalyzeOptions {
  std::string input, html, csv, source, target, truth;
  int frames = 0;  ///< frames per morph of a scene; 0: as in the scene
  std::vector<std::string> limits, sets;
  JsonOutput json;
};

bool is_scene(const std::string& input) {
  return std::filesystem::path(input).extension() == ".json";
}

/// Finds the model with true points for one end of a mesh sequence. `file`: the object's file, as
/// given by --source or --target; empty: `mesh`, the first or last mesh, is the object.
const TrueModel* find_end_model(const Truth& truth, const std::string& file,
                                const std::filesystem::path& mesh) {
  const std::filesystem::path path = file.empty() ? mesh : std::filesystem::path(file);
  return truth.find(path, path.stem().string());
}

/// Measures a morph that is a sequence of mesh files. `truth`: null if no true points are given.
Result<std::vector<Analysis>> analyze_files(const FramePattern& pattern,
                                            const AnalyzeOptions& options, const Truth* truth,
                                            const AnalyzeProgress& progress) {
  MeshMorph morph{pattern, options.source, options.target, /*truth=*/{}};
  if (truth) {
    PM_TRY(const std::vector<int> numbers, existing_frames(pattern));
    if (!numbers.empty())
      morph.truth = {find_end_model(*truth, options.source, frame_path(pattern, numbers.front())),
                     find_end_model(*truth, options.target, frame_path(pattern, numbers.back()))};
  }
  return analyze_meshes(morph, progress);
}

/// Checks that at least one morph was measured against the true points. `truth`: null if none are
/// given. Errors: kInput.
Status check_truth(const std::vector<Analysis>& morphs, const Truth* truth) {
  if (!truth || std::any_of(morphs.begin(), morphs.end(), [](const Analysis& morph) {
        return morph.find("points")->value.has_value();
      }))
    return Ok{};
  return make_error(ErrorCode::kInput,
                    "{}: has no points that two successive objects have in common - its models "
                    "are found by their files, else by the objects' names",
                    truth->file.string());
}

/// Measures the meshes or the scene that the options name.
Result<std::vector<Analysis>> analyze_input(const CommandLine& line,
                                            const AnalyzeOptions& options) {
  const AnalyzeProgress progress = [](int done, int count) {
    log_debug("frame {} of {}", done + 1, count);
    return !stop_requested();
  };
  Truth loaded_truth;
  if (!options.truth.empty()) {
    PM_TRY(loaded_truth, load_truth(options.truth));
  }
  const Truth* truth = options.truth.empty() ? nullptr : &loaded_truth;
  if (!is_scene(options.input)) {
    const bool is_animated = pose_count(options.input) > 0;
    PM_TRY(const FramePattern pattern,
           parse_pattern(is_animated ? pose_pattern(options.input).string() : options.input));
    if (!pattern.has_number() || !options.sets.empty())
      return make_error(ErrorCode::kUsage,
                        "{}: neither a scene (.json) nor meshes with a place for the frame number "
                        "(seq.####.obj){}",
                        options.input, options.sets.empty() ? "" : ", and --set is for scenes");
    PM_TRY(std::vector<Analysis> morphs, analyze_files(pattern, options, truth, progress));
    PM_TRY_STATUS(check_truth(morphs, truth));
    return morphs;
  }
  if (!options.source.empty() || !options.target.empty())
    return make_error(ErrorCode::kUsage,
                      "--source and --target are for meshes - a scene names its own");
  PM_TRY(const std::vector<Override> overrides, parse_overrides(options.sets));
  PM_TRY(const Scene scene, load_scene(options.input, overrides));
  PM_TRY(const EngineScene engine_scene, prepare_on_engine(scene, resources(line.common)));
  PM_TRY(std::vector<Analysis> morphs, analyze_scene(engine_scene.prepared, *engine_scene.engine,
                                                     options.frames, progress, truth));
  PM_TRY_STATUS(check_truth(morphs, truth));
  return morphs;
}

void print_analysis(const Analysis& morph) {
  print_data("{}, {} frames\n", morph_name(morph), morph.frames.size());
  for (const Metric& metric : morph.metrics)
    print_data("  {:<24} {:<18} {:>10}  {:<8} {}{}\n", metric.principle, metric.name,
               metric.value ? fmt::format("{:.4g}", *metric.value) : "-", metric.goal,
               metric.value && !reaches(*metric.value, metric.goal) ? "MISSED: " : "",
               metric.definition);
}

Result<int> run_analyze(const CommandLine& line, const AnalyzeOptions& options) {
  PM_TRY(const std::vector<Limit> limits, parse_limits(options.limits));
  auto morphs = analyze_input(line, options);
  if (!morphs && stop_requested()) return make_error(stop_code(), "stopped, nothing written");
  if (!morphs) return std::move(morphs).error();
  if (!options.html.empty())
    PM_TRY_STATUS(write_file(options.html, analysis_html(*morphs, options.input)));
  if (!options.csv.empty()) PM_TRY_STATUS(write_file(options.csv, analysis_csv(*morphs)));
  if (options.json.enabled)
    PM_TRY_STATUS(write_json(options.json, analysis_json(*morphs)));
  else
    for (const Analysis& morph : *morphs) print_analysis(morph);
  return check_limits(*morphs, limits);
}

}  // namespace

void add_analyze(CommandLine& line) {
  auto options = std::make_shared<AnalyzeOptions>();
  Command command = add_command(
      line, "analyze", "Measure how good a morph is: a scene's, or any program's meshes.",
      "  polymorph analyze scene.json --html report.html\n"
      "  polymorph analyze scene.json --fail-on \"dip>=0.98\" --fail-on \"curvature<=1.05\"\n"
      "  polymorph analyze scene.json --truth truth.json --fail-on \"map_within_10>=0.7\"\n"
      "  polymorph analyze \"seq.####.obj\" --source a.obj --target b.obj --json",
      "  0 measured, every limit holds   1 a limit does not hold   2 usage\n"
      "  3 bad scene, model or meshes   4 cannot write   5 device or memory\n"
      "  130, 143 stopped by a signal");
  command
      .add_option("input", options->input, "SCENE|MESHES",
                  "a scene .json, or meshes as seq.####.obj")
      .required();
  command.add_option("--html", options->html, "FILE", "a page with numbers and curves");
  command.add_option("--csv", options->csv, "FILE", "a line per frame");
  command
      .add_option("--fail-on", options->limits, "LIMIT",
                  "a limit that must hold in every morph, as \"pop<=2\"; else exit code 1")
      .one_value_each();
  command
      .add_option("-c,--count", options->frames, "N",
                  "frames of each morph of a scene, ends included; default: as it has")
      .range(0, 10000);
  command.add_option(
      "--truth", options->truth, "FILE",
      "points of the models that belong together, which the morph is judged by (JSON)");
  command.add_option("--source", options->source, "FILE",
                     "meshes: the object they start from (OBJ)");
  command.add_option("--target", options->target, "FILE",
                     "meshes: the object they arrive at (OBJ)");
  add_overrides(command, options->sets);
  add_json(command, options->json);
  set_action(line, command, [&line, options] { return run_analyze(line, *options); });
}

}  // namespace polymorph
