#include "base/text.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>

#include "base/odd_names.h"

namespace polymorph {
namespace {

/// Returns the smallest number of insertions, deletions, substitutions and swaps of adjacent
/// characters that turn `a` into `b` (optimal string alignment).
std::size_t edit_distance(std::string_view a, std::string_view b) {
  // Rows i - 2, i - 1 and i of the table of distances between prefixes of `a` and of `b`.
  std::vector<std::size_t> before(b.size() + 1), above(b.size() + 1), row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::swap(before, above);
    std::swap(above, row);
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      row[j] =
          std::min({above[j] + 1, row[j - 1] + 1, above[j - 1] + (a[i - 1] == b[j - 1] ? 0u : 1u)});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        row[j] = std::min(row[j], before[j - 2] + 1);
    }
  }
  return row[b.size()];
}

/// Parses all of `text` as a number, which may have a plus sign.
template <class T>
std::optional<T> parse_all(std::string_view text) {
  if (text.starts_with('+')) text.remove_prefix(1);
  T value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || text.empty()) return std::nullopt;
  return value;
}

/// Returns the size in bytes of the UTF-8 character at `i`, or 0 if there is no valid one.
std::size_t character_size(std::string_view text, std::size_t i) {
  const auto lead = static_cast<unsigned char>(text[i]);
  const std::size_t size = lead < 0x80   ? 1
                           : lead < 0xc2 ? 0
                           : lead < 0xe0 ? 2
                           : lead < 0xf0 ? 3
                           : lead < 0xf5 ? 4
                                         : 0;
  if (size == 0 || i + size > text.size()) return 0;
  for (std::size_t k = 1; k < size; ++k)
    if ((static_cast<unsigned char>(text[i + k]) & 0xc0) != 0x80) return 0;
  if (size < 3) return size;
  const auto second = static_cast<unsigned char>(text[i + 1]);
  const bool is_invalid = (lead == 0xe0 && second < 0xa0) || (lead == 0xed && second > 0x9f) ||
                          (lead == 0xf0 && second < 0x90) || (lead == 0xf4 && second > 0x8f);
  return is_invalid ? 0 : size;  // invalid: overlong forms, surrogates, codes beyond U+10FFFF
}

/// Decodes a UTF-8 character; an invalid byte is decoded as itself.
std::uint32_t code_point(std::string_view character) {
  auto value = static_cast<std::uint32_t>(static_cast<unsigned char>(character[0]));
  // The lead byte of n > 1 bytes begins with n ones and a zero.
  if (character.size() > 1) value &= 0xffu >> (character.size() + 1);
  for (const char c : character.substr(1))
    value = value << 6 | (static_cast<unsigned char>(c) & 0x3fu);
  return value;
}

/// Tests whether a code point is a control character (C0, DEL or C1), a line or paragraph
/// separator, or a bidirectional mark, embedding, override or isolate.
bool is_control(std::uint32_t code) {
  return code < 0x20 || (code >= 0x7f && code < 0xa0) || code == 0x61c || code == 0x200e ||
         code == 0x200f || (code >= 0x2028 && code <= 0x202e) || (code >= 0x2066 && code <= 0x2069);
}

}  // namespace

std::string printable(std::string_view raw_text, LineBreaks line_breaks) {
  const std::string cleaned =
      line_breaks == LineBreaks::kKeep ? replace_breaks_of_names(raw_text) : std::string(raw_text);
  const std::string_view text = cleaned;
  std::string result;
  result.reserve(text.size());
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t size = character_size(text, i);
    const std::string_view character = text.substr(i, std::max<std::size_t>(size, 1));
    const bool is_layout = line_breaks == LineBreaks::kKeep &&
                           (character.front() == '\n' || character.front() == '\t');
    if (size > 0 && (is_layout || !is_control(code_point(character))))
      result += character;
    else
      result += '?';
    i += character.size();
  }
  return result;
}

std::string escape_json(std::string_view text) {
  std::string escaped;
  for (const char c : text) {
    if (c == '"' || c == '\\') escaped += '\\';
    if (static_cast<unsigned char>(c) < 0x20)
      escaped += fmt::format("\\u{:04x}", static_cast<int>(c));
    else
      escaped += c;
  }
  return escaped;
}

std::string printable_json(std::string text) {
  // The lead bytes of U+007F, U+0080 to U+00BF, U+0600 to U+063F and U+2000 to U+2FFF.
  const auto may_begin_control = [](char c) {
    return c == '\x7f' || static_cast<unsigned char>(c) == 0xc2 || c == '\xd8' || c == '\xe2';
  };
  if (std::none_of(text.begin(), text.end(), may_begin_control)) return text;
  std::string result;
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t size = std::max<std::size_t>(character_size(text, i), 1);
    const std::string_view character = std::string_view(text).substr(i, size);
    const std::uint32_t code = code_point(character);
    if (code >= 0x7f && is_control(code))
      result += fmt::format("\\u{:04x}", code);
    else
      result += character;
    i += size;
  }
  return result;
}

std::optional<double> parse_number(std::string_view text) {
  const auto value = parse_all<double>(text);
  if (!value || !std::isfinite(*value)) return std::nullopt;
  return value;
}

std::optional<long long> parse_integer(std::string_view text) { return parse_all<long long>(text); }

std::optional<std::string> nearest_word(std::string_view word,
                                        std::span<const std::string> candidates) {
  std::optional<std::string> best;
  std::size_t best_distance = std::max<std::size_t>(1, word.size() / 3) + 1;  // exclusive limit
  for (const std::string& candidate : candidates) {
    const std::size_t longer = std::max(word.size(), candidate.size());
    // The edit distance is at least the difference of the lengths.
    if (longer - std::min(word.size(), candidate.size()) >= best_distance) continue;
    const std::size_t distance = edit_distance(word, candidate);
    if (distance < best_distance) {
      best_distance = distance;
      best = candidate;
    }
  }
  return best;
}

std::string did_you_mean(std::string_view word, std::span<const std::string> candidates) {
  const auto nearest = nearest_word(word, candidates);
  return nearest ? fmt::format(" - did you mean \"{}\"?", *nearest) : "";
}

std::string join_quoted(std::span<const std::string> words) {
  std::string text;
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (i > 0) text += i + 1 == words.size() ? " or " : ", ";
    text += '"' + words[i] + '"';
  }
  return text;
}

std::string escape_cell(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (c == '|') out += '\\';
    out += c;
  }
  return out;
}

std::string escape_markup(std::string_view text) {
  std::string result;
  for (const char c : printable(text, LineBreaks::kKeep)) {
    if (c == '<')
      result += "&lt;";
    else if (c == '>')
      result += "&gt;";
    else if (c == '&')
      result += "&amp;";
    else if (c == '"')
      result += "&quot;";
    else
      result += c;
  }
  return result;
}

std::string lower_case(std::string text) {
  for (char& c : text)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return text;
}

std::vector<std::string> split(std::string_view text, char separator) {
  std::vector<std::string> parts;
  std::size_t start = 0;
  for (std::size_t i = 0; i <= text.size(); ++i) {
    if (i < text.size() && text[i] != separator) continue;
    parts.emplace_back(text.substr(start, i - start));
    start = i + 1;
  }
  return parts;
}

std::string format_bytes(double bytes) {
  if (bytes >= 1e9) return fmt::format("{:.1f} GB", bytes * 1e-9);
  if (bytes >= 1e6) return fmt::format("{:.1f} MB", bytes * 1e-6);
  if (bytes >= 1e3) return fmt::format("{:.0f} kB", bytes * 1e-3);
  return fmt::format("{:.0f} B", bytes);
}

std::string format_seconds(double seconds) {
  if (seconds >= 3600) {
    const auto minutes = static_cast<std::int64_t>(std::lround(seconds / 60));
    return fmt::format("{} h {:02d} min", minutes / 60, minutes % 60);
  }
  if (seconds >= 60) {
    const auto rounded = static_cast<std::int64_t>(std::lround(seconds));
    return fmt::format("{} min {:02d} s", rounded / 60, rounded % 60);
  }
  return fmt::format("{:.2f} s", seconds);
}

}  // namespace polymorph
