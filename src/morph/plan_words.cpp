#include "morph/plan_words.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <vector>

#include "base/exact_math.h"

namespace polymorph {

std::string describe_rotation(const MorphPlan& plan) {
  constexpr double kDegrees = 180 / exact::kPi, kMinAngle = 5, kMinVertical = 0.999;
  if (plan.motion.path == Path::kStraight) return "";
  const double angle = length(plan.alignment.rotation_vector) * kDegrees;
  if (angle < kMinAngle) return "";
  const bool upright =
      std::fabs(plan.alignment.rotation_vector.y) * kDegrees > kMinVertical * angle;
  return fmt::format("turns by {:.0f} degrees about {}", angle,
                     upright ? "the vertical" : "a tilted axis (see plan.align)");
}

std::string describe_limbs(const MorphPlan& plan) {
  std::vector<std::string> limbs;
  for (const auto& [from, to] : plan.limb_names)
    limbs.push_back((from.empty() ? "nothing" : from) + " -> " + (to.empty() ? "nothing" : to));
  return fmt::format("{}", fmt::join(limbs, ", "));
}

}  // namespace polymorph
