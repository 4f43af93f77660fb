// Image format detection from a file's bytes.
#pragma once

#include <string>
#include <string_view>

#include "base/result.h"

namespace polymorph {

/// OpenImageIO's name of the reader for these bytes; no other reader is ever given
/// a file. The content decides. Targa files need not say what they are: a name that ends in
/// .tga is believed, and what has no known beginning is tried as one, if its header makes sense.
/// Checks as well what the readers let pass, print about or stumble over: PNG chunk lengths and
/// checksums, the sizes in EXR headers, the ends of JPEG, TIFF, BMP and Targa, and the size that
/// GIF and JPEG 2000 make room for while the file is opened. Errors (kInput): a reason without a
/// file name.
Result<std::string> sniff_image_format(std::string_view bytes, std::string_view name = {},
                                       std::size_t max_bytes = std::size_t{1} << 30);

}  // namespace polymorph
