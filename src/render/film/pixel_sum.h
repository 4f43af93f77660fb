// Sums of the light of a pixel's samples.
#pragma once

#include "kernels/types.h"
#include "render/path/integrator.h"

namespace polymorph {

/// Light and coverages summed over samples of a pixel.
struct PixelSum {
  Vec3 light, odd;  ///< sums of radiance over all samples, and over those of odd index
  float alpha = 0, floor = 0, lit = 0, unlit = 0;  ///< sums of PathLight's members
  int samples = 0;

  PM_HD void add(const PixelSum& other) {
    light = light + other.light;
    odd = odd + other.odd;
    alpha += other.alpha;
    floor += other.floor;
    lit += other.lit;
    unlit += other.unlit;
    samples += other.samples;
  }
};

/// Adds the light of a sample; `odd`: the sample's index is odd.
PM_HD inline void add_sample(PixelSum& sum, const PathLight& light, bool odd) {
  ++sum.samples;
  sum.alpha += light.alpha;
  sum.floor += light.floor;
  sum.lit += light.lit;
  sum.unlit += light.unlit;
  // Skip NaN and infinity, which one bad normal or texel can cause.
  if (!finite(light.radiance)) return;
  sum.light = sum.light + light.radiance;
  if (odd) sum.odd = sum.odd + light.radiance;
}

}  // namespace polymorph
