#include <algorithm>

#include "cli/command_line.h"

namespace polymorph {
namespace {

Result<int> run_help(const CommandLine& line, const std::vector<std::string>& words) {
  const std::string name = fmt::format("{}", fmt::join(words, " "));
  std::vector<std::string> names;
  for (const CommandTable& command : command_tables(line)) {
    names.push_back(command.name);
    for (const VerbTable& verb : command.verbs) names.push_back(command.name + " " + verb.name);
  }
  if (!name.empty() && std::find(names.begin(), names.end(), name) == names.end())
    return make_error(ErrorCode::kUsage, "unknown command \"{}\"{}", name,
                      did_you_mean(name, names));
  print_bytes(help_page(line, name, /*full=*/true));
  return 0;
}

}  // namespace

void add_help(CommandLine& line) {
  auto words = std::make_shared<std::vector<std::string>>();
  Command command =
      add_command(line, "help", "Print the help of a command, or list all commands.",
                  "  polymorph help\n  polymorph help render\n  polymorph help golden accept",
                  "  0 printed   2 unknown command");
  command.add_option("command", *words, "COMMAND",
                     "the command, perhaps with its verb; default: all of them in a list");
  set_action(line, command, [&line, words] { return run_help(line, *words); });
}

}  // namespace polymorph
