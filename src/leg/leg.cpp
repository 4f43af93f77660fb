#include "leg/leg.h"

#include <algorithm>

#include "kernels/linear.h"
#include "mesh/components.h"

namespace polymorph {

float object_size(const Leg& leg, float u) {
  return lerp(leg.from->model.box().diagonal(), leg.to->model.box().diagonal(),
              std::clamp(u, 0.0f, 1.0f));
}

double min_component_share(const Leg& leg, float u) {
  const auto min_share = static_cast<double>(leg.settings.min_component_share);
  return visit(
      leg, [&] { return min_share; },
      [&](const DistanceLeg&) {
        // Fragments that separate between two objects, such as a limb's tip, are left out if they
        // are much smaller than the smallest component of an object. Near an end of the leg this is
        // the object there; half way it is the object whose smallest component is larger.
        constexpr float kNear = 0.1f, kFar = 0.35f;  // eased progress from the nearer end
        if (min_share <= 0) return min_share;
        const double from = leg.from->distances.smallest_component_share,
                     to = leg.to->distances.smallest_component_share;
        const double end = min_fragment_share(u < 0.5f ? from : to),
                     middle = min_fragment_share(std::max(from, to));
        const float t = std::clamp((std::min(u, 1 - u) - kNear) / (kFar - kNear), 0.0f, 1.0f);
        return std::max(min_share, std::lerp(end, middle, static_cast<double>(t)));
      });
}

void remove_fragments(const Leg& leg, float u, Mesh& surface) {
  remove_fragments(min_component_share(leg, u), leg.settings, surface);
}

void remove_fragments(double fraction, const LegSettings& settings, Mesh& surface) {
  // Fraction of the volume; interchange/play.html has the same constant.
  constexpr double kMaxFragments = 0.05;
  remove_small_components(surface, fraction,
                          {kMaxFragments, static_cast<double>(settings.min_component_share)});
}

double min_fragment_share(double smallest) {
  constexpr double kFragment = 0.015;  // largest result, a fraction of the volume
  return std::min(kFragment, 0.5 * smallest);
}

}  // namespace polymorph
