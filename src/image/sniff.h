// What an image file is, told from its bytes.
#pragma once

#include <string>
#include <string_view>

#include "base/result.h"

namespace polymorph {

/// OpenImageIO's name of the reader for these bytes: "png", "jpeg", "tiff" or "openexr"; no other
/// reader is ever let near a file. Checks as well what the readers let pass or print about: PNG
/// chunk lengths and checksums, the sizes in EXR headers, the ends of JPEG and TIFF. Errors
/// (kInput): a reason without a file name.
Result<std::string> sniff_image_format(std::string_view bytes);

}  // namespace polymorph
