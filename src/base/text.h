// Text helpers: locale-independent numbers, suggestions, lists, escaping.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace polymorph {

/// Parse all of `text` as a finite number, with '.' as the decimal point in every locale, or as an
/// integer. Return nothing if `text` is anything else.
std::optional<double> parse_number(std::string_view text);
std::optional<long long> parse_integer(std::string_view text);

/// Finds the candidate with the smallest edit distance from `word`. Returns nothing if that
/// distance exceeds max(1, a third of the word's length).
std::optional<std::string> nearest_word(std::string_view word,
                                        std::span<const std::string> candidates);

/// Returns " - did you mean \"x\"?" for the nearest candidate, or "": a suffix for messages.
std::string did_you_mean(std::string_view word, std::span<const std::string> candidates);

/// Joins words as "a, b or c", each quoted.
std::string join_quoted(std::span<const std::string> words);

/// Treatment of line breaks and tabs in printable().
enum class LineBreaks { kKeep, kReplace };
/// Makes `text` safe for display and for file headers: replaces invalid UTF-8, control characters
/// (they move a terminal's cursor and end a header's line) and characters that change the direction
/// of writing by '?'.
std::string printable(std::string_view text, LineBreaks line_breaks = LineBreaks::kReplace);

/// Makes JSON text printable without a change of the values that it represents: characters from DEL
/// (U+007F) on that printable() would replace become \\u escapes.
std::string printable_json(std::string text);

/// Escapes `text` for a JSON string.
std::string escape_json(std::string_view text);

/// Escapes `text` for a cell of a Markdown table.
std::string escape_cell(std::string_view text);

/// Escapes printable text for HTML or XML, also for attributes: < > & and " become entities. Line
/// breaks and tabs stay.
std::string escape_markup(std::string_view text);

/// Converts A .. Z to a .. z; other characters, in any encoding, stay.
std::string lower_case(std::string text);

/// Splits at each separator; n separators give n + 1 parts.
std::vector<std::string> split(std::string_view text, char separator);

/// Formats a size as "1.2 MB" or "834 kB".
std::string format_bytes(double bytes);
/// Formats a duration as "0.42 s" or "1 min 03 s".
std::string format_seconds(double seconds);

}  // namespace polymorph
