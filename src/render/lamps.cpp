#include "render/lamps.h"

#include <cmath>
#include <limits>

namespace polymorph {
namespace {

constexpr float kNever = std::numeric_limits<float>::infinity();

/// 1 - cos of the half angle at which a ball is seen, and the sine's square.
struct Cap {
  float height = 0, sin2 = 0;
};
Cap cap_of(float radius, float distance2) {
  const float sin2 = radius * radius / distance2;
  // 1 - sqrt(1 - s^2) would cancel for small balls.
  return {sin2 / (1 + std::sqrt(std::max(0.0f, 1 - sin2))), sin2};
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
  // Upright where it can be: its width is level.
  const Vec3 level = cross(Vec3{0, 1, 0}, lamp.frame.z);
  if (dot(level, level) > 1e-6f) {
    lamp.frame.x = normalized(level);
    lamp.frame.y = cross(lamp.frame.z, lamp.frame.x);
  }
  if (lamp.panel) {
    lamp.half_width = 0.5f * settings.width;
    lamp.half_height = 0.5f * settings.height;
    // Of a small panel; near ones give less than `intensity`, as panels do.
    lamp.radiance = lamp.irradiance * (distance2 / (settings.width * settings.height));
    return lamp;
  }
  lamp.radius = settings.radius;
  lamp.intensity = lamp.irradiance * distance2;
  if (lamp.radius > 0) lamp.radiance = lamp.intensity / (kPi * lamp.radius * lamp.radius);
  return lamp;
}

LampSample sample_lamp(const Lamp& lamp, Vec3 from, float u, float v) {
  LampSample sample;
  if (lamp.panel) {
    const Vec3 point = lamp.position + lamp.frame.x * ((2 * u - 1) * lamp.half_width) +
                       lamp.frame.y * ((2 * v - 1) * lamp.half_height);
    const Vec3 way = point - from;
    const float distance2 = dot(way, way);
    sample.distance = std::sqrt(distance2);
    if (!(sample.distance > 0)) return {};
    sample.direction = way / sample.distance;
    const float cosine = -dot(sample.direction, lamp.frame.z);
    if (cosine <= 1e-6f) return {};
    sample.density = distance2 / (cosine * 4 * lamp.half_width * lamp.half_height);
    sample.power = lamp.radiance / sample.density;
    return sample;
  }
  const Vec3 way = lamp.position - from;
  const float distance2 = dot(way, way);
  sample.distance = std::sqrt(distance2);
  if (!(sample.distance > lamp.radius)) return {};
  const Vec3 axis = way / sample.distance;
  if (!(lamp.radius > 0)) {
    sample.direction = axis;
    sample.power = lamp.intensity / distance2;
    return sample;
  }
  const Cap cap = cap_of(lamp.radius, distance2);
  const Vec2 disc = concentric_disc(u, v);
  const float r2 = disc.x * disc.x + disc.y * disc.y;
  const float scale = std::sqrt(std::max(0.0f, cap.height * (2 - r2 * cap.height)));
  sample.direction =
      normalized(to_world(make_frame(axis), {disc.x * scale, disc.y * scale, 1 - r2 * cap.height}));
  const float met = meets_lamp(lamp, {from, sample.direction});
  if (met < kNever) sample.distance = met;
  sample.density = 1 / (2 * kPi * cap.height);
  sample.power = lamp.radiance / sample.density;
  return sample;
}

float meets_lamp(const Lamp& lamp, const Ray& ray) {
  const Vec3 way = lamp.position - ray.origin;
  if (lamp.panel) {
    const float facing = -dot(ray.direction, lamp.frame.z);
    if (facing <= 1e-6f) return kNever;
    const float distance = -dot(way, lamp.frame.z) / facing;
    if (!(distance > 0 && distance < ray.far)) return kNever;
    const Vec3 there = ray.direction * distance - way;
    return std::fabs(dot(there, lamp.frame.x)) <= lamp.half_width &&
                   std::fabs(dot(there, lamp.frame.y)) <= lamp.half_height
               ? distance
               : kNever;
  }
  if (!(lamp.radius > 0)) return kNever;
  const float along = dot(way, ray.direction);
  const Vec3 aside = way - ray.direction * along;
  const float inside2 = lamp.radius * lamp.radius - dot(aside, aside);
  if (along <= 0 || inside2 < 0) return kNever;
  const float distance = along - std::sqrt(inside2);
  return distance > 0 && distance < ray.far ? distance : kNever;
}

float lamp_density(const Lamp& lamp, const Ray& ray, float distance) {
  if (lamp.panel) {
    const float cosine = -dot(ray.direction, lamp.frame.z);
    return distance * distance / (cosine * 4 * lamp.half_width * lamp.half_height);
  }
  const Vec3 way = lamp.position - ray.origin;
  return 1 / (2 * kPi * cap_of(lamp.radius, dot(way, way)).height);
}

}  // namespace polymorph
