// Image sizes stated in headers, read before a decoder allocates memory for them.
#pragma once

#include <optional>
#include <string_view>

namespace polymorph {

/// Size in pixels of the largest image or tile for which a header lets a decoder allocate memory.
/// If the header states no number of channels, `channels` is 4.
struct HeaderSize {
  double width = 0, height = 0, channels = 4;
};

/// Reads the size from the first bytes of a file. `format` is a result of sniff_image_format();
/// supported are PNG, JPEG, TIFF, OpenEXR, GIF, WebP and JPEG 2000. If tiles are larger than the
/// image, the size of a tile counts. Returns nullopt for other formats, whose readers allocate
/// nothing on opening, and if the header is cut short or states no size.
std::optional<HeaderSize> header_size(std::string_view bytes, std::string_view format);

}  // namespace polymorph
