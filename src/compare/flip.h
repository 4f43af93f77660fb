// LDR-FLIP (Andersson et al. 2020): the difference that a viewer perceives when flipping between
// two images.
//
// After Andersson, Nilsson, Akenine-Moller, Oskarsson, Astrom, Fairchild, "FLIP: A Difference
// Evaluator for Alternating Images", Proc. ACM Comput. Graph. Interact. Tech. 3(2), 2020. Colours
// are blurred as by the eye at the viewing distance (one contrast sensitivity function each for
// lightness, red-green and blue-yellow), converted to L*a*b* with saturation scaled by lightness,
// and compared by HyAB. Edges and points that only one picture has raise the difference.
#pragma once

#include <vector>

#include "image/image.h"

namespace polymorph {

struct FlipSettings {
  /// A screen of 3840 pixels and 0.7 m, seen from 0.7 m: 3840 pi / 180.
  float pixels_per_degree = 67.0206433f;
  float exposure = 0;  ///< stops; colours are then clamped to [0, 1]
};

/// Computes one value per pixel, 0 (no difference) to 1. Both images must have the same size and R,
/// G, B (PM_CHECK). A pixel with a NaN or infinite channel in either image has the value 1; for its
/// neighbours, this channel counts as 0. The result does not depend on threads.
std::vector<float> flip_map(const Image& actual, const Image& reference,
                            const FlipSettings& settings = {});

/// Statistics of a FLIP map. p99 is the smallest value that 99 % of the pixels do not exceed.
struct FlipStatistics {
  double mean = 0, median = 0, p99 = 0, max = 0;
};
/// Computes the statistics of a map; all are 0 for an empty map.
FlipStatistics flip_statistics(const std::vector<float>& map);

}  // namespace polymorph
