#include "scene/commented_scene.h"

#include "base/json.h"
#include "base/text.h"
#include "scene/load_scene.h"

namespace polymorph {
namespace {

constexpr std::size_t kWidth = 96;  // columns of a line

/// Wraps `text` into lines that begin with `prefix`, at most kWidth wide where words allow it.
std::string wrap_comment(const std::string& prefix, const std::string& text) {
  std::string out, line = prefix;
  for (const std::string& word : split(text, ' ')) {
    if (line.size() > prefix.size() && line.size() + 1 + word.size() > kWidth) {
      out += line + "\n";
      line = prefix;
    }
    line += " " + word;
  }
  return out + line + "\n";
}

/// Description of a schema's key, followed by its values or its range, if it has any.
std::string describe_key(const JsonValue& schema) {
  std::string text = schema.get("description").string;
  if (schema.contains("enum")) {
    std::string words;
    for (const JsonValue& word : schema.get("enum").items)
      words += (words.empty() ? "" : ", ") + word.string;
    text += (text.empty() ? "" : "; ") + std::string("one of: ") + words;
  } else if (schema.contains("minimum")) {
    text += fmt::format("{}{} to {}", text.empty() ? "" : "; ", format_json(schema.get("minimum")),
                        format_json(schema.get("maximum")));
  }
  return text;
}

/// Returns the schemas of an object's keys; empty if the value is never an object. A value may be
/// an object or a string, as the source of a chain is.
JsonValue find_properties(const JsonValue& schema) {
  if (schema.contains("properties")) return schema.get("properties");
  for (const JsonValue& choice : schema.get("oneOf").items)
    if (choice.contains("properties")) return choice.get("properties");
  return JsonValue::object();
}

/// Formats JSON on one line.
std::string inline_json(const JsonValue& value) {
  if (!value.is_object() && !value.is_array()) return printable_json(format_json(value));
  std::string text;
  for (const JsonValue& item : value.items) text += (text.empty() ? "" : ", ") + inline_json(item);
  for (const JsonMember& member : value.members)
    text += (text.empty() ? "" : ", ") + inline_json(member.key) + ": " + inline_json(member.value);
  return (value.is_object() ? "{" : "[") + text + (value.is_object() ? "}" : "]");
}

/// Writes the members of an object, with `suggestions` as commented_scene() explains. `properties`:
/// the schemas of its keys. `level`: depth of the object, from 1, which sets the indent.
std::string write_members(const JsonValue& object, const JsonValue& properties,
                          const JsonValue& suggestions, int level) {
  const std::string indent(2 * static_cast<std::size_t>(level), ' ');
  std::string out;
  std::size_t remaining = object.size();  // members not yet written
  for (const auto& [key, value, offset] : object.members) {
    for (const auto& [suggested, example, suggested_offset] : suggestions.get(key).members) {
      out += wrap_comment(indent + "//", describe_key(properties.get(suggested)));
      out += indent + "//   " + inline_json(suggested) + ": " + inline_json(example) + ",\n";
    }
    const JsonValue& schema = properties.get(key);
    if (const std::string text = describe_key(schema); !text.empty())
      out += wrap_comment(indent + "//", text);
    // Settings get one line per member. An object with a model is written on a single line.
    const bool is_expanded =
        level == 1 && value.is_object() && !value.empty() && !value.contains("model");
    out += indent + inline_json(key) + ": ";
    out += is_expanded
               ? "{\n" + write_members(value, find_properties(schema), {}, level + 1) + indent + "}"
               : inline_json(value);
    out += --remaining > 0 ? ",\n" : "\n";
  }
  return out;
}

}  // namespace

std::string commented_scene(const JsonValue& scene, const std::string& title,
                            const JsonValue& suggestions) {
  const JsonValue schema = parse_json("the schema", scene_schema()).value().root;
  std::string out;
  for (const std::string& line : split(title, '\n')) out += wrap_comment("//", printable(line));
  return out + "{\n" + write_members(scene, schema.get("properties"), suggestions, 1) + "}\n";
}

}  // namespace polymorph
