#include "base/file.h"
#include "base/log.h"
#include "base/program_identity.h"
#include "cli/command_line.h"
#include "cli/report_options.h"
#include "compare/report_merge.h"
#include "sequence/golden/golden_accept.h"
#include "sequence/golden/golden_bits.h"
#include "sequence/golden/golden_frames.h"
#include "sequence/golden/golden_run.h"

namespace polymorph {
namespace {

struct GoldenOptions {
  std::string verb;
  std::vector<std::string> suites;
  std::string root = "golden_frames", failures, reason, only;
  std::string isa = GoldenSettings{}.isa;
  bool overwrite = false, any_program = false, bits = false;
  std::string output;
  JsonOutput json;
  ReportOptions report;
};

GoldenSettings golden_settings(const CommandLine& line, const GoldenOptions& options) {
  GoldenSettings settings;
  // Goldens are made on the CPU; another device must be asked for by name.
  settings.device = line.common.device == "auto" ? "cpu" : line.common.device;
  settings.cache_folder = cache_folder(line.common);
  // Inside the report, so that it can be accepted wherever it is kept.
  settings.failures = !options.failures.empty() ? std::filesystem::path(options.failures)
                      : !options.report.folder.empty()
                          ? std::filesystem::path(options.report.folder) / "frames"
                          : std::filesystem::path("golden-failures");
  settings.isa = options.isa;
  return settings;
}

std::string accept_command(const GoldenOptions& options, const std::string& suite) {
  const std::string root =
      options.root == "golden_frames" ? "" : " --root " + shell_quoted(options.root);
  return fmt::format("polymorph golden update {}{} --reason \"...\"", shell_quoted(suite), root);
}

/// The names of all suites. None is no answer: green would hide that the folder is another than was
/// meant.
Result<std::vector<std::string>> all_suites(const std::string& root) {
  PM_TRY(std::vector<std::string> names, list_golden_suites(root));
  if (names.empty())
    return make_error(
        ErrorCode::kInput,
        "{}: no golden suite in it (a suite is a folder with a suite.json) - check --root", root);
  return names;
}

/// Compares the build with itself; the goldens take no part, and nothing can be accepted.
Status test_bits(const GoldenSuite& suite, const GoldenSettings& settings,
                 const GoldenOptions& options, Report& report) {
  PM_TRY(std::vector<ReportCase> cases, test_golden_bits(suite, settings));
  std::size_t passed = 0;
  for (ReportCase& one : cases) {
    passed += one.passed();
    if (!options.json.wanted)
      print_data("{}, {}: {}\n", one.group, one.name,
                 one.passed() ? "ok: " + one.detail : "FAILED: " + one.message);
    report.cases.push_back(std::move(one));
  }
  if (!options.json.wanted) print_data("{}: {} of {} pass\n", suite.name, passed, cases.size());
  return Ok{};
}

/// Runs one suite and adds its frames to the report.
Status test(const GoldenSuite& suite, const GoldenSettings& settings, const GoldenOptions& options,
            Report& report) {
  PM_TRY(GoldenResult result, test_golden(suite, settings));
  const std::string accept = accept_command(options, suite.name);
  for (GoldenFrame& frame : result.frames) {
    if (!options.json.wanted)
      print_data("{} frame {}: {}{}{}{}\n", suite.name, frame.frame,
                 frame.passed() ? "ok" : "FAILED: ", frame.message,
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
  if (!options.json.wanted)
    print_data("{}: {} of {} frames pass\n", suite.name, result.frames.size() - result.failed(),
               result.frames.size());
  if (result.failed() == 0) return Ok{};
  log_info("actual, reference and difference: {}", (settings.failures / suite.name).string());
  log_info("to accept: {}", accept);
  return Ok{};
}

Status test_suite(const std::string& name, const GoldenSettings& settings,
                  const GoldenOptions& options, Report& report) {
  PM_TRY(const GoldenSuite suite, load_golden_suite(options.root, name));
  if (options.bits && !suite.command.empty())
    return make_error(ErrorCode::kUsage,
                      "{}: --bits is for scenes, this suite's frames come from a command", name);
  PM_TRY(const std::string hash, suite_hash(suite));
  report.suites.emplace_back(name, hash);
  return options.bits ? test_bits(suite, settings, options, report)
                      : test(suite, settings, options, report);
}

/// Counts a suite that could not be tested as a failed case, so that CI does not pass it.
void add_error(const std::string& group, const std::string& name, const Error& error,
               const GoldenOptions& options, Report& report) {
  if (!options.json.wanted) print_data("{}: could not be tested\n", group);
  print_error(error);
  ReportCase one;
  one.group = group;
  one.name = name;
  one.message = error.message;
  one.error = true;
  report.cases.push_back(std::move(one));
}

Result<int> test_all(const GoldenOptions& options, GoldenSettings settings) {
  PM_TRY_STATUS(begin_report(options.report, options.overwrite));
  PictureBudget budget;
  if (options.report.pictures()) settings.pictures = &budget;
  Report report{"Golden frames",
                {{"polymorph", PM_VERSION},
                 {"program", std::string(program_identity())},
                 {"device", settings.device},
                 {"isa", settings.isa.empty() ? "best" : settings.isa}},
                {},
                {}};
  int code = 0;  // of the first thing that could not be tested
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
    if (status.error().code == ErrorCode::kUsage) return status.error();
    if (code == 0) code = static_cast<int>(status.error().code);
    add_error(name, "the suite", status.error(), options, report);
  }
  if (report.errors() > 0 && code == 0) code = static_cast<int>(ErrorCode::kInput);
  if (report.failed() > 0 && code == 0) code = static_cast<int>(ErrorCode::kAnswerNo);
  if (options.json.wanted) PM_TRY_STATUS(write_json(options.json, report_json(report)));
  PM_TRY_STATUS(write_reports(options.report, report));
  return code;
}

/// "SHA256  SUITE/frame.0012", as sha256sum prints it, for comparing machines.
Result<int> print_hashes(const GoldenOptions& options, const GoldenSettings& settings) {
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

Result<int> merge(const GoldenOptions& options) {
  if (options.suites.size() < 2 || options.output.empty())
    return make_error(ErrorCode::kUsage,
                      "golden merge needs two reports and -o - polymorph golden merge a b -o all");
  ReportOptions output;
  output.folder = options.output;
  PM_TRY_STATUS(begin_report(output, options.overwrite));
  const std::vector<std::filesystem::path> reports(options.suites.begin(), options.suites.end());
  PM_TRY(const std::size_t failed, merge_reports(reports, options.output));
  print_data("{}: {} reports, {} frames failed\n", options.output, reports.size(), failed);
  return failed == 0 ? 0 : static_cast<int>(ErrorCode::kAnswerNo);
}

Result<int> accept(const GoldenOptions& options) {
  if (options.suites.empty())
    return make_error(ErrorCode::kUsage,
                      "golden accept needs the report: a folder, .zip or .tar - polymorph golden "
                      "accept golden-report --reason \"...\"");
  AcceptSettings settings;
  settings.root = options.root;
  settings.suites.assign(options.suites.begin() + 1, options.suites.end());
  settings.frames = options.only;
  settings.reason = options.reason;
  settings.any_program = options.any_program;
  PM_TRY(const auto written, accept_report(options.suites[0], settings));
  for (const auto& path : written) print_data("{}\n", path.string());
  return 0;
}

Result<int> run_golden(const CommandLine& line, GoldenOptions& options) {
  options.overwrite = line.common.overwrite;
  const GoldenSettings settings = golden_settings(line, options);
  if (options.verb == "test") return test_all(options, settings);
  if (options.verb == "accept") return accept(options);
  if (options.verb == "merge") return merge(options);
  if (options.verb == "hash") return print_hashes(options, settings);
  std::vector<std::string> names = options.suites;
  if (names.empty()) {
    if (options.verb == "update")
      return make_error(ErrorCode::kUsage,
                        "golden update needs the suite's name - polymorph golden list shows them");
    PM_TRY(names, all_suites(options.root));
  }
  for (const std::string& name : names) {
    PM_TRY(const GoldenSuite suite, load_golden_suite(options.root, name));
    if (options.verb == "list") {
      print_data("{}: {} frames of {}\n", suite.name, suite.frames.size(),
                 suite.command.empty() ? suite.scene.string() : suite.command);
      continue;
    }
    PM_TRY(const auto written, update_golden(suite, settings, options.reason));
    for (const auto& path : written) print_data("{}\n", path.string());
    if (written.empty()) log_info("{}: nothing to update", suite.name);
  }
  return 0;
}

}  // namespace

void add_golden(CommandLine& line) {
  auto options = std::make_shared<GoldenOptions>();
  Command command =
      add_command(line, "golden", "Test golden frames, update them or accept new ones.",
                  "  polymorph golden test\n"
                  "  polymorph golden test teapot-penguin --report golden-report\n"
                  "  polymorph golden update teapot-penguin --reason \"softer key light\"\n"
                  "  polymorph golden accept golden-report.zip --reason \"softer key light\"\n"
                  "  polymorph golden hash > here.txt    # the same on every machine",
                  "  0 all frames pass   1 a frame differs or its golden is missing   2 usage\n"
                  "  3 bad suite or scene; the others are tested   4 cannot write\n"
                  "  5 device or memory");
  command
      .add_option("verb", options->verb,
                  "test; update: render goldens anew; accept REPORT: take a failed run's frames; "
                  "merge REPORT...: one report of several; list; hash: SHA-256 of each frame's "
                  "pixels, of suites or SCENE.json")
      .required()
      .choices({"test", "update", "accept", "merge", "list", "hash"})
      .type_name("VERB")
      .group("Main");
  command
      .add_option("suite", options->suites,
                  "suites; default: all. accept: the report, then suites; hash: scenes, too")
      .type_name("SUITE")
      .group("Main");
  command.add_option("--root", options->root, "folder of the suites; default: golden_frames")
      .type_name("DIR")
      .group("Main");
  command
      .add_option("--failures", options->failures,
                  "where failing frames are kept; default: frames in the report, else "
                  "golden-failures")
      .type_name("DIR")
      .group("Main");
  command.add_option("--reason", options->reason, "why goldens change; goes to CHANGES.md")
      .type_name("TEXT")
      .group("Main");
  command
      .add_option("--only", options->only,
                  "accept: these frames, as in 4,9-15; default: all that failed")
      .type_name("FRAMES")
      .group("Main");
  command.add_option("-o,--output", options->output, "merge: the folder of the new report")
      .type_name("DIR")
      .group("Output");
  command
      .add_flag("--any-program", options->any_program,
                "accept: also what another build of polymorph rendered")
      .group("Main");
  command
      .add_option("--isa", options->isa,
                  "Embree's instructions: sse2, sse4.2, avx, avx2 or avx512; default: the best. "
                  "All give the same pixels")
      .choices({"sse2", "sse4.2", "avx", "avx2", "avx512"})
      .environment("POLYMORPH_ISA")
      .type_name("ISA")
      .group("Main");
  command
      .add_flag("--bits", options->bits,
                "test: render in all ways that must not matter (threads, shards, caches, resumed) "
                "and compare the bits with each other")
      .group("Main");
  add_report(command, options->report);
  add_json(command, options->json);
  set_action(line, command, [&line, options] { return run_golden(line, *options); });
}

}  // namespace polymorph
