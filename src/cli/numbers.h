// Numeric option validators: each option's number must be finite and in its range, otherwise the
// command ends with exit code 2.
#pragma once

#include <CLI/CLI.hpp>
#include <cmath>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "base/result.h"
#include "base/text.h"

namespace polymorph {

/// For Option::transform(): a number from `low` to `high`, written as a decimal ('.' as its point,
/// no hexadecimal, no octal); whole where T is an integer. The option gets the number as read here.
template <class T>
CLI::Validator number_from(T low, std::type_identity_t<T> high) {
  constexpr bool kWhole = std::is_integral_v<T>;
  return CLI::Validator(
      [low, high](std::string& text) -> std::string {
        const auto value = [&] {
          if constexpr (kWhole)
            return parse_integer(text);
          else
            return parse_number(text);
        }();
        if (!value || !(*value >= low && *value <= high))
          return fmt::format("{} is no value for it - write a {}number from {} to {}", text,
                             kWhole ? "whole " : "", low, high);
        text = fmt::format("{}", *value);
        return {};
      },
      std::string());
}

/// What the letter behind an amount multiplies it by; the first is that of an amount without one.
using AmountUnits = std::vector<std::pair<char, double>>;

/// A number of at least 0 with one of the units behind it. A size, which is what has the unit 'b',
/// may say KB or KiB for K. Errors: kUsage, also where the product is above 1e18.
Result<double> parse_amount(const std::string& option, const std::string& text,
                            const AmountUnits& units, const std::string& example);

/// For Option::transform(): bytes, or with K, M, G or T, each 1024 times the one before.
CLI::Validator size_in_bytes();

}  // namespace polymorph
