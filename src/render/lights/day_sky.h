// Clear daylight sky model (Perez).
#pragma once

#include "render/lights/lights.h"
#include "render/lights/sky.h"

namespace polymorph {

/// Makes a clear sky around a sun in the direction of the key light (Preetham, Shirley and Smits
/// 1999, "A practical analytic model for daylight"). The sky lacks the sun's own disc; below the
/// horizon it shows sunlit ground of the colour `floor`. `turbidity`: from 2 (clear) to 10 (hazy).
/// At `scale` 1 the irradiance of level ground by the sky is about kDayIrradiance. A sun below the
/// horizon counts as one at the horizon.
Sky make_day_sky(const DistantLight& sun, Vec3 floor, float turbidity, float scale,
                 SkyDomain domain);

/// Irradiance of level ground by the sky: a fourth of the key light's default, as on a clear day.
inline constexpr float kDayIrradiance = 0.9f;

}  // namespace polymorph
