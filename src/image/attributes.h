// Lookup of an image's header entries by name.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "image/image.h"

namespace polymorph {

/// Returns the text of the entry called `name`; "" if there is no such entry or its value is a
/// number.
std::string find_text(const Image& image, std::string_view name);

/// Formats the value of the entry called `name` as encode_png() writes it; nullopt if there is no
/// such entry.
std::optional<std::string> format_entry(const Image& image, std::string_view name);

}  // namespace polymorph
