// The command line as data: what help, completions, man pages and the reference are made from.
#pragma once

#include <string>
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

struct CommandTable {
  std::string name, purpose, examples, exit_codes;  ///< the program itself has no name
  std::vector<OptionRow> options;                   ///< positional ones first, then by group
};

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
