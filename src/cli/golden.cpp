#include "base/log.h"
#include "cli/command_line.h"
#include "sequence/golden_run.h"

namespace polymorph {
namespace {

struct GoldenOptions {
  std::string verb;
  std::vector<std::string> suites;
  std::string root = "golden_frames", failures = "golden-failures", reason;
};

GoldenSettings golden_settings(const CommandLine& line, const GoldenOptions& options) {
  GoldenSettings settings;
  // Goldens are made on the CPU; another device must be asked for by name.
  settings.device = line.common.device == "auto" ? "cpu" : line.common.device;
  settings.cache_folder = cache_folder(line.common);
  settings.failures = options.failures;
  return settings;
}

Result<int> test(const GoldenSuite& suite, const GoldenSettings& settings) {
  PM_TRY(const GoldenResult result, test_golden(suite, settings));
  for (const GoldenFrame& frame : result.frames) {
    print_data("{} frame {}: {}{}\n", suite.name, frame.frame,
               frame.passed() ? "ok" : "FAILED: ", frame.message);
    if (frame.passed() && frame.image && frame.image->verdict == Verdict::kWithin)
      log_debug("  {}", frame.image->reason);
  }
  for (const auto& orphan : result.orphans)
    log_warning("{}: no frame of {} asks for it", orphan.string(), suite.name);
  print_data("{}: {} of {} frames pass\n", suite.name, result.frames.size() - result.failed(),
             result.frames.size());
  if (result.failed() == 0) return 0;
  log_info("actual, reference and difference: {}", (settings.failures / suite.name).string());
  log_info("to accept: polymorph golden update {} --reason \"...\"", suite.name);
  return static_cast<int>(ErrorCode::kAnswerNo);
}

Result<int> run_golden(const CommandLine& line, const GoldenOptions& options) {
  std::vector<std::string> names = options.suites;
  if (names.empty()) {
    if (options.verb == "update")
      return make_error(ErrorCode::kUsage,
                        "golden update needs the suite's name - polymorph golden list shows them");
    PM_TRY(names, list_golden_suites(options.root));
  }
  const GoldenSettings settings = golden_settings(line, options);
  int code = 0;
  for (const std::string& name : names) {
    PM_TRY(const GoldenSuite suite, load_golden_suite(options.root, name));
    if (options.verb == "list") {
      print_data("{}: {} frames of {}\n", suite.name, suite.frames.size(), suite.scene.string());
    } else if (options.verb == "test") {
      PM_TRY(const int one, test(suite, settings));
      code = std::max(code, one);
    } else {
      PM_TRY(const auto written, update_golden(suite, settings, options.reason));
      for (const auto& path : written) print_data("{}\n", path.string());
      if (written.empty()) log_info("{}: nothing to update", suite.name);
    }
  }
  return code;
}

}  // namespace

void add_golden(CommandLine& line) {
  auto options = std::make_shared<GoldenOptions>();
  CLI::App* command =
      add_command(line, "golden", "Test, update or list golden frames.",
                  "  polymorph golden test\n"
                  "  polymorph golden test teapot-penguin --failures /tmp/failed\n"
                  "  polymorph golden update teapot-penguin --reason \"softer key light\"",
                  "  0 all frames pass   1 a frame differs or its golden is missing   2 usage\n"
                  "  3 bad suite or scene   4 cannot write   5 device or memory");
  command->add_option("verb", options->verb, "test, update or list")
      ->required()
      ->check(CLI::IsMember({"test", "update", "list"}))
      ->type_name("VERB")
      ->group("Main");
  command->add_option("suite", options->suites, "suites; default: all")
      ->type_name("SUITE")
      ->group("Main");
  command->add_option("--root", options->root, "folder of the suites; default: golden_frames")
      ->type_name("DIR")
      ->group("Main");
  command
      ->add_option("--failures", options->failures,
                   "where failing frames are kept; default: golden-failures")
      ->type_name("DIR")
      ->group("Main");
  command->add_option("--reason", options->reason, "why goldens change; goes to CHANGES.md")
      ->type_name("TEXT")
      ->group("Main");
  command->callback(
      [&line, options] { line.action = [&line, options] { return run_golden(line, *options); }; });
}

}  // namespace polymorph
