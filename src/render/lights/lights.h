// Key light and studio environment, both placed relative to the camera.
#pragma once

#include <memory>
#include <optional>

#include "kernels/types.h"
#include "render/lights/sky.h"
#include "render/math/vector_math.h"
#include "render/render.h"

namespace polymorph {

/// A round light infinitely far away, like the sun.
struct KeyLight {
  Frame frame;           ///< z points to its centre
  float cos_radius = 1;  ///< cosine of its angular radius; 1 = a point
  float sin_radius = 0;
  float pdf = 0;      ///< 1 / solid angle; 0 = a point
  Vec3 irradiance;    ///< irradiance on a surface that faces it
  Vec3 radiance;      ///< radiance of the disc; 0 for a point
  Vec3 sample_power;  ///< contribution of one sample: radiance / pdf, or irradiance for a point
};

/// Makes the key light of the settings; its irradiance is key_intensity * key_color.
KeyLight make_key_light(const LightSettings& settings, const Camera& camera);
/// Makes a lamp of kind sun, in the same way.
KeyLight make_sun(const LampSettings& settings, const Camera& camera);
/// Samples a direction towards it.
template <class V>
PM_HD inline Vec3Of<V> sample_key(const KeyLight& key, V u, V v) {
  if (!(key.pdf > 0)) return broadcast3<Vec3Of<V>>(key.frame.z);
  return to_world(key.frame, cone_direction(1 - key.cos_radius, u, v));
}
template <class T3>
PM_HD inline MaskOf<T3> hits_key(const KeyLight& key, T3 direction) {
  return dot(direction, key.frame.z) >= (key.pdf > 0 ? key.cos_radius : 2.0f);
}

/// Tests whether nothing inside this sphere can be between the point and any part of the light.
/// Conservative: it may return false needlessly.
template <class T3>
PM_HD inline MaskOf<T3> key_is_clear(const KeyLight& key, T3 point, Vec3 center, float radius) {
  // The cone of the light's directions around its axis, half angle r: the sphere is outside of it
  // where the signed distance of its centre from the cone, d cos r - along sin r, exceeds its
  // radius.
  using V = ComponentOf<T3>;
  const T3 to_center = center - point;
  const V along = dot(to_center, key.frame.z);
  const V axis_distance = sqrt(max(dot(to_center, to_center) - along * along, 0.0f));
  return (along + radius < 0.0f) |
         (axis_distance * key.cos_radius - along * key.sin_radius > radius);
}

/// Makes the frame of the camera's horizontal direction: x to its right, y up in the world, z from
/// the subject towards the camera.
Frame make_rig(const Camera& camera);

/// Makes the built-in studio: a sky of soft boxes whose lower half and horizon show a floor of the
/// colour `floor` that this sky and the key light illuminate.
Sky make_studio_sky(const Frame& rig, const KeyLight& key, Vec3 floor, float scale, SkyPart part);

}  // namespace polymorph
