// Texture type and lookup: bilinear, repeating, v up as in OBJ.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>

#include "image/image.h"
#include "kernels/types.h"

namespace polymorph {

/// View of a texture's pixels, in the memory of the CPU or of a GPU. It does not own them. Their
/// samples are floats or, if `codes` is not null, 8-bit codes, of which `code_values` has the 256
/// values.
struct TextureView {
  int width = 0, height = 0;
  std::size_t channels = 0;  ///< samples per pixel; fewer than three count as grey
  const float* pixels = nullptr;
  const std::uint8_t* codes = nullptr;
  const float* code_values = nullptr;

  PM_HD bool empty() const { return width < 1 || height < 1 || channels < 1; }
  /// Returns R, G, B of a pixel. Inlined, because calls took as long as all else in a lookup of
  /// materials.
  PM_HD [[gnu::always_inline]] Vec3 texel(std::size_t column, std::size_t row) const {
    const std::size_t red = (row * static_cast<std::size_t>(width) + column) * channels,
                      green = channels >= 3 ? red + 1 : red, blue = channels >= 3 ? red + 2 : red;
    if (codes)
      return {code_values[codes[red]], code_values[codes[green]], code_values[codes[blue]]};
    return {pixels[red], pixels[green], pixels[blue]};
  }
};

/// Texture in memory. A texture of 8 bits keeps the codes of its file, which take a quarter of the
/// memory of floats.
struct Texture {
  /// Scene-linear R, G, B and further channels. Without pixels if there are codes.
  Image image;
  /// Codes [(y * width + x) * code_channels + channel]; null if `image` has the pixels.
  std::shared_ptr<const std::uint8_t[]> codes;
  std::size_t code_channels = 0;            ///< 1: grey, 2: grey and A, 3: R, G, B, 4: R, G, B, A
  std::array<float, 256> code_values = {};  ///< scene-linear value of each code of a colour

  TextureView view() const {
    return {image.width,         image.height, codes ? code_channels : image.channel_count(),
            image.pixels.data(), codes.get(),  code_values.data()};
  }
  /// Counts the codes; 0 if there are none.
  std::size_t code_count() const {
    return static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height) *
           code_channels;
  }
};

/// Computes the bytes that a texture's pixels occupy.
inline std::size_t pixel_bytes(const Texture& texture) {
  return texture.codes ? texture.code_count() : texture.image.pixels.size() * sizeof(float);
}

/// Returns the texture with its pixels as floats.
Image texture_image(const Texture& texture);

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

/// Samples R, G, B at `uv`; white for an empty texture.
PM_HD inline Vec3 sample_texture(const TextureView& texture, Vec2 uv) {
  if (texture.empty()) return {1, 1, 1};
  const TextureTaps x = texture_taps(uv.x, texture.width),
                    y = texture_taps(1 - uv.y, texture.height);
  return lerp(lerp(texture.texel(x.first, y.first), texture.texel(x.second, y.first), x.fraction),
              lerp(texture.texel(x.first, y.second), texture.texel(x.second, y.second), x.fraction),
              y.fraction);
}
inline Vec3 sample_texture(const Texture& texture, Vec2 uv) {
  return sample_texture(texture.view(), uv);
}

}  // namespace polymorph
