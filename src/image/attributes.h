// Entries of an image's header by their names.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "image/image.h"

namespace polymorph {

/// Returns the text of the entry; "" if there is none, or it is a number.
std::string find_text(const Image& image, std::string_view name);

/// Writes the value of the entry as text, as PNG keeps numbers, too; nothing if there is none.
std::optional<std::string> format_entry(const Image& image, std::string_view name);

}  // namespace polymorph
