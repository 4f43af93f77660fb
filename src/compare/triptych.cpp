#include <algorithm>
#include <cmath>

#include "compare/compare.h"
#include "image/color_space.h"
#include "image/rgb_channels.h"

namespace polymorph {
namespace {

constexpr float kGain = 8;  // factor of the differences

/// An image in Rec. 709 and its channels R, G and B. The first channel stands for missing ones.
struct Colors {
  Image image;
  std::array<int, 3> channel;

  explicit Colors(const Image& original) : image(original), channel(find_rgb(original)) {
    convert_to_rec709(image);
    for (int& c : channel) c = std::max(c, 0);
  }
  /// Tests for a pixel inside the image.
  bool covers(int x, int y) const {
    return x < image.width && y < image.height && !image.channels.empty();
  }
  float at(int x, int y, int c) const { return image.at(x, y, channel[c]); }
};

/// Amplified difference, or 1 (white) where only one image has a pixel or a value is not finite.
float difference_at(const Colors& a, const Colors& b, int x, int y, int c) {
  if (!a.covers(x, y) || !b.covers(x, y)) return a.covers(x, y) == b.covers(x, y) ? 0.0f : 1.0f;
  const float difference = std::abs(a.at(x, y, c) - b.at(x, y, c));
  return std::isfinite(difference) ? kGain * difference : 1.0f;
}

}  // namespace

Image difference_triptych(const Image& actual, const Image& reference) {
  const int width = std::max({actual.width, reference.width, 1});
  const int height = std::max({actual.height, reference.height, 1});
  const Colors a(actual), b(reference);
  Image triptych = make_image(3 * width, height, {"R", "G", "B"});
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      for (int c = 0; c < 3; ++c) {
        if (b.covers(x, y)) triptych.at(x, y, c) = b.at(x, y, c);
        if (a.covers(x, y)) triptych.at(width + x, y, c) = a.at(x, y, c);
        triptych.at(2 * width + x, y, c) = difference_at(a, b, x, y, c);
      }
  return triptych;
}

}  // namespace polymorph
