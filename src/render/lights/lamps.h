// Point and area lights: points, spheres and rectangular panels. Camera rays do not see them.
#pragma once

#include "kernels/types.h"
#include "render/math/vector_math.h"
#include "render/rays/ray.h"
#include "scene/scene.h"

namespace polymorph {

/// A light: a sphere, a point (radius 0), or a panel that emits on one side.
struct Lamp {
  Vec3 position;  ///< centre
  float radius = 0;
  bool panel = false;
  Frame frame;  ///< panel: z is the normal of the emitting side, x along the width
  float half_width = 0, half_height = 0;
  Vec3 radiance;    ///< surface radiance; 0 for a point
  Vec3 intensity;   ///< radiant intensity of a point (power per solid angle)
  Vec3 irradiance;  ///< irradiance at the target, of a surface that faces the lamp
};

/// Makes a lamp or panel (not a sun). `middle`: the target of a lamp whose settings have none.
Lamp make_lamp(const LampSettings& settings, Vec3 middle);

/// A direction sampled from a point to a lamp, or eight such directions.
template <class T3>
struct LampSampleOf {
  T3 direction{};
  ComponentOf<T3> distance{};  ///< distance of the lamp
  ComponentOf<T3> pdf{};       ///< per solid angle; 0 = a point, or no light arrives
  T3 power{};  ///< radiance / pdf, or intensity / distance^2 of a point; 0 = no light arrives
};
using LampSample = LampSampleOf<Vec3>;

/// Returns 1 - cos(half angle) of the cone in which a sphere is seen from outside.
template <class V>
PM_HD V cap_height(float radius, V distance2) {
  const V sin2 = radius * radius / distance2;
  // 1 - sqrt(1 - sin^2) would cancel for small spheres.
  return sin2 / (1.0f + sqrt(max(1.0f - sin2, 0.0f)));
}

/// Returns the distance at which a ray hits the emitting side, or infinity. Points and panels seen
/// edge-on are never hit.
template <class T3>
PM_HD ComponentOf<T3> intersect_lamp(const Lamp& lamp, const RayOf<T3>& ray) {
  using V = ComponentOf<T3>;
  const V no_hit = broadcast<V>(kInfinity);
  const T3 to_lamp = lamp.position - ray.origin;
  if (lamp.panel) {
    const V facing = -dot(ray.direction, lamp.frame.z);
    const V distance = -dot(to_lamp, lamp.frame.z) / facing;
    const T3 offset = ray.direction * distance - to_lamp;
    const MaskOf<T3> hit = (facing > 1e-6f) & (distance > 0.0f) & (distance < ray.far) &
                           (abs(dot(offset, lamp.frame.x)) <= lamp.half_width) &
                           (abs(dot(offset, lamp.frame.y)) <= lamp.half_height);
    return select(hit, distance, no_hit);
  }
  if (!(lamp.radius > 0)) return no_hit;
  const V along = dot(to_lamp, ray.direction);
  const T3 perpendicular = to_lamp - ray.direction * along;
  const V half_chord2 = lamp.radius * lamp.radius - dot(perpendicular, perpendicular);
  const V distance = along - sqrt(max(half_chord2, 0.0f));
  return select((half_chord2 >= 0.0f) & (distance > 0.0f) & (distance < ray.far), distance, no_hit);
}

/// The pdf of sample_lamp(), from the ray's origin, for the ray's direction. The ray hits the lamp
/// at `distance`.
template <class T3>
PM_HD ComponentOf<T3> lamp_pdf(const Lamp& lamp, const RayOf<T3>& ray, ComponentOf<T3> distance) {
  using V = ComponentOf<T3>;
  if (lamp.panel) {
    const V cosine = -dot(ray.direction, lamp.frame.z);
    return distance * distance / (cosine * (4 * lamp.half_width * lamp.half_height));
  }
  const T3 to_lamp = lamp.position - ray.origin;
  return 1.0f / (2 * kPi * cap_height(lamp.radius, dot(to_lamp, to_lamp)));
}

/// Samples a direction from a point to a lamp. No light arrives inside a sphere or behind a panel.
template <class T3>
PM_HD LampSampleOf<T3> sample_lamp(const Lamp& lamp, const T3& from, ComponentOf<T3> u,
                                   ComponentOf<T3> v) {
  using V = ComponentOf<T3>;
  LampSampleOf<T3> sample;
  if (lamp.panel) {
    const T3 point = lamp.position + lamp.frame.x * ((2.0f * u - 1.0f) * lamp.half_width) +
                     lamp.frame.y * ((2.0f * v - 1.0f) * lamp.half_height);
    const T3 to_point = point - from;
    sample.distance = length(to_point);
    sample.direction = to_point / sample.distance;
    const V cosine = -dot(sample.direction, lamp.frame.z);
    const MaskOf<T3> lit = (sample.distance > 0.0f) & (cosine > 1e-6f);
    sample.pdf = zero_unless(lit, sample.distance * sample.distance /
                                      (cosine * (4 * lamp.half_width * lamp.half_height)));
    sample.power = zero_unless(lit, lamp.radiance * (1.0f / sample.pdf));
    return sample;
  }
  const T3 to_lamp = lamp.position - from;
  const V distance2 = dot(to_lamp, to_lamp);
  sample.distance = sqrt(distance2);
  const MaskOf<T3> outside = sample.distance > lamp.radius;
  const T3 axis = to_lamp / sample.distance;
  if (!(lamp.radius > 0)) {
    sample.direction = axis;
    sample.power = zero_unless(outside, lamp.intensity * (1.0f / distance2));
    return sample;
  }
  const V height = cap_height(lamp.radius, distance2);
  sample.direction = normalized(to_world(make_frame(axis), cone_direction(height, u, v)));
  const V hit = intersect_lamp(lamp, RayOf<T3>{from, sample.direction});
  // Rounding may let a ray at the rim of the sphere miss it.
  sample.distance = select(hit < kInfinity, hit, sample.distance);
  sample.pdf = zero_unless(outside, 1.0f / (2 * kPi * height));
  sample.power = zero_unless(outside, lamp.radiance * (1.0f / sample.pdf));
  return sample;
}

#if defined(PM_PACKS)
extern template Pack intersect_lamp(const Lamp&, const RayOf<Pack3>&);
extern template Pack lamp_pdf(const Lamp&, const RayOf<Pack3>&, Pack);
extern template LampSampleOf<Pack3> sample_lamp(const Lamp&, const Pack3&, Pack, Pack);
#endif

}  // namespace polymorph
