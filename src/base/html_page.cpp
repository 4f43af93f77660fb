#include "base/html_page.h"

#include <algorithm>

#include "base/result.h"

namespace polymorph {

std::string base64(std::string_view bytes) {
  constexpr const char* kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const auto byte_at = [&](std::size_t k) {
      return k < bytes.size() ? static_cast<unsigned char>(bytes[k]) : 0u;
    };
    const unsigned value = byte_at(i) << 16 | byte_at(i + 1) << 8 | byte_at(i + 2);
    // 1, 2 or 3 bytes give 2, 3 or 4 digits; '=' fills the group of four.
    for (unsigned digit = 0; digit < 4; ++digit)
      text += i + digit <= bytes.size() ? kDigits[value >> (18 - 6 * digit) & 63] : '=';
  }
  return text;
}

std::string json_in_script(std::string_view json) {
  std::string result;
  for (const char c : json) {
    if (c == '<')
      result += "\\u003c";
    else
      result += c;
  }
  return result;
}

std::string fill_page(std::string_view page,
                      const std::vector<std::pair<std::string_view, std::string>>& values) {
  std::string result;
  while (!page.empty()) {
    const auto mark = page.find("{{");
    result += page.substr(0, mark);
    if (mark == std::string_view::npos) break;
    page.remove_prefix(mark);
    const auto entry = std::find_if(values.begin(), values.end(),
                                    [&](const auto& v) { return page.starts_with(v.first); });
    PM_CHECK(entry != values.end());
    result += entry->second;
    page.remove_prefix(entry->first.size());
  }
  return result;
}

}  // namespace polymorph
