// Key light, suns and studio environment, all placed relative to the camera.
#pragma once

#include <memory>
#include <optional>

#include "kernels/types.h"
#include "render/lights/sky.h"
#include "render/math/vector_math.h"
#include "render/render.h"

namespace polymorph {

/// A round light at infinity, like the sun.
struct DistantLight {
  Frame frame;           ///< z points to the light's centre
  float cos_radius = 1;  ///< cosine of the angular radius; 1 = a point
  float sin_radius = 0;
  float pdf = 0;      ///< 1 / solid angle; 0 = a point
  Vec3 irradiance;    ///< irradiance of a surface that faces the light
  Vec3 radiance;      ///< radiance of the disc; 0 for a point
  Vec3 sample_power;  ///< contribution of one sample: radiance / pdf, or irradiance for a point
};

/// Makes the key light of the settings, with the irradiance key_intensity * key_color.
DistantLight make_key_light(const LightSettings& settings, const Camera& camera);
/// Makes a lamp of kind sun, with the irradiance intensity * color.
DistantLight make_sun(const LampSettings& settings, const Camera& camera);
/// Samples a direction towards the light, uniformly in solid angle.
template <class V>
PM_HD inline Vec3Of<V> sample_distant(const DistantLight& light, V u, V v) {
  if (!(light.pdf > 0)) return broadcast3<Vec3Of<V>>(light.frame.z);
  return to_world(light.frame, cone_direction(1 - light.cos_radius, u, v));
}
/// Tests whether a direction points into the disc of the light. It never does for a point.
template <class T3>
PM_HD inline MaskOf<T3> hits_distant(const DistantLight& light, T3 direction) {
  return dot(direction, light.frame.z) >= (light.pdf > 0 ? light.cos_radius : 2.0f);
}

/// Tests whether nothing inside a sphere can occlude any part of the light from the point. The test
/// is conservative: it may return false although nothing can.
template <class T3>
PM_HD inline MaskOf<T3> is_light_unoccluded(const DistantLight& light, T3 point, Vec3 center,
                                            float radius) {
  // The light's directions form a cone of half angle r around its axis. At distance d from the axis
  // the sphere's centre has the signed distance d cos r - along sin r from the cone; the sphere is
  // outside where this exceeds its radius. It is also outside if it is behind the point.
  using V = ComponentOf<T3>;
  const T3 to_center = center - point;
  const V along = dot(to_center, light.frame.z);
  const V axis_distance = sqrt(max(dot(to_center, to_center) - along * along, 0.0f));
  return (along + radius < 0.0f) |
         (axis_distance * light.cos_radius - along * light.sin_radius > radius);
}

/// Makes the frame to which lights are attached: x to the camera's right, y up in the world, z from
/// the subject towards the camera, x and z horizontal.
Frame make_rig(const Camera& camera);

/// Makes the built-in studio: a sky of soft boxes. Its lower half and horizon show a floor of the
/// colour `floor`, lit by this sky and the key light. `scale` multiplies the light of the soft
/// boxes and of the room around them.
Sky make_studio_sky(const Frame& rig, const DistantLight& key, Vec3 floor, float scale,
                    SkyDomain domain);

}  // namespace polymorph
