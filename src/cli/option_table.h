// The command line as data: what help, completions, man pages and the reference are made from.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace CLI {
class App;
}

namespace polymorph {

struct OptionRow {
  std::vector<std::string> names;    ///< "-o", "--output"; empty for a positional argument
  std::string value;                 ///< "FILE"; empty for a flag
  std::vector<std::string> choices;  ///< the words it takes, where they are few
  std::string group, description, environment;
  bool positional = false, required = false;
  bool repeated = false;  ///< takes any number of values
};

/// A verb of a command, as `test` of `golden`.
struct VerbTable {
  std::string name, purpose;
  std::string arguments;             ///< arguments after it: "NAME SCENE"; empty: none
  std::vector<std::string> options;  ///< "--root": those of the command that it takes
  std::string examples, exit_codes;
  /// Descriptions that are not the command's own, by option or argument.
  std::vector<std::pair<std::string, std::string>> descriptions;
};

struct CommandTable {
  std::string name, purpose, examples, exit_codes;  ///< the program itself has no name
  std::string usage;                                ///< empty: made of the arguments
  std::vector<OptionRow> options;                   ///< positional ones first, then by group
  std::vector<VerbTable> verbs;                     ///< empty where it has none
};

/// Tests whether an option has one of the names.
bool is_named(const OptionRow& option, const std::vector<std::string>& names);

/// A verb as a command of its own: "golden test", with the options that it takes.
CommandTable verb_table(const CommandTable& command, const VerbTable& verb);

/// One command, or the program (its options alone).
CommandTable command_table(const CLI::App& command);
/// Tables of all commands, in their order.
std::vector<CommandTable> command_tables(const CLI::App& program);

/// Scripts that complete the program's command line.
std::string bash_completion(const std::vector<CommandTable>& commands);
std::string zsh_completion(const std::vector<CommandTable>& commands);
std::string fish_completion(const std::vector<CommandTable>& commands);

/// Manual pages in roff: of the program, and of one command.
std::string program_page(const std::vector<CommandTable>& commands);
std::string command_page(const CommandTable& command);

/// Reference pages in Markdown: of the command line, and of the scene format (describe.h).
std::string commands_markdown(const std::vector<CommandTable>& commands);
std::string scene_markdown();

}  // namespace polymorph
