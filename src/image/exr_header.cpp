#include "image/exr_header.h"

#include <bit>
#include <cstdint>
#include <fstream>
#include <string>

#include "image/byte_order.h"

namespace polymorph {
namespace {

using namespace std::string_view_literals;

constexpr std::string_view kSignature = "\x76\x2f\x31\x01"sv;
constexpr std::size_t kMaxHeader = std::size_t{64} << 20;  // bytes

/// Tests whether an encoder writes this entry itself.
bool is_encoders_own(std::string_view name) {
  return name == "pixelAspectRatio" || name == "screenWindowWidth" || name == "type";
}

/// Parses the entries of a header; nullopt if the header does not end within `bytes`.
std::optional<std::vector<Attribute>> parse_header(std::string_view bytes) {
  std::vector<Attribute> attributes;
  std::size_t at = kExrHeaderBegin;
  while (const auto entry = take_exr_entry(bytes, at)) {
    if (entry->name.empty()) return attributes;
    const std::string name(entry->name);
    const std::string_view type = entry->type, value = bytes.substr(entry->begin, entry->size);
    const auto number = static_cast<std::uint32_t>(read_little_endian(value, 0, 4));
    if (is_encoders_own(name)) continue;
    if (type == "string") attributes.push_back({name, std::string(value)});
    if (type == "int" && value.size() == 4) attributes.push_back({name, static_cast<int>(number)});
    if (type == "float" && value.size() == 4)
      attributes.push_back({name, std::bit_cast<float>(number)});
  }
  return {};
}

}  // namespace

std::optional<ExrEntry> take_exr_entry(std::string_view bytes, std::size_t& at) {
  const std::size_t name_end = bytes.find('\0', at);
  if (name_end == std::string_view::npos) return std::nullopt;
  ExrEntry entry{bytes.substr(at, name_end - at), /*type=*/{}, name_end + 1, /*size=*/0};
  // The type ends in a zero byte; 4 bytes of size follow, then the value.
  if (!entry.name.empty()) {
    const std::size_t type_end = bytes.find('\0', name_end + 1);
    if (type_end == std::string_view::npos || bytes.size() - type_end < 5) return std::nullopt;
    entry.type = bytes.substr(name_end + 1, type_end - name_end - 1);
    entry.begin = type_end + 5;
    entry.size = read_little_endian(bytes, type_end + 1, 4);
    if (entry.size > bytes.size() - entry.begin) return std::nullopt;
  }
  at = entry.begin + entry.size;
  return entry;
}

Result<std::vector<Attribute>> read_exr_attributes(const std::filesystem::path& path) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error))
    return make_error(ErrorCode::kInput, "{}: is no file", path.string());
  std::ifstream file(path, std::ios::binary);
  std::string bytes;
  // Read a growing beginning of the file until it contains the whole header.
  for (std::size_t size = std::size_t{1} << 14; size <= kMaxHeader; size *= 4) {
    const std::size_t old_size = bytes.size();
    bytes.resize(size);
    file.read(bytes.data() + old_size, static_cast<std::streamsize>(size - old_size));
    bytes.resize(old_size + static_cast<std::size_t>(file.gcount()));
    if (!std::string_view(bytes).starts_with(kSignature)) {
      if (file.bad() || !file.is_open())
        return make_error(ErrorCode::kInput, "{}: cannot read it", path.string());
      return std::vector<Attribute>{};
    }
    if (auto attributes = parse_header(bytes)) return std::move(*attributes);
    if (!file) break;  // the end of the file
  }
  return make_error(ErrorCode::kInput, "{}: its header is cut off or too large", path.string());
}

}  // namespace polymorph
