// Image comparison against tolerances. NaN and infinities always fail, and so does a negative
// alpha.
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

/// Limits as idiff users know them. A pixel fails when one of its channels does:
///   Z: |a - b| > depth * |b|, or only one of the two hit something (values from 1e9 on mean
///   nothing hit); N.*: |a - b| > normal;  ids (channel_rule.h, and whatever is stored as whole
///   numbers): any difference; all others: |a - b| > fail + relative * |b|.
struct Tolerance {
  float fail = 0.004f;
  float relative = 0.01f;
  float fail_percent = 0.1f;  ///< share of failing pixels allowed, %
  /// No colour (R, G, B, A) may differ by more, except where the reference's id changes within the
  /// 3 x 3 neighbourhood (silhouettes, which move by parts of a pixel); without ids the limit holds
  /// everywhere.
  float hard_fail = 1e30f;
  float depth = 1e-3f;   ///< relative
  float normal = 0.05f;  ///< absolute
  /// FLIP of the colours (flip.h) at no exposure: its mean, and what 99 % of the pixels stay below.
  float flip_mean = 1e30f, flip_p99 = 1e30f;
  /// More than warn_percent of the pixels differing by more than `warn` in any channel but Z and id
  /// is worth a word, but no failure.
  float warn = 1e30f, warn_percent = 0;
  std::string why = {};  ///< the reason for these limits, shown in reports
};

/// Every value must be equal.
inline Tolerance exact_tolerance() {
  return {.fail = 0, .relative = 0, .fail_percent = 0, .depth = 0, .normal = 0};
}
/// Tests whether no pixel may differ.
inline bool is_exact(const Tolerance& t) {
  return t.fail == 0 && t.relative == 0 && t.fail_percent == 0 && t.depth == 0 && t.normal == 0;
}

enum class Verdict : std::uint8_t {
  kSame,     ///< all values are equal
  kWithin,   ///< differences within the limits
  kDiffers,  ///< too many failing pixels, one beyond hard_fail, a negative alpha, or another pixel
             ///< aspect ratio, orientation or gamma in the header
  kSizeMismatch,
  kChannelMismatch,  ///< the sets of names differ; their order does not matter
  kNotFinite,        ///< NaN or infinity in either image
};

struct ChannelDifference {
  std::string channel;
  ChannelRule rule = ChannelRule::kOther;
  /// |actual - reference| over finite values; between other ids it is 1
  double max = 0, mean = 0, rms = 0;
  int max_x = 0, max_y = 0;   ///< the first pixel that differs by max
  std::uint64_t failing = 0;  ///< pixels that fail in this channel
};

/// Histogram of pixels by the share of their limits that they differ by: the worst channel's |a -
/// b| over its limit, 0 in a bin of its own, then six bins a decade from 1/1000 to 1000. Bin
/// kAtLimit is the first of pixels that fail.
struct LimitHistogram {
  static constexpr int kBins = 37, kAtLimit = 19;
  std::array<std::uint64_t, kBins> pixels{};
};

struct Comparison {
  Verdict verdict = Verdict::kSame;
  std::vector<ChannelDifference> channels;  ///< ordered as in the reference; empty on a mismatch
  std::uint64_t pixels = 0, failing_pixels = 0, hard_failing_pixels = 0, not_finite_pixels = 0;
  std::uint64_t negative_alpha_pixels = 0, warning_pixels = 0;
  bool warned = false;              ///< more than warn_percent of the pixels beyond `warn`
  double psnr = 0;                  ///< dB over R, G, B clipped to [0, 1]; infinity when equal
  std::optional<FlipFigures> flip;  ///< absent without R, G, B
  LimitHistogram histogram;
  std::string reason;  ///< one line: why the verdict
  bool passed() const { return verdict == Verdict::kSame || verdict == Verdict::kWithin; }
};

enum class PixelState : std::uint8_t { kEqual, kWithin, kOver, kHard, kNotFinite };

/// Results of compare_images() per pixel; empty on a mismatch.
struct PixelMaps {
  std::vector<PixelState> states;
  std::vector<float> flip;  ///< empty without R, G, B, or when the colours are equal
};

/// Same result for any number of threads. `maps`, if given, is filled.
Comparison compare_images(const Image& actual, const Image& reference, const Tolerance& tolerance,
                          PixelMaps* maps = nullptr);

/// "same", "within", "differs", "size", "channels", "not-finite"
const char* verdict_name(Verdict verdict);

/// reference | actual | 8x absolute difference of R, G, B, side by side. Takes any two images:
/// without R, G, B the first channel stands in; where only one image has a pixel the difference is
/// white, and so it is where a value is not finite.
Image difference_triptych(const Image& actual, const Image& reference);

}  // namespace polymorph
