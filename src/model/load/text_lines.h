// Line reader for OBJ and MTL files: text detection, logical lines, numbers, and the list of errors
// found.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"

namespace polymorph {

/// `bytes` without a UTF-8 byte order mark, if they are text. Errors (kInput): NUL or control
/// bytes, UTF-16, a known other format; each names the byte offset and what to do.
Result<std::string_view> checked_text(std::string_view bytes, const std::string& file);

/// Walks logical lines: LF, CRLF and lone CR end a line; a backslash at its end joins the next one,
/// except in a comment (`# saved in C:\dir\` must not swallow a vertex). White space at both ends
/// is cut.
class LineReader {
 public:
  explicit LineReader(std::string_view text) : rest_(text) {}
  bool next();
  std::string_view line() const { return line_; }   ///< valid until next()
  std::uint32_t number() const { return number_; }  ///< 1-based, of its first physical line

 private:
  std::string_view physical_line();
  std::string_view rest_, line_;
  std::string joined_;
  std::uint32_t number_ = 0, lines_read_ = 0;
};

/// Takes the next word (no blanks) off the front of `line`; empty at the end.
std::string_view take_word(std::string_view& line);
std::string_view trimmed(std::string_view text);

/// A number as OBJ and MTL write it. `problem` is null, or says what is wrong and what to do.
struct ParsedReal {
  float value = 0;
  const char* problem = nullptr;
};
/// '.' in every locale; leading '+' and '.' are fine; below float's range becomes 0; beyond +-1e15,
/// NaN and infinity in any spelling are problems.
ParsedReal parse_real(std::string_view word);

/// Errors of one file in line order, up to a limit.
class ErrorList {
 public:
  static constexpr std::size_t kLimit = 20;
  explicit ErrorList(std::string file) : file_(std::move(file)) {}
  void add(std::uint32_t line, const std::string& text);
  bool empty() const { return items_.empty(); }
  bool full() const { return items_.size() >= kLimit; }
  Error error() const;  ///< all of them, one per line, "FILE:LINE: text"; kInput

 private:
  struct Item {
    std::uint32_t line;
    std::string text;
  };
  std::string file_;
  std::vector<Item> items_;
};

/// Something that happens often and is told once, with where it happened first.
struct Occurrences {
  std::uint64_t count = 0;
  std::uint32_t first_line = 0;
  void note(std::uint32_t line) {
    if (count++ == 0) first_line = line;
  }
};

}  // namespace polymorph
