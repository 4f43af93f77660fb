// Difference images: heat maps, limit maps and triptychs of a comparison.
#pragma once

#include <vector>

#include "base/result.h"
#include "compare/compare.h"
#include "image/image.h"

namespace polymorph {

/// Converts an image to R, G, B in Rec. 709 for display. An image without R, G, B shows its first
/// channel as grey.
Image visible_colors(const Image& image);

/// Draws a FLIP map in colours of rising lightness, from black (0) over violet and orange to pale
/// yellow (`range` and above).
Image heat_picture(const std::vector<float>& map, int width, int height, double range = 1);
/// Smallest of the ranges 1, 0.5, 0.2, ... 0.01 that contains `max`; 1 if `max` is larger.
double heat_range(double max);

/// Draws the reference in dark grey, pixels over their limits in red, those beyond hard_fail in
/// yellow, and NaN or infinity in cyan.
Image limits_picture(const Image& reference, const std::vector<PixelState>& states);

/// Draws reference | actual | heat with captions. Images narrower than 320 pixels are enlarged by
/// an integer factor to at most that width. Without FLIP, the third picture is limits_picture(). If
/// `maps` is empty, draws difference_triptych().
Result<Image> failure_picture(const Image& actual, const Image& reference,
                              const Comparison& comparison, const PixelMaps& maps);

}  // namespace polymorph
