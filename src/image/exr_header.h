// Header of an OpenEXR file, read without its pixels.
#pragma once

#include <filesystem>
#include <vector>

#include "base/result.h"
#include "image/image.h"

namespace polymorph {

/// Reads the string, int and float entries of the (first) header, with the names and values of the
/// file, except those that the encoder itself writes. A file that is not OpenEXR has none. Errors
/// (kInput): the file cannot be read, or its header is cut off or larger than 64 MB.
Result<std::vector<Attribute>> read_exr_attributes(const std::filesystem::path& path);

}  // namespace polymorph
