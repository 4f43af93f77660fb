// TIFF validation: finds truncated files, whose missing strips libtiff would read as black.
#pragma once

#include <string_view>

#include "base/result.h"

namespace polymorph {

/// Fails (kInput, a reason without a file name) when the first directory of a TIFF or BigTIFF, one
/// of its entries, or one of its strips or tiles reaches beyond the file's end. `bytes` begins with
/// a TIFF's magic.
Status check_tiff(std::string_view bytes);

/// Size in pixels of the first image of a TIFF or BigTIFF, or of its tiles if they are larger. A
/// width or height that the directory does not state is 0.
struct TiffSize {
  double width = 0, height = 0, channels = 1;
};
/// Reads the size from the first directory of a file with a TIFF's magic.
TiffSize tiff_size(std::string_view bytes);

}  // namespace polymorph
