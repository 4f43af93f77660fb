// Difference images: heat maps, limit maps and triptychs of a comparison.
#pragma once

#include <vector>

#include "base/result.h"
#include "compare/compare.h"
#include "image/image.h"

namespace polymorph {

/// R, G, B as they would be shown; of an image without them, the first channel as grey.
Image visible_colors(const Image& image);

/// A FLIP map in colours from black over violet and orange to pale yellow, rising in lightness;
/// `range` and above is the last.
Image heat_picture(const std::vector<float>& map, int width, int height, double range = 1);
/// The round number (1, 0.5, 0.2, ... 0.01) that shows a map of this maximum best.
double heat_range(double max);

/// The reference in dark grey; red: pixels over their limits, yellow: beyond hard_fail, cyan: NaN
/// or infinite.
Image limits_picture(const Image& reference, const std::vector<PixelState>& states);

/// reference | actual | heat, each with its caption below, enlarged by whole numbers up to some 320
/// pixels per picture. For images that cannot be compared, difference_triptych().
Result<Image> failure_picture(const Image& actual, const Image& reference,
                              const Comparison& comparison, const PixelMaps& maps);

}  // namespace polymorph
