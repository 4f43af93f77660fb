#include "image/exr_header.h"

#include <bit>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <optional>
#include <string>
#include <string_view>

namespace polymorph {
namespace {

using namespace std::string_view_literals;

constexpr std::string_view kSignature = "\x76\x2f\x31\x01"sv;
constexpr std::size_t kHeaderBegin = 8;                    // after signature and version
constexpr std::size_t kMaxHeader = std::size_t{64} << 20;  // bytes

std::uint32_t read_uint32(std::string_view bytes) {
  std::uint32_t number = 0;
  std::memcpy(&number, bytes.data(), sizeof number);  // the file and this machine are little-endian
  return number;
}

/// Tests whether an encoder writes this entry itself.
bool is_encoders_own(std::string_view name) {
  return name == "pixelAspectRatio" || name == "screenWindowWidth";
}

/// Parses the entries of a header (name, type, size, value); nullopt if the header does not end
/// within `bytes`.
std::optional<std::vector<Attribute>> parse_header(std::string_view bytes) {
  std::vector<Attribute> attributes;
  for (std::size_t at = kHeaderBegin; at < bytes.size();) {
    const std::size_t name_end = bytes.find('\0', at);
    if (name_end == at) return attributes;  // an empty name ends the header
    if (name_end == std::string_view::npos) return {};
    const std::size_t type_end = bytes.find('\0', name_end + 1);
    if (type_end == std::string_view::npos || bytes.size() - type_end < 5) return {};
    const std::string_view type = bytes.substr(name_end + 1, type_end - name_end - 1);
    const std::size_t begin = type_end + 5, size = read_uint32(bytes.substr(type_end + 1, 4));
    if (size > bytes.size() - begin) return {};
    const std::string_view value = bytes.substr(begin, size);
    const std::string name(bytes.substr(at, name_end - at));
    at = begin + size;
    if (is_encoders_own(name)) continue;
    if (type == "string") attributes.push_back({name, std::string(value)});
    if (type == "int" && size == 4)
      attributes.push_back({name, static_cast<int>(read_uint32(value))});
    if (type == "float" && size == 4)
      attributes.push_back({name, std::bit_cast<float>(read_uint32(value))});
  }
  return {};
}

}  // namespace

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
