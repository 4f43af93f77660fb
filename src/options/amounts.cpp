#include "options/amounts.h"

#include <algorithm>
#include <cctype>
#include <cmath>

#include "base/text.h"

namespace polymorph {
namespace {

constexpr double kMaxAmount = 1e18;  // below 2^63, so that it fits an integer

/// Finds the factor of `unit`, the lower-case letters after the digits.
std::optional<double> find_factor(const std::string& unit, const AmountUnits& units) {
  if (unit.empty()) return units.front().second;
  const bool is_size =
      std::any_of(units.begin(), units.end(), [](const auto& u) { return u.first == 'b'; });
  for (const auto& [letter, factor] : units) {
    if (unit[0] != letter) continue;
    const std::string suffix = unit.substr(1);
    if (suffix.empty() || (is_size && letter != 'b' && (suffix == "b" || suffix == "ib")))
      return factor;
  }
  return std::nullopt;
}

}  // namespace

Result<double> parse_amount(const std::string& option, const std::string& text,
                            const AmountUnits& units, const std::string& example) {
  const std::string lowered = lower_case(text);
  std::size_t end = lowered.size();
  while (end > 0 && std::isalpha(static_cast<unsigned char>(lowered[end - 1]))) --end;
  const auto value = parse_number(std::string_view(lowered).substr(0, end));
  const auto factor = find_factor(lowered.substr(end), units);
  if (!value || !factor || *value < 0)
    return make_error(ErrorCode::kUsage, "{} {}: not an amount - write {}", option, text, example);
  if (*value * *factor > kMaxAmount)
    return make_error(ErrorCode::kUsage, "{} {}: too much - write {}", option, text, example);
  return *value * *factor;
}

std::string parse_size(std::string& text) {
  constexpr double kKilo = 1024;
  const auto bytes = parse_amount("", text,
                                  {{'b', 1},
                                   {'k', kKilo},
                                   {'m', kKilo * kKilo},
                                   {'g', kKilo * kKilo * kKilo},
                                   {'t', kKilo * kKilo * kKilo * kKilo}},
                                  "bytes as a number, 500M or 1.5G");
  // The message begins with the space after the option's name, which is empty here.
  if (!bytes) return bytes.error().message.substr(1);
  // Round up: a limit below one byte must not become 0, which means no limit.
  text = fmt::format("{}", static_cast<std::uint64_t>(std::ceil(*bytes)));
  return {};
}

}  // namespace polymorph
