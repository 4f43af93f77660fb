// Adaptive sampling: rounds of samples, and the test that stops converged pixels, for CPU and GPU.
#pragma once

#include <algorithm>
#include <cmath>

#include "render/film/pixel_sum.h"

namespace polymorph {

inline constexpr int kTile = 16;  ///< pixels along a side of the tiles that are sampled together
/// Samples of the first round; each further round doubles the total.
inline constexpr int kFirstSamples = 16;
/// Side of the blocks of pixels that continue or stop together.
inline constexpr int kConvergenceBlock = 4;

/// Returns the end of the round that begins with sample `first`, at most `end`. Without adaptive
/// sampling (`noise` 0) there is only one round.
PM_HD inline int round_end(float noise, int first, int end) {
  if (!(noise > 0)) return end;
  return std::min(first == 0 ? kFirstSamples : 2 * first, end);
}

/// Estimates the error of the mean as its difference from the mean of the samples of odd index. The
/// result is divided by the square root of the brightness, which approximates perception (Dammertz
/// et al. 2010, "A hierarchical automatic stopping condition for Monte Carlo global illumination").
PM_HD inline float estimate_error(const PixelSum& sum) {
  const float n = static_cast<float>(sum.samples);
  const Vec3 mean = sum.light / n, odd_mean = sum.odd * (2 / n);
  const Vec3 difference = mean - odd_mean;
  return (std::fabs(difference.x) + std::fabs(difference.y) + std::fabs(difference.z)) /
         (0.01f + std::sqrt(std::max(0.0f, mean.x + mean.y + mean.z)));
}

/// Marks the pixels of converged blocks of a tile as done, and returns whether any pixels are left.
/// A block next to a noisy one continues too, because the estimate of a single block is uncertain.
/// `width`, `height`: size of the tile in pixels; `noise`: threshold of the error (image.noise).
/// `total(x, y)` returns the sum of a pixel's samples, `done(x, y)` a reference to its mark.
template <class Total, class Done>
PM_HD bool mark_converged(int width, int height, float noise, const Total& total,
                          const Done& done) {
  constexpr int kBlock = kConvergenceBlock, kBlocks = kTile / kBlock;
  const int columns = (width + kBlock - 1) / kBlock, rows = (height + kBlock - 1) / kBlock;
  const auto for_pixels_of_block = [&](int row, int column, const auto& f) {
    for (int y = row * kBlock; y < std::min((row + 1) * kBlock, height); ++y)
      for (int x = column * kBlock; x < std::min((column + 1) * kBlock, width); ++x) f(x, y);
  };
  bool noisy[kBlocks][kBlocks] = {};
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) {
      float sum = 0;
      int count = 0;
      for_pixels_of_block(row, column, [&](int x, int y) {
        sum += estimate_error(total(x, y));
        ++count;
      });
      noisy[row][column] = !(sum <= noise * static_cast<float>(count));
    }
  bool any_left = false;
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) {
      bool continues = false;
      for (int r = std::max(row - 1, 0); r < std::min(row + 2, rows); ++r)
        for (int c = std::max(column - 1, 0); c < std::min(column + 2, columns); ++c)
          continues = continues || noisy[r][c];
      for_pixels_of_block(row, column, [&](int x, int y) {
        // A pixel that has stopped stays done, even if a neighbour becomes noisy: it has missed
        // rounds, and its samples must be the first of the sequence without a gap.
        if (!continues) done(x, y) = true;
        any_left = any_left || !done(x, y);
      });
    }
  return any_left;
}

}  // namespace polymorph
