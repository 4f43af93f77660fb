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

/// Checks that `bytes` are text and removes a UTF-8 byte order mark. Errors (kInput): NUL or
/// control bytes, UTF-16, another known format. Each says what to do.
Result<std::string_view> check_text(std::string_view bytes, const std::string& file);

/// Reads logical lines. LF, CRLF and a lone CR end a line; a backslash at the end of a line joins
/// it with the next one, except in a comment (`# saved in C:\dir\` must not swallow a vertex).
/// White space at both ends is removed.
class LineReader {
 public:
  explicit LineReader(std::string_view text) : remaining_(text) {}
  bool next();                                     ///< reads a line; false at the end of the text
  std::string_view line() const { return line_; }  ///< valid until next()
  /// Number of the line's first physical line, from 1.
  std::uint32_t number() const { return number_; }

 private:
  std::string_view physical_line();
  std::string_view remaining_, line_;
  std::string joined_;
  std::uint32_t number_ = 0, lines_read_ = 0;
};

/// Removes the next word from the front of `line` and returns it; empty at the end of the line.
std::string_view take_word(std::string_view& line);
/// Removes blanks at both ends.
std::string_view trim(std::string_view text);

/// A number of an OBJ or MTL file. If the word is no valid number, `problem` is a message that says
/// what to do, and `value` is 0; else `problem` is null.
struct ParsedReal {
  float value = 0;
  const char* problem = nullptr;
};
/// Parses a number with '.' in every locale; leading '+' and '.' are accepted; values below float's
/// range become 0; values beyond +-1e15, NaN and infinity in any spelling are problems.
ParsedReal parse_real(std::string_view word);

/// Collects the errors of one file, up to a limit; error() sorts them by line.
class ErrorList {
 public:
  static constexpr std::size_t kLimit = 20;
  explicit ErrorList(std::string file) : file_(std::move(file)) {}
  void add(std::uint32_t line, const std::string& text);
  bool empty() const { return items_.empty(); }
  bool full() const { return items_.size() >= kLimit; }
  Error error() const;  ///< all errors, one per line, "FILE:LINE: text"; kInput

 private:
  struct Item {
    std::uint32_t line;
    std::string text;
  };
  std::string file_;
  std::vector<Item> items_;
};

/// Counts an event that is reported once, with the line of its first occurrence.
struct Occurrences {
  std::uint64_t count = 0;
  std::uint32_t first_line = 0;
  void note(std::uint32_t line) {
    if (count++ == 0) first_line = line;
  }
};

}  // namespace polymorph
