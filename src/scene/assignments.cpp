#include "scene/assignments.h"

#include "base/json.h"
#include "scene/load_scene.h"
#include "scene/scene.h"

namespace polymorph {
namespace {

/// Adds the assignments of all keys of an object's schema to `list`; `path` precedes the keys.
/// Leaves out lists of objects, because a path to their keys needs an index.
void add_keys(const JsonValue& schema, const std::string& path, std::vector<std::string>& list);

/// Adds the assignments of a key's enumerated values, and of the keys inside it. Returns whether it
/// added any.
bool add_values(const JsonValue& schema, const std::string& key, std::vector<std::string>& list) {
  const std::size_t old_size = list.size();
  for (const JsonValue& word : schema.get("enum").items) list.push_back(key + "=" + word.string);
  if (schema.get("type").string == "boolean")
    for (const char* word : {"true", "false"}) list.push_back(key + "=" + word);
  if (key == "image.aovs") {  // a string in the schema, because layers may be combined
    for (const char* word : {"all", "none"}) list.push_back(key + "=" + word);
    for (const std::string& layer : kAovNames) list.push_back(key + "=" + layer);
  }
  // Skip keyframes, which nobody types on a command line.
  if (!schema.contains("$ref")) add_keys(schema, key + ".", list);
  for (const JsonValue& choice : schema.get("oneOf").items) add_values(choice, key, list);
  return list.size() > old_size;
}

void add_keys(const JsonValue& schema, const std::string& path, std::vector<std::string>& list) {
  for (const auto& [key, value, offset] : schema.get("properties").members)
    if (key != "$schema" && key != "actors" && key != "intermediate" && key != "blend" &&
        !add_values(value, path + key, list))
      list.push_back(path + key + "=");
}

}  // namespace

std::vector<std::string> list_assignments() {
  const JsonValue schema = parse_json("the schema", scene_schema()).value().root;
  std::vector<std::string> list;
  add_keys(schema, "", list);
  return list;
}

}  // namespace polymorph
