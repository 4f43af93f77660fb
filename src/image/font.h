// Bitmap font for labels: printable ASCII, capitals 7 pixels high, proportional.
#pragma once

#include <array>
#include <cstdint>

namespace polymorph {

inline constexpr int kFontHeight = 9;  ///< pixels: 7 above the baseline, 2 below
inline constexpr int kFontGap = 1;     ///< pixels between two glyphs

struct Glyph {
  int width = 0;
  std::array<std::uint8_t, kFontHeight> rows{};  ///< bit x set: pixel x (from the left) is inked
};

/// Finds the glyph of a printable ASCII character, or a hollow box for any other character.
const Glyph& find_glyph(char character);

}  // namespace polymorph
