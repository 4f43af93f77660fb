#include "compare/compare.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/parallel.h"
#include "base/plural.h"
#include "base/text.h"
#include "compare/display_mismatch.h"
#include "compare/pictures.h"
#include "image/image_io.h"
#include "image/rgb_channels.h"

namespace polymorph {
namespace {

/// Returns the largest difference that the tolerance allows between `a` and `b`.
float allowed_difference(ChannelRule rule, float a, float b, const Tolerance& tolerance) {
  switch (rule) {
    case ChannelRule::kDepth:
      if (a >= kNothingHit && b >= kNothingHit) return std::numeric_limits<float>::infinity();
      return a >= kNothingHit || b >= kNothingHit ? 0 : tolerance.depth * std::abs(b);
    case ChannelRule::kNormal:
      return tolerance.normal;
    case ChannelRule::kId:
      return 0;
    case ChannelRule::kColor:
    case ChannelRule::kOther:
      break;
  }
  return tolerance.fail + tolerance.relative * std::abs(b);
}

/// Finds the LimitHistogram bin of a pixel that differs. `ratio` is the largest |a - b| / limit of
/// its channels; `over` says whether the pixel fails, since rounding may shift `ratio` across 1.
std::size_t histogram_bin(float ratio, bool over) {
  constexpr int kAt = LimitHistogram::kAtLimit, kLast = LimitHistogram::kBins - 1;
  // Clamp 0 and infinity (a limit of 0) to finite logarithms outside the bins. 6 bins per decade.
  const float offset = std::floor(6 * std::log10(std::clamp(ratio, 1e-6f, 1e6f)));
  const int bin = kAt + static_cast<int>(offset);
  return static_cast<std::size_t>(over ? std::clamp(bin, kAt, kLast) : std::clamp(bin, 1, kAt - 1));
}

/// Indices of one channel in both images.
struct ChannelPair {
  std::size_t actual, reference;
  ChannelRule rule;
  bool visible;  ///< R, G or B: part of the PSNR
};

/// Absolute differences of one channel in one row.
struct Sums {
  double max = 0, sum = 0, squares = 0;
  int max_x = 0;              ///< the first column with the difference `max`
  std::uint64_t failing = 0;  ///< pixels
};

/// Sums over one row. Rows are added in order, so that the totals do not depend on threads.
struct RowSums {
  std::vector<Sums> channels;  ///< one entry per ChannelPair
  double clipped_squares = 0;  ///< sum over R, G and B clipped to [0, 1], for the PSNR
  bool equal = true;
  /// Numbers of pixels.
  std::uint64_t failing = 0, hard_failing = 0, not_finite = 0, negative_alpha = 0, warning = 0;
  LimitHistogram histogram;
};

/// Compares two images of equal size row by row.
class Comparer {
 public:
  Comparer(const Image& actual, const Image& reference, const Tolerance& tolerance,
           std::vector<ChannelPair> pairs)
      : actual_(actual),
        reference_(reference),
        tolerance_(tolerance),
        pairs_(std::move(pairs)),
        id_(reference.find_channel("id")),
        alphas_{actual.find_channel("A"), reference.find_channel("A")} {
    if (id_ < 0) id_ = reference.find_channel("id.object");
  }

  /// Compares row y. Fills its part of `states` (PixelMaps::states), unless null.
  RowSums sum_row(int y, PixelState* states) const {
    RowSums sums;
    sums.channels.resize(pairs_.size());
    const std::size_t first =
        static_cast<std::size_t>(y) * static_cast<std::size_t>(reference_.width);
    for (int x = 0; x < reference_.width; ++x) {
      const std::size_t pixel = first + static_cast<std::size_t>(x);
      const PixelState state = add_pixel(x, y, pixel, sums);
      if (states) states[pixel] = state;
    }
    return sums;
  }

 private:
  /// Compares the pixel (x, y), whose index is `pixel`, and adds its differences to `sums`.
  PixelState add_pixel(int x, int y, std::size_t pixel, RowSums& sums) const {
    const float* a = &actual_.pixels[pixel * actual_.channel_count()];
    const float* b = &reference_.pixels[pixel * reference_.channel_count()];
    bool fails = false, hard = false, finite = true, warns = false, equal = true;
    float ratio = 0;  // the largest difference / limit
    for (std::size_t c = 0; c < pairs_.size(); ++c) {
      const ChannelPair& pair = pairs_[c];
      const float u = a[pair.actual], v = b[pair.reference];
      if (!std::isfinite(u) || !std::isfinite(v)) {
        finite = false;
        continue;
      }
      if (u == v) continue;
      equal = false;
      if (add_difference(pair, u, v, x, sums.channels[c]) && pair.visible) {
        const double clipped = std::clamp<double>(u, 0, 1) - std::clamp<double>(v, 0, 1);
        sums.clipped_squares += clipped * clipped;
      }
      const float limit = allowed_difference(pair.rule, u, v, tolerance_),
                  difference = std::abs(u - v);
      const bool exceeds = difference > limit;
      ratio = std::max(ratio, difference / limit);
      sums.channels[c].failing += exceeds;
      fails = fails || exceeds;
      hard = hard || (pair.rule == ChannelRule::kColor && difference > tolerance_.hard_fail);
      warns = warns || (pair.rule != ChannelRule::kDepth && pair.rule != ChannelRule::kId &&
                        difference > tolerance_.warn);
    }
    hard = hard && !on_silhouette(x, y);
    // Count the pixel in the sums of its row, and find its state.
    sums.equal = sums.equal && equal;
    sums.not_finite += !finite;
    sums.failing += fails;
    sums.hard_failing += hard;
    sums.warning += warns;
    sums.negative_alpha +=
        (alphas_[0] >= 0 && a[alphas_[0]] < 0) || (alphas_[1] >= 0 && b[alphas_[1]] < 0);
    if (finite) ++sums.histogram.pixels[equal ? 0 : histogram_bin(ratio, fails)];
    if (!finite) return PixelState::kNotFinite;
    if (hard) return PixelState::kHard;
    if (fails) return PixelState::kOver;
    return equal ? PixelState::kEqual : PixelState::kWithin;
  }

  /// Adds a difference to the sums of its channel. Returns false, without adding, if the channel is
  /// a depth and one of the rays hit nothing.
  static bool add_difference(const ChannelPair& pair, float u, float v, int x, Sums& sums) {
    // The depth of a ray that hit nothing would dominate the sums.
    if (pair.rule == ChannelRule::kDepth && (u >= kNothingHit || v >= kNothingHit)) return false;
    const double difference = pair.rule == ChannelRule::kId
                                  ? 1
                                  : std::abs(static_cast<double>(u) - static_cast<double>(v));
    if (difference > sums.max) {
      sums.max = difference;
      sums.max_x = x;
    }
    sums.sum += difference;
    sums.squares += difference * difference;
    return true;
  }

  /// Tests whether the reference has two ids in the 3 x 3 pixels around (x, y).
  bool on_silhouette(int x, int y) const {
    if (id_ < 0) return false;
    const float center_id = reference_.at(x, y, id_);
    for (int v = std::max(y - 1, 0); v <= std::min(y + 1, reference_.height - 1); ++v)
      for (int u = std::max(x - 1, 0); u <= std::min(x + 1, reference_.width - 1); ++u)
        if (reference_.at(u, v, id_) != center_id) return true;
    return false;
  }

  const Image& actual_;
  const Image& reference_;
  const Tolerance& tolerance_;
  std::vector<ChannelPair> pairs_;
  int id_;         ///< index of the reference's id channel; -1 = none
  int alphas_[2];  ///< indices of A in the actual image and in the reference; -1 = none
};

/// Tests whether the file stored this channel as integers.
bool holds_ids(const Image& image, const std::string& channel) {
  // read_image() appends its entry; an earlier entry of this name comes from the file.
  const auto attribute =
      std::find_if(image.attributes.rbegin(), image.attributes.rend(),
                   [](const Attribute& a) { return a.name == kIdChannelsAttribute; });
  if (attribute == image.attributes.rend()) return false;
  const auto* names = std::get_if<std::string>(&attribute->value);
  if (!names) return false;
  const std::vector<std::string> ids = split(*names, ',');
  return std::find(ids.begin(), ids.end(), channel) != ids.end();
}

/// Splits the id channels of `image` that are split in `other`. If a file has large ids,
/// read_image() puts their low bytes into a channel NAME.low, and leaves id - low byte in the
/// channel NAME.
Image split_ids(const Image& image, const Image& other) {
  constexpr std::string_view kLow = ".low";
  Image split = image;
  for (const std::string& low_name : other.channels) {
    if (!low_name.ends_with(kLow) || image.find_channel(low_name) >= 0) continue;
    const std::string name = low_name.substr(0, low_name.size() - kLow.size());
    const int channel = image.find_channel(name);
    if (channel < 0 || !holds_ids(other, name) || !holds_ids(image, name)) continue;
    const std::size_t count = split.channel_count();
    std::vector<float> pixels;
    pixels.reserve(split.pixels.size() / count * (count + 1));
    for (std::size_t i = 0; i < split.pixels.size(); i += count) {
      const auto first = split.pixels.begin() + static_cast<std::ptrdiff_t>(i);
      pixels.insert(pixels.end(), first, first + static_cast<std::ptrdiff_t>(count));
      // Floats represent ids up to 2^24 exactly.
      const float low_byte = std::fmod(first[channel], 256.0f);
      pixels[pixels.size() - count + static_cast<std::size_t>(channel)] -= low_byte;
      pixels.push_back(low_byte);
    }
    split.pixels = std::move(pixels);
    split.channels.push_back(low_name);
  }
  return split;
}

/// Lists the channels that only one of the images has; "" when both have the same.
std::string channel_mismatch(const Image& actual, const Image& reference) {
  const auto only_in = [](const Image& a, const Image& b) {
    std::string names;
    for (const std::string& name : a.channels)
      if (b.find_channel(name) < 0) names += (names.empty() ? "" : ", ") + name;
    return names;
  };
  const std::string extra = only_in(actual, reference), missing = only_in(reference, actual);
  if (extra.empty() && missing.empty()) return "";
  std::string text = "channels differ:";
  if (!missing.empty()) text += " missing " + missing;
  if (!extra.empty()) text += (missing.empty() ? " extra " : "; extra ") + extra;
  return text;
}

/// Describes the largest difference in the channel with most failing pixels (if no pixel fails, in
/// a colour channel), and the id channel with most changed ids.
std::string describe_largest(const Comparison& result) {
  const ChannelDifference *worst = nullptr, *ids = nullptr;
  for (const ChannelDifference& channel : result.channels) {
    if (channel.max <= 0) continue;
    const ChannelDifference*& leader = channel.rule == ChannelRule::kId ? ids : worst;
    if (!leader || channel.failing > leader->failing ||
        (channel.failing == 0 && leader->failing == 0 && channel.rule == ChannelRule::kColor &&
         channel.max > leader->max))
      leader = &channel;
  }
  std::string text;
  if (worst)
    text = fmt::format("; largest difference {:.4g} in {} at ({}, {})", worst->max, worst->channel,
                       worst->max_x, worst->max_y);
  if (ids)
    text += fmt::format("; another id in {} at {}, the first at ({}, {})", ids->channel,
                        plural(ids->failing, "pixel"), ids->max_x, ids->max_y);
  return text;
}

bool exceeds_flip_limits(const Tolerance& tolerance, const FlipStatistics& flip) {
  return flip.mean > static_cast<double>(tolerance.flip_mean) ||
         flip.p99 > static_cast<double>(tolerance.flip_p99);
}

/// Formats a number of pixels with its verb: "1 pixel is", "2 pixels are".
std::string pixels_are(std::size_t count) {
  return fmt::format("{} pixel{}", count, count == 1 ? " is" : "s are");
}

/// Describes the statistics of FLIP; "" if it is 0 everywhere.
std::string flip_text(const Comparison& result) {
  if (!result.flip || !(result.flip->max > 0)) return "";
  return fmt::format("; FLIP mean {:.3g}, 99 % below {:.3g}, worst {:.3g}", result.flip->mean,
                     result.flip->p99, result.flip->max);
}

/// Sets the verdict and its reason by the first condition that holds, in descending order of
/// severity. `mismatch` is from describe_display_mismatch().
void set_verdict(const Tolerance& tolerance, bool equal, const std::string& mismatch,
                 Comparison& result) {
  const double percent = 100.0 * static_cast<double>(result.failing_pixels) /
                         std::max(1.0, static_cast<double>(result.pixels));
  const std::string largest = describe_largest(result);
  if (result.not_finite_pixels > 0) {
    result.verdict = Verdict::kNotFinite;
    result.reason = pixels_are(result.not_finite_pixels) + " NaN or infinite";
  } else if (result.negative_alpha_pixels > 0) {
    result.verdict = Verdict::kDiffers;
    result.reason = pixels_are(result.negative_alpha_pixels) + " of negative alpha";
  } else if (!mismatch.empty()) {
    result.verdict = Verdict::kDiffers;
    result.reason = fmt::format("the files are shown differently: {}{}", mismatch, largest);
  } else if (equal) {
    result.verdict = Verdict::kSame;
    result.reason = "all values are equal";
  } else if (result.hard_failing_pixels > 0) {
    result.verdict = Verdict::kDiffers;
    result.reason = fmt::format("{} off by more than {:.4g}, which none may be{}",
                                pixels_are(result.hard_failing_pixels),
                                static_cast<double>(tolerance.hard_fail), largest);
  } else if (const bool within = percent <= static_cast<double>(tolerance.fail_percent);
             within && result.flip && exceeds_flip_limits(tolerance, *result.flip)) {
    result.verdict = Verdict::kDiffers;
    result.reason = fmt::format("FLIP has mean {:.3g} (allowed {:.3g}), 99 % below {:.3g} ({:.3g})",
                                result.flip->mean, static_cast<double>(tolerance.flip_mean),
                                result.flip->p99, static_cast<double>(tolerance.flip_p99));
  } else {
    result.verdict = within ? Verdict::kWithin : Verdict::kDiffers;
    if (is_exact(tolerance))
      result.reason = fmt::format("{} of {} pixels differ{}{}", result.failing_pixels,
                                  result.pixels, largest, flip_text(result));
    else
      result.reason = fmt::format(
          "{} of {} pixels {} over the limits ({:.3g} %, allowed {:.3g} %){}",
          result.failing_pixels, result.pixels, result.failing_pixels == 1 ? "is" : "are", percent,
          static_cast<double>(tolerance.fail_percent), largest);
  }
}

/// Pairs the channels of two images that have the same channel names.
std::vector<ChannelPair> pair_channels(const Image& actual, const Image& reference) {
  std::vector<ChannelPair> pairs;
  for (std::size_t c = 0; c < reference.channel_count(); ++c) {
    const std::string& name = reference.channels[c];
    const ChannelRule rule = holds_ids(actual, name) || holds_ids(reference, name)
                                 ? ChannelRule::kId
                                 : channel_rule(name);
    pairs.push_back({static_cast<std::size_t>(actual.find_channel(name)), c, rule,
                     rule == ChannelRule::kColor && name != "A"});
  }
  return pairs;
}

/// Adds the sums of the rows to the result, in order. `colors` is the number of channels (R, G, B)
/// in the PSNR. Returns whether all values are equal.
bool add_rows(const std::vector<RowSums>& rows, double colors, Comparison& result) {
  bool equal = true;
  double clipped_squares = 0;
  for (std::size_t y = 0; y < rows.size(); ++y) {
    const RowSums& row = rows[y];
    equal = equal && row.equal;
    clipped_squares += row.clipped_squares;
    result.failing_pixels += row.failing;
    result.hard_failing_pixels += row.hard_failing;
    result.not_finite_pixels += row.not_finite;
    result.negative_alpha_pixels += row.negative_alpha;
    result.warning_pixels += row.warning;
    for (std::size_t bin = 0; bin < row.histogram.pixels.size(); ++bin)
      result.histogram.pixels[bin] += row.histogram.pixels[bin];
    for (std::size_t c = 0; c < result.channels.size(); ++c) {
      ChannelDifference& channel = result.channels[c];
      channel.mean += row.channels[c].sum;  // mean and rms are divided below
      channel.rms += row.channels[c].squares;
      channel.failing += row.channels[c].failing;
      if (row.channels[c].max <= channel.max) continue;
      channel.max = row.channels[c].max;
      channel.max_x = row.channels[c].max_x;
      channel.max_y = static_cast<int>(y);
    }
  }
  const double count = std::max(1.0, static_cast<double>(result.pixels));
  for (ChannelDifference& channel : result.channels) {
    channel.mean /= count;
    channel.rms = std::sqrt(channel.rms / count);
  }
  result.psnr = clipped_squares > 0 ? 10 * std::log10(count * colors / clipped_squares)
                                    : std::numeric_limits<double>::infinity();
  return equal;
}

/// Checks that an image has one value per pixel and channel.
void check_storage(const Image& image) {
  PM_CHECK(image.width >= 0 && image.height >= 0);
  PM_CHECK(image.pixels.size() == static_cast<std::size_t>(image.width) *
                                      static_cast<std::size_t>(image.height) *
                                      image.channel_count());
}

}  // namespace

Comparison compare_images(const Image& actual, const Image& reference, const Tolerance& tolerance,
                          PixelMaps* maps) {
  check_storage(actual);
  check_storage(reference);
  PixelMaps unused_maps;
  if (!maps) maps = &unused_maps;
  *maps = {};
  Comparison result;
  // Images of other sizes or channels are not compared further.
  if (actual.width != reference.width || actual.height != reference.height) {
    result.verdict = Verdict::kSizeMismatch;
    result.reason = fmt::format("sizes differ: {} x {} instead of {} x {}", actual.width,
                                actual.height, reference.width, reference.height);
    return result;
  }
  result.pixels =
      static_cast<std::uint64_t>(reference.width) * static_cast<std::uint64_t>(reference.height);
  result.reason = channel_mismatch(actual, reference);
  if (!result.reason.empty()) {
    // Ids that were split in one image only are no mismatch.
    const Image split = split_ids(actual, reference),
                split_reference = split_ids(reference, actual);
    if (channel_mismatch(split, split_reference).empty())
      return compare_images(split, split_reference, tolerance, maps);
    result.verdict = Verdict::kChannelMismatch;
    return result;
  }
  // Compare the rows, then add their sums in order.
  const std::vector<ChannelPair> pairs = pair_channels(actual, reference);
  for (const ChannelPair& pair : pairs)
    result.channels.push_back({.channel = reference.channels[pair.reference], .rule = pair.rule});
  const Comparer comparer(actual, reference, tolerance, pairs);
  maps->states.resize(result.pixels);
  std::vector<RowSums> rows(static_cast<std::size_t>(reference.height));
  parallel_for(
      reference.height,
      [&](std::int64_t y) {
        rows[static_cast<std::size_t>(y)] =
            comparer.sum_row(static_cast<int>(y), maps->states.data());
      },
      /*grain=*/16);
  const auto colors =
      std::count_if(pairs.begin(), pairs.end(), [](const ChannelPair& p) { return p.visible; });
  const bool equal = add_rows(rows, static_cast<double>(colors), result);
  if (has_rgb(reference)) {
    // FLIP of equal colours is 0 and needs no map. Depths or ids may still differ.
    const bool colors_differ = std::isfinite(result.psnr) || result.not_finite_pixels > 0;
    if (colors_differ) maps->flip = flip_map(visible_colors(actual), visible_colors(reference));
    result.flip = flip_statistics(maps->flip);
  }
  const double percent =
      100.0 * static_cast<double>(result.warning_pixels) / static_cast<double>(result.pixels);
  result.warned =
      result.warning_pixels > 0 && percent > static_cast<double>(tolerance.warn_percent);
  set_verdict(tolerance, equal, describe_display_mismatch(actual, reference), result);
  return result;
}

const char* verdict_name(Verdict verdict) {
  switch (verdict) {
    case Verdict::kSame:
      return "same";
    case Verdict::kWithin:
      return "within";
    case Verdict::kDiffers:
      return "differs";
    case Verdict::kSizeMismatch:
      return "size";
    case Verdict::kChannelMismatch:
      return "channels";
    case Verdict::kNotFinite:
      return "not-finite";
  }
  return "";
}

}  // namespace polymorph
