// Manual pages in roff, and the reference in Markdown.
#include <fmt/format.h>

#include <algorithm>
#include <cctype>

#include "base/json.h"
#include "base/program_identity.h"
#include "base/text.h"
#include "cli/option_table.h"
#include "scene/load_scene.h"

namespace polymorph {
namespace {

/// Escapes a text so that roff prints it literally.
std::string escape_roff(const std::string& text) {
  std::string out;
  bool line_start = true;
  for (const char c : text) {
    if (line_start && (c == '.' || c == '\'')) out += "\\&";
    if (c == '\\')
      out += "\\e";
    else if (c == '-')
      out += "\\-";
    else
      out += c;
    line_start = c == '\n';
  }
  return out;
}

std::string names_and_value(const OptionRow& row) {
  const std::string names = fmt::format("{}", fmt::join(row.names, ", "));
  return row.value.empty() ? names : names + " " + row.value;
}

std::string literal_block(const std::string& text) {
  return ".nf\n" + escape_roff(text) + "\n.fi\n";
}

std::string page_head(const std::string& name) {
  return fmt::format(".TH \"{}\" \"1\" \"\" \"polymorph {}\" \"User Commands\"\n", name,
                     program_version());
}

std::string environment_text(const OptionRow& row) {
  return row.environment.empty() || row.description.find(row.environment) != std::string::npos
             ? ""
             : fmt::format(" (env {})", row.environment);
}

/// Escapes a text for a cell of a Markdown table.
std::string escape_cell(const std::string& text) {
  std::string out;
  for (const char c : text) out += c == '|' ? std::string("\\|") : std::string(1, c);
  return out;
}

std::string choices_text(const JsonValue& schema) {
  std::string text;
  for (const JsonValue& word : schema.items)
    text += (text.empty() ? "" : ", ") + fmt::format("`{}`", word.string);
  return text;
}

std::string range_text(const JsonValue& schema) {
  return format_json(schema.get("minimum")) + " to " + format_json(schema.get("maximum"));
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

/// Describes the kind of a value of the scene format in Markdown.
std::string describe_kind(const JsonValue& schema) {
  if (schema.contains("$ref"))
    return "[keyframes](films.md)";  // keyframes are the only shared definition
  if (schema.contains("enum")) return choices_text(schema.get("enum"));
  if (schema.contains("oneOf")) {
    std::string text;
    for (const JsonValue& choice : schema.get("oneOf").items) {
      const std::string kind = describe_kind(choice);
      text += (text.empty() ? "" : ", or ") + kind;
    }
    return text;
  }
  const std::string& type = schema.get("type").string;
  if (type == "integer" || type == "number") {
    const std::string name = type == "integer" ? "whole number" : "number";
    return schema.contains("minimum") ? fmt::format("{}, {}", name, range_text(schema)) : name;
  }
  if (type == "boolean") return "true or false";
  if (type == "string") return schema.contains("pattern") ? "colour, `\"#rrggbb\"` (sRGB)" : "text";
  if (type == "array") {
    if (schema.contains("prefixItems"))
      return fmt::format("list of {} numbers", schema.get("prefixItems").size());
    if (schema.get("minItems").integer == 3)
      return fmt::format("3 numbers, {}", range_text(schema.get("items")));
    return "list";
  }
  return "object";
}

std::string format_default(const JsonValue& schema) {
  return schema.contains("default") ? fmt::format("`{}`", format_json(schema.get("default"))) : "";
}

/// Finds the object schema of a value: the schema itself, the items of a list, or the first object
/// among alternatives. Null: none, or keyframes.
const JsonValue* inner_object(const JsonValue& schema) {
  if (schema.contains("$ref")) return nullptr;
  if (schema.contains("properties")) return &schema;
  if (schema.contains("items")) return inner_object(schema.get("items"));
  for (const JsonValue& choice : schema.get("oneOf").items)
    if (const JsonValue* object_schema = inner_object(choice)) return object_schema;
  return nullptr;
}

/// Appends a table of an object's keys to `out`, then tables of the objects in it. `seen` has the
/// keys of the objects that have a table.
void describe_keys(const std::string& path, const JsonValue& object, const std::string& description,
                   std::vector<std::string>& seen, std::string& out) {
  if (!path.empty()) out += "\n## " + path + "\n\n";
  if (!description.empty()) out += description + ".\n\n";
  out += "| key | what | value | default |\n|---|---|---|---|\n";
  for (const auto& [key, schema, offset] : object.get("properties").members) {
    if (key == "$schema") continue;
    const JsonValue* inner = inner_object(schema);
    out += fmt::format(
        "| `{}` | {} | {} | {} |\n", key, escape_cell(schema.get("description").string),
        escape_cell(inner ? describe_kind(schema) + ", see below" : describe_kind(schema)),
        escape_cell(format_default(schema)));
  }
  for (const auto& [key, schema, offset] : object.get("properties").members) {
    const JsonValue* inner = inner_object(schema);
    if (!inner) continue;
    // Objects of a chain have the same keys, whatever their place: one table for all.
    const std::string keys = format_json(inner->get("properties"));
    if (std::find(seen.begin(), seen.end(), keys) != seen.end()) continue;
    seen.push_back(keys);
    describe_keys(path.empty() ? key : path + "." + key, *inner, schema.get("description").string,
                  seen, out);
  }
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

std::string scene_markdown() {
  const JsonValue schema = parse_json("the schema", scene_schema()).value().root;
  std::string out =
      "# The scene format\n\nMade by `polymorph manual scene`; do not edit it by hand.\n\n"
      "A scene is a JSON file; comments (`//` and `/* */`) may stand anywhere. Every key has a "
      "default but `source` and `target`, `blend` or `actors`. Paths are relative to the scene "
      "file, lengths are in scene units, angles in degrees. `polymorph init` writes a scene to "
      "start "
      "from, and with `\"$schema\"` an editor completes the keys.\n\n";
  std::vector<std::string> seen;
  describe_keys("", schema, "", seen, out);
  return out;
}

}  // namespace polymorph
