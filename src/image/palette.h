// Colour quantization (median cut): one palette for many frames, and dithering between the two
// palette colours around a pixel's colour.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace polymorph {

using Rgb8 = std::array<std::uint8_t, 3>;

/// Histogram of colours in cells of 4 codes per side.
class ColorHistogram {
 public:
  ColorHistogram();
  void add(const std::vector<Rgb8>& pixels);

 private:
  friend std::vector<Rgb8> choose_palette(const ColorHistogram& histogram, std::size_t size);
  struct Cell {
    std::uint64_t count = 0;
    std::array<std::uint64_t, 3> sum{};
  };
  std::vector<Cell> cells_;
};

/// Chooses at most `size` colours by median cut (Heckbert 1982), refined by Lloyd's iteration. A
/// colour's weight is the square root of its number of pixels, so that a large background does not
/// take all entries.
std::vector<Rgb8> choose_palette(const ColorHistogram& histogram, std::size_t size);

/// Maps pixels to a palette. The palette must outlive it; 1 to 256 colours.
class PaletteMap {
 public:
  explicit PaletteMap(const std::vector<Rgb8>& palette);
  /// Returns the nearest entry or the entry on the other side of `color`: the latter if `color`
  /// lies further than the fraction `threshold` (0..1) of the way from the former to the latter.
  /// With the thresholds of a dither pattern the results average to `color`.
  std::uint8_t dither(Rgb8 color, float threshold) const;

 private:
  std::uint8_t nearest(std::array<int, 3> color) const;
  const std::vector<Rgb8>& palette_;
  std::vector<std::uint8_t> table_;  ///< nearest entry per cell of 4 codes per side
};

}  // namespace polymorph
