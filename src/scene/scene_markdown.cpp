// Reference of the scene format in Markdown, made from the schema.
#include <fmt/format.h>

#include <algorithm>

#include "base/json.h"
#include "base/text.h"
#include "scene/load_scene.h"

namespace polymorph {
namespace {

std::string choices_text(const JsonValue& schema) {
  std::string text;
  for (const JsonValue& word : schema.items)
    text += (text.empty() ? "" : ", ") + fmt::format("`{}`", word.string);
  return text;
}

std::string range_text(const JsonValue& schema) {
  return format_json(schema.get("minimum")) + " to " + format_json(schema.get("maximum"));
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
  // A landmark's vertex has a pattern, too, but inside a map, which is described as an object.
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

/// Finds the object in the schema of a value: the schema itself, the items of a list, or the first
/// object among alternatives. Null if there is none; keyframes do not count.
const JsonValue* inner_object(const JsonValue& schema) {
  if (schema.contains("$ref")) return nullptr;
  if (schema.contains("properties")) return &schema;
  if (schema.contains("items")) return inner_object(schema.get("items"));
  for (const JsonValue& choice : schema.get("oneOf").items)
    if (const JsonValue* object_schema = inner_object(choice)) return object_schema;
  return nullptr;
}

/// Appends a table of an object's keys to `out`, then tables of the objects in it. `path`: the keys
/// that lead to the object, joined by dots. `seen`: for each object that has a table, the schemas
/// of its keys as JSON.
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
    // All objects of a chain have the same keys, so they share one table.
    const std::string keys = format_json(inner->get("properties"));
    if (std::find(seen.begin(), seen.end(), keys) != seen.end()) continue;
    seen.push_back(keys);
    describe_keys(path.empty() ? key : path + "." + key, *inner, schema.get("description").string,
                  seen, out);
  }
}

}  // namespace

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
