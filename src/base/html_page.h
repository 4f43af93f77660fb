// Self-contained HTML pages: a template with marks, data inside a script element, bytes as base64.
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace polymorph {

std::string base64(std::string_view bytes);

/// JSON may stand inside a script element when no "<" can end it.
std::string json_in_script(std::string_view json);

/// `page` with each mark, "{{name}}", replaced by its value. A "{{" that is no known mark is a bug.
std::string fill_page(std::string_view page,
                      const std::vector<std::pair<std::string_view, std::string>>& values);

}  // namespace polymorph
