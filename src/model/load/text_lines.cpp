#include "model/load/text_lines.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>

namespace polymorph {
namespace {

// At this limit, areas are finite as floats, and squares of areas are finite as doubles.
constexpr double kMaxCoordinate = 1e15;

bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\f' || c == '\v'; }

bool is_utf16(std::string_view bytes) {
  if (bytes.starts_with("\xff\xfe") || bytes.starts_with("\xfe\xff")) return true;
  // There is no byte order mark, but ASCII text in UTF-16 has a NUL in every second byte.
  const std::size_t n = std::min<std::size_t>(bytes.size(), 64) & ~std::size_t{1};
  std::size_t zeros[2] = {0, 0};
  for (std::size_t i = 0; i < n; ++i)
    if (bytes[i] == '\0') ++zeros[i % 2];
  return n >= 8 && (zeros[0] > n / 3 || zeros[1] > n / 3) && (zeros[0] == 0 || zeros[1] == 0);
}

/// Guesses the format of a file that is no OBJ from its first bytes; null if unknown.
const char* guess_format(std::string_view bytes) {
  if (bytes.starts_with("ply\n") || bytes.starts_with("ply\r")) return "a PLY file";
  if (bytes.starts_with("solid ")) return "an STL file";
  if (bytes.starts_with("glTF")) return "a binary glTF file";
  if (bytes.starts_with("OFF\n") || bytes.starts_with("OFF\r")) return "an OFF file";
  if (bytes.starts_with("; FBX") || bytes.starts_with("Kaydara FBX")) return "an FBX file";
  if (bytes.starts_with("BLENDER")) return "a Blender file";
  if (bytes.starts_with("PK\x03\x04")) return "a ZIP archive";
  if (bytes.starts_with("\x1f\x8b")) return "a gzip archive";
  if (bytes.starts_with("\x89PNG")) return "a PNG image";
  if (bytes.starts_with("<?xml") || bytes.starts_with("<!DOCTYPE") || bytes.starts_with("<html"))
    return "an XML or HTML file";
  return nullptr;
}

/// Tests whether a number that is out of range for a double is too small. std::from_chars reports
/// overflow and underflow alike, so the text decides.
bool underflows(std::string_view word) {
  const std::size_t e = word.find_first_of("eE");
  if (e != std::string_view::npos) return e + 1 < word.size() && word[e + 1] == '-';
  const std::size_t digit = word.find_first_of("123456789");
  const std::size_t dot = word.find('.');
  return dot != std::string_view::npos && dot < digit;
}

/// Returns the reason why a word is no number, with what to do.
const char* describe_problem(std::string_view word) {
  std::string lower(word);
  for (char& c : lower) c = static_cast<char>(c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c);
  if (lower.find("nan") != std::string::npos || lower.find("inf") != std::string::npos ||
      lower.find('#') != std::string::npos)
    return "is not a finite number - repair the model in the program that wrote it";
  if (lower.find(',') != std::string::npos)
    return "has a decimal comma - export the file with decimal points";
  return "is not a number";
}

}  // namespace

Result<std::string_view> check_text(std::string_view bytes, const std::string& file) {
  if (is_utf16(bytes))
    return make_error(ErrorCode::kInput,
                      "{}: is not plain text but UTF-16 - save it as UTF-8 or ASCII", file);
  if (const char* format = guess_format(bytes))
    return make_error(ErrorCode::kInput, "{}: is {}, not an OBJ or MTL - convert it", file, format);
  if (bytes.starts_with("\xef\xbb\xbf")) bytes.remove_prefix(3);
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    const auto c = static_cast<unsigned char>(bytes[i]);
    // 0x1a is the end-of-file mark of DOS programs.
    if (c >= 0x20 || (c >= '\t' && c <= '\r') || (c == 0x1a && i + 1 == bytes.size())) continue;
    return make_error(ErrorCode::kInput,
                      "{}: is not text (byte 0x{:02x} at offset {}) - is this an OBJ?", file,
                      static_cast<unsigned>(c), i);
  }
  if (bytes.ends_with('\x1a')) bytes.remove_suffix(1);
  return bytes;
}

std::string_view LineReader::physical_line() {
  const std::size_t end = remaining_.find_first_of("\r\n");
  std::string_view line = remaining_.substr(0, end);
  if (end == std::string_view::npos) {
    remaining_ = {};
  } else {
    const bool crlf =
        remaining_[end] == '\r' && end + 1 < remaining_.size() && remaining_[end + 1] == '\n';
    remaining_.remove_prefix(end + (crlf ? 2 : 1));
  }
  ++lines_read_;
  return line;
}

bool LineReader::next() {
  if (remaining_.empty()) return false;
  line_ = trim(physical_line());
  number_ = lines_read_;
  if (!line_.ends_with('\\') || line_.starts_with('#')) return true;
  joined_.clear();
  while (true) {
    const bool is_continued = line_.ends_with('\\');
    if (is_continued) line_.remove_suffix(1);
    joined_ += line_;
    if (!is_continued || remaining_.empty()) break;
    joined_ += ' ';
    line_ = trim(physical_line());
  }
  line_ = trim(joined_);
  return true;
}

std::string_view trim(std::string_view text) {
  while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_blank(text.back())) text.remove_suffix(1);
  return text;
}

std::string_view take_word(std::string_view& line) {
  std::size_t begin = 0;
  while (begin < line.size() && is_blank(line[begin])) ++begin;
  std::size_t end = begin;
  while (end < line.size() && !is_blank(line[end])) ++end;
  const std::string_view word = line.substr(begin, end - begin);
  line.remove_prefix(end);
  return word;
}

ParsedReal parse_real(std::string_view word) {
  if (word.empty()) return {0, "is missing"};
  std::string_view digits = word;
  if (digits.front() == '+') digits.remove_prefix(1);
  double value = 0;
  const char* end = digits.data() + digits.size();
  const auto [stop, error] = std::from_chars(digits.data(), end, value);
  if (error == std::errc::result_out_of_range && stop == end) {
    if (underflows(digits)) return {0, nullptr};
    return {0, "is too large (beyond 1e15) - scale the model down"};
  }
  if (error != std::errc{} || stop != end || !std::isfinite(value) || word.starts_with("+-"))
    return {0, describe_problem(word)};
  if (std::abs(value) > kMaxCoordinate)
    return {0, "is too large (beyond 1e15) - scale the model down"};
  // This also turns -0 into 0: points are welded by their exact bits.
  if (std::abs(value) < static_cast<double>(std::numeric_limits<float>::min())) value = 0;
  return {static_cast<float>(value), nullptr};
}

void ErrorList::add(std::uint32_t line, const std::string& text) {
  if (!full()) items_.push_back({line, text});
}

Error ErrorList::error() const {
  std::vector<Item> sorted = items_;
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const Item& a, const Item& b) { return a.line < b.line; });
  std::string message;
  for (const Item& item : sorted) {
    if (!message.empty()) message += '\n';
    message += fmt::format("{}:{}: {}", file_, item.line, item.text);
  }
  if (full()) message += fmt::format("\n{}: stopped after {} errors", file_, kLimit);
  return {ErrorCode::kInput, message};
}

}  // namespace polymorph
