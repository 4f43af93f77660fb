#include "leg/leg.h"

#include <algorithm>

#include "kernels/linear.h"

namespace polymorph {

float object_size(const Leg& leg, float u) {
  return lerp(leg.from->model.box().diagonal(), leg.to->model.box().diagonal(),
              std::clamp(u, 0.0f, 1.0f));
}

double min_component_share(const Leg& leg) {
  const auto min_share = static_cast<double>(leg.settings.min_component_share);
  return visit(
      leg, [&] { return min_share; },
      [&](const DistanceLeg&) {
        // Fragments that come off between two objects, a limb's tip perhaps, are left out unless
        // they are as large as a component that one of them has.
        constexpr double kFragment = 0.015;
        if (min_share <= 0) return min_share;
        const double smallest = std::min(leg.from->distances.smallest_component_share,
                                         leg.to->distances.smallest_component_share);
        return std::max(min_share, std::min(kFragment, 0.5 * smallest));
      });
}

}  // namespace polymorph
