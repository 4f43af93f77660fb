// Texture lookup: bilinear, repeating, v up as in OBJ.
#pragma once

#include "image/image.h"
#include "kernels/types.h"

namespace polymorph {

/// Samples R, G, B at `uv`; an image with fewer than three channels counts as grey. White for an
/// empty image.
Vec3 sample_texture(const Image& image, Vec2 uv);

}  // namespace polymorph
