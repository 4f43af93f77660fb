// Help texts of 80 columns: purpose, usage, examples, options in groups, exit codes.

#include <fmt/format.h>

#include <algorithm>

#include "options/option_table.h"

namespace polymorph {
namespace {

constexpr std::size_t kWidth = 80;
constexpr std::size_t kDescriptionColumn = 26;  // where descriptions start

/// Wraps a text at kWidth. The first line starts at `first_column`, the others at
/// kDescriptionColumn.
std::string wrap_text(const std::string& text, std::size_t first_column) {
  std::string out;
  std::size_t column = first_column;
  bool is_line_start = true;
  for (std::size_t i = 0; i < text.size();) {
    std::size_t end = text.find(' ', i);
    if (end == std::string::npos) end = text.size();
    const std::string word = text.substr(i, end - i);
    if (!is_line_start && column + 1 + word.size() > kWidth) {
      out += "\n" + std::string(kDescriptionColumn, ' ');
      column = kDescriptionColumn;
      is_line_start = true;
    }
    if (!is_line_start) out += ' ', ++column;
    out += word;
    column += word.size();
    is_line_start = false;
    i = end + 1;
  }
  return out + "\n";
}

/// Formats a row of two columns. If `left` is too wide for its column, it gets a line of its own.
std::string table_row(const std::string& left, const std::string& right) {
  std::string out = "  " + left;
  if (out.size() + 2 > kDescriptionColumn)
    out += "\n" + std::string(kDescriptionColumn, ' ');
  else
    out.resize(kDescriptionColumn, ' ');
  return out + wrap_text(right, kDescriptionColumn);
}

/// Formats an option's names and value. Long names are aligned, with or without a short name
/// before.
std::string option_names(const OptionRow& option) {
  if (option.positional) return option.value;
  std::string names;
  for (const std::string& name : option.names) {
    if (names.empty() && name.starts_with("--")) names = "    ";  // the width of "-x, "
    names += (names.empty() || names == "    " ? "" : ", ") + name;
  }
  return option.value.empty() ? names : names + " " + option.value;
}

/// Formats the options of a command in groups; only the first group unless `full`.
std::string options_text(const CommandTable& table, bool full) {
  std::string out, group;
  for (const OptionRow& option : table.options) {
    // A command with verbs lists only its common options, and those only in the full help: the help
    // of each verb lists the others.
    if (!table.verbs.empty() && (!full || option.group != "Common")) continue;
    if (option.group != group) {
      if (!full && !group.empty()) break;  // the short help has only the first group
      group = option.group;
      out += "\n" + group + ":\n";
    }
    out += table_row(option_names(option), option.description);
  }
  return out;
}

/// Formats the list of a command's verbs.
std::string verbs_text(const CommandTable& table) {
  std::string out = "\nVerbs:\n";
  for (const VerbTable& verb : table.verbs)
    out +=
        table_row(verb.name + (verb.arguments.empty() ? "" : " " + verb.arguments), verb.purpose);
  return out + fmt::format("\n'polymorph {} VERB --help' has the options of each.\n", table.name);
}

/// Formats the help of a command or, if `commands` is not empty, of the program.
std::string help_text(const CommandTable& table, const std::vector<CommandTable>& commands,
                      bool full) {
  const bool is_program = !commands.empty();
  std::string out = table.purpose + "\n\nUsage: " +
                    (is_program ? "polymorph COMMAND [OPTIONS]" : usage_line(table)) + "\n";
  if (!table.examples.empty()) out += "\nExamples:\n" + table.examples + "\n";
  if (is_program) {
    out += "\nCommands:\n";
    for (const CommandTable& command : commands) out += table_row(command.name, command.purpose);
  }
  if (!table.verbs.empty()) out += verbs_text(table);
  out += options_text(table, full || is_program);
  if (full && !table.exit_codes.empty()) out += "\nExit codes:\n" + table.exit_codes + "\n";
  if (!full && !is_program)
    out += fmt::format("\n--help shows {} options and the exit codes.\n",
                       table.verbs.empty() ? "all" : "the common");
  return out;
}

}  // namespace

bool is_named(const OptionRow& option, const std::vector<std::string>& names) {
  return std::any_of(option.names.begin(), option.names.end(), [&](const std::string& name) {
    return std::find(names.begin(), names.end(), name) != names.end();
  });
}

std::string positional_usage(const CommandTable& command) {
  std::string usage = command.name.empty() ? "polymorph" : "polymorph " + command.name;
  for (const OptionRow& row : command.options)
    if (row.positional) usage += row.required ? " " + row.value : " [" + row.value + "]";
  return usage;
}

std::string usage_line(const CommandTable& command) {
  return command.usage.empty() ? positional_usage(command) + " [OPTIONS]" : command.usage;
}

CommandTable verb_table(const CommandTable& command, const VerbTable& verb) {
  CommandTable table;
  table.name = command.name + " " + verb.name;
  table.purpose = verb.purpose;
  table.examples = verb.examples;
  table.exit_codes = verb.exit_codes;
  table.usage = fmt::format("polymorph {}{}{} [OPTIONS]", table.name,
                            verb.arguments.empty() ? "" : " ", verb.arguments);
  static const std::vector<std::string> kSharedByVerbs = {
      "--quiet", "--verbose", "--color", "--progress", "--log-file", "--log-format", "--config"};
  // Keep the verb's own options and the shared ones. Of the positional arguments, drop VERB, and
  // replace the other one by the arguments of the verb, if it has any.
  for (OptionRow option : command.options) {
    if (option.positional ? option.value == "VERB" || verb.arguments.empty()
                          : !is_named(option, verb.options) && !is_named(option, kSharedByVerbs))
      continue;
    if (option.positional) option.value = verb.arguments, option.description = verb.argument_text;
    table.options.push_back(std::move(option));
  }
  return table;
}

std::string page_name(const std::vector<CommandTable>& commands, int argc, char** argv) {
  for (int i = 1; i < argc; ++i)
    for (const CommandTable& command : commands) {
      if (command.name != argv[i]) continue;
      for (int j = 1; j < argc; ++j)
        for (const VerbTable& verb : command.verbs)
          if (verb.name == argv[j]) return command.name + " " + verb.name;
      return command.name;
    }
  return {};
}

std::string help_page(const CommandTable& program, const std::vector<CommandTable>& commands,
                      const std::string& name, bool full) {
  for (const CommandTable& command : commands) {
    if (command.name == name) return help_text(command, /*commands=*/{}, full);
    for (const VerbTable& verb : command.verbs)
      if (command.name + " " + verb.name == name)
        return help_text(verb_table(command, verb), /*commands=*/{}, full);
  }
  return help_text(program, commands, /*full=*/true);
}

}  // namespace polymorph
