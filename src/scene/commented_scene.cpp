#include "scene/commented_scene.h"

#include <nlohmann/json.hpp>

#include "base/text.h"
#include "scene/json_text.h"
#include "scene/load_scene.h"

namespace polymorph {
namespace {

using Json = nlohmann::ordered_json;

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

/// What a key of the schema is for and, where it has one, its range or its words.
std::string description_of(const Json& schema) {
  std::string text = schema.value("description", "");
  if (schema.contains("enum")) {
    std::string words;
    for (const Json& word : schema["enum"])
      words += (words.empty() ? "" : ", ") + word.get<std::string>();
    text += (text.empty() ? "" : "; ") + std::string("one of: ") + words;
  } else if (schema.contains("minimum")) {
    text += fmt::format("{}{} to {}", text.empty() ? "" : "; ", schema["minimum"].dump(),
                        schema["maximum"].dump());
  }
  return text;
}

/// The properties of a key that is an object or, as the ends of a chain, may be one.
Json properties_of(const Json& schema) {
  if (schema.contains("properties")) return schema["properties"];
  if (schema.contains("oneOf") && schema["oneOf"].is_array())
    for (const Json& choice : schema["oneOf"])
      if (choice.contains("properties")) return choice["properties"];
  return Json::object();
}

std::string one_line(const Json& value) {
  const bool object = value.is_object();
  if (!object && !value.is_array()) {
    std::string text = dump_json(value, -1);
    text.pop_back();
    return text;
  }
  std::string text;
  for (const auto& [key, item] : value.items())
    text += (text.empty() ? "" : ", ") + (object ? one_line(key) + ": " : "") + one_line(item);
  return (object ? "{" : "[") + text + (object ? "}" : "]");
}

/// The members of one object; those of `suggestions` are commented out.
std::string members(const Json& object, const Json& properties, const Json& suggestions,
                    int level) {
  const std::string indent(2 * static_cast<std::size_t>(level), ' ');
  std::string out;
  std::size_t left = object.size();
  for (const auto& [key, value] : object.items()) {
    if (suggestions.contains(key))
      for (const auto& [other, example] : suggestions[key].items()) {
        out += comment(indent + "//", description_of(properties.value(other, Json::object())));
        out += indent + "//   " + one_line(other) + ": " + one_line(example) + ",\n";
      }
    const Json schema = properties.value(key, Json::object());
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

std::string commented_scene(const Json& scene, const std::string& title, const Json& suggestions) {
  const Json schema = Json::parse(scene_schema());
  std::string out;
  for (const std::string& line : split(title, '\n')) out += comment("//", printable(line));
  return out + "{\n" + members(scene, schema["properties"], suggestions, 1) + "}\n";
}

}  // namespace polymorph
