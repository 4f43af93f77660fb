#include "scene/override.h"

#include "base/text.h"

namespace polymorph {
namespace {

Result<JsonValue> parse_fragment(std::string_view text) {
  PM_TRY(JsonDocument document, parse_json("", std::string(text)));
  return std::move(document.root);
}

void forget_offsets(JsonValue& value) {
  value.offset = JsonValue::kNowhere;
  for (JsonValue& item : value.items) forget_offsets(item);
  for (JsonMember& member : value.members) {
    member.key_offset = JsonValue::kNowhere;
    forget_offsets(member.value);
  }
}

}  // namespace

Status set_json_value(JsonDocument& document, std::string_view path, std::string_view text) {
  JsonValue* at = &document.root;
  for (const std::string& part : split(path, '.')) {
    if (part.empty())
      return make_error(ErrorCode::kUsage, "--set {}: empty name in the path", path);
    if (at->is_array()) {
      const auto index = parse_integer(part);
      if (!index || *index < 0 || static_cast<std::size_t>(*index) >= at->items.size())
        return make_error(ErrorCode::kUsage, "--set {}: \"{}\" is not an index below {}", path,
                          part, at->items.size());
      at = &at->items[static_cast<std::size_t>(*index)];
      continue;
    }
    if (at->is_string()) {
      JsonValue word = std::move(*at);
      *at = JsonValue::object();
      (*at)[""] = std::move(word);
    }
    if (!at->is_object()) *at = JsonValue::object();
    at = &(*at)[part];
  }
  auto value = parse_fragment(text);
  *at = value ? std::move(*value) : JsonValue(text);
  forget_offsets(*at);
  return Ok{};
}

}  // namespace polymorph
