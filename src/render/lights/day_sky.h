// Clear daylight sky model (Perez).
#pragma once

#include "render/lights/lights.h"
#include "render/lights/sky.h"

namespace polymorph {

/// Clear sky around a sun in the direction of the key light (Preetham, Shirley and Smits 1999, "A
/// practical analytic model for daylight"), without the sun's own disc, over ground of the colour
/// `floor` that lies in its light. `turbidity` 2 to 10; brightness is scaled so that the sky gives
/// level ground an irradiance of about kDayIrradiance at `scale` 1. A sun below the horizon is
/// taken for one on it.
Sky make_day_sky(const KeyLight& sun, Vec3 floor, float turbidity, float scale, SkyPart part);

/// A fourth of what the key light gives by default, as on a clear day.
inline constexpr float kDayIrradiance = 0.9f;

}  // namespace polymorph
