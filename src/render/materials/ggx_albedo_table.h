// Directional albedo of GGX with Schlick's Fresnel term, split as f0 * scale + bias (Karis 2013),
// tabulated.
#pragma once

#include "render/math/simd.h"

namespace polymorph {

template <class V>
struct SplitAlbedoOf {
  V scale, bias;  ///< their sum is the albedo of a perfect reflector (single scattering)
};
using SplitAlbedo = SplitAlbedoOf<float>;

SplitAlbedoOf<float> split_albedo(float alpha, float cosine);
SplitAlbedoOf<Pack> split_albedo(Pack alpha, Pack cosine);
/// Cosine-weighted mean of the split albedo over all directions.
SplitAlbedoOf<float> mean_split_albedo(float alpha);
SplitAlbedoOf<Pack> mean_split_albedo(Pack alpha);

}  // namespace polymorph
