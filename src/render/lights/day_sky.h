// Clear daylight sky model (Perez).
#pragma once

#include "render/lights/lights.h"
#include "render/lights/sky.h"

namespace polymorph {

/// Makes a clear sky around a sun in the direction of the key light (Preetham, Shirley and Smits
/// 1999, "A practical analytic model for daylight"), without the sun's own disc, above sunlit
/// ground of the colour `floor`. `turbidity` 2 to 10; brightness is scaled so that the sky's
/// irradiance on level ground is about kDayIrradiance at `scale` 1. A sun below the horizon is
/// moved onto it.
Sky make_day_sky(const KeyLight& sun, Vec3 floor, float turbidity, float scale, SkyPart part);

/// A fourth of the key light's default irradiance, as on a clear day.
inline constexpr float kDayIrradiance = 0.9f;

}  // namespace polymorph
