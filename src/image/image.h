// Image type: named float channels, interleaved, row 0 on top, colours scene-linear (Rec. 709
// primaries, D65).
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace polymorph {

/// A header entry of an image file, as in ("polymorph/frame", 17). Entries are written in order, so
/// files are reproducible.
struct Attribute {
  std::string name;
  std::variant<std::string, int, float> value;
};

/// An image in memory.
struct Image {
  int width = 0;
  int height = 0;
  std::vector<std::string>
      channels;               ///< "R","G","B","A" first (alpha premultiplied), then "Z", "N.X", ...
  std::vector<float> pixels;  ///< [(y * width + x) * channels.size() + channel]
  std::vector<Attribute> attributes;

  std::size_t channel_count() const { return channels.size(); }
  /// Index of a channel by name, or -1.
  int find_channel(std::string_view name) const {
    for (std::size_t i = 0; i < channels.size(); ++i)
      if (channels[i] == name) return static_cast<int>(i);
    return -1;
  }
  float& at(int x, int y, int channel) {
    return pixels[(static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                   static_cast<std::size_t>(x)) *
                      channels.size() +
                  static_cast<std::size_t>(channel)];
  }
  float at(int x, int y, int channel) const { return const_cast<Image*>(this)->at(x, y, channel); }
};

/// Makes an image of the given size and channels, all zero.
inline Image make_image(int width, int height, std::vector<std::string> channels) {
  Image image;
  image.width = width;
  image.height = height;
  image.channels = std::move(channels);
  image.pixels.assign(
      static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * image.channels.size(),
      0.0f);
  return image;
}

}  // namespace polymorph
