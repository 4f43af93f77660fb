// Image format detection from a file's bytes.
#pragma once

#include <string>
#include <string_view>

#include "base/result.h"

namespace polymorph {

/// Detects the format of an image from its content and returns OpenImageIO's name of the reader; no
/// other reader is tried. Targa files have no magic number: a name that ends in .tga is believed,
/// and unknown data are tried as a Targa if the header is plausible. Also checks for damage that
/// readers ignore, report on standard error or crash on: PNG chunk lengths and checksums, sizes in
/// EXR headers, and the ends of JPEG, TIFF, BMP, Targa, GIF and JPEG 2000. Errors (kInput): a
/// reason without a file name.
Result<std::string> sniff_image_format(std::string_view bytes, std::string_view name = {});

}  // namespace polymorph
