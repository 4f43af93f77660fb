// The command line: the subcommands, the options that they share, and the help texts. A file of
// cli/commands/ defines each subcommand in a function add_NAME(), which is declared here.
#pragma once

#include <cstdio>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/json.h"
#include "base/log.h"
#include "base/result.h"
#include "base/shell_quote.h"
#include "base/stop.h"
#include "base/text.h"
#include "options/option_table.h"
#include "options/options.h"
#include "scene/load_scene.h"
#include "sequence/prepare/engine_scene.h"

namespace polymorph {

/// Display of a run's progress on standard error.
enum class ProgressMode {
  kAuto,    ///< chosen by progress_mode()
  kBar,     ///< one line that is redrawn
  kLines,   ///< one line of the log per frame
  kJson,    ///< one JSON object per frame, and the log as JSON, too
  kOpenJd,  ///< lines for a session of Open Job Description
  kNone,    ///< nothing
};

/// Options that every command has.
struct CommonOptions {
  int threads = 0;     ///< 0 = all that the process may use
  int verbose = 0;     ///< above 0: the log has debug messages
  bool quiet = false;  ///< the log has only warnings and errors
  ColorMode color = ColorMode::kAuto;
  ProgressMode progress = ProgressMode::kAuto;
  std::string log_file;  ///< a copy of the log; empty: none
  LogFormat log_format = LogFormat::kText;
  std::string cache_dir;  ///< empty: the default folder (cache_folder())
  bool no_cache = false;
  std::string device = "auto";   ///< "cpu", "cuda", "cuda:1" or "auto"; for films, a list of them
  std::uint64_t max_memory = 0;  ///< bytes; 0 = no limit
  bool overwrite = false;        ///< existing files may be replaced
  std::string config;  ///< file with the options' defaults (options/config.h); empty: none
};

/// The parsed command line, and the tables from which help is made.
struct CommandLine {
  std::shared_ptr<CLI::App> app;  ///< the program with its subcommands and options
  CommonOptions common;
  std::string arguments;  ///< argv joined by spaces, file names without folders, for image headers
  std::string program = "polymorph";    ///< name in suggested commands; argv[0] if it is a path
  std::function<Result<int>()> action;  ///< set by the chosen subcommand; the int is the exit code
  /// Verbs of each command that has any (second words, such as "test" of "golden test"), by the
  /// command's name.
  std::map<std::string, std::vector<VerbTable>> verbs;
};

/// Returns the tables of all commands, with their verbs.
std::vector<CommandTable> command_tables(const CommandLine& line);

/// Formats the help page of a command ("render"), of a verb ("golden test") or of the program (""):
/// a short one, or a full one with all groups of options (options/option_table.h).
std::string help_page(const CommandLine& line, const std::string& name, bool full);

/// Adds a subcommand with the options that all commands share. Its help shows `purpose` (one line),
/// `examples` and `exit_codes`.
Command add_command(CommandLine& line, const std::string& name, const std::string& purpose,
                    const std::string& examples, const std::string& exit_codes);

/// Sets the action of a command, which runs if the command is chosen and returns the exit code.
void set_action(CommandLine& line, Command command, std::function<Result<int>()> action);

/// Adds the argument VERB to a command and runs the action of the chosen verb. Options of other
/// verbs are usage errors.
void add_verbs(CommandLine& line, Command command, const std::vector<VerbTable>& verbs);

/// Adds --overwrite. run_program() adds it, under "Common", to the commands that have not done so.
Option add_overwrite(Command command, CommonOptions& common);

/// Adds --set KEY=VALUE, which may be repeated.
void add_overrides(Command command, std::vector<std::string>& texts);
/// Parses the values of --set. Errors: kUsage.
Result<std::vector<Override>> parse_overrides(const std::vector<std::string>& texts);

/// Value of --json [FILE]: whether and where a command writes its report as JSON.
struct JsonOutput {
  bool enabled = false;  ///< --json is given
  std::string file;      ///< empty: standard output
};
/// Adds --json [FILE].
void add_json(Command command, JsonOutput& json);
/// Writes a report. If it is an object, the program's version becomes its first key.
Status write_json(const JsonOutput& json, const JsonValue& report);
/// Writes a text that is no report, such as a scene or a schema, to the place that `json` names.
Status write_text(const JsonOutput& json, const std::string& text);

/// Writes bytes to standard output unchanged.
void print_bytes(std::string_view bytes);

/// Prints text to standard output, made safe by printable() (base/text.h). The work goes on if the
/// text cannot be written. run_program() then returns kOutput, unless the reader of a pipe has
/// closed it.
template <class... Args>
void print_data(fmt::format_string<Args...> text, Args&&... args) {
  print_bytes(printable(fmt::format(text, std::forward<Args>(args)...), LineBreaks::kKeep));
}

/// Returns the mode of --progress. Resolves kAuto: a bar on a terminal, lines elsewhere, nothing
/// with --quiet.
ProgressMode progress_mode(const CommonOptions& common);
/// Returns the folder of the cache; empty: there is none, or --no-cache is given.
std::filesystem::path cache_folder(const CommonOptions& common);
/// Returns the device, the cache folder and the memory limit for prepare_on_engine().
Resources resources(const CommonOptions& common);

void add_demo(CommandLine& line);
void add_init(CommandLine& line);
void add_render(CommandLine& line);
void add_merge(CommandLine& line);
void add_submit(CommandLine& line);
void add_status(CommandLine& line);
void add_pairs(CommandLine& line);
void add_completion(CommandLine& line);
void add_manual(CommandLine& line);
void add_strip(CommandLine& line);
void add_mesh(CommandLine& line);
void add_spheres(CommandLine& line);
void add_check(CommandLine& line);
void add_info(CommandLine& line);
void add_compare(CommandLine& line);
void add_golden(CommandLine& line);
void add_reproduce(CommandLine& line);
void add_analyze(CommandLine& line);
void add_landmarks(CommandLine& line);
void add_bench(CommandLine& line);
void add_cache(CommandLine& line);
void add_cubes(CommandLine& line);
void add_devices(CommandLine& line);
void add_schema(CommandLine& line);
void add_help(CommandLine& line);
void add_version(CommandLine& line);

/// Logs an error, one line of the log per line of its message.
void print_error(const Error& error);

/// Runs the program: parses the arguments, runs the command, prints errors, returns the exit code.
int run_program(int argc, char** argv);

}  // namespace polymorph
