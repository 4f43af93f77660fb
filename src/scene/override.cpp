#include "scene/override.h"

#include "base/text.h"

namespace polymorph {
namespace {

Result<JsonValue> parse_value(std::string_view text) {
  PM_TRY(JsonDocument document, parse_json("", std::string(text)));
  return std::move(document.root);
}

/// Marks a value, and all values in it, as not being in the file.
void forget_offsets(JsonValue& value) {
  value.offset = JsonValue::kNowhere;
  for (JsonValue& item : value.items) forget_offsets(item);
  for (JsonMember& member : value.members) {
    member.key_offset = JsonValue::kNowhere;
    forget_offsets(member.value);
  }
}

}  // namespace

Status apply_override(JsonDocument& document, std::string_view path, std::string_view text) {
  JsonValue* node = &document.root;
  for (const std::string& key : split(path, '.')) {
    if (key.empty()) return make_error(ErrorCode::kUsage, "--set {}: empty name in the path", path);
    if (node->is_array()) {
      const auto index = parse_integer(key);
      if (!index || *index < 0 || static_cast<std::size_t>(*index) >= node->items.size())
        return make_error(ErrorCode::kUsage, "--set {}: \"{}\" is not an index below {}", path, key,
                          node->items.size());
      node = &node->items[static_cast<std::size_t>(*index)];
      continue;
    }
    if (node->is_string()) {  // the short form of an object moves to the key ""
      JsonValue short_form = std::move(*node);
      *node = JsonValue::object();
      (*node)[""] = std::move(short_form);
    }
    if (!node->is_object()) *node = JsonValue::object();
    node = &(*node)[key];
  }
  auto value = parse_value(text);
  *node = value ? std::move(*value) : JsonValue(text);
  forget_offsets(*node);
  return Ok{};
}

}  // namespace polymorph
