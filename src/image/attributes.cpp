#include "image/attributes.h"

#include <variant>

#include "base/result.h"

namespace polymorph {

std::string find_text(const Image& image, std::string_view name) {
  for (const Attribute& attribute : image.attributes)
    if (const auto* text = std::get_if<std::string>(&attribute.value);
        text && attribute.name == name)
      return *text;
  return "";
}

std::optional<std::string> format_entry(const Image& image, std::string_view name) {
  for (const Attribute& attribute : image.attributes)
    if (attribute.name == name)
      return std::visit([](const auto& v) { return fmt::format("{}", v); }, attribute.value);
  return std::nullopt;
}

}  // namespace polymorph
