#include <algorithm>
#include <cmath>

#include "image/image_io.h"
#include "inspect/inspection.h"

namespace polymorph {
namespace {

/// Statistics of a channel's finite values, and the number of pixels that are not finite.
struct ChannelRange {
  float low = 0, high = 0;
  double mean = 0;
  std::size_t not_finite = 0;
};

ChannelRange measure_range(const Image& image, std::size_t channel) {
  ChannelRange range{/*low=*/INFINITY, /*high=*/-INFINITY, /*mean=*/0, /*not_finite=*/0};
  std::size_t count = 0;
  for (std::size_t i = channel; i < image.pixels.size(); i += image.channel_count()) {
    const float v = image.pixels[i];
    if (!std::isfinite(v)) {
      ++range.not_finite;
      continue;
    }
    range.low = std::min(range.low, v);
    range.high = std::max(range.high, v);
    range.mean += static_cast<double>(v);
    ++count;
  }
  if (count > 0) range.mean /= static_cast<double>(count);
  return range;
}

/// Shortens a long text, such as a scene in a header, to its beginning and its length.
std::string shorten(const std::string& text) {
  constexpr std::size_t kMaxLength = 500, kShortLength = 60;  // characters
  if (text.size() <= kMaxLength) return text;
  return fmt::format("{}... ({} characters)", text.substr(0, kShortLength), text.size());
}

}  // namespace

Result<Inspection> inspect_image(const std::string& file) {
  PM_TRY(const Image image, read_image(file, {.stored_colors = true}));
  Inspection out;
  JsonValue& json = out.json;
  json = {{"file", file}, {"width", image.width}, {"height", image.height}};
  json["channels"] = JsonValue::array();
  out.text += fmt::format("{}: {} x {}, {} channels\n", file, image.width, image.height,
                          image.channel_count());
  for (std::size_t c = 0; c < image.channel_count(); ++c) {
    const ChannelRange range = measure_range(image, c);
    json["channels"].push_back({{"name", image.channels[c]},
                                {"min", range.low},
                                {"max", range.high},
                                {"mean", range.mean},
                                {"not_finite", range.not_finite}});
    out.text +=
        fmt::format("  {:<12} {:>12.6g} to {:<12.6g} mean {:<12.6g}{}\n", image.channels[c],
                    range.low, range.high, range.mean,
                    range.not_finite ? fmt::format(" {} NaN or infinite", range.not_finite) : "");
  }
  for (const Attribute& attribute : image.attributes) {
    std::visit(
        [&](const auto& value) {
          json["attributes"][attribute.name] = value;
          out.text += fmt::format("  {} = {}\n", attribute.name, shorten(fmt::format("{}", value)));
        },
        attribute.value);
  }
  return out;
}

}  // namespace polymorph
