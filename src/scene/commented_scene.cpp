#include "scene/commented_scene.h"

#include "base/json.h"
#include "base/text.h"
#include "scene/load_scene.h"

namespace polymorph {
namespace {

constexpr std::size_t kWidth = 96;

/// `text` in lines that begin with `lead`, at most kWidth columns wide where words allow it.
std::string comment(const std::string& lead, const std::string& text) {
  std::string out, line = lead;
  for (const std::string& word : split(text, ' ')) {
    if (line.size() > lead.size() && line.size() + 1 + word.size() > kWidth) {
      out += line + "\n";
      line = lead;
    }
    line += " " + word;
  }
  return out + line + "\n";
}

/// Purpose of a key of the schema and, where it has one, its range or its words.
std::string description_of(const JsonValue& schema) {
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

/// The properties of a key that is an object or, as the ends of a chain, may be one.
JsonValue properties_of(const JsonValue& schema) {
  if (schema.contains("properties")) return schema.get("properties");
  for (const JsonValue& choice : schema.get("oneOf").items)
    if (choice.contains("properties")) return choice.get("properties");
  return JsonValue::object();
}

std::string one_line(const JsonValue& value) {
  if (!value.is_object() && !value.is_array()) return printable_json(format_json(value));
  std::string text;
  for (const JsonValue& item : value.items) text += (text.empty() ? "" : ", ") + one_line(item);
  for (const JsonMember& member : value.members)
    text += (text.empty() ? "" : ", ") + one_line(member.key) + ": " + one_line(member.value);
  return (value.is_object() ? "{" : "[") + text + (value.is_object() ? "}" : "]");
}

/// The members of one object; those of `suggestions` are commented out.
std::string members(const JsonValue& object, const JsonValue& properties,
                    const JsonValue& suggestions, int level) {
  const std::string indent(2 * static_cast<std::size_t>(level), ' ');
  std::string out;
  std::size_t left = object.size();
  for (const auto& [key, value, offset] : object.members) {
    for (const auto& [other, example, other_offset] : suggestions.get(key).members) {
      out += comment(indent + "//", description_of(properties.get(other)));
      out += indent + "//   " + one_line(other) + ": " + one_line(example) + ",\n";
    }
    const JsonValue& schema = properties.get(key);
    if (const std::string text = description_of(schema); !text.empty())
      out += comment(indent + "//", text);
    // The objects of a chain are best seen whole, settings one by one.
    const bool open = level == 1 && value.is_object() && !value.empty() && !value.contains("model");
    out += indent + one_line(key) + ": ";
    out += open ? "{\n" + members(value, properties_of(schema), {}, level + 1) + indent + "}"
                : one_line(value);
    out += --left > 0 ? ",\n" : "\n";
  }
  return out;
}

}  // namespace

std::string commented_scene(const JsonValue& scene, const std::string& title,
                            const JsonValue& suggestions) {
  const JsonValue schema = parse_json("the schema", scene_schema()).value().root;
  std::string out;
  for (const std::string& line : split(title, '\n')) out += comment("//", printable(line));
  return out + "{\n" + members(scene, schema.get("properties"), suggestions, 1) + "}\n";
}

}  // namespace polymorph
