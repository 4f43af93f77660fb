// PNG decoder on libpng. Textures and golden frames are often PNGs, and opening OpenImageIO's
// libraries takes 0.3 s.
#pragma once

#include <memory>
#include <string>

#include "image/oiio_module.h"

namespace polymorph {

/// A decoded image in the format of the OpenImageIO module, with the function that frees it.
using DecodedImage = std::unique_ptr<PmOiioImage, PmOiioFreeFunction*>;

/// Decodes a PNG of any kind: grey, palette or colours, 1 to 16 bits, with or without alpha,
/// interlaced or not. Text chunks become attributes. Never null; see PmOiioImage::failure.
/// `max_bytes` is as in PmOiioRequest. `bytes` must have passed sniff_image_format().
DecodedImage decode_png(const std::string& bytes, std::uint64_t max_bytes);

}  // namespace polymorph
