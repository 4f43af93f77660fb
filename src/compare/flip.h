// LDR-FLIP (Andersson et al. 2020): the difference that a viewer perceives when flipping between
// two images.
//
// After Andersson, Nilsson, Akenine-Moller, Oskarsson, Astrom, Fairchild, "FLIP: A Difference
// Evaluator for Alternating Images", Proc. ACM Comput. Graph. Interact. Tech. 3(2), 2020. Colours
// are blurred as the eye blurs them at this distance (a contrast sensitivity function each for
// lightness, red-green and blue-yellow), taken to L*a*b* with saturation scaled by lightness, and
// measured by HyAB; edges and points that only one picture has raise the difference.
#pragma once

#include <vector>

#include "image/image.h"

namespace polymorph {

struct FlipSettings {
  /// A screen of 3840 pixels and 0.7 m, seen from 0.7 m: 3840 pi / 180.
  float pixels_per_degree = 67.0206433f;
  float exposure = 0;  ///< stops; colours are then clamped to [0, 1]
};

/// One value per pixel, 0 (no difference) to 1. Both images have one size and R, G, B (PM_CHECK).
/// Where either has a NaN or infinite colour the value is 1, and the colour counts as black for its
/// neighbours. Same result for any number of threads.
std::vector<float> flip_map(const Image& actual, const Image& reference,
                            const FlipSettings& settings = {});

struct FlipFigures {
  double mean = 0, median = 0, p99 = 0, max = 0;
};
/// `pNN` is the least value that NN % of the pixels do not exceed. All 0 for an empty map.
FlipFigures flip_figures(const std::vector<float>& map);

}  // namespace polymorph
