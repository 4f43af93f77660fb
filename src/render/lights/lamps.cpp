#include "render/lights/lamps.h"

#include <cmath>
#include <limits>

namespace polymorph {
namespace {

constexpr float kNever = std::numeric_limits<float>::infinity();

/// 1 - cos of the half angle at which a ball is seen from outside.
template <class V>
V cap_height(float radius, V distance2) {
  const V sin2 = radius * radius / distance2;
  // 1 - sqrt(1 - s^2) would cancel for small balls.
  return sin2 / (1.0f + sqrt(max(1.0f - sin2, 0.0f)));
}

template <class T3>
ComponentOf<T3> intersect(const Lamp& lamp, const RayOf<T3>& ray) {
  using V = ComponentOf<T3>;
  const V no_hit = broadcast<V>(kNever);
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
  const V inside2 = lamp.radius * lamp.radius - dot(perpendicular, perpendicular);
  const V distance = along - sqrt(max(inside2, 0.0f));
  return select((inside2 >= 0.0f) & (distance > 0.0f) & (distance < ray.far), distance, no_hit);
}

template <class T3>
ComponentOf<T3> compute_pdf(const Lamp& lamp, const RayOf<T3>& ray, ComponentOf<T3> distance) {
  using V = ComponentOf<T3>;
  if (lamp.panel) {
    const V cosine = -dot(ray.direction, lamp.frame.z);
    return distance * distance / (cosine * (4 * lamp.half_width * lamp.half_height));
  }
  const T3 to_lamp = lamp.position - ray.origin;
  return 1.0f / (2 * kPi * cap_height(lamp.radius, dot(to_lamp, to_lamp)));
}

template <class T3>
LampSampleOf<T3> sample(const Lamp& lamp, T3 from, ComponentOf<T3> u, ComponentOf<T3> v) {
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
  const V hit = intersect(lamp, RayOf<T3>{from, sample.direction});
  sample.distance = select(hit < kNever, hit, sample.distance);
  sample.pdf = zero_unless(outside, 1.0f / (2 * kPi * height));
  sample.power = zero_unless(outside, lamp.radiance * (1.0f / sample.pdf));
  return sample;
}

}  // namespace

Lamp make_lamp(const LampSettings& settings, Vec3 middle) {
  Lamp lamp;
  lamp.position = settings.position;
  const Vec3 to_target = settings.target.value_or(middle) - settings.position;
  const float distance2 = std::max(dot(to_target, to_target), 1e-12f);
  lamp.irradiance = settings.color * settings.intensity;
  lamp.panel = settings.kind == LampKind::kPanel;
  const Vec3 forward = normalized(to_target);
  lamp.frame = make_frame(dot(forward, forward) > 0.5f ? forward : Vec3{0, -1, 0});
  // Upright if possible: its width is horizontal.
  const Vec3 level = cross(Vec3{0, 1, 0}, lamp.frame.z);
  if (dot(level, level) > 1e-6f) {
    lamp.frame.x = normalized(level);
    lamp.frame.y = cross(lamp.frame.z, lamp.frame.x);
  }
  if (lamp.panel) {
    lamp.half_width = 0.5f * settings.width;
    lamp.half_height = 0.5f * settings.height;
    // Exact for a small panel; near, large panels give less than `intensity`.
    lamp.radiance = lamp.irradiance * (distance2 / (settings.width * settings.height));
    return lamp;
  }
  lamp.radius = settings.radius;
  lamp.intensity = lamp.irradiance * distance2;
  if (lamp.radius > 0) lamp.radiance = lamp.intensity / (kPi * lamp.radius * lamp.radius);
  return lamp;
}

LampSample sample_lamp(const Lamp& lamp, Vec3 from, float u, float v) {
  return sample(lamp, from, u, v);
}
LampSampleOf<Pack3> sample_lamp(const Lamp& lamp, const Pack3& from, Pack u, Pack v) {
  return sample(lamp, from, u, v);
}

float intersect_lamp(const Lamp& lamp, const Ray& ray) { return intersect(lamp, ray); }
Pack intersect_lamp(const Lamp& lamp, const RayOf<Pack3>& ray) { return intersect(lamp, ray); }

float lamp_pdf(const Lamp& lamp, const Ray& ray, float distance) {
  return compute_pdf(lamp, ray, distance);
}
Pack lamp_pdf(const Lamp& lamp, const RayOf<Pack3>& ray, Pack distance) {
  return compute_pdf(lamp, ray, distance);
}

}  // namespace polymorph
