// Manual pages in roff, and the reference of the command line in Markdown.
#include <fmt/format.h>

#include <algorithm>
#include <cctype>

#include "base/program_identity.h"
#include "base/text.h"
#include "options/option_table.h"

namespace polymorph {
namespace {

/// Escapes a text so that roff prints it literally.
std::string escape_roff(const std::string& text) {
  std::string out;
  bool is_line_start = true;
  for (const char c : text) {
    if (is_line_start && (c == '.' || c == '\'')) out += "\\&";
    if (c == '\\')
      out += "\\e";
    else if (c == '-')
      out += "\\-";
    else
      out += c;
    is_line_start = c == '\n';
  }
  return out;
}

std::string names_and_value(const OptionRow& row) {
  const std::string names = fmt::format("{}", fmt::join(row.names, ", "));
  return row.value.empty() ? names : names + " " + row.value;
}

/// Formats a text with its own line breaks: .nf and .fi switch the filling of lines off and on.
std::string literal_block(const std::string& text) {
  return ".nf\n" + escape_roff(text) + "\n.fi\n";
}

std::string page_head(const std::string& name) {
  return fmt::format(".TH \"{}\" \"1\" \"\" \"polymorph {}\" \"User Commands\"\n", name,
                     program_version());
}

/// Names the environment variable of an option, unless its description does so already.
std::string environment_text(const OptionRow& row) {
  return row.environment.empty() || row.description.find(row.environment) != std::string::npos
             ? ""
             : fmt::format(" (env {})", row.environment);
}

/// Formats a Markdown table of a command's options, without those that all commands have.
std::string options_markdown(const CommandTable& command) {
  std::string out = "| option | what |\n|---|---|\n";
  for (const OptionRow& row : command.options)
    if (row.group != "Common")
      out += fmt::format("| `{}` | {} |\n",
                         escape_cell(row.positional ? row.value : names_and_value(row)),
                         escape_cell(row.description + environment_text(row)));
  return out;
}

}  // namespace

std::string program_page(const std::vector<CommandTable>& commands) {
  std::string out = page_head("POLYMORPH");
  out +=
      ".SH NAME\npolymorph \\- renders morph sequences between polyhedra\n"
      ".SH SYNOPSIS\n.B polymorph\n.I COMMAND\n[OPTIONS]\n.SH COMMANDS\n";
  for (const CommandTable& command : commands)
    out += fmt::format(".TP\n.BR polymorph\\-{} (1)\n{}\n", escape_roff(command.name),
                       escape_roff(command.purpose));
  out += ".SH EXAMPLES\n" + literal_block(
                                "polymorph demo\npolymorph init first.obj second.obj\n"
                                "polymorph render scene.json -o 'out/frame.####.exr' --png");
  out +=
      ".SH EXIT STATUS\n0 good, 1 a check, test or comparison failed, 2 usage, 3 bad input, 4 "
      "cannot "
      "write, 5 device or memory, 6 some frames failed, 70 a bug, 75 stopped early on purpose, 130 "
      "and 143 stopped "
      "by a signal.\n.SH ENVIRONMENT\n";
  std::vector<std::string> seen;
  for (const CommandTable& command : commands)
    for (const OptionRow& row : command.options) {
      if (row.environment.empty() ||
          std::find(seen.begin(), seen.end(), row.environment) != seen.end())
        continue;
      seen.push_back(row.environment);
      out += fmt::format(
          ".TP\n.B {}\n{}\n", row.environment,
          escape_roff(fmt::format("What {} says where it is not given.", row.names.back())));
    }
  out +=
      ".TP\n.B POLYMORPH_DATA_DIR\nThe folder of the models, effects and scenes.\n"
      ".TP\n.B POLYMORPH_OIIO_MODULE\nThe image reader polymorph_oiio.so.\n"
      ".TP\n.B POLYMORPH_ISA\nEmbree's instruction set; all give the same pixels.\n";
  return out;
}

std::string command_page(const CommandTable& command) {
  std::string name = "POLYMORPH-" + command.name;
  std::transform(name.begin(), name.end(), name.begin(),
                 [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  std::string out = page_head(name);
  out +=
      fmt::format(".SH NAME\npolymorph\\-{} \\- {}\n.SH SYNOPSIS\n{}\n", escape_roff(command.name),
                  escape_roff(command.purpose), escape_roff(usage_line(command)));
  std::string group;
  out += ".SH OPTIONS\n";
  for (const OptionRow& row : command.options) {
    if (!row.positional && row.group != group) out += ".SS " + escape_roff(row.group) + "\n";
    if (!row.positional) group = row.group;
    out += fmt::format(".TP\n.B {}\n{}\n",
                       escape_roff(row.positional ? row.value : names_and_value(row)),
                       escape_roff(row.description + environment_text(row)));
  }
  if (!command.verbs.empty()) out += ".SH VERBS\n";
  for (const VerbTable& verb : command.verbs) {
    const CommandTable table = verb_table(command, verb);
    out += fmt::format(".TP\n.B {}\n{}", escape_roff(table.usage), escape_roff(verb.purpose));
    for (const OptionRow& row : table.options)
      if (!row.positional && row.group != "Common")
        out += fmt::format("\n.br\n{}", escape_roff(names_and_value(row) + ": " + row.description));
    out += "\n";
  }
  if (!command.examples.empty()) out += ".SH EXAMPLES\n" + literal_block(command.examples);
  if (!command.exit_codes.empty()) out += ".SH EXIT STATUS\n" + literal_block(command.exit_codes);
  return out + ".SH SEE ALSO\n.BR polymorph (1)\n";
}

std::string commands_markdown(const std::vector<CommandTable>& commands) {
  std::string out =
      "# The command line\n\nMade by `polymorph manual commands`; do not edit it by hand.\n";
  for (const CommandTable& command : commands) {
    out += fmt::format("\n## {}\n\n{}\n\n```\n{}\n```\n\n", command.name, command.purpose,
                       usage_line(command));
    if (command.verbs.empty())
      out += options_markdown(command);
    else
      out += "| verb | what |\n|---|---|\n";
    for (const VerbTable& verb : command.verbs)
      out += fmt::format("| [`{0}`](#{1}-{0}) | {2} |\n", verb.name, command.name,
                         escape_cell(verb.purpose));
    if (!command.examples.empty()) out += "\n```sh\n" + command.examples + "\n```\n";
    if (!command.exit_codes.empty())
      out += "\nExit codes:\n\n```\n" + command.exit_codes + "\n```\n";
    for (const VerbTable& verb : command.verbs) {
      const CommandTable table = verb_table(command, verb);
      out += fmt::format("\n### {}\n\n{}\n\n```\n{}\n```\n\n", table.name, table.purpose,
                         usage_line(table));
      out += options_markdown(table) + "\n```sh\n" + table.examples + "\n```\n";
      out += "\nExit codes:\n\n```\n" + table.exit_codes + "\n```\n";
    }
  }
  out += "\n## Options of every command\n\n| option | what |\n|---|---|\n";
  if (!commands.empty())
    for (const OptionRow& row : commands.front().options)
      if (row.group == "Common")
        out += fmt::format("| `{}` | {} |\n", escape_cell(names_and_value(row)),
                           escape_cell(row.description + environment_text(row)));
  return out;
}

}  // namespace polymorph
