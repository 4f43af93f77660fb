#include <set>

#include "analyze/mesh_difference.h"
#include "base/file.h"
#include "base/frames.h"
#include "base/json.h"
#include "base/log.h"
#include "base/program_identity.h"
#include "cli/command_line.h"
#include "cli/report_options.h"
#include "compare/explain.h"
#include "compare/flicker.h"
#include "compare/report_data.h"
#include "image/image_io.h"
#include "model/load/load_model.h"
#include "scene/animated_model.h"
#include "scene/mesh_numbers.h"

namespace polymorph {
namespace {

struct CompareOptions {
  std::string actual, reference, difference;  ///< `difference`: file of --diff; empty: none
  Tolerance tolerance;
  JsonOutput json;
  ReportOptions report;
};

struct FilePair {
  std::filesystem::path actual, reference;
};

/// Pairs two files, or the files of two sequences by their numbers. `are_models`: the files are
/// models, and the poses of an animated model form a sequence. Otherwise they are images. Errors:
/// kUsage, kInput.
Result<std::vector<FilePair>> find_pairs(const CompareOptions& options, bool are_models) {
  const auto parse = [&](const std::string& name) {
    return parse_pattern(are_models && pose_count(name) > 0 ? pose_pattern(name).string() : name);
  };
  PM_TRY(const FramePattern a, parse(options.actual));
  PM_TRY(const FramePattern b, parse(options.reference));
  if (!a.has_number() && !b.has_number())
    return std::vector<FilePair>{{options.actual, options.reference}};
  if (a.has_number() != b.has_number())
    return make_error(ErrorCode::kUsage,
                      "compare two {} or two sequences (with #### in both names)",
                      are_models ? "models" : "images");
  std::set<int> numbers;
  for (const auto& [pattern, name] :
       {std::pair(a, options.actual), std::pair(b, options.reference)}) {
    PM_TRY(const std::vector<int> existing,
           are_models ? existing_meshes(pattern) : existing_frames(pattern));
    if (existing.empty()) return make_error(ErrorCode::kInput, "{}: no such files", name);
    numbers.insert(existing.begin(), existing.end());
  }
  std::vector<FilePair> pairs;
  for (const int number : numbers) pairs.push_back({frame_path(a, number), frame_path(b, number)});
  return pairs;
}

/// Prints how many pairs of a sequence pass, unless there is a JSON report. Returns the exit code.
int finish_pairs(const CompareOptions& options, std::size_t pairs, std::size_t failed) {
  if (pairs > 1 && !options.json.enabled)
    print_data("{} of {} pairs pass\n", pairs - failed, pairs);
  return failed == 0 ? 0 : static_cast<int>(ErrorCode::kAnswerNo);
}

/// Returns the file for the difference picture of a pair: the file of --diff, preceded by the stem
/// of the pair's image for a sequence.
std::string difference_path(const CompareOptions& options, const FilePair& pair, bool is_sequence) {
  const std::filesystem::path path(options.difference);
  if (!is_sequence) return path.string();
  return path.parent_path() / (pair.actual.stem().string() + "." + path.filename().string());
}

/// The last pair of a sequence that was compared, and the flicker since the pair before it.
struct PreviousPair {
  Image actual, reference;
  /// Means over the pixels, of `actual` and of `reference`; empty for the first pair.
  std::optional<double> flicker, reference_flicker;

  /// Measures the flicker to the next pair, and stores that pair.
  void advance(Image next_actual, Image next_reference) {
    const auto mean = [](const std::optional<Flicker>& f) {
      return f ? std::optional<double>(f->mean) : std::nullopt;
    };
    flicker = mean(flicker_between(actual, next_actual));
    reference_flicker = mean(flicker_between(reference, next_reference));
    actual = std::move(next_actual);
    reference = std::move(next_reference);
  }
};

/// Compares one pair of images, and makes its pictures if a report has any. Then makes `pair` the
/// `previous` pair.
Result<ReportCase> compare_pair(const CompareOptions& options, const FilePair& pair,
                                bool is_sequence, PreviousPair& previous, PictureBudget& budget) {
  const ReadImageSettings settings{.single_picture = true, .stored_colors = true};
  PM_TRY(Image actual, read_image(pair.actual, settings));
  PM_TRY(Image reference, read_image(pair.reference, settings));
  PixelMaps maps;
  ReportCase result;
  result.name = pair.actual.filename().string();
  result.actual = pair.actual;
  result.reference = pair.reference;
  result.tolerance = options.tolerance;
  result.comparison = compare_images(actual, reference, options.tolerance, &maps);
  if (!result.comparison->passed()) {
    result.message = result.comparison->reason;
    result.accept = fmt::format("cp {} {}", quote_for_shell(pair.actual.string()),
                                quote_for_shell(pair.reference.string()));
    if (!options.difference.empty()) {
      const std::string path = difference_path(options, pair, is_sequence);
      PM_TRY_STATUS(write_image(path, difference_triptych(actual, reference)));
      log_info("reference | actual | difference: {}", path);
    }
  }
  result.cause = explain_change(actual, reference);
  if (options.report.has_pictures())
    PM_TRY_STATUS(add_pictures(result, actual, &reference, maps, budget));
  previous.advance(std::move(actual), std::move(reference));
  return result;
}

/// Compares meshes by the distance between their surfaces.
Result<int> compare_meshes(const CompareOptions& options) {
  if (options.report.has_pictures() || !options.report.junit.empty() || !options.difference.empty())
    return make_error(ErrorCode::kUsage,
                      "{} is a model - reports and --diff are for images; leave them out",
                      options.actual);
  PM_TRY(const std::vector<FilePair> pairs, find_pairs(options, /*are_models=*/true));
  LoadObjSettings settings;
  settings.textures = false;
  const auto limit = static_cast<double>(options.tolerance.fail);
  std::size_t failed = 0;
  JsonValue json{{"cases", JsonValue::array()}};
  for (const FilePair& pair : pairs) {
    for (const auto& file : {pair.actual, pair.reference}) remember_input(file);
    PM_TRY(const LoadedModel actual, load_model(pair.actual, settings));
    PM_TRY(const LoadedModel reference, load_model(pair.reference, settings));
    const MeshDifference difference = mesh_difference(actual.model, reference.model);
    const bool passed = difference.largest <= limit;
    if (!passed) ++failed;
    json["cases"].push_back({{"name", pair.actual.filename().string()},
                             {"passed", passed},
                             {"same", difference.is_same},
                             {"mean", difference.mean},
                             {"largest", difference.largest}});
    if (options.json.enabled) continue;
    print_data("{}: {}\n", pair.actual.string(),
               difference.is_same
                   ? std::string("same points and faces")
                   : fmt::format("{}at most {:.2g} of the size apart, {:.2g} on the mean",
                                 passed ? "" : "different: ", difference.largest, difference.mean));
  }
  if (options.json.enabled) PM_TRY_STATUS(write_json(options.json, json));
  return finish_pairs(options, pairs.size(), failed);
}

/// Compares images: checks all outputs before any work, compares the pairs, then writes the
/// reports.
Result<int> run_compare(const CompareOptions& options, bool overwrite) {
  if (is_model_file(options.actual) && is_model_file(options.reference))
    return compare_meshes(options);
  const auto pairs_or_error = find_pairs(options, /*are_models=*/false);
  const std::vector<FilePair> pairs = pairs_or_error ? *pairs_or_error : std::vector<FilePair>{};
  for (const FilePair& pair : pairs)
    for (const auto& file : {pair.actual, pair.reference}) remember_input(file);
  // Refuse to write pictures over inputs or other files before an earlier report is removed.
  for (const FilePair& pair : pairs) {
    if (!options.report.folder.empty())
      PM_TRY_STATUS(check_writable(std::filesystem::path(options.report.folder) /
                                   pair.actual.filename().replace_extension(".png")));
    if (!options.difference.empty())
      PM_TRY_STATUS(check_output(difference_path(options, pair, pairs.size() > 1), overwrite));
  }
  // Remove an earlier report, even if there is nothing to compare. All inputs are known here, so
  // that none of them is removed.
  PM_TRY_STATUS(begin_report(options.report, overwrite));
  if (!pairs_or_error) return pairs_or_error.error();
  Report report{fmt::format("{} against {}", options.actual, options.reference),
                {{"polymorph", std::string(program_version())}},
                /*cases=*/{},
                /*notes=*/{}};
  PictureBudget budget;
  PreviousPair previous;
  for (const FilePair& pair : pairs) {
    PM_TRY(ReportCase result, compare_pair(options, pair, pairs.size() > 1, previous, budget));
    // The case before this one gets the flicker from its pair to this pair.
    if (!report.cases.empty()) {
      report.cases.back().flicker = previous.flicker;
      report.cases.back().reference_flicker = previous.reference_flicker;
    }
    if (!options.json.enabled)
      print_data("{}: {}{}{}\n", pair.actual.string(), result.comparison->reason,
                 result.cause.empty() ? "" : "; seen: ", result.cause);
    if (result.warned())
      log_warning("{}: {} pixels differ by more than {}", pair.actual.string(),
                  result.comparison->warning_pixels, options.tolerance.warn);
    report.cases.push_back(std::move(result));
  }
  if (options.json.enabled) {
    JsonValue json{{"cases", JsonValue::array()}};
    for (const ReportCase& result : report.cases) json["cases"].push_back(case_json(result));
    PM_TRY_STATUS(write_json(options.json, json));
  }
  const int code = finish_pairs(options, pairs.size(), report.failed());
  PM_TRY_STATUS(write_reports(options.report, report, overwrite));
  return code;
}

/// Adds the options that set the limits of a comparison.
void add_limits(Command command, Tolerance& t) {
  constexpr double kMax = 1e30;  // practically no limit
  const auto add = [&](const char* name, float& value, double highest, const char* type,
                       const std::string& what) {
    command.add_option(name, value, type, what).range(0.0, highest);
  };
  add("--fail", t.fail, kMax, "X",
      fmt::format(
          "a pixel fails beyond this difference ({}); of models their surfaces, beyond this "
          "share of the size",
          t.fail));
  add("--relative", t.relative, kMax, "X",
      fmt::format("... plus this share of the reference ({})", t.relative));
  add("--failpercent", t.fail_percent, 100, "P",
      fmt::format("maximum share of failing pixels, % ({})", t.fail_percent));
  add("--hardfail", t.hard_fail, kMax, "X", "no pixel may differ by more (off)");
  add("--depth", t.depth, kMax, "X", fmt::format("relative limit for Z ({})", t.depth));
  add("--normal", t.normal, kMax, "X", fmt::format("limit for N.* ({})", t.normal));
  add("--flip", t.flip_mean, 1, "X", "limit of the mean FLIP, 0 to 1 (off)");
  add("--flip-p99", t.flip_p99, 1, "X", "... and of what 99 % of the pixels stay below (off)");
  add("--warn", t.warn, kMax, "X", "say so when a pixel differs by more; no failure (off)");
  add("--warnpercent", t.warn_percent, 100, "P",
      fmt::format("... when more than this share does, % ({})", t.warn_percent));
}

}  // namespace

void add_compare(CommandLine& line) {
  auto options = std::make_shared<CompareOptions>();
  Command command =
      add_command(line, "compare",
                  "Compare two images, two models or two sequences of either; NaN always fails.",
                  "  polymorph compare new.exr golden.exr\n"
                  "  polymorph compare 'a/f.####.exr' 'b/f.####.exr' --fail 0.01 --html page.html\n"
                  "  polymorph compare 'a/seq.####.obj' 'b/seq.####.obj'",
                  "  0 within the limits   1 different   2 usage   3 unreadable image\n"
                  "  4 cannot write");
  command
      .add_option("actual", options->actual, "ACTUAL",
                  "image or model, or a sequence of them with ####")
      .required();
  command
      .add_option("reference", options->reference, "REFERENCE",
                  "the image, model or sequence to compare with")
      .required();
  add_limits(command, options->tolerance);
  command
      .add_option("--diff", options->difference, "FILE",
                  "write reference | actual | difference of what fails")
      .group("Output");
  add_report(command, options->report);
  add_json(command, options->json);
  set_action(line, command,
             [&line, options] { return run_compare(*options, line.common.overwrite); });
}

}  // namespace polymorph
