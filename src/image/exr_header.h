// Header of an OpenEXR file, read without its pixels.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "image/image.h"

namespace polymorph {

/// An entry of a header; its name is empty at the end of a part's header.
struct ExrEntry {
  std::string_view name, type;
  std::size_t begin = 0, size = 0;  ///< offset and size of the value in the file, in bytes
};

/// Offset of the first entry, behind signature and version.
inline constexpr std::size_t kExrHeaderBegin = 8;

/// Reads the entry at the offset `at` and sets `at` to its end; nullopt if it ends beyond `bytes`.
/// An entry consists of name, type, size and value (OpenEXR file layout).
std::optional<ExrEntry> take_exr_entry(std::string_view bytes, std::size_t& at);

/// Reads the string, int and float entries of the (first) header, with the names and values of the
/// file, except those that the encoder itself writes. A file that is not OpenEXR has none. Errors
/// (kInput): the file cannot be read, or its header is cut off or larger than 64 MB.
Result<std::vector<Attribute>> read_exr_attributes(const std::filesystem::path& path);

}  // namespace polymorph
