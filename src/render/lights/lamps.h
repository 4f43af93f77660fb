// Area and point lights: points, spheres and rectangular panels. The camera does not see them.
#pragma once

#include "kernels/types.h"
#include "render/math/vector_math.h"
#include "render/rays/scene_build.h"
#include "scene/scene.h"

namespace polymorph {

/// A glowing ball (a point where its radius is 0) or a rectangle that glows on one side.
struct Lamp {
  Vec3 position;
  float radius = 0;
  bool panel = false;
  Frame frame;  ///< panel: z towards its lit side
  float half_width = 0, half_height = 0;
  Vec3 radiance;    ///< surface radiance; 0 for a point
  Vec3 intensity;   ///< intensity of a point, per solid angle
  Vec3 irradiance;  ///< irradiance at its target
};

/// Makes a lamp or panel (not a sun). `middle` is its target if the settings have none.
Lamp make_lamp(const LampSettings& settings, Vec3 middle);

/// A sampled direction from a point to a lamp, or eight.
template <class T3>
struct LampSampleOf {
  T3 direction{};
  ComponentOf<T3> distance{};
  ComponentOf<T3> pdf{};  ///< per solid angle; 0 = a point, or not visible from here
  T3 power{};             ///< radiance / pdf, or intensity / distance^2; black = nothing
};
using LampSample = LampSampleOf<Vec3>;
LampSample sample_lamp(const Lamp& lamp, Vec3 from, float u, float v);
LampSampleOf<Pack3> sample_lamp(const Lamp& lamp, const Pack3& from, Pack u, Pack v);

/// Distance at which a ray hits the emitting side, or infinity. Points are never hit.
float intersect_lamp(const Lamp& lamp, const Ray& ray);
Pack intersect_lamp(const Lamp& lamp, const RayOf<Pack3>& ray);
/// The pdf of sample_lamp() for a ray from its origin that hits the lamp at `distance`.
float lamp_pdf(const Lamp& lamp, const Ray& ray, float distance);
Pack lamp_pdf(const Lamp& lamp, const RayOf<Pack3>& ray, Pack distance);

}  // namespace polymorph
