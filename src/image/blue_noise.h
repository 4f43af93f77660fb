// Blue-noise dither matrix (void and cluster): a tileable ordering of pixels for ordered dithering.
#pragma once

#include <cstdint>
#include <vector>

namespace polymorph {

inline constexpr int kBlueNoiseSize = 32;  ///< side of the tile

/// Ranks 0 .. kBlueNoiseSize^2 - 1, row by row: for each n the pixels of rank < n are distributed
/// evenly (void-and-cluster, Ulichney 1993). Computed once, in some milliseconds.
const std::vector<std::uint16_t>& blue_noise_ranks();

}  // namespace polymorph
