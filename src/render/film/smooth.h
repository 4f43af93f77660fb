// Smoothing of the noise of few samples: an edge-avoiding wavelet filter (Dammertz, Sewtz, Hanika
// and Lensch 2010, "Edge-avoiding a-trous wavelet transform for fast global illumination
// filtering"), guided by id, normal, depth and albedo.
#pragma once

#include <cstdint>

#include "image/image.h"

namespace polymorph {

/// Layers that smooth_noise() needs, as image.aovs names them.
inline constexpr const char* kSmoothLayers = "Z,N,albedo,id";

/// Smooths R, G and B of a film that has the layers kSmoothLayers. Colours are divided by the
/// albedo before filtering and multiplied by it afterwards, so that only light is smoothed. Pixels
/// where normals or texture change abruptly are only clamped to the range of their neighbours'
/// light. On a silhouette, where the id changes or the depth jumps, the few samples of a pixel fall
/// on either side by chance. Such a pixel gets a weighted mean of the filtered colours of its 3 x 3
/// neighbourhood, plus a correction: the difference between a pixel's sampled colour and that
/// weighted mean, averaged over nearby pixels on the silhouette.
/// All other channels are unchanged. The result has the same bits for any number of threads and on
/// every processor.
void smooth_noise(Image& film);

/// Returns the memory that smooth_noise() takes, in bytes.
std::uint64_t smooth_bytes(int width, int height);

}  // namespace polymorph
