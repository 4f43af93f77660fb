#include "image/texture.h"

namespace polymorph {

Vec3 sample_texture(const Image& image, Vec2 uv) {
  return sample_texture(
      TextureView{image.width, image.height, image.channel_count(), image.pixels.data()}, uv);
}

}  // namespace polymorph
