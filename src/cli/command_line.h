// The command line: the subcommands, the options that they share, and the layout of the help text.
// Each subcommand is one file with a function add_NAME() that is declared here.
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
#include "base/result.h"
#include "base/shell_quote.h"
#include "base/stop.h"
#include "base/text.h"
#include "cli/option_table.h"
#include "cli/options.h"
#include "scene/load_scene.h"

namespace polymorph {

enum class ProgressMode { kAuto, kBar, kLines, kJson, kOpenJd, kNone };

struct CommonOptions {
  int threads = 0;
  int verbose = 0;
  bool quiet = false;
  std::string color = "auto";
  std::string progress = "auto";
  std::string log_file;
  std::string log_format = "text";
  std::string cache_dir;
  bool no_cache = false;
  std::string device = "auto";
  std::uint64_t max_memory = 0;  ///< bytes; 0 = no limit
  bool overwrite = false;        ///< files that exist may be replaced
  std::string config;            ///< file with defaults of options (cli/config.h)
};

struct CommandLine {
  std::shared_ptr<CLI::App> app;
  CommonOptions common;
  std::string text;                     ///< argv joined, without folders, for image headers
  std::string program = "polymorph";    ///< name it was called by, for commands that are suggested
  std::function<Result<int>()> action;  ///< set by the chosen subcommand; the int is the exit code
  /// Verbs of the commands that have any, by the command's name.
  std::map<std::string, std::vector<VerbTable>> verbs;
};

/// Tables of all commands, with their verbs.
std::vector<CommandTable> command_tables(const CommandLine& line);

/// Errors (kUsage): an option was given that the command has, but this verb does not take.
Status check_verb(const CommandLine& line, const std::string& command, const std::string& verb);

/// A subcommand with its one-line purpose, examples and exit codes (shown by its help).
Command add_command(CommandLine& line, const std::string& name, const std::string& purpose,
                    const std::string& examples, const std::string& exit_codes);

/// Sets the action of a command when it is chosen; its int is the exit code.
void set_action(CommandLine& line, Command command, std::function<Result<int>()> action);

/// --overwrite, which every command has: those that do not add it themselves get it among what all
/// commands share.
Option add_overwrite(Command command, CommonOptions& common);

/// --set path=value, repeated.
void add_overrides(Command command, std::vector<std::string>& texts);
Result<std::vector<Override>> parse_overrides(const std::vector<std::string>& texts);

/// --json [FILE]: machine output to standard output or a file.
struct JsonOutput {
  bool enabled = false;
  std::string file;
};
void add_json(Command command, JsonOutput& json);
/// A report; where it is an object, the program's version stands first in it.
Status write_json(const JsonOutput& json, const JsonValue& report);
/// Writes text that is no report: scenes, schemas, tables.
Status write_text(const JsonOutput& json, const std::string& text);

/// Bytes to standard output, as they are.
void print_bytes(std::string_view bytes);

/// Data for people and scripts to standard output, printable (base/text.h). A reader that has gone
/// does not end the work; a full disk makes run_program() fail.
template <class... Args>
void print_data(fmt::format_string<Args...> text, Args&&... args) {
  print_bytes(printable(fmt::format(text, std::forward<Args>(args)...), Lines::kKeep));
}

ProgressMode progress_mode(const CommonOptions& common);
std::filesystem::path cache_folder(const CommonOptions& common);

/// First commands to try, shown when the program is called without arguments.
std::string first_steps(const CommandLine& line);

/// Help as text, at most 80 columns, of one command, or of the program, which has `commands`:
/// `full` shows every option, else those of the first groups.
std::string help_text(const CommandTable& table, const std::vector<CommandTable>& commands,
                      bool full);
/// Name of the page that the arguments ask help for: a command's, one of a verb ("golden test"), or
/// empty for the program's.
std::string named_page(const CommandLine& line, int argc, char** argv);
/// Help of the command or verb of this name, or of the program where there is none of it.
std::string help_page(const CommandLine& line, const std::string& name, bool full);

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

/// The error on standard error, as the end of a run says it.
void print_error(const Error& error);

/// The whole program: parses, runs, prints errors, returns the exit code.
int run_program(int argc, char** argv);

}  // namespace polymorph
