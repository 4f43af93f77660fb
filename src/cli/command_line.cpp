#include "cli/command_line.h"

#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <mutex>
#include <nlohmann/json.hpp>
#include <system_error>

#include "base/activity.h"
#include "base/file.h"
#include "base/log.h"
#include "base/parallel.h"
#include "base/text.h"
#include "cli/config.h"
#include "cli/numbers.h"
#include "scene/json_text.h"
#include "spheres/spheres.h"

namespace polymorph {
namespace {

std::atomic<bool> stop{false};
volatile std::sig_atomic_t stop_signal = 0;

void on_stop(int number) {
  stop_signal = number;
  stop = true;
  std::signal(number, SIG_DFL);  // a second one ends the process
}

void set_signals() {
  std::signal(SIGPIPE, SIG_IGN);  // write() then says EPIPE; frames go on without their log
  std::signal(SIGXFSZ, SIG_IGN);  // write() then says EFBIG, with the file's name
}

void add_common(CLI::App* command, CommonOptions& common) {
  const auto add = [&](CLI::Option* option) { option->group("Common"); };
  add(command
          ->add_option("-t,--threads", common.threads,
                       "threads; 0 = all this process may use (env POLYMORPH_THREADS)")
          ->envname("POLYMORPH_THREADS")
          ->transform(number_from(0, 4096))
          ->type_name("N"));
  add(command
          ->add_option("--device", common.device,
                       "cpu, cuda, cuda:1 or auto (env POLYMORPH_DEVICE)")
          ->envname("POLYMORPH_DEVICE")
          ->type_name("DEVICE"));
  add(command
          ->add_option("--max-memory", common.max_memory,
                       "most memory for making surfaces: bytes, or with K, M or G; 0 = no limit")
          ->envname("POLYMORPH_MAX_MEMORY")
          ->transform(size_in_bytes())
          ->type_name("SIZE"));
  add(command
          ->add_option("--cache-dir", common.cache_dir,
                       "where sphere approximations are kept (env POLYMORPH_CACHE_DIR)")
          ->envname("POLYMORPH_CACHE_DIR")
          ->type_name("DIR"));
  add(command->add_flag("--no-cache", common.no_cache, "neither read nor write the cache"));
  add(command->add_flag("-q,--quiet", common.quiet, "only warnings and errors"));
  add(command->add_flag("-v,--verbose", common.verbose, "say more"));
  add(command->add_option("--color", common.color, "auto, always or never (NO_COLOR is respected)")
          ->envname("POLYMORPH_COLOR")
          ->check(CLI::IsMember({"auto", "always", "never"}))
          ->type_name("WHEN"));
  add(command->add_option("--progress", common.progress, "auto, bar, lines, json or none")
          ->envname("POLYMORPH_PROGRESS")
          ->check(CLI::IsMember({"auto", "bar", "lines", "json", "none"}))
          ->type_name("HOW"));
  add(command->add_option("--log-file", common.log_file, "write the log there, too")
          ->envname("POLYMORPH_LOG_FILE")
          ->type_name("FILE"));
  add(command->add_option("--log-format", common.log_format, "text or json")
          ->envname("POLYMORPH_LOG_FORMAT")
          ->check(CLI::IsMember({"text", "json"}))
          ->type_name("FMT"));
  add(command
          ->add_option("--config", common.config,
                       "defaults of options, in TOML (env POLYMORPH_CONFIG; docs/settings.md)")
          ->envname("POLYMORPH_CONFIG")
          ->type_name("FILE"));
}

/// A report that render wrote for an earlier part of the run that is resumed now.
bool is_run_report(const std::string& file) {
  const auto text = read_file(file, 1u << 30);
  return text && text->starts_with("{\n  \"version\":") &&
         text->find("\"scene_hash\":") != std::string::npos;
}

/// What a command writes besides what it is for. --log-file has its own rule (base/log.h), and what
/// -o and --diff name depends on the frames.
Status check_side_outputs(const CLI::App& command, bool overwrite) {
  for (const CLI::Option* option : command.get_options())
    if (option->get_positional())
      for (const std::string& word : option->results()) remember_input(word);
  const CLI::Option* skip = command.get_option_no_throw("--skip-existing");
  const bool resumes = skip && skip->count() > 0;
  for (const char* name : {"--json", "--html", "--csv", "--junit"}) {
    const CLI::Option* option = command.get_option_no_throw(name);
    if (!option || option->results().empty()) continue;
    const std::string& file = option->results().front();
    if (file.empty() || file == "-") continue;
    PM_TRY_STATUS(check_output(file, overwrite || (resumes && is_run_report(file))));
  }
  return Ok{};
}

/// What Slurm gives this job on its machine, in bytes; 0: this is no job, or it has it all.
std::uint64_t slurm_memory() {
  const char* mebibytes = std::getenv("SLURM_MEM_PER_NODE");
  const auto value = mebibytes ? parse_integer(mebibytes) : std::nullopt;
  return value && *value > 0 ? static_cast<std::uint64_t>(*value) << 20 : 0;
}

Status start_up(const CommonOptions& common) {
  LogSettings log;
  log.level = common.quiet         ? LogLevel::kWarning
              : common.verbose > 0 ? LogLevel::kDebug
                                   : LogLevel::kInfo;
  // Who reads progress as JSON lines gets nothing but JSON lines.
  const bool json = common.log_format == "json" || common.progress == "json";
  log.format = json ? LogFormat::kJson : LogFormat::kText;
  log.color = common.color == "always"  ? ColorMode::kAlways
              : common.color == "never" ? ColorMode::kNever
                                        : ColorMode::kAuto;
  log.file = common.log_file;
  log.replace_file = common.overwrite;
  set_thread_count(common.threads);
  PM_TRY_STATUS(set_log(log));
  const ProgressMode mode = progress_mode(common);
  show_activities(common.quiet                   ? ActivityDisplay::kNone
                  : mode == ProgressMode::kBar   ? ActivityDisplay::kLine
                  : mode == ProgressMode::kLines ? ActivityDisplay::kLog
                  : mode == ProgressMode::kJson  ? ActivityDisplay::kJson
                                                 : ActivityDisplay::kNone);
  return Ok{};
}

std::vector<std::string> command_names(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; }))
    names.push_back(command->get_name());
  return names;
}

/// The subcommand that argv names, or the program itself.
const CLI::App* wanted_help(const CLI::App& app, int argc, char** argv) {
  for (int i = 1; i < argc; ++i)
    for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; }))
      if (command->get_name() == argv[i]) return command;
  return &app;
}

/// What is wrong with the first argument that looks like an option and is none; empty if there is
/// no such.
std::string unknown_option(const CLI::App& command, int argc, char** argv) {
  std::vector<std::string> known;
  for (const CLI::Option* option : command.get_options())
    for (const std::string& name : option->get_lnames()) known.push_back("--" + name);
  for (int i = 1; i < argc; ++i) {
    const std::string argument =
        std::string(argv[i]).substr(0, std::string_view(argv[i]).find('='));
    if (!argument.starts_with("--") || argument.size() < 3 ||
        std::find(known.begin(), known.end(), argument) != known.end())
      continue;
    return fmt::format("unknown option \"{}\"{}", argument, did_you_mean(argument, known));
  }
  return "";
}

int usage_error(const CLI::App& app, int argc, char** argv, const CLI::ParseError& error) {
  std::string message = error.what();
  bool known_command = true;
  if (argc > 1 && argv[1][0] != '-') {
    const auto names = command_names(app);
    if (std::find(names.begin(), names.end(), argv[1]) == names.end()) {
      message = fmt::format("unknown command \"{}\"{}", argv[1], did_you_mean(argv[1], names));
      known_command = false;
    }
  }
  const CLI::App* command = wanted_help(app, argc, argv);
  // "--method: soup not in {medial,hubbard}" of CLI11, and its "verb: " for arguments without
  // dashes.
  if (const auto listed = message.find(" not in {"); listed != std::string::npos) {
    const auto colon = message.find(": ");
    const std::string name = message.substr(0, colon);
    const std::string value = message.substr(colon + 2, listed - colon - 2);
    std::vector<std::string> words = split(message.substr(listed + 9), ',');
    if (!words.empty() && words.back().ends_with('}')) words.back().pop_back();
    const std::string hint = did_you_mean(value, words);
    message =
        fmt::format("{} \"{}\"{} - use {}", name.starts_with("-") ? name : command->get_name(),
                    value, hint, fmt::join(words, ", "));
  }
  if (const std::string unknown = unknown_option(*command, argc, argv);
      known_command && !unknown.empty())
    message = unknown;
  const std::string name = command == &app ? "polymorph" : "polymorph " + command->get_name();
  log_message(LogLevel::kError, message);
  log_info("try: {} --help", name);
  return static_cast<int>(ErrorCode::kUsage);
}

void report_bug(const char* what) {
  log_message(LogLevel::kError, fmt::format("internal error: {}", what));
  log_info(
      "this is a bug in polymorph {}; please report it with the command line and the scene file",
      PM_VERSION);
}

/// Data that never arrived is a failure, unless its reader has seen enough.
int finish_output(int code) {
  if (std::fflush(stdout) == 0 && !std::ferror(stdout)) return code;
  pollfd output{STDOUT_FILENO, POLLOUT, 0};
  if (poll(&output, 1, 0) == 1 && (output.revents & POLLERR) != 0) return code;
  log_message(LogLevel::kError,
              "standard output: cannot write - free some space or send it elsewhere");
  return static_cast<int>(ErrorCode::kOutput);
}

int run_action(CommandLine& line) {
  CLI::App& command = *line.app.get_subcommands().front();
  auto status = line.common.config.empty() ? Status(Ok{})
                                           : apply_config(line.common.config, line.app, command);
  if (status) status = check_side_outputs(command, line.common.overwrite);
  if (status) status = check_threads();
  if (line.common.max_memory == 0) line.common.max_memory = slurm_memory();
  if (status) status = start_up(line.common);
  if (!status) {
    log_message(LogLevel::kError, status.error().message);
    return static_cast<int>(status.error().code);
  }
  const auto result = line.action();
  set_status_line("");
  if (result) return *result;
  print_error(result.error());
  return static_cast<int>(result.error().code);
}

}  // namespace

CLI::App* add_command(CommandLine& line, const std::string& name, const std::string& purpose,
                      const std::string& examples, const std::string& exit_codes) {
  CLI::App* command = line.app.add_subcommand(name, purpose);
  command->footer("Examples:\n" + examples + "\fExit codes:\n" + exit_codes);
  command->set_help_flag();
  add_common(command, line.common);
  return command;
}

CLI::Option* add_overwrite(CLI::App* command, CommonOptions& common) {
  return command->add_flag("--overwrite", common.overwrite, "replace existing files");
}

void add_overrides(CLI::App* command, std::vector<std::string>& texts) {
  command->add_option("--set", texts, "change a setting of the scene: --set image.samples=64")
      ->type_name("KEY=VALUE")
      ->allow_extra_args(false)
      ->group("Scene");
}

Result<std::vector<Override>> parse_overrides(const std::vector<std::string>& texts) {
  std::vector<Override> overrides;
  for (const std::string& text : texts) {
    const auto equals = text.find('=');
    if (equals == std::string::npos || equals == 0)
      return make_error(ErrorCode::kUsage,
                        "--set {}: write KEY=VALUE, as in --set image.samples=64", text);
    overrides.emplace_back(text.substr(0, equals), text.substr(equals + 1));
  }
  return overrides;
}

void add_json(CLI::App* command, JsonOutput& json) {
  command
      ->add_option_function<std::string>(
          "--json",
          [&json](const std::string& file) {
            json = {true, file == "-" ? "" : file};
          },
          "report as JSON, to FILE or to standard output")
      ->expected(0, 1)
      ->default_str("-")
      ->type_name("[FILE]")
      ->group("Output");
}

Status write_json(const JsonOutput& json, const nlohmann::ordered_json& report) {
  nlohmann::ordered_json versioned{{"version", PM_VERSION}};
  versioned.update(report);
  return write_text(json, dump_json(versioned));
}

Status write_text(const JsonOutput& json, const std::string& text) {
  if (!json.file.empty()) return write_file(json.file, text);
  print_bytes(text);
  return Ok{};
}

void print_bytes(std::string_view bytes) { std::fwrite(bytes.data(), 1, bytes.size(), stdout); }

ProgressMode progress_mode(const CommonOptions& common) {
  if (common.progress == "bar") return ProgressMode::kBar;
  if (common.progress == "lines") return ProgressMode::kLines;
  if (common.progress == "json") return ProgressMode::kJson;
  if (common.progress == "none" || common.quiet) return ProgressMode::kNone;
  return isatty(2) ? ProgressMode::kBar : ProgressMode::kLines;
}

std::filesystem::path cache_folder(const CommonOptions& common) {
  if (common.no_cache) return {};
  return common.cache_dir.empty() ? default_cache_folder()
                                  : std::filesystem::path(common.cache_dir);
}

const std::atomic<bool>& stop_requested() {
  static std::once_flag once;
  std::call_once(once, [] {
    std::signal(SIGINT, on_stop);
    std::signal(SIGTERM, on_stop);
    std::signal(SIGUSR1, on_stop);
  });
  return stop;
}

ErrorCode stop_code() {
  return stop_signal == SIGUSR1   ? ErrorCode::kResumable
         : stop_signal == SIGTERM ? ErrorCode::kTerminated
                                  : ErrorCode::kInterrupted;
}

void print_error(const Error& error) {
  for (const std::string& text : split(error.message, '\n')) {
    // Each finding of a list is an error of its own; excerpt lines are not.
    const bool excerpt = text.starts_with("  ");
    log_message(excerpt ? LogLevel::kInfo : LogLevel::kError, text);
  }
}

int run_program(int argc, char** argv) {
  set_signals();
  const InputGuard inputs_are_kept;
  CommandLine line;
  for (int i = 1; i < argc; ++i) line.text += (i > 1 ? " " : "") + std::string(argv[i]);
  if (argc > 0 && std::string_view(argv[0]).find('/') != std::string_view::npos)
    line.program = shell_quoted(argv[0]);
  line.app.footer(
      "Examples:\n"
      "  polymorph demo                              a first morph, in seconds\n"
      "  polymorph init first.obj second.obj         a scene for your own models\n"
      "  polymorph check scene.json\n"
      "  polymorph render scene.json -o 'out/frame.####.exr' --png\n"
      "  polymorph strip 'out/frame.####.exr' -o strip.png --gif morph.gif");
  line.app.require_subcommand(1);
  line.app.set_help_flag();
  bool ignored = false;  // both are answered before parsing
  line.app.add_flag("-V,--version", ignored, "print the version")->group("Options");
  line.app.add_flag("-h,--help", ignored, "this help; -h after a command is short, --help is full")
      ->group("Options");
  for (const auto add :
       {add_demo,    add_init,  add_render,  add_strip,   add_submit, add_status,     add_mesh,
        add_spheres, add_check, add_info,    add_compare, add_golden, add_analyze,    add_bench,
        add_cache,   add_cubes, add_devices, add_schema,  add_pairs,  add_completion, add_manual})
    add(line);
  for (CLI::App* command : line.app.get_subcommands([](const CLI::App*) { return true; }))
    if (!command->get_option_no_throw("--overwrite"))
      add_overwrite(command, line.common)->group("Common");

  // Help and version answer before anything is checked, wherever they stand.
  const auto given = [&](const char* flag) {
    return std::any_of(argv + 1, argv + argc,
                       [&](const char* a) { return std::string_view(a) == flag; });
  };
  if (argc < 2) {
    std::fputs(first_steps(line).c_str(), stderr);
    return static_cast<int>(ErrorCode::kUsage);
  }
  if (given("--help") || given("-h")) {
    std::fputs(help_text(*wanted_help(line.app, argc, argv), given("--help")).c_str(), stdout);
    return finish_output(0);
  }
  if (given("--version") || (argc == 2 && given("-V"))) {
    print_data("polymorph {}\n", PM_VERSION);
    return finish_output(0);
  }
  try {
    line.app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return usage_error(line.app, argc, argv, error);
  }
  try {
    return finish_output(run_action(line));
  } catch (const std::bad_alloc&) {
    log_message(LogLevel::kError,
                "out of memory - lower surface.resolution, image size or --threads");
    return static_cast<int>(ErrorCode::kResource);
  } catch (const std::exception& error) {
    const auto* system = dynamic_cast<const std::system_error*>(&error);
    const bool threads = (system && system->code() == std::errc::resource_unavailable_try_again) ||
                         std::string_view(error.what()).starts_with("pthread_create");  // TBB's
    if (threads) {
      print_error(thread_error(error.what()));
      return static_cast<int>(ErrorCode::kResource);
    }
    report_bug(error.what());
    return static_cast<int>(ErrorCode::kInternal);
  }
}

}  // namespace polymorph
