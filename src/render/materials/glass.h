// Glass: Fresnel reflection and refraction at a smooth or frosted dielectric boundary.
#pragma once

#include <cmath>

#include "render/math/vector_math.h"

namespace polymorph {

/// Fraction of unpolarized light that is reflected at `cosine` > 0 of the incident side; `eta` is
/// the refractive index of that side divided by the other's (Fresnel). 1 beyond the critical angle.
PM_HD inline float dielectric_fresnel(float cosine, float eta) {
  const float c = clamp01(cosine);
  const float sin2 = eta * eta * (1 - c * c);
  if (sin2 >= 1) return 1;
  const float t = std::sqrt(1 - sin2);
  const float parallel = (c - eta * t) / (c + eta * t);
  const float perpendicular = (eta * c - t) / (eta * c + t);
  return 0.5f * (parallel * parallel + perpendicular * perpendicular);
}

/// Direction of refracted light that arrives along `direction` (unit) at a boundary whose normal
/// points to the incident side; `eta` as above. Not beyond the critical angle.
PM_HD inline Vec3 refracted(Vec3 direction, Vec3 normal, float eta) {
  const float c = -dot(direction, normal);
  const float t = std::sqrt(std::max(0.0f, 1 - eta * eta * (1 - c * c)));
  return normalized(direction * eta + normal * (eta * c - t));
}

}  // namespace polymorph
