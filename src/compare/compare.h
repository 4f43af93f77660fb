// Image comparison against tolerances. NaN, infinities and negative alpha always fail.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "compare/channel_rule.h"
#include "compare/flip.h"
#include "image/image.h"

namespace polymorph {

/// Limits similar to those of OpenImageIO's idiff. A pixel fails if one of its channels does, with
/// the actual value a and the reference value b:
///   Z: |a - b| > depth * |b|, or only one of the two rays hit something (kNothingHit);
///   N.*: |a - b| > normal;
///   ids (channel_rule.h, and channels stored as integers): any difference;
///   all others: |a - b| > fail + relative * |b|.
struct Tolerance {
  float fail = 0.004f;
  float relative = 0.01f;
  float fail_percent = 0.1f;  ///< percentage of pixels that may fail
  /// Largest difference of a colour (R, G, B, A), except at silhouettes, which may move by a
  /// fraction of a pixel. A silhouette is where the reference's id changes within 3 x 3 pixels.
  /// Without ids, the limit holds everywhere. 1e30 stands for no limit, in this and in later
  /// members.
  float hard_fail = 1e30f;
  float depth = 1e-3f;   ///< relative to |b|
  float normal = 0.05f;  ///< absolute, per component of the unit normal
  /// Limits of the mean and of the 99th percentile of FLIP (flip.h), at exposure 0.
  float flip_mean = 1e30f, flip_p99 = 1e30f;
  /// Warns, but does not fail, if more than warn_percent of the pixels differ by more than `warn`
  /// in any channel except Z and ids.
  float warn = 1e30f, warn_percent = 0;
  std::string why = {};  ///< the reason for these limits, shown in reports
};

/// Tolerance that requires equal values.
inline Tolerance zero_tolerance() {
  return {.fail = 0, .relative = 0, .fail_percent = 0, .depth = 0, .normal = 0};
}
/// Tests whether a tolerance requires equal values.
inline bool is_exact(const Tolerance& t) {
  return t.fail == 0 && t.relative == 0 && t.fail_percent == 0 && t.depth == 0 && t.normal == 0;
}

enum class Verdict : std::uint8_t {
  kSame,     ///< all values are equal
  kWithin,   ///< differences within the limits
  kDiffers,  ///< too many failing pixels, a pixel beyond hard_fail, FLIP over its limits, a
             ///< negative alpha, or headers that show pixels differently (display_mismatch.h)
  kSizeMismatch,
  kChannelMismatch,  ///< the sets of names differ; their order does not matter
  kNotFinite,        ///< NaN or infinity in either image
};

struct ChannelDifference {
  std::string channel;
  ChannelRule rule = ChannelRule::kOther;
  /// Statistics of |actual - reference| over all pixels. Different ids differ by 1. A pixel counts
  /// as 0 if one of its values is not finite, or is the depth of a ray that hit nothing.
  double max = 0, mean = 0, rms = 0;
  int max_x = 0, max_y = 0;   ///< the first pixel, row by row, that differs by `max`
  std::uint64_t failing = 0;  ///< pixels that fail in this channel
};

/// Histogram of pixels by the largest |a - b| / limit of their channels. Bin 0 counts equal pixels;
/// bins 1 .. 36 divide the ratios 1/1000 .. 1000 into six bins per decade, and bins 1 and 36 also
/// count the ratios beyond. kAtLimit (ratio 1) is the first bin of failing pixels.
struct LimitHistogram {
  static constexpr int kBins = 37, kAtLimit = 19;
  std::array<std::uint64_t, kBins> pixels{};
};

/// Result of compare_images(). Members that end in `pixels` are numbers of pixels.
struct Comparison {
  Verdict verdict = Verdict::kSame;
  /// Channels in the reference's order; empty if sizes or channels differ.
  std::vector<ChannelDifference> channels;
  std::uint64_t pixels = 0, failing_pixels = 0, hard_failing_pixels = 0, not_finite_pixels = 0;
  std::uint64_t negative_alpha_pixels = 0, warning_pixels = 0;
  bool warned = false;  ///< see Tolerance::warn
  double psnr = 0;  ///< dB over R, G, B clipped to [0, 1]; infinity if these are equal or absent
  std::optional<FlipStatistics> flip;  ///< absent without R, G, B
  LimitHistogram histogram;
  std::string reason;  ///< reason of the verdict, in one line
  bool passed() const { return verdict == Verdict::kSame || verdict == Verdict::kWithin; }
};

/// State of a pixel, in ascending order of severity. Its worst channel decides.
enum class PixelState : std::uint8_t {
  kEqual,
  kWithin,    ///< differs, but fails in no channel
  kOver,      ///< fails (see Tolerance)
  kHard,      ///< differs by more than Tolerance::hard_fail
  kNotFinite  ///< NaN or infinity in either image
};

/// Results of compare_images() per pixel, row by row. Empty if sizes or channels differ.
struct PixelMaps {
  std::vector<PixelState> states;
  std::vector<float> flip;  ///< empty without R, G, B, or when the colours are equal
};

/// Compares two images, and fills `maps` unless it is null. The result does not depend on threads.
Comparison compare_images(const Image& actual, const Image& reference, const Tolerance& tolerance,
                          PixelMaps* maps = nullptr);

/// Returns "same", "within", "differs", "size", "channels" or "not-finite".
const char* verdict_name(Verdict verdict);

/// Draws reference | actual | 8x absolute difference of R, G, B, side by side. Images without R, G,
/// B show their first channel. The difference is white where only one image has a pixel or a value
/// is not finite.
Image difference_triptych(const Image& actual, const Image& reference);

}  // namespace polymorph
