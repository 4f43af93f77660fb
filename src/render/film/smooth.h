// Smoothing of the noise of few samples: an edge-avoiding wavelet filter (Dammertz, Sewtz, Hanika
// and Lensch 2010, "Edge-avoiding a-trous wavelet transform for fast global illumination
// filtering"), guided by id, normal, depth and albedo.
#pragma once

#include <cstdint>

#include "image/image.h"

namespace polymorph {

/// Layers that smooth_noise() needs, as image.aovs names them.
inline constexpr const char* kSmoothLayers = "Z,N,albedo,id";

/// Smooths R, G and B of a film with these layers. The light of surfaces is smoothed and not their
/// colours: it is divided by the albedo before and multiplied after. Pixels beside an edge of a
/// surface, of its normals or of its texture are only kept within what their neighbours' light
/// allows. The pixels of silhouettes, whose few samples fall on either side by chance, differ from
/// the filtered colours of both sides by a mean of their neighbours' differences. Everything else
/// stays. The same bits for any number of threads, on any processor.
void smooth_noise(Image& film);

/// Memory that it takes, in bytes.
std::uint64_t smooth_bytes(int width, int height);

}  // namespace polymorph
