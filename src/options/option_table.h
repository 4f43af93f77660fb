// Tables of the commands and their options, from which help, completion scripts, manual pages and
// the reference are made.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "base/result.h"

namespace CLI {
class App;
}

namespace polymorph {

/// An option or positional argument.
struct OptionRow {
  std::vector<std::string> names;    ///< "-o", "--output"; empty for a positional argument
  std::string value;                 ///< name of the value in help, "FILE"; empty for a flag
  std::vector<std::string> choices;  ///< allowed values; empty: any
  /// `group`: heading in help; `environment`: variable with the default, empty if there is none.
  std::string group, description, environment;
  bool positional = false, required = false;
  bool repeated = false;  ///< takes more than one value
};

/// A verb of a command, such as `test` of `golden`.
struct VerbTable {
  std::string name, purpose;
  std::string arguments;             ///< positional arguments, "NAME SCENE"; empty: none
  std::string argument_text;         ///< description of these arguments
  std::vector<std::string> options;  ///< names of the command's options that the verb takes
  std::string examples, exit_codes;
  std::function<Result<int>()> action;  ///< returns the exit code
};

/// A command, or the program itself.
struct CommandTable {
  std::string name, purpose, examples, exit_codes;  ///< `name` is empty for the program itself
  std::string usage;               ///< usage line; empty: derived from the arguments
  std::vector<OptionRow> options;  ///< positional arguments, then the options by group
  std::vector<VerbTable> verbs;    ///< empty if the command has none
};

/// Tests whether one of the option's names is among `names`.
bool is_named(const OptionRow& option, const std::vector<std::string>& names);

/// Returns the table of a verb as if it were a command ("golden test"), with the verb's options.
CommandTable verb_table(const CommandTable& command, const VerbTable& verb);

/// Returns the usage without options: "polymorph compare ACTUAL REFERENCE".
std::string positional_usage(const CommandTable& command);
/// Returns the usage line: "polymorph compare ACTUAL REFERENCE [OPTIONS]".
std::string usage_line(const CommandTable& command);

/// Returns the table of a command, or of the program's own options.
CommandTable command_table(const CLI::App& command);
/// Returns the tables of all commands, in the order of the help, without their verbs.
std::vector<CommandTable> command_tables(const CLI::App& program);

/// Returns the name of the help page for these arguments: the command and verb that they contain
/// ("golden test"), the command alone, or "" for the program.
std::string page_name(const std::vector<CommandTable>& commands, int argc, char** argv);
/// Formats the help page of this name in at most 80 columns, or that of the program if no command
/// has the name. If `full`, the page has the options of all groups and the exit codes, else only
/// the options of the first group.
std::string help_page(const CommandTable& program, const std::vector<CommandTable>& commands,
                      const std::string& name, bool full);

/// Return scripts that complete the command line in a shell.
std::string bash_completion(const std::vector<CommandTable>& commands);
std::string zsh_completion(const std::vector<CommandTable>& commands);
std::string fish_completion(const std::vector<CommandTable>& commands);

/// Return manual pages in roff: of the program, and of one command.
std::string program_page(const std::vector<CommandTable>& commands);
std::string command_page(const CommandTable& command);

/// Returns the reference page of the command line, in Markdown.
std::string commands_markdown(const std::vector<CommandTable>& commands);

}  // namespace polymorph
