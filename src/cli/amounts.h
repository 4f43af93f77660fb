// Amounts with units on the command line: sizes and ages.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "base/result.h"
#include "base/text.h"

namespace polymorph {

/// Units by the letter behind an amount, with their factors; the first is that of no letter.
using AmountUnits = std::vector<std::pair<char, double>>;

/// A number of at least 0 with one of the units behind it. A size, which is what has the unit 'b',
/// may say KB or KiB for K. Errors: kUsage, also where the product is above 1e18.
Result<double> parse_amount(const std::string& option, const std::string& text,
                            const AmountUnits& units, const std::string& example);

/// Replaces a size, in bytes or with K, M, G or T (each 1024 times the one before), by its bytes.
/// Returns what is wrong with it; empty: nothing.
std::string read_size(std::string& text);

}  // namespace polymorph
