// Reading and writing JSON text with nlohmann-json. No other file includes that library, because
// its header takes longer to compile than most files.
#include <algorithm>
#include <iterator>
#include <nlohmann/json.hpp>
#include <unordered_map>
#include <utility>

#include "base/json.h"
#include "base/text.h"

namespace polymorph {
namespace {

constexpr std::size_t kMaxDepth = 64;

/// Iterator that counts the bytes read. At each SAX event, the count is the lexer's position.
class CountingIterator {
 public:
  using iterator_category = std::input_iterator_tag;
  using value_type = char;
  using difference_type = std::ptrdiff_t;
  using pointer = const char*;
  using reference = const char&;

  CountingIterator(const char* at, std::size_t* read_count) : at_(at), read_count_(read_count) {}
  reference operator*() const { return *at_; }
  CountingIterator& operator++() {
    ++at_;
    ++*read_count_;
    return *this;
  }
  CountingIterator operator++(int) {
    CountingIterator before = *this;
    ++*this;
    return before;
  }
  bool operator==(const CountingIterator& other) const { return at_ == other.at_; }
  bool operator!=(const CountingIterator& other) const { return at_ != other.at_; }

 private:
  const char* at_;
  std::size_t* read_count_;
};

/// Tests whether a byte of UTF-8 continues a character.
bool is_continuation(char c) { return (static_cast<unsigned char>(c) & 0xC0) == 0x80; }

/// Returns the line of text around `offset`, with a caret below the character there.
std::string excerpt(const JsonDocument& document, std::size_t offset) {
  const std::string& text = document.text;
  offset = std::min(offset, text.size());
  std::size_t begin = offset;
  while (begin > 0 && text[begin - 1] != '\n') --begin;
  // Skip a byte order mark.
  if (begin == 0 && text.starts_with("\xEF\xBB\xBF")) begin = std::min<std::size_t>(3, offset);
  std::size_t end = std::min(text.find('\n', offset), text.size());
  // A minified scene is one long line. Show a part of it that begins and ends between characters.
  constexpr std::size_t kContext = 50;  // bytes on each side
  if (offset - begin > kContext) begin = offset - kContext;
  while (begin < offset && is_continuation(text[begin])) ++begin;
  end = std::min(end, offset + kContext);
  while (end < text.size() && end > offset && is_continuation(text[end])) --end;
  std::string line = text.substr(begin, end - begin);
  for (char& c : line)
    if (static_cast<unsigned char>(c) < 0x20) c = ' ';
  const auto columns = offset - begin -
                       static_cast<std::size_t>(std::count_if(
                           text.begin() + static_cast<std::ptrdiff_t>(begin),
                           text.begin() + static_cast<std::ptrdiff_t>(offset), is_continuation));
  return fmt::format("\n  | {}\n  | {}^", line, std::string(columns, ' '));
}

/// Builds the tree from nlohmann's SAX events.
class TreeBuilder : public nlohmann::json_sax<nlohmann::json> {
 public:
  TreeBuilder(JsonDocument& document, const std::size_t& read_count)
      : document_(document), read_count_(read_count) {}

  std::string error;  ///< message, if parsing fails

  bool null() override { return add_value({}); }
  bool boolean(bool value) override { return add_value(value); }
  bool number_integer(number_integer_t value) override { return add_value(value); }
  bool number_unsigned(number_unsigned_t value) override { return add_value(value); }
  bool number_float(number_float_t value, const string_t&) override { return add_value(value); }
  bool string(string_t& value) override { return add_value(std::move(value)); }
  bool binary(binary_t&) override { return false; }
  bool start_object(std::size_t) override { return open(JsonValue::Kind::kObject); }
  bool start_array(std::size_t) override { return open(JsonValue::Kind::kArray); }
  bool end_object() override { return close(); }
  bool end_array() override { return close(); }
  bool key(string_t& value) override {
    const std::size_t offset = token_start();
    end_ = read_count_;
    std::vector<JsonMember>& members = open_.back()->members;
    const auto [entry, added] = keys_.back().try_emplace(value, offset);
    if (!added)
      return fail(offset,
                  fmt::format("duplicate key \"{}\" (first on line {}) - remove one of the two",
                              value, document_.position(entry->second).line));
    members.push_back({std::move(value), {}, offset});
    return true;
  }
  bool parse_error(std::size_t position, const std::string&,
                   const nlohmann::detail::exception& e) override {
    std::string message = e.what();
    // Remove the prefix of messages such as:
    // "[json.exception.parse_error.101] parse error at line 3, column 5: syntax error ..."
    if (const auto colon = message.find(": "); colon != std::string::npos)
      message = message.substr(colon + 2);
    // "[json.exception.out_of_range.406] number overflow parsing '1e999'"
    if (message.starts_with('['))
      message = message.substr(std::min(message.find("] "), message.size() - 2) + 2);
    std::size_t offset = position > 0 ? position - 1 : 0;  // `position` counts from 1
    // Point at the token's start: the lexer reports the position after the token. A message that
    // spells control characters as <U+0000> does not show the token's size.
    if (const auto token_at = message.find("last read: '");
        token_at != std::string::npos && message.find("unexpected") != std::string::npos) {
      const auto close = message.rfind('\'');
      // 12 is the length of "last read: '".
      const std::size_t size = close > token_at + 12 ? close - token_at - 12 : 0;
      if (size > 1 && offset + 1 >= size && message.find("<U+") == std::string::npos)
        offset -= size - 1;
    }
    const char character = offset < document_.text.size() ? document_.text[offset] : '\0';
    const char* hint = "";
    if (character == '#') hint = " - a comment starts with //";
    if (character == '\'') hint = " - strings need double quotes";
    if ((character == '}' || character == ']') && message.find("unexpected") != std::string::npos)
      hint = " - remove the comma before it, or add what is missing";
    return fail(offset, message + hint);
  }

 private:
  bool add_value(JsonValue value) {
    const std::size_t offset = token_start();
    const bool is_number = value.is_number();
    value.offset = offset;
    slot() = std::move(value);
    // The lexer has read one character beyond a number, but stops at the end of other values.
    end_ = read_count_;
    if (is_number)
      for (end_ = offset; end_ < document_.text.size() && is_number_char(document_.text[end_]);)
        ++end_;
    return true;
  }
  bool open(JsonValue::Kind kind) {
    const std::size_t offset = token_start();
    if (open_.size() >= kMaxDepth)
      return fail(offset, fmt::format("nested deeper than {} levels - flatten it", kMaxDepth));
    JsonValue& value = slot();
    value.kind = kind;
    value.offset = offset;
    open_.push_back(&value);
    keys_.emplace_back();
    end_ = read_count_;
    return true;
  }
  bool close() {
    open_.pop_back();
    keys_.pop_back();
    end_ = read_count_;
    return true;
  }
  /// Returns the value to fill in next: the root, the value of the last member, or a new item.
  JsonValue& slot() {
    if (open_.empty()) return document_.root;
    JsonValue& parent = *open_.back();
    if (parent.is_object()) return parent.members.back().value;
    parent.items.emplace_back();
    return parent.items.back();
  }
  /// Returns the offset of the next token: skips the spaces, separators and comments after end_,
  /// whose syntax the lexer has checked.
  std::size_t token_start() const {
    const std::string& text = document_.text;
    std::size_t at = end_;
    while (at < text.size()) {
      if (text.compare(at, 2, "//") == 0)
        at = std::min(text.find('\n', at), text.size());
      else if (text.compare(at, 2, "/*") == 0)
        at = std::min(text.find("*/", at + 2), text.size() - 2) + 2;
      else if (std::string_view(" \t\r\n,:\xEF\xBB\xBF").find(text[at]) != std::string_view::npos)
        ++at;
      else
        break;
    }
    return at;
  }
  static bool is_number_char(char c) {
    return (c >= '0' && c <= '9') || c == '+' || c == '-' || c == '.' || c == 'e' || c == 'E';
  }
  /// Sets `error`. Returns false, which ends the parsing.
  bool fail(std::size_t offset, const std::string& what) {
    const TextPosition at = document_.position(offset);
    error = fmt::format("{}:{}:{}: {}{}", document_.name, at.line, at.column, what,
                        excerpt(document_, offset));
    return false;
  }

  JsonDocument& document_;
  const std::size_t& read_count_;
  std::size_t end_ = 0;  ///< offset after the last token
  /// The containers that are not complete yet, the innermost last. The pointers stay valid, because
  /// only the innermost container grows.
  std::vector<JsonValue*> open_;
  /// Offsets of the keys, one map per open container.
  std::vector<std::unordered_map<std::string, std::size_t>> keys_;
};

/// Formats a number or a string as nlohmann-json does.
template <class T>
std::string format_scalar(const T& value) {
  return nlohmann::json(value).dump(/*indent=*/-1, /*indent_char=*/' ', /*ensure_ascii=*/false,
                                    nlohmann::json::error_handler_t::replace);
}

/// Appends JSON values to `text`.
class Writer {
 public:
  explicit Writer(int indent) : indent_(indent) {}
  std::string text;

  void write(const JsonValue& value) {
    switch (value.kind) {
      case JsonValue::Kind::kNull:
        text += "null";
        break;
      case JsonValue::Kind::kBoolean:
        text += value.boolean ? "true" : "false";
        break;
      case JsonValue::Kind::kNumber:
        write_number(value);
        break;
      case JsonValue::Kind::kString:
        write_string(value.string);
        break;
      case JsonValue::Kind::kArray:
        write_list('[', ']', value.items, [&](const JsonValue& item) { write(item); });
        break;
      case JsonValue::Kind::kObject:
        write_list('{', '}', value.members, [&](const JsonMember& member) {
          write_string(member.key);
          text += indent_ < 0 ? ":" : ": ";
          write(member.value);
        });
        break;
    }
  }

 private:
  void write_number(const JsonValue& value) {
    if (value.integral)
      text += fmt::format("{}", value.integer);
    else if (value.exceeds_int64)
      text += fmt::format("{}", static_cast<std::uint64_t>(value.integer));
    else
      text += format_scalar(value.number);
  }
  void write_string(const std::string& string) {
    const auto is_plain = [](char c) { return c >= ' ' && c < 0x7f && c != '"' && c != '\\'; };
    text += std::all_of(string.begin(), string.end(), is_plain) ? '"' + string + '"'
                                                                : format_scalar(string);
  }
  template <class List, class F>
  void write_list(char open, char close, const List& list, const F& write_one) {
    text += open;
    ++level_;
    for (std::size_t i = 0; i < list.size(); ++i) {
      if (i > 0) text += ',';
      break_line();
      write_one(list[i]);
    }
    --level_;
    if (!list.empty()) break_line();
    text += close;
  }
  void break_line() {
    if (indent_ < 0) return;
    text += '\n';
    text.append(static_cast<std::size_t>(level_ * indent_), ' ');
  }

  int indent_;
  int level_ = 0;
};

}  // namespace

TextPosition JsonDocument::position(std::size_t offset) const {
  if (offset == JsonValue::kNowhere) return {};
  TextPosition at{1, 1};
  for (std::size_t i = 0; i < std::min(offset, text.size()); ++i) {
    // Columns count characters: skip continuation bytes of UTF-8 and a byte order mark.
    if (!is_continuation(text[i]) && !(i == 0 && text.starts_with("\xEF\xBB\xBF"))) ++at.column;
    if (text[i] == '\n') at = {at.line + 1, 1};
  }
  return at;
}

Result<JsonDocument> parse_json(std::string name, std::string text) {
  if (text.starts_with("\xFF\xFE") || text.starts_with("\xFE\xFF"))
    return make_error(ErrorCode::kInput, "{}: is UTF-16 - save it as UTF-8", name);
  JsonDocument document{std::move(name), std::move(text), {}};
  // The parser would take a NUL for the end of the text.
  if (const std::size_t nul = document.text.find('\0'); nul != std::string::npos) {
    const TextPosition at = document.position(nul);
    return make_error(ErrorCode::kInput, "{}:{}:{}: a NUL is no part of JSON - remove it",
                      document.name, at.line, at.column);
  }
  std::size_t read_count = 0;
  TreeBuilder builder(document, read_count);
  const char* begin = document.text.data();
  const bool ok =
      nlohmann::json::sax_parse(CountingIterator(begin, &read_count),
                                CountingIterator(begin + document.text.size(), &read_count),
                                &builder, nlohmann::json::input_format_t::json, /*strict=*/true,
                                /*ignore_comments=*/true);
  if (!ok) return Error{ErrorCode::kInput, builder.error};
  return document;
}

std::string format_json(const JsonValue& value, int indent) {
  Writer writer(indent);
  writer.write(value);
  return std::move(writer.text);
}

std::string dump_json(const JsonValue& value, int indent) {
  return printable_json(format_json(value, indent) + "\n");
}

}  // namespace polymorph
