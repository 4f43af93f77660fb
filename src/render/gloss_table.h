// Directional albedo of GGX with Schlick's Fresnel term, split as f0 * scale + bias (Karis 2013),
// tabulated.
#pragma once

namespace polymorph {

struct SplitAlbedo {
  float scale, bias;  ///< their sum is the albedo of a perfect reflector (single scattering)
};
SplitAlbedo split_albedo(float alpha, float cosine);
/// Its cosine-weighted mean over all directions.
SplitAlbedo mean_split_albedo(float alpha);

}  // namespace polymorph
