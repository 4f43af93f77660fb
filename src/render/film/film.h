// Film and pixel reconstruction filter. The filter is importance-sampled, not splatted: each pixel
// draws its own samples with the filter's pdf. So a pixel belongs to one task, which sums its
// samples in a fixed order.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "kernels/types.h"
#include "render/aov.h"
#include "render/math/simd.h"

namespace polymorph {

/// Pixel filter: the inverse CDF of a Blackman-Harris window.
struct PixelFilter {
  static constexpr int kCells = 256;
  std::array<float, kCells + 1> offsets{};  ///< pixels; the CDF at offsets[i] is i / kCells
};
/// Makes a filter that reaches `radius` pixels from a pixel's centre.
PixelFilter make_pixel_filter(float radius);
/// Maps a random number in [0, 1) to an offset from the pixel's centre along one axis.
template <class V>
PM_HD inline V filter_offset(const PixelFilter& filter, V u) {
  const V x = u * static_cast<float>(PixelFilter::kCells);
  const auto i = min(truncate(x), PixelFilter::kCells - 1);
  const float* offsets = filter.offsets.data();
  return lerp(gather(offsets, i), gather(offsets + 1, i), x - to_float(i));
}

/// Lists the film's channels: R G B A, then the AOVs.
std::vector<std::string> list_film_channels(const std::vector<const Aov*>& aovs);

}  // namespace polymorph
