#include "leg/origin_colors.h"

#include <algorithm>
#include <utility>

#include "leg/leg_surface.h"

namespace polymorph {

Result<std::vector<Vec3>> trace_back(std::span<const std::shared_ptr<const Leg>> legs,
                                     const LegState& state, std::vector<Vec3> points,
                                     Engine& engine) {
  PM_TRY(PullBack pulled, pull_back(*legs.back(), state, points, engine));
  for (std::size_t k = legs.size() - 1; k-- > 0;) {
    PM_TRY(const LegState end, leg_state(*legs[k], legs[k]->until, engine));
    points = std::move(pulled.source);
    PM_TRY(pulled, pull_back(*legs[k], end, points, engine));
  }
  return std::move(pulled.source);
}

std::vector<Vec3> colors_by_position(const std::vector<Vec3>& points, const Box& box) {
  // Smallest value of a channel, and the range of its values.
  constexpr float kDarkest = 0.1f, kRange = 0.85f;
  const Vec3 size = box.size();
  const auto channel = [&](float v, float low, float extent) {
    return kDarkest + kRange * (extent > 0 ? std::clamp((v - low) / extent, 0.0f, 1.0f) : 0.5f);
  };
  std::vector<Vec3> colors;
  colors.reserve(points.size());
  for (const Vec3 p : points)
    colors.push_back({channel(p.x, box.low.x, size.x), channel(p.y, box.low.y, size.y),
                      channel(p.z, box.low.z, size.z)});
  return colors;
}

}  // namespace polymorph
