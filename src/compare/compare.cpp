#include "compare/compare.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/parallel.h"

namespace polymorph {
namespace {

constexpr float kNothingHit = 1e9f;  // the renderer writes 1e10

enum class Rule : std::uint8_t { kColor, kDepth, kNormal, kId, kOther };

Rule rule_of(const std::string& name) {
  if (name == "R" || name == "G" || name == "B" || name == "A") return Rule::kColor;
  if (name == "Z") return Rule::kDepth;
  if (name.starts_with("N.")) return Rule::kNormal;
  if (name == "id" || name.starts_with("id.")) return Rule::kId;
  return Rule::kOther;
}

bool exceeds(Rule rule, float a, float b, const Tolerance& tolerance) {
  const float difference = std::abs(a - b);
  switch (rule) {
    case Rule::kDepth:
      if (a >= kNothingHit || b >= kNothingHit) return (a >= kNothingHit) != (b >= kNothingHit);
      return difference > tolerance.depth * std::abs(b);
    case Rule::kNormal:
      return difference > tolerance.normal;
    case Rule::kId:
      return a != b;
    case Rule::kColor:
    case Rule::kOther:
      break;
  }
  return difference > tolerance.fail + tolerance.relative * std::abs(b);
}

/// One channel of both images.
struct Pair {
  std::size_t actual, reference;
  Rule rule;
  bool visible;  ///< R, G or B: part of the PSNR
};

struct Sums {
  double max = 0, sum = 0, squares = 0;
  int max_x = 0;
  std::uint64_t failing = 0;
};

/// What one row adds; rows are added up in order, so that no sum depends on threads.
struct RowSums {
  std::vector<Sums> channels;
  double clipped_squares = 0;
  bool equal = true;
  std::uint64_t failing = 0, hard_failing = 0, not_finite = 0, negative_alpha = 0;
};

class Comparer {
 public:
  Comparer(const Image& actual, const Image& reference, const Tolerance& tolerance,
           std::vector<Pair> pairs)
      : actual_(actual),
        reference_(reference),
        tolerance_(tolerance),
        pairs_(std::move(pairs)),
        id_(reference.find_channel("id")),
        alphas_{actual.find_channel("A"), reference.find_channel("A")} {
    if (id_ < 0) id_ = reference.find_channel("id.object");
  }

  RowSums row(int y) const {
    RowSums sums;
    sums.channels.resize(pairs_.size());
    for (int x = 0; x < reference_.width; ++x) add_pixel(x, y, sums);
    return sums;
  }

 private:
  void add_pixel(int x, int y, RowSums& sums) const {
    const std::size_t pixel =
        static_cast<std::size_t>(y) * static_cast<std::size_t>(reference_.width) +
        static_cast<std::size_t>(x);
    const float* a = &actual_.pixels[pixel * actual_.channel_count()];
    const float* b = &reference_.pixels[pixel * reference_.channel_count()];
    bool fails = false, hard = false, finite = true;
    for (std::size_t c = 0; c < pairs_.size(); ++c) {
      const Pair& pair = pairs_[c];
      const float u = a[pair.actual], v = b[pair.reference];
      if (!std::isfinite(u) || !std::isfinite(v)) {
        finite = false;
        continue;
      }
      if (u == v) continue;
      sums.equal = false;
      add_difference(pair, u, v, x, sums.channels[c], sums.clipped_squares);
      const bool over = exceeds(pair.rule, u, v, tolerance_);
      sums.channels[c].failing += over;
      fails = fails || over;
      hard = hard || (pair.rule == Rule::kColor && std::abs(u - v) > tolerance_.hard_fail);
    }
    sums.not_finite += !finite;
    sums.failing += fails;
    sums.hard_failing += hard && !on_silhouette(x, y);
    sums.negative_alpha +=
        (alphas_[0] >= 0 && a[alphas_[0]] < 0) || (alphas_[1] >= 0 && b[alphas_[1]] < 0);
  }

  static void add_difference(const Pair& pair, float u, float v, int x, Sums& sums,
                             double& clipped) {
    // Depths that mean nothing hit would drown all others.
    if (pair.rule == Rule::kDepth && (u >= kNothingHit || v >= kNothingHit)) return;
    const double difference = std::abs(static_cast<double>(u) - static_cast<double>(v));
    if (difference > sums.max) {
      sums.max = difference;
      sums.max_x = x;
    }
    sums.sum += difference;
    sums.squares += difference * difference;
    if (!pair.visible) return;
    const double shown = std::clamp<double>(u, 0, 1) - std::clamp<double>(v, 0, 1);
    clipped += shown * shown;
  }

  bool on_silhouette(int x, int y) const {
    if (id_ < 0) return false;
    const float own = reference_.at(x, y, id_);
    for (int v = std::max(y - 1, 0); v <= std::min(y + 1, reference_.height - 1); ++v)
      for (int u = std::max(x - 1, 0); u <= std::min(x + 1, reference_.width - 1); ++u)
        if (reference_.at(u, v, id_) != own) return true;
    return false;
  }

  const Image& actual_;
  const Image& reference_;
  const Tolerance& tolerance_;
  std::vector<Pair> pairs_;
  int id_;
  int alphas_[2];
};

/// The names that only one side has, or "" when both have the same.
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

/// The worst of the channel with most failing pixels; without any, of the colours.
std::string describe_largest(const Comparison& result) {
  const ChannelDifference* worst = nullptr;
  for (const ChannelDifference& channel : result.channels) {
    if (channel.max <= 0) continue;
    if (!worst || channel.failing > worst->failing ||
        (channel.failing == 0 && worst->failing == 0 && rule_of(channel.channel) == Rule::kColor &&
         channel.max > worst->max))
      worst = &channel;
  }
  if (!worst) return "";
  return fmt::format("; largest difference {:.4g} in {} at ({}, {})", worst->max, worst->channel,
                     worst->max_x, worst->max_y);
}

void decide(const Tolerance& tolerance, bool equal, Comparison& result) {
  const double percent = 100.0 * static_cast<double>(result.failing_pixels) /
                         std::max(1.0, static_cast<double>(result.pixels));
  const std::string largest = describe_largest(result);
  if (result.not_finite_pixels > 0) {
    result.verdict = Verdict::kNotFinite;
    result.reason = fmt::format("{} pixels are NaN or infinite", result.not_finite_pixels);
  } else if (result.negative_alpha_pixels > 0) {
    result.verdict = Verdict::kDiffers;
    result.reason = fmt::format("{} pixels have a negative alpha", result.negative_alpha_pixels);
  } else if (equal) {
    result.verdict = Verdict::kSame;
    result.reason = "all values are equal";
  } else if (result.hard_failing_pixels > 0) {
    result.verdict = Verdict::kDiffers;
    result.reason =
        fmt::format("{} pixels differ by more than {:.4g}, which none may{}",
                    result.hard_failing_pixels, static_cast<double>(tolerance.hard_fail), largest);
  } else {
    const bool within = percent <= static_cast<double>(tolerance.fail_percent);
    result.verdict = within ? Verdict::kWithin : Verdict::kDiffers;
    result.reason = fmt::format(
        "{} of {} pixels are over the limits ({:.3g} %, allowed {:.3g} %){}", result.failing_pixels,
        result.pixels, percent, static_cast<double>(tolerance.fail_percent), largest);
  }
}

std::vector<Pair> pair_channels(const Image& actual, const Image& reference) {
  std::vector<Pair> pairs;
  for (std::size_t c = 0; c < reference.channel_count(); ++c) {
    const std::string& name = reference.channels[c];
    const Rule rule = rule_of(name);
    pairs.push_back({static_cast<std::size_t>(actual.find_channel(name)), c, rule,
                     rule == Rule::kColor && name != "A"});
  }
  return pairs;
}

/// Adds the rows up, in order. True when all values are equal.
bool add_rows(const std::vector<RowSums>& rows, double visible_channels, Comparison& result) {
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
    for (std::size_t c = 0; c < result.channels.size(); ++c) {
      ChannelDifference& channel = result.channels[c];
      channel.mean += row.channels[c].sum;
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
  result.psnr = clipped_squares > 0 ? 10 * std::log10(count * visible_channels / clipped_squares)
                                    : std::numeric_limits<double>::infinity();
  return equal;
}

void check_storage(const Image& image) {
  PM_CHECK(image.width >= 0 && image.height >= 0);
  PM_CHECK(image.pixels.size() == static_cast<std::size_t>(image.width) *
                                      static_cast<std::size_t>(image.height) *
                                      image.channel_count());
}

}  // namespace

Comparison compare_images(const Image& actual, const Image& reference, const Tolerance& tolerance) {
  check_storage(actual);
  check_storage(reference);
  Comparison result;
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
    result.verdict = Verdict::kChannelMismatch;
    return result;
  }
  const std::vector<Pair> pairs = pair_channels(actual, reference);
  for (const std::string& name : reference.channels) result.channels.push_back({.channel = name});
  const Comparer comparer(actual, reference, tolerance, pairs);
  std::vector<RowSums> rows(static_cast<std::size_t>(reference.height));
  parallel_for(
      reference.height,
      [&](std::int64_t y) {
        rows[static_cast<std::size_t>(y)] = comparer.row(static_cast<int>(y));
      },
      16);
  const auto visible =
      std::count_if(pairs.begin(), pairs.end(), [](const Pair& p) { return p.visible; });
  const bool equal = add_rows(rows, static_cast<double>(visible), result);
  decide(tolerance, equal, result);
  return result;
}

}  // namespace polymorph
