// JSON: a tree of values, its reader and its writer. Members keep their order. Parsed values keep
// their offset in the text, so that messages can name line and column.
#pragma once

#include <array>
#include <concepts>
#include <cstdint>
#include <initializer_list>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/result.h"

namespace polymorph {

struct JsonMember;

/// One value. Booleans, numbers, strings and lists of them convert to it, and braces make an
/// object: `JsonValue{{"name", "torus"}, {"genus", 1}}`.
struct JsonValue {
  enum class Kind : std::uint8_t { kNull, kBoolean, kNumber, kString, kArray, kObject };
  static constexpr std::size_t kNowhere = static_cast<std::size_t>(-1);  ///< not parsed from text

  Kind kind = Kind::kNull;
  bool boolean = false;
  bool integral = false;            ///< the number is written without fraction and fits int64
  bool exceeds_int64 = false;       ///< the integer fits only uint64; `integer` has its bits
  double number = 0;                ///< value of a number
  std::int64_t integer = 0;         ///< value of a number, if `integral`
  std::string string;               ///< value of a string
  std::vector<JsonValue> items;     ///< elements of an array
  std::vector<JsonMember> members;  ///< members of an object, in their order
  std::size_t offset = kNowhere;    ///< offset of the value's first byte in the text

  JsonValue() = default;  ///< null
  JsonValue(std::string text);
  JsonValue(std::string_view text);
  JsonValue(const char* text);
  JsonValue(std::initializer_list<JsonMember> object);
  template <std::same_as<bool> T>
  JsonValue(T value) : kind(Kind::kBoolean), boolean(value) {}
  template <std::integral T>
  requires(!std::same_as<T, bool>) JsonValue(T value)
      : kind(Kind::kNumber),
        integral(std::in_range<std::int64_t>(value)),
        exceeds_int64(!integral),
        number(static_cast<double>(value)),
        integer(static_cast<std::int64_t>(value)) {}
  template <std::floating_point T>
  JsonValue(T value) : kind(Kind::kNumber), number(static_cast<double>(value)) {}
  template <class T>
  JsonValue(const std::vector<T>& values)
      : kind(Kind::kArray), items(values.begin(), values.end()) {}
  template <class T, std::size_t N>
  JsonValue(const std::array<T, N>& values)
      : kind(Kind::kArray), items(values.begin(), values.end()) {}
  template <class T>
  JsonValue(const std::map<std::string, T>& object) : kind(Kind::kObject) {
    for (const auto& [key, value] : object) (*this)[key] = value;
  }
  static JsonValue array(std::initializer_list<JsonValue> values = {});
  static JsonValue object();

  bool is_null() const { return kind == Kind::kNull; }
  bool is_number() const { return kind == Kind::kNumber; }
  bool is_string() const { return kind == Kind::kString; }
  bool is_array() const { return kind == Kind::kArray; }
  bool is_object() const { return kind == Kind::kObject; }

  /// Number of elements or members; 0 unless the value is an array or an object.
  std::size_t size() const;
  bool empty() const { return size() == 0; }

  /// Returns the member called `key`, or a null pointer.
  const JsonValue* find(std::string_view key) const;
  bool contains(std::string_view key) const { return find(key) != nullptr; }
  /// Returns the member called `key`, or a null value.
  const JsonValue& get(std::string_view key) const;

  /// Returns the member called `key`, which is appended if it is missing. A null value becomes an
  /// object first.
  JsonValue& operator[](std::string_view key);
  /// Copies all members of `object` into this one; they replace members with the same keys. A null
  /// value becomes an object first.
  void update(const JsonValue& object);
  /// Appends an item to an array; a null value becomes an array first.
  void push_back(JsonValue item);
};

struct JsonMember {
  std::string key;
  JsonValue value;
  std::size_t key_offset = JsonValue::kNowhere;  ///< offset of the key's first byte in the text
};

// Defined here, where JsonMember is a complete type: clang 14 needs that for size().
inline std::size_t JsonValue::size() const { return items.size() + members.size(); }

struct TextPosition {
  int line = 0, column = 0;  ///< counted from 1, in characters; 0 = not from the file
};

struct JsonDocument {
  std::string name;  ///< name of the file in messages
  std::string text;
  JsonValue root;
  /// Position of the character at a byte offset, which may be kNowhere.
  TextPosition position(std::size_t offset) const;
};

/// Parses JSON. Skips comments (// to the end of a line and /* */). Nesting deeper than 64 levels
/// and duplicate keys are errors. Errors (kInput): "NAME:LINE:COL: what", the line itself and a
/// caret below it; for a duplicate key, both lines are named.
Result<JsonDocument> parse_json(std::string name, std::string text);

/// Formats JSON with `indent` spaces per level (-1: one line). Floating-point numbers have at most
/// 17 digits and read back as the same value. Numbers that are not finite become null; bytes that
/// are not UTF-8 become U+FFFD.
std::string format_json(const JsonValue& value, int indent = -1);

/// format_json() for files and terminals: ends with a newline, and escapes characters that would
/// control a terminal.
std::string dump_json(const JsonValue& value, int indent = 2);

/// Name of a kind in messages: "true or false", "a number", "a list" ...
const char* kind_name(JsonValue::Kind kind);

}  // namespace polymorph
