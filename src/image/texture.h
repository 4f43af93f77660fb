// Texture lookup: bilinear, repeating, v up as in OBJ.
#pragma once

#include <cmath>
#include <cstddef>

#include "image/image.h"
#include "kernels/types.h"

namespace polymorph {

/// View of an image's pixels, in the memory of the CPU or of a GPU. It does not own them.
struct TextureView {
  int width = 0, height = 0;
  std::size_t channels = 0;
  const float* pixels = nullptr;
};

/// Indices, along one axis, of the two texels around a texture coordinate; weight of the second.
struct TextureTaps {
  std::size_t first, second;
  float fraction;
};
/// Finds the texels for the coordinate `t` of an axis with `size` texels. `t` repeats with
/// period 1.
PM_HD inline TextureTaps texture_taps(float t, int size) {
  const float n = static_cast<float>(size);
  const float position = std::isfinite(t) ? (t - std::floor(t)) * n - 0.5f : 0.0f;
  const float lower = std::floor(position);
  const int first = static_cast<int>(lower);
  // `first` is in [-1, size]. Conditions wrap it, because integer divisions took half of the time
  // of a lookup.
  const int wrapped_first = first < 0 ? size - 1 : first < size ? first : 0;
  const int second = wrapped_first + 1 < size ? wrapped_first + 1 : 0;
  return {static_cast<std::size_t>(wrapped_first), static_cast<std::size_t>(second),
          position - lower};
}

/// Samples R, G, B at `uv`; an image with fewer than three channels counts as grey. White for an
/// empty image.
PM_HD inline Vec3 sample_texture(const TextureView& image, Vec2 uv) {
  const std::size_t channels = image.channels;
  if (image.width < 1 || image.height < 1 || channels < 1) return {1, 1, 1};
  const TextureTaps x = texture_taps(uv.x, image.width), y = texture_taps(1 - uv.y, image.height);
  const std::size_t green = channels >= 3 ? 1 : 0, blue = channels >= 3 ? 2 : 0;
  const auto texel = [&](std::size_t column, std::size_t row) {
    const float* p =
        &image.pixels[(row * static_cast<std::size_t>(image.width) + column) * channels];
    return Vec3{p[0], p[green], p[blue]};
  };
  return lerp(lerp(texel(x.first, y.first), texel(x.second, y.first), x.fraction),
              lerp(texel(x.first, y.second), texel(x.second, y.second), x.fraction), y.fraction);
}

Vec3 sample_texture(const Image& image, Vec2 uv);

}  // namespace polymorph
