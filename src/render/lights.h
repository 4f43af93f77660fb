// The rig: the key light and the studio around the stage, both placed relative to the camera.
#pragma once

#include <memory>
#include <optional>

#include "kernels/types.h"
#include "render/render.h"
#include "render/sky.h"
#include "render/vector_math.h"

namespace polymorph {

/// A round light infinitely far away, like the sun.
struct KeyLight {
  Frame frame;           ///< z points to its centre
  float cos_radius = 1;  ///< of its apparent radius; 1 = a point
  float sin_radius = 0;
  float density = 0;  ///< 1 / solid angle; 0 = a point
  Vec3 irradiance;    ///< on a surface that faces it
  Vec3 radiance;      ///< of the disc; 0 for a point
  Vec3 sample_power;  ///< radiance / density, or irradiance for a point: what one sample carries
};

/// Key light of the settings; its irradiance is key_intensity * key_color.
KeyLight make_key_light(const LightSettings& settings, const Camera& camera);
/// A lamp of kind sun, the same way.
KeyLight make_sun(const LampSettings& settings, const Camera& camera);
/// A direction towards it.
Vec3 sample_key(const KeyLight& key, float u, float v);
inline bool hits_key(const KeyLight& key, Vec3 direction) {
  return key.density > 0 && dot(direction, key.frame.z) >= key.cos_radius;
}

/// Can nothing inside this sphere stand between the point and any part of the light? (May say no
/// needlessly.)
bool key_is_clear(const KeyLight& key, Vec3 point, Vec3 center, float radius);

/// Camera's horizontal bearing: x to its right, y up in the world, z from the subject towards the
/// camera.
Frame make_rig(const Camera& camera);

/// The built-in studio: a sky of soft boxes whose lower half and horizon show a floor of the colour
/// `floor` under that very sky and the key light.
Sky make_studio_sky(const Frame& rig, const KeyLight& key, Vec3 floor, float scale, SkyPart part);

}  // namespace polymorph
