// Small text helpers: numbers without a locale, "did you mean", natural lists.
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

/// `text` inside HTML or XML, attributes included: < > & and " as entities.
std::string escape_markup(std::string_view text);

std::vector<std::string> split(std::string_view text, char separator);

/// "1.2 MB", "834 kB".
std::string format_bytes(double bytes);
/// "0.42 s", "1 min 03 s".
std::string format_seconds(double seconds);

}  // namespace polymorph
