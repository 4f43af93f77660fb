#include "image/texture.h"

#include "base/parallel.h"

namespace polymorph {

namespace {

/// Writes row `y` of a texture with codes as floats, with the channels of `texture.image`.
void expand_row(const Texture& texture, std::size_t y, float* to) {
  const auto width = static_cast<std::size_t>(texture.image.width);
  const std::size_t in_count = texture.code_channels, out_count = texture.image.channel_count();
  const TextureView view = texture.view();
  for (std::size_t x = 0; x < width; ++x, to += out_count) {
    const Vec3 color = view.texel(x, y);
    to[0] = color.x, to[1] = color.y, to[2] = color.z;
    if (out_count > 3)
      to[3] = static_cast<float>(texture.codes[(y * width + x) * in_count + in_count - 1]) / 255.0f;
  }
}

}  // namespace

Image texture_image(const Texture& texture) {
  Image image = texture.image;
  if (!texture.codes) return image;
  const std::size_t row_size = static_cast<std::size_t>(image.width) * image.channel_count();
  image.pixels.resize(row_size * static_cast<std::size_t>(image.height));
  parallel_for(
      image.height,
      [&](std::int64_t y) {
        const auto row = static_cast<std::size_t>(y);
        expand_row(texture, row, &image.pixels[row * row_size]);
      },
      /*grain=*/16);
  return image;
}

}  // namespace polymorph
