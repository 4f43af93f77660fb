// Text helpers: numbers without a locale, "did you mean", natural lists.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace polymorph {

/// The whole of `text` as a finite number ('.' decimal point in every locale), or nothing.
std::optional<double> parse_number(std::string_view text);
std::optional<long long> parse_integer(std::string_view text);

/// The candidate nearest to `word` by edit distance, if it is near enough to be meant.
std::optional<std::string> nearest_word(std::string_view word,
                                        std::span<const std::string> candidates);

/// " - did you mean \"x\"?" for the nearest candidate, or nothing: to be put behind a message.
std::string did_you_mean(std::string_view word, std::span<const std::string> candidates);

/// "a, b or c" with each quoted.
std::string join_quoted(std::span<const std::string> words);

/// Whether control characters that only lay text out, new lines and tabs, may stay.
enum class Lines { kKeep, kReplace };
/// `text` as it may be shown to people and written into files' headers: what is not UTF-8, control
/// characters (they move a terminal's cursor and end a header's line) and those that turn the
/// direction of writing are a '?' each.
std::string printable(std::string_view text, Lines lines = Lines::kReplace);

/// JSON with the same characters as \\u escapes: it says the same.
std::string printable_json(std::string text);

/// `text` inside a JSON string.
std::string escape_json(std::string_view text);

/// `text` inside HTML or XML, attributes included: < > & and " as entities; printable().
std::string escape_markup(std::string_view text);

std::vector<std::string> split(std::string_view text, char separator);

/// "1.2 MB", "834 kB".
std::string format_bytes(double bytes);
/// "0.42 s", "1 min 03 s".
std::string format_seconds(double seconds);

}  // namespace polymorph
