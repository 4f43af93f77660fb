#include "base/json.h"

namespace polymorph {

JsonValue::JsonValue(std::string text) : kind(Kind::kString), string(std::move(text)) {}

JsonValue::JsonValue(std::string_view text) : kind(Kind::kString), string(text) {}

JsonValue::JsonValue(const char* text) : kind(Kind::kString), string(text) {}

JsonValue::JsonValue(std::initializer_list<JsonMember> object)
    : kind(Kind::kObject), members(object) {}

JsonValue JsonValue::array(std::initializer_list<JsonValue> values) {
  JsonValue array;
  array.kind = Kind::kArray;
  array.items = values;
  return array;
}

JsonValue JsonValue::object() {
  JsonValue object;
  object.kind = Kind::kObject;
  return object;
}

const JsonValue* JsonValue::find(std::string_view key) const {
  for (const JsonMember& member : members)
    if (member.key == key) return &member.value;
  return nullptr;
}

const JsonValue& JsonValue::get(std::string_view key) const {
  static const JsonValue null;
  const JsonValue* member = find(key);
  return member ? *member : null;
}

JsonValue& JsonValue::operator[](std::string_view key) {
  if (is_null()) kind = Kind::kObject;
  PM_CHECK(is_object());
  for (JsonMember& member : members)
    if (member.key == key) return member.value;
  members.push_back({std::string(key), {}});
  return members.back().value;
}

void JsonValue::update(const JsonValue& object) {
  if (is_null()) kind = Kind::kObject;
  for (const JsonMember& member : object.members) (*this)[member.key] = member.value;
}

void JsonValue::push_back(JsonValue item) {
  if (is_null()) kind = Kind::kArray;
  PM_CHECK(is_array());
  items.push_back(std::move(item));
}

const char* kind_name(JsonValue::Kind kind) {
  switch (kind) {
    case JsonValue::Kind::kNull:
      return "null";
    case JsonValue::Kind::kBoolean:
      return "true or false";
    case JsonValue::Kind::kNumber:
      return "a number";
    case JsonValue::Kind::kString:
      return "a string";
    case JsonValue::Kind::kArray:
      return "a list";
    case JsonValue::Kind::kObject:
      return "an object";
  }
  return "";
}

}  // namespace polymorph
