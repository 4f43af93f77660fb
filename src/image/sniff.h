// Image format detection from a file's bytes.
#pragma once

#include <string>
#include <string_view>

#include "base/result.h"

namespace polymorph {

/// Detects the format of an image from its content and returns OpenImageIO's name of the reader; no
/// other reader is tried. Targa files have no magic number: unknown data are taken for a Targa if
/// the header is plausible. If it is not, but the name ends in .tga or the data end in Targa's
/// footer, the Targa is reported as damaged. Also checks for damage that readers ignore, report on
/// standard error or crash on: PNG chunk lengths and checksums, sizes in EXR headers, and the ends
/// of JPEG, TIFF, BMP, Targa, GIF and JPEG 2000. Errors (kInput): a reason without a file name.
Result<std::string> sniff_image_format(std::string_view bytes, std::string_view name = {});

}  // namespace polymorph
