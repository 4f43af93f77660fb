#include "model/assimp/guard_ply.h"

#include <sstream>

#include "base/text.h"

namespace {

/// Size in bytes of a PLY type; 0 for unknown types.
std::size_t size_of(std::string_view type) {
  if (type == "char" || type == "uchar" || type == "int8" || type == "uint8") return 1;
  if (type == "short" || type == "ushort" || type == "int16" || type == "uint16") return 2;
  if (type == "int" || type == "uint" || type == "int32" || type == "uint32" || type == "float" ||
      type == "float32")
    return 4;
  return type == "double" || type == "float64" ? 8 : 0;
}

/// The first element of a PLY file.
struct FirstElement {
  std::size_t count = 0, stride = 0;  ///< number of items, and bytes of each
  std::size_t properties_offset = 0;  ///< offset of its first property in the header
};

/// Finds the first element; nothing if the file is not binary, or the element has a list or an
/// unknown type.
std::optional<FirstElement> find_first_element(const std::string& header) {
  std::istringstream lines(header);
  std::string line;
  FirstElement element;
  bool is_binary = false;
  while (std::getline(lines, line)) {
    std::istringstream words(line);
    // format ENCODING VERSION, element NAME COUNT, or property TYPE NAME.
    std::string keyword, second, third;
    words >> keyword >> second >> third;
    if (keyword == "format") is_binary = second.starts_with("binary_");
    if (keyword == "element" && element.properties_offset > 0) break;
    if (keyword == "element") {
      const auto count = polymorph::parse_integer(third);
      if (!count || *count < 0) return std::nullopt;
      element.count = static_cast<std::size_t>(*count);
      element.properties_offset = static_cast<std::size_t>(lines.tellg());
    }
    if (keyword != "property" || element.properties_offset == 0) continue;
    if (size_of(second) == 0) return std::nullopt;
    element.stride += size_of(second);
  }
  return is_binary && element.stride > 0 ? std::optional(element) : std::nullopt;
}

}  // namespace

std::optional<std::size_t> find_line_feed_data(std::string_view bytes) {
  constexpr std::string_view kEnd = "\nend_header";
  const std::size_t end = bytes.starts_with("ply") ? bytes.find(kEnd) : std::string_view::npos;
  if (end == std::string_view::npos) return std::nullopt;
  const std::size_t line_end = bytes.find('\n', end + kEnd.size());
  if (line_end == std::string_view::npos || line_end + 1 >= bytes.size()) return std::nullopt;
  return bytes[line_end + 1] == '\n' ? std::optional(line_end + 1) : std::nullopt;
}

std::string guard_ply(std::string file) {
  const std::string_view bytes = file;
  const auto data_offset = find_line_feed_data(bytes);
  if (!data_offset) return file;
  std::size_t offset = *data_offset;
  const auto element = find_first_element(file.substr(0, offset));
  if (!element || element->count > (bytes.size() - offset) / element->stride) return file;
  std::string copy(bytes.substr(0, element->properties_offset));
  copy.reserve(bytes.size() + element->count + 64);  // 64: more than the property's line
  copy += "property uchar guard\n";
  copy += bytes.substr(element->properties_offset, offset - element->properties_offset);
  for (std::size_t i = 0; i < element->count; ++i, offset += element->stride) {
    copy += '\1';  // any value but a line feed
    copy += bytes.substr(offset, element->stride);
  }
  return copy += bytes.substr(offset);
}
