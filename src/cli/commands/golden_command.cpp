#include <fmt/ranges.h>

#include <algorithm>

#include "base/folder.h"
#include "base/frames.h"
#include "base/log.h"
#include "base/plural.h"
#include "base/program_identity.h"
#include "cli/command_line.h"
#include "cli/report_options.h"
#include "compare/report_merge.h"
#include "golden/golden_accept.h"
#include "golden/golden_bits.h"
#include "golden/golden_frames.h"
#include "golden/golden_run.h"

namespace polymorph {
namespace {

struct GoldenOptions {
  std::vector<std::string> suites;  ///< arguments after the verb: suites, scenes or reports
  std::string root = "golden_frames", failures;  ///< folders
  std::string reason, frames;                    ///< `frames`: a list, "1,12,24"
  bool any_program = false, bits = false;
  std::string output;
  JsonOutput json;
  ReportOptions report;
};

GoldenSettings golden_settings(const CommandLine& line, const GoldenOptions& options) {
  GoldenSettings settings;
  // Goldens are rendered on the CPU unless another device is named.
  settings.device = line.common.device == "auto" ? "cpu" : line.common.device;
  settings.cache_folder = cache_folder(line.common);
  // The failing frames lie inside the report, so that it can be accepted from any folder.
  settings.failures = !options.failures.empty() ? std::filesystem::path(options.failures)
                      : !options.report.folder.empty()
                          ? std::filesystem::path(options.report.folder) / "frames"
                          : std::filesystem::path("golden-failures");
  return settings;
}

/// Returns the option --root for a suggested command; "" if it has its default.
std::string root_argument(const GoldenOptions& options) {
  return options.root == "golden_frames" ? "" : " --root " + quote_for_shell(options.root);
}

/// Returns the command that makes the failed frames goldens: `accept` if the report keeps the
/// frames, else `update`, which renders them again.
std::string accept_command(const GoldenOptions& options, const std::string& suite) {
  const bool keeps_frames = !options.report.folder.empty() && options.failures.empty();
  const std::string verb =
      keeps_frames ? "accept " + quote_for_shell(options.report.folder) + " " : "update ";
  return fmt::format("polymorph golden {}{}{} --reason \"...\"", verb, quote_for_shell(suite),
                     root_argument(options));
}

/// Checks that `folder` is outside the folder of the suites, where it would be mistaken for a
/// suite. Errors: kUsage.
Status check_outside_suites(const GoldenOptions& options, const std::filesystem::path& folder) {
  if (!is_in_folder(folder, options.root)) return Ok{};
  return make_error(ErrorCode::kUsage,
                    "{}: lies in {}, where each entry is a suite - give --report or --failures "
                    "another folder",
                    folder.string(), options.root);
}

/// Lists the names of all suites. An empty folder is an error, because it may be the wrong one.
Result<std::vector<std::string>> all_suites(const std::string& root) {
  PM_TRY(std::vector<std::string> names, list_golden_suites(root));
  if (names.empty())
    return make_error(ErrorCode::kInput,
                      "{}: no golden suite in it (a suite is a folder with a suite.json) - check "
                      "--root, or make one: "
                      "polymorph golden new NAME SCENE -f 1,12,24",
                      root);
  return names;
}

/// Renders a suite's frames in several ways that must give equal bits (`--bits`), and adds a case
/// per way to the report. The goldens are not read.
Status test_bits(const GoldenSuite& suite, const GoldenSettings& settings,
                 const GoldenOptions& options, Report& report) {
  PM_TRY(std::vector<ReportCase> cases, test_golden_bits(suite, settings));
  std::size_t passed = 0;
  for (ReportCase& result : cases) {
    passed += result.passed();
    if (!options.json.enabled)
      print_data("{}, {}: {}\n", result.group, result.name,
                 result.passed() ? "ok: " + result.detail : "FAILED: " + result.message);
    report.cases.push_back(std::move(result));
  }
  if (!options.json.enabled) print_data("{}: {} of {} pass\n", suite.name, passed, cases.size());
  return Ok{};
}

/// Compares a suite's frames with their goldens and adds them to the report.
Status test_frames(const GoldenSuite& suite, const GoldenSettings& settings,
                   const GoldenOptions& options, Report& report) {
  PM_TRY(GoldenResult result, test_golden(suite, settings));
  const std::string accept = accept_command(options, suite.name);
  for (GoldenFrame& frame : result.frames) {
    if (!options.json.enabled)
      print_data("{} frame {}: {}{}{}{}{}\n", suite.name, frame.frame,
                 frame.passed() ? "ok" : "FAILED: ", frame.message,
                 frame.masked_percent > 0 && frame.masked_percent <= frame.report.max_masked_percent
                     ? fmt::format(", {:.3g} % masked", frame.masked_percent)
                     : "",
                 frame.report.cause.empty() ? "" : "; seen: ", frame.report.cause);
    if (frame.passed() && frame.image && frame.image->verdict == Verdict::kWithin)
      log_debug("  {}", frame.image->reason);
    if (frame.report.warned())
      log_warning("{} frame {}: {} pixels differ by more than {}", suite.name, frame.frame,
                  frame.image->warning_pixels, suite.tolerance.warn);
    if (!frame.passed()) frame.report.accept = accept;
    report.cases.push_back(std::move(frame.report));
  }
  for (const auto& orphan : result.orphans) {
    report.notes.push_back(
        fmt::format("{}: no frame of {} asks for it", orphan.string(), suite.name));
    log_warning("{}", report.notes.back());
  }
  if (!options.json.enabled)
    print_data("{}: {} of {} frames pass\n", suite.name, result.frames.size() - result.failed(),
               result.frames.size());
  if (result.failed() == 0) return Ok{};
  log_info("actual, reference and difference: {}", (settings.failures / suite.name).string());
  log_info("to accept: {}", accept);
  return Ok{};
}

/// Tests one suite as the options say, and adds its cases to the report.
Status test_suite(const std::string& name, const GoldenSettings& settings,
                  const GoldenOptions& options, Report& report) {
  PM_TRY(const GoldenSuite suite, load_golden_suite(options.root, name));
  if (options.bits && !suite.command.empty())
    return make_error(ErrorCode::kUsage,
                      "{}: --bits is for scenes, this suite's frames come from a command", name);
  PM_TRY(const std::string hash, suite_hash(suite));
  report.suites.emplace_back(name, hash);
  return options.bits ? test_bits(suite, settings, options, report)
                      : test_frames(suite, settings, options, report);
}

/// Adds a failed case for a suite that could not be tested, so that CI does not pass. `group` and
/// `name` identify the case in the report.
void add_error(const std::string& group, const std::string& name, const Error& error,
               const GoldenOptions& options, Report& report) {
  if (!options.json.enabled) print_data("{}: could not be tested\n", group);
  print_error(error);
  ReportCase failed;
  failed.group = group;
  failed.name = name;
  failed.message = error.message;
  failed.error = true;
  report.cases.push_back(std::move(failed));
}

/// Tests all named suites and writes the reports, even if some suites cannot be tested.
Result<int> test_all(const CommandLine& line, const GoldenOptions& options) {
  GoldenSettings settings = golden_settings(line, options);
  PM_TRY_STATUS(check_outside_suites(options, settings.failures));
  if (!options.report.folder.empty())
    PM_TRY_STATUS(check_outside_suites(options, options.report.folder));
  PM_TRY_STATUS(begin_report(options.report, line.common.overwrite));
  PictureBudget budget;
  if (options.report.has_pictures()) settings.pictures = &budget;
  Report report{"Golden frames",
                {{"polymorph", std::string(program_version())},
                 {"program", std::string(program_identity())},
                 {"device", settings.device}},
                /*cases=*/{},
                /*notes=*/{}};
  int code = 0;  // exit code of the first error
  std::vector<std::string> names = options.suites;
  if (names.empty()) {
    auto all = all_suites(options.root);
    if (all) names = std::move(*all);
    if (!all) {
      code = static_cast<int>(all.error().code);
      add_error(options.root, "the folder", all.error(), options, report);
    }
  }
  if (names.size() == 1) report.title = names[0] + ": golden frames";
  for (const std::string& name : names) {
    const Status status = test_suite(name, settings, options, report);
    if (status) continue;
    // A wrong use of the command ends the run; other errors become cases of the report.
    if (status.error().code == ErrorCode::kUsage) return status.error();
    if (code == 0) code = static_cast<int>(status.error().code);
    add_error(name, "the suite", status.error(), options, report);
  }
  if (report.errors() > 0 && code == 0) code = static_cast<int>(ErrorCode::kInput);
  if (report.failed() > 0 && code == 0) code = static_cast<int>(ErrorCode::kAnswerNo);
  if (options.json.enabled) PM_TRY_STATUS(write_json(options.json, report_json(report)));
  PM_TRY_STATUS(write_reports(options.report, report, line.common.overwrite));
  return code;
}

/// Prints "SHA256  SUITE/frame.0012" per frame, as sha256sum does, so that machines can be
/// compared.
Result<int> print_hashes(const CommandLine& line, const GoldenOptions& options) {
  const GoldenSettings settings = golden_settings(line, options);
  std::vector<std::string> names = options.suites;
  if (names.empty()) {
    PM_TRY(names, all_suites(options.root));
  }
  for (const std::string& name : names) {
    GoldenSuite suite;
    if (name.ends_with(".json")) {
      suite.name = std::filesystem::path(name).stem().string();
      suite.scene = name;
    } else {
      PM_TRY(suite, load_golden_suite(options.root, name));
    }
    PM_TRY(const std::vector<FrameHash> hashes, hash_golden(suite, settings));
    for (const FrameHash& hash : hashes)
      print_data("{}  {}/frame.{:04}\n", hash.sha256, suite.name, hash.frame);
  }
  return 0;
}

/// Merges reports of several machines into one.
Result<int> merge_golden_reports(const CommandLine& line, const GoldenOptions& options) {
  if (options.suites.size() < 2 || options.output.empty())
    return make_error(ErrorCode::kUsage,
                      "golden merge needs two reports and -o - polymorph golden merge a b -o all");
  const std::vector<std::filesystem::path> reports(options.suites.begin(), options.suites.end());
  ReportOptions output;
  output.folder = options.output;
  PM_TRY_STATUS(check_merge_output(reports, options.output));
  PM_TRY_STATUS(begin_report(output, line.common.overwrite));
  PM_TRY(const std::size_t failed, merge_reports(reports, options.output, line.common.overwrite));
  print_data("{}: {} reports, {} failed\n", options.output, reports.size(),
             plural(failed, "frame"));
  return failed == 0 ? 0 : static_cast<int>(ErrorCode::kAnswerNo);
}

/// Makes a suite of a scene and logs the next steps.
Result<int> make_suite(const CommandLine& line, const GoldenOptions& options) {
  if (options.suites.size() != 2 || options.frames.empty())
    return make_error(ErrorCode::kUsage,
                      "golden new needs a name, a scene and frames - polymorph golden new logo "
                      "scenes/logo.json -f 1,12,24");
  GoldenSuite suite;
  suite.name = options.suites[0];
  suite.scene = options.suites[1];
  suite.folder = std::filesystem::path(options.root) / suite.name;
  if (suite.name.starts_with('.') || std::filesystem::path(suite.name).filename() != suite.name ||
      suite.name.empty())
    return make_error(ErrorCode::kUsage, "'{}': not a name for a folder in {}", suite.name,
                      options.root);
  PM_TRY(suite.frames, parse_frames(options.frames, /*first=*/0, /*last=*/9999999));
  std::sort(suite.frames.begin(), suite.frames.end());
  const std::string reason = options.reason.empty() ? "first frames" : options.reason;
  PM_TRY(const auto written, create_golden_suite(suite, golden_settings(line, options), reason));
  for (const auto& path : written) print_data("{}\n", path.string());
  log_info("look at the frames and commit {}; then test it:", suite.folder.string());
  log_info("polymorph golden test {}{} --report golden-report", quote_for_shell(suite.name),
           root_argument(options));
  return 0;
}

/// Prints a line per suite, and the errors of suites that cannot be loaded.
Result<int> list_suites(const CommandLine&, const GoldenOptions& options) {
  std::vector<std::string> names = options.suites;
  if (names.empty()) {
    PM_TRY(names, all_suites(options.root));
  }
  int code = 0;
  for (const std::string& name : names) {
    const auto suite = load_golden_suite(options.root, name);
    if (suite) {
      print_data("{}: {} of {}\n", suite->name, plural(suite->frames.size(), "frame"),
                 suite->command.empty() ? suite->scene.string() : suite->command);
      continue;
    }
    print_error(suite.error());
    if (code == 0) code = static_cast<int>(suite.error().code);
  }
  return code;
}

/// Makes the frames of a report goldens. The first argument is the report, the others are suites.
Result<int> accept_frames(const CommandLine&, const GoldenOptions& options) {
  if (options.suites.empty())
    return make_error(ErrorCode::kUsage,
                      "golden accept needs the report: a folder, .zip or .tar - polymorph golden "
                      "accept golden-report --reason \"...\"");
  AcceptSettings settings;
  settings.root = options.root;
  settings.suites.assign(options.suites.begin() + 1, options.suites.end());
  settings.frames = options.frames;
  settings.reason = options.reason;
  settings.any_program = options.any_program;
  PM_TRY(const auto written, accept_report(options.suites[0], settings));
  for (const auto& path : written) print_data("{}\n", path.string());
  return 0;
}

/// Renders the goldens of suites anew.
Result<int> update_suites(const CommandLine& line, const GoldenOptions& options) {
  if (options.suites.empty())
    return make_error(ErrorCode::kUsage,
                      "golden update needs the suite's name - polymorph golden list shows them");
  const GoldenSettings settings = golden_settings(line, options);
  for (const std::string& name : options.suites) {
    PM_TRY(const GoldenSuite suite, load_golden_suite(options.root, name));
    PM_TRY(const auto written, update_golden(suite, settings, options.reason));
    for (const auto& path : written) print_data("{}\n", path.string());
    if (written.empty()) log_info("{}: nothing to update", suite.name);
  }
  return 0;
}

/// Lists the verbs, with the members of VerbTable in its order (options/option_table.h).
std::vector<VerbTable> golden_verbs(const CommandLine& line,
                                    std::shared_ptr<GoldenOptions> options) {
  const auto call = [&line, options](auto action) {
    return [&line, options, action] { return action(line, *options); };
  };
  const std::vector<std::string> compute_options = {"-t", "--device", "--max-memory", "--cache-dir",
                                                    "--no-cache"};
  const auto with_compute_options = [&](std::vector<std::string> names) {
    names.insert(names.end(), compute_options.begin(), compute_options.end());
    return names;
  };
  return {
      {"test", "Render the frames of suites and compare them with their goldens.", "[SUITE...]",
       "suites; default: all of them",
       with_compute_options({"--root", "--failures", "--bits", "--report", "--html", "--junit",
                             "--json", "--overwrite"}),
       "  polymorph golden test\n"
       "  polymorph golden test teapot-penguin --report golden-report\n"
       "  polymorph golden test --bits",
       "  0 all frames pass   1 a frame differs or its golden is missing   2 usage\n"
       "  3 bad suite or scene; the others are tested   4 cannot write\n"
       "  5 device or memory",
       call(test_all)},
      {"new", "Make a suite of some frames of a scene, and render their goldens.", "NAME SCENE",
       "name of the suite, and its scene", with_compute_options({"--root", "--frames", "--reason"}),
       "  polymorph golden new logo scenes/logo.json -f 1,12,24",
       "  0 made   2 usage   3 bad scene   4 cannot write, exists   5 device or memory",
       call(make_suite)},
      {"update", "Render the goldens of suites anew.", "SUITE...", "suites; golden list shows them",
       with_compute_options({"--root", "--reason"}),
       "  polymorph golden update teapot-penguin --reason \"softer key light\"",
       "  0 done   2 usage   3 bad suite or scene   4 cannot write   5 device or memory",
       call(update_suites)},
      {"accept",
       "Make the frames of a failed run goldens, without rendering.",
       "REPORT [SUITE...]",
       "the report, a folder, .zip or .tar, then suites; default: all in it",
       {"--root", "--frames", "--reason", "--any-program"},
       "  polymorph golden accept golden-report.zip --reason \"softer key light\"\n"
       "  polymorph golden accept golden-report teapot-penguin -f 12 --reason \"easing\"",
       "  0 accepted   2 usage   3 bad report or suite   4 cannot write",
       call(accept_frames)},
      {"merge",
       "Make one report of those of several machines.",
       "REPORT...",
       "reports: two folders or more",
       {"--output", "--overwrite"},
       "  polymorph golden merge shard-1 shard-2 -o golden-report",
       "  0 all frames pass   1 a frame failed   2 usage   3 bad report   4 cannot write",
       call(merge_golden_reports)},
      {"list",
       "List the suites with their frames and scenes.",
       "[SUITE...]",
       "the suites; default: all",
       {"--root"},
       "  polymorph golden list",
       "  0 all can be loaded   2 usage   3 no suite, or a bad one",
       call(list_suites)},
      {"hash", "Print the SHA-256 of each frame's pixels: the same on every machine.",
       "[SUITE|SCENE.json...]", "suites and scenes; default: all suites",
       with_compute_options({"--root"}),
       "  polymorph golden hash > here.txt\n  polymorph golden hash scenes/logo.json",
       "  0 printed   2 usage   3 bad suite or scene   5 device or memory", call(print_hashes)},
  };
}

}  // namespace

void add_golden(CommandLine& line) {
  auto options = std::make_shared<GoldenOptions>();
  Command command =
      add_command(line, "golden", "Test golden frames, make, update or accept them.",
                  "  polymorph golden new logo scenes/logo.json -f 1,12,24\n"
                  "  polymorph golden test\n"
                  "  polymorph golden test teapot-penguin --report golden-report\n"
                  "  polymorph golden update teapot-penguin --reason \"softer key light\"\n"
                  "  polymorph golden accept golden-report.zip --reason \"softer key light\"\n"
                  "  polymorph golden hash > here.txt    # the same on every machine",
                  "  0 all frames pass   1 a frame differs or its golden is missing   2 usage\n"
                  "  3 bad suite or scene; the others are tested   4 cannot write\n"
                  "  5 device or memory");
  add_verbs(line, command, golden_verbs(line, options));
  command.add_option("suite", options->suites, "SUITE", "suites, scenes or reports");
  command.add_option("--root", options->root, "DIR",
                     "folder of the suites; default: golden_frames");
  command.add_option("--failures", options->failures, "DIR",
                     "folder for failing frames; default: frames in the report, else "
                     "golden-failures");
  command.add_option("-f,--frames", options->frames, "FRAMES",
                     "frames, as in 1,12,24; default of accept: all that failed");
  command.add_option("--reason", options->reason, "TEXT",
                     "reason for the goldens; goes to CHANGES.md; default of new: first frames");
  command.add_option("-o,--output", options->output, "DIR", "folder of the new report")
      .group("Output");
  command.add_flag("--any-program", options->any_program,
                   "take also what another build of polymorph rendered");
  command.add_flag(
      "--bits", options->bits,
      "render in all ways that must not matter (threads, shards, caches, resumed) and compare "
      "the bits with each other");
  add_report(command, options->report);
  add_json(command, options->json);
}

}  // namespace polymorph
