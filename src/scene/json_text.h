// JSON parser with source positions: a tree that remembers the line and column of each value, for
// messages. Parsing is nlohmann-json's; what it lets pass (duplicate keys, 100 000-deep nesting) is
// refused.
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"

namespace polymorph {

struct JsonMember;

struct JsonValue {
  enum class Kind : std::uint8_t { kNull, kBoolean, kNumber, kString, kArray, kObject };
  Kind kind = Kind::kNull;
  bool boolean = false;
  bool integral = false;  ///< a number written without fraction that fits int64
  double number = 0;
  std::int64_t integer = 0;  ///< when integral
  std::string string;
  std::vector<JsonValue> items;     ///< of an array
  std::vector<JsonMember> members;  ///< of an object, in file order
  std::size_t offset = kNowhere;    ///< byte offset of its first character

  static constexpr std::size_t kNowhere = static_cast<std::size_t>(-1);
  const JsonValue* find(std::string_view key) const;
};

struct JsonMember {
  std::string key;
  std::size_t key_offset = JsonValue::kNowhere;
  JsonValue value;
};

struct TextPosition {
  int line = 0, column = 0;  ///< from 1; 0 = not from the file
};

struct JsonDocument {
  std::string name;  ///< the file, for messages
  std::string text;
  JsonValue root;
  TextPosition position(std::size_t offset) const;
};

/// Comments, // to the end of a line and /* */, are read over. Nesting is limited to 64; a
/// duplicate key is an error that names both lines. Errors (kInput): "NAME:LINE:COL: what", the
/// line itself and a caret below it.
Result<JsonDocument> parse_json(std::string name, std::string text);

/// Sets the value at a dotted path ("image.width", "intermediate.0.meta") to `value`, which is JSON
/// or, failing that, a plain string. Missing objects on the way are made. Errors: kUsage.
Status set_json_value(JsonDocument& document, std::string_view path, std::string_view value);

/// JSON as it is written everywhere: `indent` spaces per level (-1: one line), a newline at the
/// end, bytes that are not UTF-8 (paths may be anything) replaced, and what a terminal would act
/// upon escaped.
std::string dump_json(const nlohmann::ordered_json& json, int indent = 2);

/// "boolean", "number", ... for messages.
const char* kind_name(JsonValue::Kind kind);

}  // namespace polymorph
