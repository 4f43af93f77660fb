// Counts with their nouns in messages: "1 frame", "3 frames".
#pragma once

#include <fmt/format.h>

#include <concepts>
#include <string>

namespace polymorph {

/// Joins a count and a noun, which gets an "s" unless the count is 1.
std::string plural(std::integral auto count, const char* noun) {
  return fmt::format("{} {}{}", count, noun, count == 1 ? "" : "s");
}

}  // namespace polymorph
