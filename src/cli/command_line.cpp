#include "cli/command_line.h"

#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>

#include "base/activity.h"
#include "base/file.h"
#include "base/json.h"
#include "base/log.h"
#include "base/memory.h"
#include "base/odd_names.h"
#include "base/parallel.h"
#include "base/private_paths.h"
#include "base/program_identity.h"
#include "base/stop.h"
#include "base/text.h"
#include "base/thread_failure.h"
#include "cli/progress.h"
#include "farm/receipt.h"
#include "kernels/interruption.h"
#include "options/config.h"
#include "spheres/spheres.h"

namespace polymorph {
namespace {

void set_signals() {
  std::signal(SIGPIPE, SIG_IGN);  // write() fails with EPIPE; rendering goes on without a log
  std::signal(SIGXFSZ, SIG_IGN);  // write() fails with EFBIG, and the error names the file
}

/// Commands that compute nothing. They accept the options for computations (--device, --cache-dir,
/// ...), but their help does not list these.
constexpr std::string_view kPrintingCommands[] = {"cubes",      "devices", "help",
                                                  "completion", "schema",  "version"};

/// Returns the group in a command's help for the options for computations; "" hides them.
const char* compute_option_group(std::string_view command) {
  const bool computes_nothing =
      std::find(std::begin(kPrintingCommands), std::end(kPrintingCommands), command) !=
      std::end(kPrintingCommands);
  return computes_nothing ? "" : "Common";
}

/// Adds the options that all commands share. Those for computations go into the help's group
/// `compute_group`; "" hides them.
void add_common(Command command, CommonOptions& common, const char* compute_group) {
  const auto add = [](Option option) { option.group("Common"); };
  const auto add_compute_option = [&](Option option) { option.group(compute_group); };
  add(command
          .add_option("-t,--threads", common.threads, "N",
                      "threads; 0 = all this process may use (env POLYMORPH_THREADS)")
          .environment("POLYMORPH_THREADS")
          .range(0, 4096));
  add_compute_option(command
                         .add_option("--device", common.device, "DEVICE",
                                     "cpu, cuda, cuda:1 or auto; for films also several, as "
                                     "cuda:0,cuda:1, or cuda:all (env POLYMORPH_DEVICE)")
                         .environment("POLYMORPH_DEVICE"));
  add_compute_option(
      command
          .add_option(
              "--max-memory", common.max_memory, "SIZE",
              "limit on memory, estimated beforehand: bytes, or with K, M or G; 0 = none; default: "
              "what the machine, the cgroup or Slurm gives")
          .environment("POLYMORPH_MAX_MEMORY")
          .bytes());
  add_compute_option(command
                         .add_option("--cache-dir", common.cache_dir, "DIR",
                                     "folder of the cache (env POLYMORPH_CACHE_DIR)")
                         .environment("POLYMORPH_CACHE_DIR"));
  add_compute_option(
      command.add_flag("--no-cache", common.no_cache, "neither read nor write the cache"));
  add(command.add_flag("-q,--quiet", common.quiet, "only warnings and errors"));
  add(command.add_flag("-v,--verbose", common.verbose, "say more"));
  add(command
          .add_choice("--color", common.color, "WHEN",
                      {{"auto", ColorMode::kAuto},
                       {"always", ColorMode::kAlways},
                       {"never", ColorMode::kNever}},
                      "auto, always or never (NO_COLOR is respected)")
          .environment("POLYMORPH_COLOR"));
  add(command
          .add_choice("--progress", common.progress, "HOW",
                      {{"auto", ProgressMode::kAuto},
                       {"bar", ProgressMode::kBar},
                       {"lines", ProgressMode::kLines},
                       {"json", ProgressMode::kJson},
                       {"openjd", ProgressMode::kOpenJd},
                       {"none", ProgressMode::kNone}},
                      "auto, bar, lines, json, openjd or none")
          .environment("POLYMORPH_PROGRESS"));
  add(command.add_option("--log-file", common.log_file, "FILE", "write the log there, too")
          .environment("POLYMORPH_LOG_FILE"));
  add(command
          .add_choice("--log-format", common.log_format, "FMT",
                      {{"text", LogFormat::kText}, {"json", LogFormat::kJson}},
                      "text or json, on standard error and in --log-file")
          .environment("POLYMORPH_LOG_FORMAT"));
  add(command
          .add_option("--config", common.config, "FILE",
                      "defaults of options, in TOML (env POLYMORPH_CONFIG; docs/settings.md)")
          .environment("POLYMORPH_CONFIG"));
}

/// Tests whether the file is a JSON report of `render`, which a resumed run may replace.
bool is_run_report(const std::string& file) {
  const auto text = read_file(file, /*limit=*/1u << 30);
  return text && text->starts_with("{\n  \"version\":") &&
         text->find("\"scene_hash\":") != std::string::npos;
}

/// Tests whether the file is a receipt of `render`, which a resumed run may replace.
bool is_receipt_file(const std::string& file) {
  const auto text = read_file(file, /*limit=*/1u << 30);
  return text && is_receipt(*text);
}

/// Tests whether the file is a JUnit report, which the next run of a CI job may replace.
bool is_junit(const std::string& file) {
  const auto text = read_file(file, /*limit=*/1u << 30);
  return text && text->starts_with("<?xml") &&
         text->substr(0, 1024).find("<testsuites") != std::string::npos;
}

/// Checks that the files that a command writes beside its main output may be written. The file of
/// --log-file follows the rule in base/log.h; names of -o and --diff depend on the frames, so the
/// commands check them.
Status check_side_outputs(const CLI::App& program, bool overwrite) {
  // Arguments that are existing files are inputs, which no output may replace.
  for (const std::string& word : positional_values(program)) remember_input(word);
  const bool resumes = is_given(program, "--skip-existing");
  for (const char* name : {"--json", "--html", "--csv", "--junit", "--receipt"}) {
    const std::vector<std::string> files = option_values(program, name);
    if (files.empty() || files.front().empty() || files.front() == "-") continue;
    const std::string& file = files.front();
    const bool is_earlier_output = (resumes && (is_run_report(file) || is_receipt_file(file))) ||
                                   (std::string_view(name) == "--junit" && is_junit(file));
    PM_TRY_STATUS(check_output(file, overwrite || is_earlier_output));
  }
  return Ok{};
}

/// Applies the common options to the process: its log, threads, memory budget and progress display.
Status start_up(const CommonOptions& common) {
  LogSettings log;
  log.level = common.quiet         ? LogLevel::kWarning
              : common.verbose > 0 ? LogLevel::kDebug
                                   : LogLevel::kInfo;
  // With --progress json the log has JSON lines only.
  log.format = common.progress == ProgressMode::kJson ? LogFormat::kJson : common.log_format;
  log.color = common.color;
  log.file = common.log_file;
  log.replace_file = common.overwrite;
  set_thread_count(common.threads);
  set_memory_budget(common.max_memory);
  PM_TRY_STATUS(set_log(log));
  const ProgressMode mode = progress_mode(common);
  show_activities(common.quiet                 ? ActivityDisplay::kNone
                  : mode == ProgressMode::kBar ? ActivityDisplay::kLine
                  : mode == ProgressMode::kLines || mode == ProgressMode::kOpenJd
                      ? ActivityDisplay::kLog
                  : mode == ProgressMode::kJson ? ActivityDisplay::kJson
                                                : ActivityDisplay::kNone);
  return Ok{};
}

void report_bug(const char* what) {
  log_message(LogLevel::kError, fmt::format("internal error: {}", what));
  log_info(
      "this is a bug in polymorph {}; please report it with the command line and the scene file",
      program_version());
}

/// Flushes standard output and returns the exit code: kOutput if output was lost or the log file is
/// incomplete, else `code`. A pipe that its reader has closed is no failure.
int finish_output(int code) {
  if (code == 0 && log_file_is_incomplete()) code = static_cast<int>(ErrorCode::kOutput);
  if (std::fflush(stdout) == 0 && !std::ferror(stdout)) return code;
  pollfd output{STDOUT_FILENO, POLLOUT, 0};
  if (poll(&output, 1, 0) == 1 && (output.revents & POLLERR) != 0) return code;
  log_message(LogLevel::kError,
              "standard output: cannot write - free some space or send it elsewhere");
  return static_cast<int>(ErrorCode::kOutput);
}

/// Returns the first commands to try, which the program shows if it is called without arguments.
std::string first_steps(const CommandLine& line) {
  const auto step = [&](const char* arguments, const char* description) {
    return fmt::format("  {} {}\n      {}\n", line.program, arguments, description);
  };
  return command_table(*line.app).purpose + "\n\nStart here:\n" +
         step("demo", "a teapot becomes a penguin: a strip, a GIF and the scene, in seconds") +
         step("demo monkey spider --through puddle", "any of the models that come with it") +
         step("init first.obj second.obj", "a scene for your own models, to edit and render") +
         fmt::format("\n{} --help lists all commands.\n", line.program);
}

/// Runs the chosen command: applies --config and the common options, checks the side outputs, runs
/// the action and prints its error. Returns the exit code.
int run_action(CommandLine& line) {
  prefer_command_line(*line.app);
  auto status =
      line.common.config.empty() ? Status(Ok{}) : apply_config(line.common.config, *line.app);
  if (status) status = check_side_outputs(*line.app, line.common.overwrite);
  if (status) status = check_threads();
  if (!is_given(*line.app, "--max-memory")) line.common.max_memory = memory_limit();
  if (status) status = start_up(line.common);
  if (!status) {
    log_message(LogLevel::kError, status.error().message);
    return static_cast<int>(status.error().code);
  }
  const auto exit_code = line.action();
  set_status_line("");  // removes the progress display
  if (exit_code) return *exit_code;
  print_error(exit_code.error());
  if (progress_mode(line.common) == ProgressMode::kOpenJd) print_openjd_failure(exit_code.error());
  // A signal makes writes fail; the exit code is then the signal's.
  const bool was_stopped = stop_requested() && exit_code.error().code == ErrorCode::kOutput;
  return static_cast<int>(was_stopped ? stop_code() : exit_code.error().code);
}

/// Checks that all given options are options of this verb. Errors (kUsage): one belongs to another
/// verb of the command.
Status check_verb(const CommandLine& line, const std::string& command, const VerbTable& verb) {
  const std::vector<VerbTable>& verbs = line.verbs.at(command);
  for (const CommandTable& table : command_tables(line)) {
    if (table.name != command) continue;
    for (const OptionRow& option : table.options) {
      if (option.positional || option.group == "Common") continue;
      // The last name is the long one.
      if (is_named(option, verb.options) || !is_given(*line.app, option.names.back().c_str()))
        continue;
      std::vector<std::string> others;
      for (const VerbTable& other : verbs)
        if (is_named(option, other.options)) others.push_back(other.name);
      return make_error(ErrorCode::kUsage, "{0} {1} takes no {2} - that is for {0} {3}", command,
                        verb.name, option.names.front(), fmt::join(others, ", "));
    }
  }
  return Ok{};
}

/// Remembers odd file names (base/odd_names.h) in the arguments, the environment and the path of
/// the working folder.
void remember_names(int argc, char** argv) {
  for (int i = 1; i < argc; ++i) remember_name(argv[i]);
  for (char** variable = environ; *variable; ++variable) {
    const std::string_view text = *variable;
    if (text.starts_with("POLYMORPH_") || text.starts_with("XDG_CACHE_HOME=") ||
        text.starts_with("HOME="))
      remember_name(text);
  }
  std::error_code ignored;
  remember_name(std::filesystem::current_path(ignored).string());
}

}  // namespace

Command add_command(CommandLine& line, const std::string& name, const std::string& purpose,
                    const std::string& examples, const std::string& exit_codes) {
  const Command command = add_subcommand(*line.app, name, purpose, examples, exit_codes);
  add_common(command, line.common, compute_option_group(name));
  return command;
}

void set_action(CommandLine& line, Command command, std::function<Result<int>()> action) {
  command.on_chosen([&line, action = std::move(action)] { line.action = action; });
}

void add_verbs(CommandLine& line, Command command, const std::vector<VerbTable>& verbs) {
  std::vector<std::string> names;
  for (const VerbTable& verb : verbs) names.push_back(verb.name);
  auto chosen_verb = std::make_shared<std::string>();
  command.add_option("verb", *chosen_verb, "VERB", fmt::format("{}", fmt::join(names, ", ")))
      .required()
      .choices(names);
  line.verbs[command.name()] = verbs;
  set_action(line, command, [&line, name = command.name(), chosen_verb]() -> Result<int> {
    const std::vector<VerbTable>& tables = line.verbs.at(name);
    const auto verb = std::ranges::find(tables, *chosen_verb, &VerbTable::name);
    PM_CHECK(verb != tables.end());
    PM_TRY_STATUS(check_verb(line, name, *verb));
    return verb->action();
  });
}

Option add_overwrite(Command command, CommonOptions& common) {
  return command.add_flag("--overwrite", common.overwrite, "replace existing files");
}

void add_overrides(Command command, std::vector<std::string>& texts) {
  command
      .add_option("--set", texts, "KEY=VALUE",
                  "change a setting of the scene: --set image.samples=64")
      .one_value_each()
      .group("Scene");
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

void add_json(Command command, JsonOutput& json) {
  const auto set_output = [&json](const std::string& file) {
    json = {true, file == "-" ? "" : file};
  };
  command
      .add_optional_value("--json", set_output, "[FILE]", "-",
                          "report as JSON, to FILE or to standard output")
      .group("Output");
}

Status write_json(const JsonOutput& json, const JsonValue& report) {
  if (!report.is_object()) return write_text(json, dump_json(report));
  JsonValue versioned{{"version", program_version()}};
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
  if (common.progress != ProgressMode::kAuto) return common.progress;
  if (common.quiet) return ProgressMode::kNone;
  return isatty(STDERR_FILENO) ? ProgressMode::kBar : ProgressMode::kLines;
}

std::filesystem::path cache_folder(const CommonOptions& common) {
  if (common.no_cache) return {};
  return common.cache_dir.empty() ? default_cache_folder()
                                  : std::filesystem::path(common.cache_dir);
}

Resources resources(const CommonOptions& common) {
  return {common.device, cache_folder(common), common.max_memory};
}

void print_error(const Error& error) {
  for (const std::string& text : split(printable(error.message, LineBreaks::kKeep), '\n')) {
    // A message may list several findings, one per line; indented lines quote the file.
    const bool is_quote = text.starts_with("  ");
    log_message(is_quote ? LogLevel::kInfo : LogLevel::kError, text);
  }
}

std::vector<CommandTable> command_tables(const CommandLine& line) {
  std::vector<CommandTable> tables = command_tables(*line.app);
  for (CommandTable& table : tables)
    if (const auto verbs = line.verbs.find(table.name); verbs != line.verbs.end())
      table.verbs = verbs->second;
  return tables;
}

std::string help_page(const CommandLine& line, const std::string& name, bool full) {
  return help_page(command_table(*line.app), command_tables(line), name, full);
}

int run_program(int argc, char** argv) {
  // Prepare the process, before it reads any file or argument.
  set_signals();
  if (const Status stack = raise_stack_limit(); !stack) {
    log_message(LogLevel::kError, stack.error().message);
    return static_cast<int>(stack.error().code);
  }
  const InputGuard input_guard;
  remember_names(argc, argv);

  // Describe the program: its commands and their options.
  CommandLine line;
  for (int i = 1; i < argc; ++i) line.arguments += (i > 1 ? " " : "") + remove_folders(argv[i]);
  if (argc > 0 && std::string_view(argv[0]).find('/') != std::string_view::npos)
    line.program = quote_for_shell(argv[0]);
  line.app =
      make_program("polymorph", "polymorph renders morph sequences between polyhedra.",
                   "  polymorph demo                              a first morph, in seconds\n"
                   "  polymorph init first.obj second.obj         a scene for your own models\n"
                   "  polymorph check scene.json\n"
                   "  polymorph render scene.json -o 'out/frame.####.exr' --png\n"
                   "  polymorph strip 'out/frame.####.exr' -o strip.png --gif morph.gif");
  const Command program = program_command(*line.app);
  bool ignored = false;  // -V and -h are answered before parsing
  program.add_flag("-V,--version", ignored, "print the version").group("Options");
  program.add_flag("-h,--help", ignored, "this help; -h after a command is short, --help is full")
      .group("Options");
  for (const auto add :
       {add_demo,    add_init,       add_render, add_merge, add_strip,   add_submit,  add_status,
        add_mesh,    add_spheres,    add_check,  add_info,  add_compare, add_golden,  add_reproduce,
        add_analyze, add_landmarks,  add_bench,  add_cache, add_cubes,   add_devices, add_schema,
        add_pairs,   add_completion, add_manual, add_help,  add_version})
    add(line);
  // Commands without an --overwrite of their own get it among the common options.
  for (const Command command : list_subcommands(*line.app))
    if (!command.has_option("--overwrite"))
      add_overwrite(command, line.common).group(compute_option_group(command.name()));

  // -h, --help and --version are answered before parsing, at any place in argv; -V only alone.
  const auto has_flag = [&](const char* flag) {
    return std::any_of(argv + 1, argv + argc,
                       [&](const char* a) { return std::string_view(a) == flag; });
  };
  if (argc < 2) {
    std::fputs(first_steps(line).c_str(), stderr);
    return static_cast<int>(ErrorCode::kUsage);
  }
  if (has_flag("--help") || has_flag("-h")) {
    print_bytes(help_page(line, page_name(command_tables(line), argc, argv), has_flag("--help")));
    return finish_output(0);
  }
  if (has_flag("--version") || (argc == 2 && has_flag("-V"))) {
    print_data("polymorph {}\n", program_version());
    return finish_output(0);
  }

  // Parse the arguments and run the command.
  if (const Status parsed = parse_arguments(*line.app, argc, argv); !parsed) {
    const std::string name = named_command(*line.app, argc, argv);
    log_message(LogLevel::kError, parsed.error().message);
    if (!name.empty() && argv[1][0] == '-')  // the command exists, but is not the first word
      log_info("options come after the command: polymorph {} {}", name, argv[1]);
    log_info("try: polymorph {}--help",
             name.empty() ? "" : page_name(command_tables(line), argc, argv) + " ");
    return static_cast<int>(ErrorCode::kUsage);
  }
  try {
    return finish_output(run_action(line));
  } catch (const Interrupted&) {
    set_status_line("");  // removes the progress display
    log_message(LogLevel::kError, "stopped - what is written is whole");
    return static_cast<int>(stop_code());
  } catch (const std::bad_alloc&) {
    log_message(LogLevel::kError,
                "out of memory - lower surface.resolution, image size or --threads");
    return static_cast<int>(ErrorCode::kResource);
  } catch (const std::exception& error) {
    if (is_thread_failure(error)) {
      print_error(make_thread_error(error.what()));
      // A library's thread pool may lack a thread; its destructor must not run.
      std::fflush(nullptr);
      std::_Exit(static_cast<int>(ErrorCode::kResource));
    }
    report_bug(error.what());
    return static_cast<int>(ErrorCode::kInternal);
  }
}

}  // namespace polymorph
