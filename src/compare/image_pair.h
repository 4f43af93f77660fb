// Pairs of images whose channels are read by name.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <initializer_list>
#include <string>

#include "image/image.h"
#include "kernels/types.h"

namespace polymorph {

/// An image and its reference, which must outlive the pair. Pixels are numbered row by row. A
/// missing channel has the value 0. All but comparable() expect images that are comparable.
class ImagePair {
 public:
  ImagePair(const Image& actual, const Image& reference) : a_(actual), b_(reference) {}

  /// Tests for equal sizes, equal sets of channels and finite values.
  bool comparable() const {
    if (a_.width != b_.width || a_.height != b_.height || a_.channel_count() != b_.channel_count())
      return false;
    for (const std::string& name : b_.channels)
      if (a_.find_channel(name) < 0) return false;
    const auto finite = [](const Image& image) {
      return std::all_of(image.pixels.begin(), image.pixels.end(),
                         [](float v) { return std::isfinite(v); });
    };
    return finite(a_) && finite(b_);
  }
  /// Tests for a channel of this name.
  bool has(const char* channel) const { return b_.find_channel(channel) >= 0; }
  int pixels() const { return b_.width * b_.height; }
  int width() const { return b_.width; }
  int height() const { return b_.height; }
  float actual(int pixel, const char* channel) const { return value(a_, pixel, channel); }
  float reference(int pixel, const char* channel) const { return value(b_, pixel, channel); }
  /// Tests for equal values; a missing channel counts as equal.
  bool equal(int pixel, const char* channel) const {
    return !has(channel) || actual(pixel, channel) == reference(pixel, channel);
  }
  bool equal(int pixel, std::initializer_list<const char*> channels) const {
    return std::all_of(channels.begin(), channels.end(),
                       [&](const char* c) { return equal(pixel, c); });
  }
  /// Tests all pixels.
  bool equal(std::initializer_list<const char*> channels) const {
    for (int i = 0; i < pixels(); ++i)
      if (!equal(i, channels)) return false;
    return true;
  }
  /// Returns the channels PREFIX + R, G, B of the actual image or of the reference.
  Vec3 color(bool of_actual, int pixel, const char* prefix) const {
    const std::string p(prefix);
    const Image& image = of_actual ? a_ : b_;
    return {value(image, pixel, (p + "R").c_str()), value(image, pixel, (p + "G").c_str()),
            value(image, pixel, (p + "B").c_str())};
  }
  const Image& actual_image() const { return a_; }
  const Image& reference_image() const { return b_; }

 private:
  static float value(const Image& image, int pixel, const char* channel) {
    const int c = image.find_channel(channel);
    return c < 0 ? 0
                 : image.pixels[static_cast<std::size_t>(pixel) * image.channel_count() +
                                static_cast<std::size_t>(c)];
  }
  const Image& a_;
  const Image& b_;
};

}  // namespace polymorph
