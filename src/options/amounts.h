// Amounts with units on the command line: sizes and ages.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "base/result.h"
#include "base/text.h"

namespace polymorph {

/// Units: the letter after an amount, in lower case, and its factor. An amount without a letter has
/// the first unit.
using AmountUnits = std::vector<std::pair<char, double>>;

/// Parses a number of at least 0 followed by one of the units, in upper or lower case, and returns
/// it times the unit's factor. If 'b' is one of the units, KB and KiB mean K (likewise for the
/// other units). Errors: kUsage, also for amounts above 1e18; the message names `option` and shows
/// `example`.
Result<double> parse_amount(const std::string& option, const std::string& text,
                            const AmountUnits& units, const std::string& example);

/// Replaces a size such as "1.5G" by its number of bytes (K, M, G and T are powers of 1024).
/// Returns an error message, or "" on success, as CLI11's validators do.
std::string parse_size(std::string& text);

}  // namespace polymorph
