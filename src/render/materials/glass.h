// Glass: Fresnel reflection and refraction at a smooth or frosted dielectric boundary.
#pragma once

#include <cmath>

#include "render/math/vector_math.h"

namespace polymorph {

/// Fresnel reflectance of unpolarized light, 1 beyond the critical angle. `cosine` > 0: cosine of
/// the angle of incidence; `eta`: refractive index of the incident side divided by the other
/// side's.
PM_HD inline float dielectric_fresnel(float cosine, float eta) {
  const float c = clamp01(cosine);
  const float sin2 = eta * eta * (1 - c * c);
  if (sin2 >= 1) return 1;
  const float t = std::sqrt(1 - sin2);
  const float parallel = (c - eta * t) / (c + eta * t);
  const float perpendicular = (eta * c - t) / (eta * c + t);
  return 0.5f * (parallel * parallel + perpendicular * perpendicular);
}

/// Returns the direction of light that arrives along `direction` (unit) after refraction at a
/// boundary whose normal points to the incident side. `eta`: as in dielectric_fresnel(). The
/// angle of incidence must be below the critical angle.
PM_HD inline Vec3 refracted(Vec3 direction, Vec3 normal, float eta) {
  const float c = -dot(direction, normal);
  const float t = std::sqrt(std::max(0.0f, 1 - eta * eta * (1 - c * c)));
  return normalized(direction * eta + normal * (eta * c - t));
}

}  // namespace polymorph
