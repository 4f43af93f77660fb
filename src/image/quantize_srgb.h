// sRGB codes of 8 bits for many values at once.
#pragma once

#include <cstdint>
#include <span>

namespace polymorph {

/// Writes the codes of linear values, which are those of SrgbQuantizer. `codes`: as many as values.
void quantize_srgb(std::span<const float> linear, std::uint8_t* codes);

}  // namespace polymorph
