// Textures for tests, in both forms.
#pragma once

#include <gtest/gtest.h>

#include <memory>

#include "image/image_io.h"
#include "image/texture.h"

namespace polymorph {

/// Returns a texture whose pixels are floats.
inline std::shared_ptr<const Texture> float_texture(Image image) {
  Texture texture;
  texture.image = std::move(image);
  return std::make_shared<const Texture>(std::move(texture));
}

/// Returns the texture that a PNG of 8 bits of the image gives, whose pixels are codes.
inline std::shared_ptr<const Texture> coded_texture(const Image& image) {
  const auto png = encode_png(image);
  EXPECT_TRUE(png) << png.error().message;
  auto texture = decode_texture(*png, "texture.png");
  EXPECT_TRUE(texture && texture->codes);
  return std::make_shared<const Texture>(*std::move(texture));
}

}  // namespace polymorph
