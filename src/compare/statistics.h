// Statistical comparison of two renderings of one scene: are they equal except for noise? It also
// works when the sampler or the number of samples changes, where per-pixel limits cannot.
#pragma once

#include <span>
#include <string>

#include "base/result.h"
#include "image/image.h"

namespace polymorph {

struct StatisticsSettings {
  double significance = 0.01;  ///< how often a good frame may fail, over all of its tests together
  /// So many of the pixels must pass. A pixel's noise is not normal (a reflection that one sample
  /// in a hundred finds): of 38 good frames the worst had 0.3 % of its pixels fail; three times
  /// that.
  double pixels_percent = 99.1;
  /// ... and of the tiles, for the same reason: at most 1 of 300 failed.
  double tiles_percent = 99;
  int tile = 8;         ///< side of the tiles whose means are tested, too, pixels
  float brightest = 2;  ///< values above count as this: fireflies are not normal at all
  /// Differences this small (absolute, and as a share of the value) are no matter, however sure.
  double min_error = 5e-4;
};

struct StatisticsResult {
  double pixels_passing = 0;  ///< %
  int tiles = 0, failing_tiles = 0;
  double worst_z = 0;  ///< of the tiles' channels, in standard deviations
  int worst_x = 0, worst_y = 0;
  bool passed = false;
  std::string reason;  ///< one line
};

/// `runs` (at least 4) are renderings of `run_samples` samples under different seeds; the reference
/// is one of `reference_samples`. Each pixel's R, G, B, and each tile's, are compared with the runs
/// by a t-test (variances over the runs; that of the reference by its samples) at the significance,
/// corrected after Sidak for their number. `tiles_percent` of the tiles and `pixels_percent` of the
/// pixels must pass. Errors: kInput when sizes differ or R, G, B are missing; a value that is not
/// finite fails.
Result<StatisticsResult> compare_statistics(std::span<const Image> runs, int run_samples,
                                            const Image& reference, int reference_samples,
                                            const StatisticsSettings& settings = {});

}  // namespace polymorph
