// Colour quantization (median cut): one palette for many frames, and dithering between the two
// palette colours around a pixel's colour.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace polymorph {

using Rgb8 = std::array<std::uint8_t, 3>;

/// Histogram of colours in cubic cells of 4 x 4 x 4 codes.
class ColorHistogram {
 public:
  ColorHistogram();
  void add(const std::vector<Rgb8>& pixels);

 private:
  friend std::vector<Rgb8> choose_palette(const ColorHistogram& histogram, std::size_t size);
  struct Cell {
    std::uint64_t count = 0;
    std::array<std::uint64_t, 3> sum{};  ///< sum of the codes per channel
  };
  std::vector<Cell> cells_;
};

/// Chooses at most `size` colours by median cut (Heckbert 1982), which here cuts at means, refined
/// by Lloyd's iteration. A colour's weight is the square root of its number of pixels, so that a
/// large background does not take all entries.
std::vector<Rgb8> choose_palette(const ColorHistogram& histogram, std::size_t size);

/// Maps pixels to a palette of 1 to 256 colours, which must outlive the map.
class PaletteMap {
 public:
  explicit PaletteMap(const std::vector<Rgb8>& palette);
  /// Chooses between two entries: the first is nearest to `color`, the second is on the other side
  /// of `color`. Returns the second if the projection of `color` onto the line from the first (0)
  /// to the second (1) exceeds `threshold` (0..1). With the thresholds of a dither pattern the
  /// results average to `color`.
  std::uint8_t dither(Rgb8 color, float threshold) const;

 private:
  /// Clamps `color` to [0, 255] and returns the entry nearest to the middle of its cell.
  std::uint8_t nearest(std::array<int, 3> color) const;
  const std::vector<Rgb8>& palette_;
  std::vector<std::uint8_t> table_;  ///< nearest entry per cell of 4 x 4 x 4 codes
};

}  // namespace polymorph
