// Colour quantization (median cut): one palette for many frames, and the two palette colours that a
// pixel lies between.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace polymorph {

using Rgb8 = std::array<std::uint8_t, 3>;

/// How often colours occur, in cells of 4 codes per side.
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

/// At most `size` colours: median cut (Heckbert 1982), refined by Lloyd's iteration. A colour
/// counts by the square root of its number of pixels, so that a wide background does not take all
/// entries.
std::vector<Rgb8> choose_palette(const ColorHistogram& histogram, std::size_t size);

/// Maps pixels to a palette. The palette must outlive it; 1 to 256 colours.
class PaletteMap {
 public:
  explicit PaletteMap(const std::vector<Rgb8>& palette);
  /// The nearest entry, or the one on the other side of `color` when the share of the way to it
  /// exceeds `threshold` (0..1): over a dither pattern the colours mix to `color`.
  std::uint8_t dithered(Rgb8 color, float threshold) const;

 private:
  std::uint8_t nearest(std::array<int, 3> color) const;
  const std::vector<Rgb8>& palette_;
  std::vector<std::uint8_t> table_;  ///< nearest entry of each cell of 4 codes per side
};

}  // namespace polymorph
