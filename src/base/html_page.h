// Helpers for self-contained HTML pages: templates with placeholders, data in script elements,
// base64.
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace polymorph {

/// Encodes bytes as base64 with padding (RFC 4648).
std::string base64(std::string_view bytes);

/// Escapes "<" in JSON, so that the JSON cannot end the script element that contains it.
std::string json_in_script(std::string_view json);

/// Replaces each placeholder, "{{name}}", in `page` by its value. `values` are pairs of a
/// placeholder, with its braces, and its value. An unknown placeholder is a bug.
std::string fill_page(std::string_view page,
                      const std::vector<std::pair<std::string_view, std::string>>& values);

}  // namespace polymorph
