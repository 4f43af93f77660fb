// sRGB codes of 8 bits for many values at once.
#pragma once

#include <cstdint>
#include <span>

namespace polymorph {

/// Writes the codes of linear values, which are those of SrgbQuantizer. `codes`: as many as values.
void quantize_srgb(std::span<const float> linear, std::uint8_t* codes);
/// Writes the codes that SrgbQuantizer has with an offset in [0, 1) for each value.
void quantize_srgb(std::span<const float> linear, std::span<const float> offsets,
                   std::uint8_t* codes);

}  // namespace polymorph
