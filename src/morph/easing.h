// Easing functions: linear, smoothstep, Bezier, spring.
#pragma once

#include "scene/scene.h"

namespace polymorph {

/// Eases `t`, clamped to [0, 1]; 0 and 1 are kept exactly. The curves of MotionSettings::easing
/// are: linear t; smoothstep 3t^2 - 2t^3; quintic 6t^5 - 15t^4 + 10t^3; bezier: the curve (0,0),
/// (x1,y1), (x2,y2), (1,1) as in CSS; spring: a damped oscillator released at 0 with equilibrium 1
/// (Gilbert 2010, Eq. 3.4), which may overshoot. `inertia` multiplies the spring's mass.
float ease(const MotionSettings& motion, float t, float inertia = 1);

}  // namespace polymorph
