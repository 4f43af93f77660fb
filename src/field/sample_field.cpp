#include "field/sample_field.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "base/activity.h"
#include "field/extract_surface.h"

namespace polymorph {

std::size_t sampled_at_once(std::size_t balls) {
  constexpr std::size_t kPairs = std::size_t{1} << 31, kMin = 1024;
  return std::max(kPairs / std::max<std::size_t>(balls, 1), kMin);
}

Result<std::vector<float>> sample_field(Engine& engine, const BallSet& balls,
                                        const std::vector<Vec3>& points,
                                        const ExtractSettings& settings, const std::string& name) {
  const std::size_t part = sampled_at_once(balls.size());
  std::vector<float> all, values;
  all.reserve(points.size());
  for (std::size_t begin = 0; begin < points.size(); begin += part) {
    const auto first = points.begin() + static_cast<std::ptrdiff_t>(begin);
    const std::size_t count = std::min(part, points.size() - begin);
    std::optional<Activity> activity;
    if (points.size() > part)
      activity.emplace(fmt::format("{}: {} %", name, 100 * begin / points.size()));
    PM_TRY_STATUS(to_status(engine.sample(
        balls, {first, first + static_cast<std::ptrdiff_t>(count)}, settings, values)));
    all.insert(all.end(), values.begin(), values.end());
  }
  return all;
}

}  // namespace polymorph
