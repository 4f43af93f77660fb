#include "image/texture.h"

#include <cmath>

namespace polymorph {
namespace {

/// The two texels around `t` (in repeats) and the weight of the second.
struct Taps {
  std::size_t first, second;
  float fraction;
};
Taps taps(float t, int size) {
  const float n = static_cast<float>(size);
  const float wrapped = std::isfinite(t) ? (t - std::floor(t)) * n - 0.5f : 0.0f;
  const float base = std::floor(wrapped);
  const int first = static_cast<int>(base);
  const int before = (first % size + size) % size;
  return {static_cast<std::size_t>(before), static_cast<std::size_t>((before + 1) % size),
          wrapped - base};
}

}  // namespace

Vec3 sample_texture(const Image& image, Vec2 uv) {
  const std::size_t channels = image.channel_count();
  if (image.width < 1 || image.height < 1 || channels < 1) return {1, 1, 1};
  const Taps x = taps(uv.x, image.width), y = taps(1 - uv.y, image.height);
  const std::size_t green = channels >= 3 ? 1 : 0, blue = channels >= 3 ? 2 : 0;
  const auto texel = [&](std::size_t column, std::size_t row) {
    const float* p =
        &image.pixels[(row * static_cast<std::size_t>(image.width) + column) * channels];
    return Vec3{p[0], p[green], p[blue]};
  };
  return lerp(lerp(texel(x.first, y.first), texel(x.second, y.first), x.fraction),
              lerp(texel(x.first, y.second), texel(x.second, y.second), x.fraction), y.fraction);
}

}  // namespace polymorph
