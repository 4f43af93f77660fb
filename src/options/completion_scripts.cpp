// Completion scripts for bash, zsh and fish.
#include <fmt/format.h>

#include "options/option_table.h"

namespace polymorph {
namespace {

std::string join_words(const std::vector<std::string>& words) {
  return fmt::format("{}", fmt::join(words, " "));
}

/// Returns a shell command that prints the possible values of an option, if they depend on the
/// installation (models, effects, ...), else "".
std::string list_command(const OptionRow& row) {
  const std::string list = "polymorph demo --list 2>/dev/null | awk ";
  if (row.value == "FROM" || row.value == "TO")
    return list + "'/^effects/ {exit} /^  / {print $1}'";
  if (row.value == "EFFECT") return list + "'/^  / {print $1}' | sort -u";
  if (row.value == "DEVICE") return "printf '%s\\n' auto cpu cuda";
  if (row.value == "KEY=VALUE") return "polymorph schema --keys 2>/dev/null";
  return "";
}

/// Returns the words for a value of an option, for bash and fish: literal words, or the command of
/// list_command() in the shell's syntax, which begins with `substitution`.
std::string value_words(const OptionRow& row, const char* substitution) {
  const std::string command = list_command(row);
  return command.empty() ? join_words(row.choices) : substitution + command + ")";
}

std::string command_names(const std::vector<CommandTable>& commands) {
  std::vector<std::string> names;
  for (const CommandTable& command : commands) names.push_back(command.name);
  return join_words(names);
}

/// Quotes a text in single quotes for a shell.
std::string quote(const std::string& text) {
  std::string out = "'";
  for (const char c : text) out += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return out + "'";
}

/// Escapes the characters [ ] : and \, which have a meaning in a specification of zsh's _arguments.
std::string escape_zsh(const std::string& text) {
  std::string out;
  for (const char c : text)
    out += std::string_view("[]:\\").find(c) == std::string_view::npos ? std::string(1, c)
                                                                       : std::string("\\") + c;
  return out;
}

/// Returns the name of the zsh function that lists the words for a kind of value.
std::string zsh_function(const std::string& value) {
  return value == "KEY=VALUE" ? "_polymorph_KEY" : "_polymorph_" + value;
}

/// Returns the action of an argument of zsh's _arguments: the words, or a function that lists them.
std::string zsh_action(const OptionRow& row) {
  if (!list_command(row).empty()) return zsh_function(row.value);
  return row.choices.empty() ? "_files" : "(" + join_words(row.choices) + ")";
}

}  // namespace

std::string bash_completion(const std::vector<CommandTable>& commands) {
  // Make the branches of two case statements: `values` sets the words for an option's value,
  // `options` the options and arguments of a command.
  std::string values, options;
  for (const CommandTable& command : commands) {
    std::vector<std::string> names;
    std::string words;       // words of the last positional argument that has words
    int argument_count = 0;  // number of positional arguments that have words
    for (const OptionRow& row : command.options) {
      names.insert(names.end(), row.names.begin(), row.names.end());
      const std::string choices = value_words(row, "$(");
      if (choices.empty()) continue;
      if (row.positional) words = choices, ++argument_count;
      if (row.names.empty()) continue;
      std::string patterns;  // "COMMAND OPTION" for each name of the option
      for (const std::string& name : row.names)
        patterns +=
            fmt::format("{}{} {}", patterns.empty() ? "" : "|", "\"" + command.name, name + "\"");
      values += fmt::format("    {}) words=\"{}\" ;;\n", patterns, choices);
    }
    options += fmt::format("    {}) options=\"{}\" arguments=\"{}\" count={} ;;\n", command.name,
                           join_words(names), words, argument_count);
  }
  return fmt::format(
      "# bash completion for polymorph: polymorph completion bash\n"
      "_polymorph() {{\n"
      "  local cur=${{COMP_WORDS[COMP_CWORD]}} prev=${{COMP_WORDS[COMP_CWORD - 1]}} command= i\n"
      "  local words= options= arguments= count=0 key= back=1 all word\n"
      "  # The shell makes three words of KEY=VALUE.\n"
      "  if [[ $cur == = ]]; then key=$prev cur= back=2\n"
      "  elif [[ $prev == = ]]; then key=${{COMP_WORDS[COMP_CWORD - 2]}} back=3; fi\n"
      "  [[ -z $key ]] || prev=${{COMP_WORDS[COMP_CWORD - back]}}\n"
      "  COMPREPLY=()\n"
      "  for ((i = 1; i < COMP_CWORD; ++i)); do\n"
      "    [[ ${{COMP_WORDS[i]}} == -* ]] || {{ command=${{COMP_WORDS[i]}}; break; }}\n"
      "  done\n"
      "  if [[ -z $command ]]; then\n"
      "    mapfile -t COMPREPLY < <(compgen -W \"{} --help --version\" -- \"$cur\")\n"
      "    return\n"
      "  fi\n"
      "  case \"$command $prev\" in\n{}  esac\n"
      "  case $command in\n{}  esac\n"
      "  if [[ -z $words && $cur == -* ]]; then words=\"$options -h --help\"; fi\n"
      "  if [[ -z $words && $COMP_CWORD -le $((i + count)) ]]; then "
      "words=$arguments; fi\n"
      "  if [[ -n $key ]]; then\n"
      "    all=$words words=\n"
      "    for word in $all; do [[ $word != \"$key=\"?* ]] || words+=\" ${{word#*=}}\"; done\n"
      "  fi\n"
      "  # Without words of its own the shell completes file names.\n"
      "  [[ -z $words ]] || mapfile -t COMPREPLY < <(compgen -W \"$words\" -- \"$cur\")\n"
      "  [[ ${{COMPREPLY[*]}} != *= ]] || compopt -o nospace 2>/dev/null || true\n"
      "}}\n"
      "complete -o default -o bashdefault -F _polymorph polymorph\n",
      command_names(commands), values, options);
}

std::string zsh_completion(const std::vector<CommandTable>& commands) {
  // `descriptions`: a line per command. `cases`: a branch of a case statement per command.
  // `functions`: a function per kind of value that depends on the installation.
  std::string descriptions, cases, functions;
  for (const char* value : {"FROM", "TO", "EFFECT", "DEVICE", "KEY=VALUE"}) {
    OptionRow row;
    row.value = value;
    // A model or an effect may also be a file.
    const bool may_be_file = row.value == "FROM" || row.value == "TO" || row.value == "EFFECT";
    // No space after KEY=, because the value follows.
    const char* suffix = row.value == "KEY=VALUE" ? "-S '' " : "";
    functions += fmt::format("{}() {{ compadd {}-- ${{(f)\"$({})\"}}{} }}\n", zsh_function(value),
                             suffix, list_command(row), may_be_file ? "; _files" : "");
  }
  // Make the specifications for _arguments: NUMBER:NAME:ACTION for a positional argument, with a
  // second colon after the number if it is optional, and *OPTION[TEXT]:NAME:ACTION for an option,
  // where the star permits repetition.
  for (const CommandTable& command : commands) {
    descriptions += "    " + quote(escape_zsh(command.name) + ":" + command.purpose) + "\n";
    cases += fmt::format("    ({})\n      _arguments", command.name);
    int position = 0;
    for (const OptionRow& row : command.options) {
      const std::string action = zsh_action(row);
      if (row.positional) {
        const std::string number = row.repeated ? "*" : fmt::format("{}", ++position);
        cases += " \\\n        " +
                 quote(fmt::format("{}:{}{}:{}", number, row.required || row.repeated ? "" : ":",
                                   escape_zsh(row.value), action));
        continue;
      }
      for (const std::string& name : row.names) {
        const std::string value =
            row.value.empty() ? "" : fmt::format(":{}:{}", escape_zsh(row.value), action);
        cases += " \\\n        " +
                 quote(fmt::format("*{}[{}]{}", name, escape_zsh(row.description), value));
      }
    }
    cases += "\n      ;;\n";
  }
  return fmt::format(
      "#compdef polymorph\n"
      "# zsh completion for polymorph: polymorph completion zsh\n"
      "{}_polymorph() {{\n"
      "  local -a commands=(\n{}  )\n"
      "  if (( CURRENT == 2 )); then\n"
      "    _describe command commands\n"
      "    return\n"
      "  fi\n"
      "  local command=$words[2]\n"
      "  shift words\n"
      "  (( CURRENT-- ))\n"
      "  case $command in\n{}  esac\n"
      "}}\n"
      "_polymorph \"$@\"\n",
      functions, descriptions, cases);
}

std::string fish_completion(const std::vector<CommandTable>& commands) {
  std::string out = "# fish completion for polymorph: polymorph completion fish\n";
  for (const CommandTable& command : commands)
    out += fmt::format("complete -c polymorph -n __fish_use_subcommand -f -a {} -d {}\n",
                       command.name, quote(command.purpose));
  for (const CommandTable& command : commands) {
    const std::string condition =
        fmt::format("complete -c polymorph -n '__fish_seen_subcommand_from {}'", command.name);
    for (const OptionRow& row : command.options) {
      std::string line = condition;
      for (const std::string& name : row.names)
        line += name.starts_with("--") ? " -l " + name.substr(2) : " -s " + name.substr(1);
      const std::string words = value_words(row, "(");
      if (row.names.empty() && words.empty()) continue;
      if (!words.empty()) line += " -a " + quote(words);
      // A file name may replace a listed word, but not a choice.
      if (!row.value.empty()) line += row.choices.empty() ? " -r" : " -x";
      out += line + " -d " + quote(row.description) + "\n";
    }
  }
  return out;
}

}  // namespace polymorph
