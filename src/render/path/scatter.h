// Path scattering at surfaces (BSDF sampling, glass, shadow catcher), for one path or for eight.
#pragma once

#include <algorithm>

#include "render/materials/glass.h"
#include "render/path/path.h"
#include "render/path/shadow_rays.h"
#include "render/path/surface_shading.h"

namespace polymorph {

/// Random numbers of path vertices, from disjoint sets of the sampler.
template <class V>
struct VertexRandomOf {
  /// Offsets of the sets, larger than any depth. kTimeSet lies between them.
  static constexpr std::uint32_t kSkySets = 1024, kGlassSets = 2048, kLightSets = 8192;
  static constexpr std::uint32_t kMaxLights = 32;  ///< sets per vertex, at least kMaxLamps
  PathSamplerOf<V> sampler;
  std::uint32_t set;  ///< 1 + v at vertex v
  bool centered;      ///< lights are sampled at their centres
  /// Returns the random numbers for the key light (a, b) and the next direction (c, d).
  PM_HD Sample4Of<V> vertex() const { return centered ? center() : sampler.get(set); }
  PM_HD Sample4Of<V> sky() const { return sampler.get(kSkySets + set); }
  PM_HD Sample4Of<V> glass() const { return sampler.get(kGlassSets + set); }
  PM_HD Sample4Of<V> light(std::size_t i) const {
    if (centered) return center();
    return sampler.get(kLightSets + set * kMaxLights + static_cast<std::uint32_t>(i));
  }
  PM_HD static Sample4Of<V> center() {
    const V half = broadcast<V>(0.5f);
    return {half, half, half, half};
  }
};

/// Path vertices, with the data for sampling lights. `Shadows` is ShadowRays or has the same add().
template <class T3, class Shadows>
struct VerticesOf {
  PathOf<T3>& path;
  BitsOf<ComponentOf<T3>> rows;  ///< indices of the paths in the wave
  T3 origin;                     ///< origin of the shadow rays and of the next ray
  MaskOf<T3> live;               ///< lanes that hold a path
  MaskOf<T3> uses_mis{};         ///< lanes whose next ray also adds suns and lamps that it hits
  Shadows& shadows;
  MaskOf<T3> records_unlit{};  ///< lanes whose unoccluded light is recorded as well (PathOf::unlit)
};

// Lobes sharper than this count as mirrors, which do not set kScattered.
inline constexpr float kMirrorAlpha = 0.1f;
// Density of the rays from the floor towards the objects, relative to sampling by the cosine, for
// the first vertex of a path (FloorDirectionOf). Of six scenes with 16 samples, 4 lowers the mean
// FLIP by 17 % and takes 14 % more time (2: 10 and 7 %, 6: 19 and 18 %; measured).
inline constexpr float kObjectDensity = 4;
// Directions per path in estimate_gloss_sky(). Of six scenes with 16 samples, 4 directions lower
// the mean FLIP by 10 % and take 10 % more time (2: 7 and 4 %, 8: 10 and 17 %); in a preview of one
// sample they lower it by 20 to 29 % (measured).
inline constexpr int kGlossSkySamples = 4;
// Replaces the infinite pdf of a smooth mirror or glass.
inline constexpr float kDeltaPdf = 1e30f;

/// Light that arrives from one direction unless it is occluded.
template <class T3>
struct DirectLightOf {
  T3 direction;
  ComponentOf<T3> distance;  ///< distance of the light
  T3 radiance;               ///< contribution to the path's radiance
  MaskOf<T3> lanes;          ///< lanes to which light arrives
};

/// Adds a shadow ray towards a light. Where vertices.records_unlit, the unoccluded light is
/// recorded as well.
template <class T3, class Shadows>
PM_HD void add_direct(const World& world, VerticesOf<T3, Shadows>& vertices,
                      const DirectLightOf<T3>& light) {
  const auto& [direction, distance, radiance, lanes] = light;
  vertices.path.unlit =
      vertices.path.unlit + zero_unless(vertices.records_unlit & lanes, luminance(radiance));
  vertices.shadows.add({vertices.origin, direction, vertices.path.ray.time, distance},
                       clamp_indirect(world, vertices.path, radiance), vertices.rows, lanes);
}

/// Adds the light of one sun. `scatter(direction)` returns the BSDF times cosine, and the pdf with
/// which the next ray takes this direction.
template <class T3, class Shadows, class Scatter>
PM_HD void add_sun(const World& world, VerticesOf<T3, Shadows>& vertices, const DistantLight& sun,
                   const Sample4Of<ComponentOf<T3>>& random, const Scatter& scatter) {
  using V = ComponentOf<T3>;
  const T3 direction = sample_distant(sun, random.a, random.b);
  const BsdfValueOf<T3> bsdf = scatter(direction);
  const MaskOf<T3> uses_mis = vertices.uses_mis & broadcast_mask<MaskOf<T3>>(sun.pdf > 0);
  const V weight =
      select(uses_mis, balance_heuristic(broadcast<V>(sun.pdf), bsdf.pdf), broadcast<V>(1));
  add_direct<T3, Shadows>(
      world, vertices,
      {direction, broadcast<V>(kInfinity),
       vertices.path.throughput * bsdf.value * sun.sample_power * weight, vertices.live});
}

/// Adds the light of one lamp. `scatter`: as in add_sun().
template <class T3, class Shadows, class Scatter>
PM_HD void add_lamp(const World& world, VerticesOf<T3, Shadows>& vertices, const Lamp& lamp,
                    const Sample4Of<ComponentOf<T3>>& random, const Scatter& scatter) {
  using V = ComponentOf<T3>;
  const LampSampleOf<T3> sample = sample_lamp(lamp, vertices.origin, random.a, random.b);
  const BsdfValueOf<T3> bsdf = scatter(sample.direction);
  const MaskOf<T3> lit = vertices.live & !is_black(sample.power);
  const V weight = select(vertices.uses_mis & (sample.pdf > 0.0f),
                          balance_heuristic(sample.pdf, bsdf.pdf), broadcast<V>(1));
  add_direct<T3, Shadows>(world, vertices,
                          {sample.direction, sample.distance,
                           vertices.path.throughput * bsdf.value * sample.power * weight, lit});
}

/// Adds light from the bright part of the sky. `scatter`: as in add_sun().
template <class T3, class Shadows, class Scatter>
PM_HD void add_bright_sky(const World& world, VerticesOf<T3, Shadows>& vertices,
                          const Sample4Of<ComponentOf<T3>>& random, const Scatter& scatter) {
  using V = ComponentOf<T3>;
  const auto [direction, pdf] = sample_bright_sky(world.sky, random.a, random.b);
  const BsdfValueOf<T3> bsdf = scatter(direction);
  const MaskOf<T3> lit = vertices.live & (pdf > 0.0f);
  const T3 bright = split_radiance(world.sky, sky_radiance(world.sky, direction)).bright;
  add_direct<T3, Shadows>(
      world, vertices,
      {direction, broadcast<V>(kInfinity),
       vertices.path.throughput * bsdf.value * bright * (power_heuristic(pdf, bsdf.pdf) / pdf),
       lit});
}

/// Adds all lights except the key light. `scatter`: as in add_sun().
template <class T3, class Shadows, class Scatter>
PM_HD void add_more_lights(const World& world, VerticesOf<T3, Shadows>& vertices,
                           const VertexRandomOf<ComponentOf<T3>>& random, const Scatter& scatter) {
  std::size_t light = 0;
  for (const DistantLight& sun : world.suns.subspan(1))
    add_sun(world, vertices, sun, random.light(light++), scatter);
  for (const Lamp& lamp : world.lamps)
    add_lamp(world, vertices, lamp, random.light(light++), scatter);
  if (world.sky.has_bright) add_bright_sky(world, vertices, random.sky(), scatter);
}

/// Fraction of the calm sky's light on the floor that a ball of 0.6 times the objects' radius
/// occludes (Howell, catalog of radiation configuration factors, B-38).
template <class T3>
PM_HD ComponentOf<T3> occluded_by_ball(const World& world, const T3& point) {
  using V = ComponentOf<T3>;
  if (!(world.radius > 0)) return V{};  // no objects
  const T3 to_center = world.center - point;
  const V distance2 = dot(to_center, to_center);
  const float radius = 0.6f * world.radius;
  return clamp01(max(to_center.y, 0.0f) * (radius * radius) / (distance2 * sqrt(distance2)));
}

/// Weight of the control variate on the floor: 1 - occluded_by_ball(), the fraction of the calm
/// sky's light that arrives. Any weight gives the same mean; where most of the sky is occluded, a
/// weight of 1 would only add noise. On a knot and a cow this weight gives 25 to 29 % less variance
/// than 1 everywhere (measured).
template <class T3>
PM_HD ComponentOf<T3> control_variate_weight(const World& world, const T3& point) {
  using V = ComponentOf<T3>;
  const V hidden = occluded_by_ball(world, point);
  // Where little is hidden the weight is 1: rays that miss all meshes then need not evaluate the
  // sky.
  return select(hidden < 0.1f, broadcast<V>(1), 1.0f - hidden);
}

/// The next direction of a path on the floor.
template <class T3>
struct FloorDirectionOf {
  T3 direction;
  ComponentOf<T3> weight;  ///< pdf by the cosine over the pdf of the sample; 0: no ray is needed
  MaskOf<T3> aimed;        ///< lanes whose direction is towards the objects
};

/// Samples a direction from a point on the floor, by the cosine or, in those lanes of `may_aim`
/// that are outside the upright cylinder around the meshes, towards that cylinder. Only there can
/// something hide the sky, whose light has been added (PathOf::control_variate). On the unit disc
/// of directions by the cosine, a sector of a ring contains the directions to the cylinder. The
/// smaller it is, the fewer samples go there: kObjectDensity times as many as by the cosine.
template <class T3>
PM_HD_CALL FloorDirectionOf<T3> sample_floor_direction(const World& world, const T3& origin,
                                                       ComponentOf<T3> u, ComponentOf<T3> v,
                                                       MaskOf<T3> may_aim) {
  using V = ComponentOf<T3>;
  const T3 local = cosine_direction(u, v);
  const T3 by_cosine{local.x, local.z, -local.y};  // from z up to y up
  const V x = world.center.x - origin.x, z = world.center.z - origin.z;
  const V distance = sqrt(x * x + z * z), gap = distance - world.upright_radius;
  const MaskOf<T3> aimed = may_aim & (gap > 0.0f);
  if (!any(aimed)) return {by_cosine, broadcast<V>(1), aimed};
  // The sector's half angle, in turns: asin(s) is at most s + (pi / 2 - 1) s^3.
  const V sine = world.upright_radius / distance;
  const V half_angle = (sine + (0.5f * kPi - 1) * sine * sine * sine) * (0.5f * kInvPi);
  const V height = max(world.bounds.high.y - origin.y, 0.0f);
  const V inner2 = gap * gap / (gap * gap + height * height);  // square of the ring's inner radius
  const V fraction = 2.0f * half_angle * (1.0f - inner2);      // of the disc's area
  const V probability = min(kObjectDensity * fraction, 1.0f);
  const V radius2 = inner2 + (1.0f - inner2) * min(u / probability, 1.0f);
  const Vec2Of<V> turn = cos_sin_turns<V>((2.0f * v - 1.0f) * half_angle);
  const V scale = sqrt(radius2) / distance;
  const T3 towards{(x * turn.x - z * turn.y) * scale, sqrt(max(1.0f - radius2, 0.0f)),
                   (z * turn.x + x * turn.y) * scale};
  return {select(aimed, towards, by_cosine),
          select(aimed, zero_unless(u < probability, fraction / probability), broadcast<V>(1)),
          aimed};
}

/// Factor that fades out light from directions above the smooth surface but near or below the
/// triangle's horizon. It follows Chiang et al. 2019, "Taming the shadow terminator", but acts only
/// near the terminator: their term shows every facet of a coarse mesh.
template <class T3>
PM_HD ComponentOf<T3> shadow_terminator(const SurfacePointOf<T3>& point, const T3& direction) {
  using V = ComponentOf<T3>;
  const V flat_cosine = dot(point.normal, direction);
  const V smooth_cosine = dot(point.shading, direction) * dot(point.shading, point.normal);
  return zero_unless(flat_cosine > 0.0f, select(flat_cosine >= smooth_cosine, broadcast<V>(1),
                                                smoothstep(0, 0.5f, flat_cosine / smooth_cosine)));
}

/// Adds the sky that gloss reflects, as if nothing occluded it. A sharp lobe reflects the radiance
/// in the mirror direction, a rough one the mean radiance of the hemisphere around that direction;
/// the roughness interpolates between both.
template <class T3>
PM_HD_CALL void add_mirrored_sky(const World& world, PathOf<T3>& path, const BsdfOf<T3>& bsdf,
                                 MaskOf<T3> where) {
  using V = ComponentOf<T3>;
  where = where & bsdf.has_gloss;
  if (!any(where)) return;
  const T3 direction = to_world(bsdf.frame, T3{-bsdf.view.x, -bsdf.view.y, bsdf.view.z});
  const SkySplitOf<T3> sky = split_radiance(world.sky, sky_radiance(world.sky, direction));
  T3 sharp = sky.calm;
  // This term is the light that BSDF sampling would add; add_bright_sky() adds the rest.
  if (world.sky.has_bright) {
    const V pdf = evaluate_bsdf(bsdf, to_local(bsdf.frame, direction)).pdf;
    sharp = sharp + sky.bright * power_heuristic(pdf, bright_sky_pdf(world.sky, direction));
  }
  const T3 blurred = sky_irradiance(world.sky, direction) * kInvPi;
  T3 light{};
  for (int i = 0; i < bsdf.gloss_count; ++i) {
    const GlossLobeOf<T3>& lobe = bsdf.gloss[i];
    const V roughness = sqrt(lobe.alpha);
    const T3 albedo = compute_gloss_energy(lobe.f0, lobe.alpha, bsdf.view.z).albedo;
    light = light + (sharp * (1.0f - roughness) + blurred * roughness) * albedo * lobe.weight;
  }
  path.radiance = path.radiance + zero_unless(where, path.throughput * light);
}

/// Estimates the light of an unoccluded calm sky that a BSDF reflects beyond its diffuse albedo:
/// its gloss, and what the coat's transmittance changes. The directions, which need no rays, are
/// copies of (u, v) that a rank-1 lattice shifts, so that those of all samples stay well
/// distributed. Half of them are for the diffuse lobes, because the coat's part varies over the
/// whole hemisphere; with a quarter the pictures have more noise (measured).
template <class T3>
PM_HD_CALL T3 estimate_gloss_sky(const SkyTables& sky, BsdfOf<T3> bsdf, ComponentOf<T3> u,
                                 ComponentOf<T3> v) {
  using V = ComponentOf<T3>;
  const V gloss = bsdf.gloss_probability[0] + bsdf.gloss_probability[1];
  bsdf.diffuse_probability = select(bsdf.has_diffuse, broadcast<V>(0.5f), broadcast<V>(0));
  const V scale = zero_unless(gloss > 0.0f, (1.0f - bsdf.diffuse_probability) / gloss);
  for (V& probability : bsdf.gloss_probability) probability = probability * scale;
  constexpr float kGoldenRatio = 0.618034f;
  const auto wrap = [](V x) { return select(x >= 1.0f, x - 1.0f, x); };
  constexpr float kStep = 1.0f / kGlossSkySamples;
  T3 sum{};
  float shift = 0;
  for (int i = 0; i < kGlossSkySamples; ++i) {
    const T3 local = sample_bsdf(bsdf, wrap(u + static_cast<float>(i) * kStep), wrap(v + shift));
    const BsdfValueOf<T3> value = evaluate_bsdf(bsdf, local);
    const T3 beyond_diffuse = value.value - bsdf.diffuse_albedo * (kInvPi * local.z);
    const T3 calm = split_radiance(sky, sky_radiance(sky, to_world(bsdf.frame, local))).calm;
    sum = sum + zero_unless(value.pdf > 0.0f, beyond_diffuse * calm / value.pdf);
    shift = shift + kGoldenRatio < 1 ? shift + kGoldenRatio : shift + kGoldenRatio - 1;
  }
  return sum * kStep;
}

/// Scatters paths on the floor: adds all lights and the calm sky, then samples the next direction.
/// Returns the lanes whose paths continue.
template <class T3, class Shadows>
PM_HD MaskOf<T3> scatter_on_floor(const World& world, VerticesOf<T3, Shadows>& vertices,
                                  const FloorPointOf<T3>& point,
                                  const VertexRandomOf<ComponentOf<T3>>& random, RayStats& stats) {
  using V = ComponentOf<T3>;
  PathOf<T3>& path = vertices.path;
  const Sample4Of<V> sample = random.vertex();
  const T3 albedo = world.floor.color * point.tone;
  vertices.origin = point.position + Vec3{0, world.epsilon, 0};
  const auto lambert = [&](const T3& d) {
    const V cosine = kInvPi * max(d.y, 0.0f);
    return BsdfValueOf<T3>{albedo * cosine, cosine};
  };
  const MaskOf<T3> records_unlit = broadcast_mask<MaskOf<T3>>(world.shadow_only) &
                                   has(path, kFromCamera) & !has(path, kThroughGlass);
  set(path, kOnShadowFloor, has(path, kOnShadowFloor) | records_unlit);
  // The key light. A disc that is completely above the floor's horizon contributes its irradiance
  // times the cosine, without noise.
  const DistantLight& key = world.suns.front();
  const bool is_above_horizon = key.frame.z.y >= key.sin_radius;
  MaskOf<T3> unoccluded{};
  if (is_above_horizon) {
    const T3 light =
        path.throughput * albedo * ((kInvPi * max(key.frame.z.y, 0.0f)) * key.irradiance);
    unoccluded = is_light_unoccluded(key, vertices.origin, world.center, world.radius);
    path.radiance = path.radiance + zero_unless(unoccluded, clamp_indirect(world, path, light));
    path.unlit = path.unlit + zero_unless(records_unlit, luminance(light));
  }
  const MaskOf<T3> needs_shadow_ray = vertices.live & !unoccluded;
  if (any(needs_shadow_ray)) {
    VerticesOf<T3, Shadows> shadow_vertices = vertices;
    shadow_vertices.live = needs_shadow_ray;
    shadow_vertices.records_unlit = records_unlit & broadcast_mask<MaskOf<T3>>(!is_above_horizon);
    add_sun(world, shadow_vertices, key, sample, lambert);
  }
  // The other lights and the calm sky.
  vertices.records_unlit = records_unlit;
  add_more_lights(world, vertices, random, lambert);
  const T3 sky_light = path.throughput * albedo * kInvPi * world.sky.upper_irradiance;
  path.unlit = path.unlit + zero_unless(records_unlit, luminance(sky_light));
  if (world.direct_only) {
    // The objects occlude a fraction of the sky, but reflect kGuessedBounce of its light.
    const V occluded = occluded_by_ball(world, vertices.origin);
    path.radiance = path.radiance + sky_light * (1.0f - occluded * (1 - kGuessedBounce));
    return MaskOf<T3>{};
  }

  // The next direction. The bright part of a sky needs directions by the cosine, whose pdf its
  // weights assume.
  const MaskOf<T3> may_aim =
      has(path, kFromCamera) & broadcast_mask<MaskOf<T3>>(!world.sky.has_bright);
  const auto [direction, weight, aimed] =
      sample_floor_direction(world, vertices.origin, sample.c, sample.d, may_aim);
  const V variate_weight =
      select(aimed, broadcast<V>(1), control_variate_weight(world, vertices.origin));
  path.radiance = path.radiance + sky_light * variate_weight;
  path.ray = {vertices.origin, direction, path.ray.time};
  path.pdf = kInvPi * direction.y;
  path.throughput = path.throughput * albedo * weight;
  path.control_variate = path.throughput * variate_weight;
  set(path, kHitsLights | kFromCamera, MaskOf<T3>{});
  set(path, kScattered, broadcast_mask<MaskOf<T3>>(true));
  const MaskOf<T3> upward = vertices.live & (weight > 0.0f) & (direction.y > 0.0f);
  if (world.sky.has_bright) return upward;
  // For rays that miss all meshes the control variate is exact. They need not be traced, but are
  // counted; samples without a ray (FloorDirectionOf::weight) are not.
  const MaskOf<T3> escaping =
      upward & (variate_weight == 1.0f) & misses_box(world.bounds, path.ray);
  stats.rays += static_cast<std::uint64_t>(count_lanes<V>(escaping));
  return upward & !escaping;
}

/// Scatters paths at a mesh: adds all lights and the calm sky, then samples the next direction.
/// Returns the lanes whose paths continue.
template <class T3, class Shadows>
PM_HD MaskOf<T3> scatter_on_mesh(const World& world, VerticesOf<T3, Shadows>& vertices,
                                 const SurfacePointOf<T3>& point, const BsdfOf<T3>& bsdf,
                                 const VertexRandomOf<ComponentOf<T3>>& random) {
  using V = ComponentOf<T3>;
  PathOf<T3>& path = vertices.path;
  const Sample4Of<V> sample = random.vertex();
  vertices.origin = point.lifted + point.normal * world.epsilon;
  if (!world.direct_only) vertices.uses_mis = bsdf.has_gloss;
  const auto scatter = [&](const T3& d) {
    BsdfValueOf<T3> value = evaluate_bsdf(bsdf, to_local(bsdf.frame, d));
    value.value = value.value * shadow_terminator(point, d);
    return value;
  };
  add_sun(world, vertices, world.suns.front(), sample, scatter);
  add_more_lights(world, vertices, random, scatter);
  if (bsdf.diffuse_count > 0)
    path.radiance = path.radiance + path.throughput * bsdf.diffuse_albedo * kInvPi *
                                        sky_irradiance(world.sky, point.shading);
  if (world.direct_only) {
    add_mirrored_sky(world, path, bsdf, vertices.live);
    return MaskOf<T3>{};
  }

  // The next direction.
  const T3 local = sample_bsdf(bsdf, sample.c, sample.d);
  const BsdfValueOf<T3> value = evaluate_bsdf(bsdf, local);
  const MaskOf<T3> scattered = vertices.live & (value.pdf > 0.0f);
  const T3 direction = to_world(bsdf.frame, local);
  path.control_variate = path.throughput * bsdf.diffuse_albedo * (kInvPi * local.z / value.pdf);
  const MaskOf<T3> estimates_gloss = vertices.live & has(path, kFromCamera) & bsdf.has_gloss;
  if (any(estimates_gloss)) {
    const T3 light = path.throughput * estimate_gloss_sky(world.sky, bsdf, sample.c, sample.d);
    path.radiance = path.radiance + zero_unless(estimates_gloss, light);
    path.control_variate =
        select(estimates_gloss, path.throughput * value.value / value.pdf, path.control_variate);
  }
  path.throughput = path.throughput * value.value / value.pdf;
  path.ray = {vertices.origin, direction, path.ray.time};
  path.pdf = value.pdf;
  set(path, kHitsLights, bsdf.has_gloss);
  set(path, kScattered,
      has(path, kScattered) | (bsdf.sharpest_alpha > kMirrorAlpha) |
          (sample.c < bsdf.diffuse_probability));
  set(path, kFromCamera, MaskOf<T3>{});
  const MaskOf<T3> mirror =
      (!bsdf.has_diffuse) & (bsdf.sharpest_alpha < kMirrorAlpha) & (path.free_mirrors > 0.0f);
  path.free_mirrors = path.free_mirrors - zero_unless(mirror, broadcast<V>(1));
  path.depth_left = path.depth_left - zero_unless(!mirror, broadcast<V>(1));
  // A direction below the triangle but above the shading normal's horizon carries no light, so the
  // control variate is subtracted again.
  const MaskOf<T3> above = dot(direction, point.normal) > 0.0f;
  const MaskOf<T3> below_triangle = scattered & !above;
  if (any(below_triangle)) add_sky(world, path, /*fraction=*/V{}, below_triangle);
  return scattered & above;
}

/// Refracts or reflects a path at a glass boundary. The caller chooses glass with the probability
/// glass.transmission.
PM_HD_CALL inline void pass_glass(const World& world, PathRow& path, const SurfacePoint& point,
                                  const Shading& glass, const Sample4& random) {
  const float eta = point.inside ? glass.ior : 1 / glass.ior;
  const float epsilon = world.epsilon;
  // The division makes up for the probability with which the caller has chosen glass.
  const Vec3 tint = glass_tint(glass) / std::max(glass.transmission, 1e-6f);
  const bool is_first_boundary = has(path, kFromCamera) && !has(path, kThroughGlass);
  path.flags |= kThroughGlass | kHitsLights;
  path.pdf = kDeltaPdf;
  if (has(path, kScattered)) {
    // After scattering, glass does not bend rays. This avoids fireflies, at the cost of caustics.
    const float cosine = -dot(path.ray.direction, point.shading);
    path.throughput = path.throughput * tint * (1 - dielectric_fresnel(cosine, eta));
    path.ray.origin = point.position - point.normal * epsilon;
    path.flags &= ~kHitsLights;
    return;
  }
  const Vec3 view = -path.ray.direction;
  Vec3 normal = point.shading;
  const float alpha = square(clamp01(glass.roughness));
  if (alpha > kMinAlpha) {
    const Frame frame = make_frame(point.shading);
    Vec3 local = to_local(frame, view);
    local.z = std::max(local.z, 1e-4f);
    normal = to_world(frame, sample_ggx_normal(local, alpha, random.c, random.d));
  }
  const float reflected = dielectric_fresnel(dot(view, normal), eta);
  // Reflections at the first boundary are weak but often show bright lights, so they are sampled
  // more often.
  const float probability =
      is_first_boundary && reflected > 0 && reflected < 0.25f ? 0.25f : reflected;
  Vec3 direction;
  if (random.a < probability) {
    path.throughput = path.throughput * (reflected / probability);
    direction = normal * (2 * dot(view, normal)) - view;
    // If the shading normal sends the ray to the wrong side of the triangle, the triangle's normal
    // is used, for reflection here and for refraction below.
    if (dot(direction, point.normal) <= 0)
      direction = point.normal * (2 * dot(view, point.normal)) - view;
    path.ray.origin = point.position + point.normal * epsilon;
    path.flags &= ~kFromCamera;
  } else {
    direction = refracted(path.ray.direction, normal, eta);
    if (dot(direction, point.normal) >= 0)
      direction = refracted(path.ray.direction, point.normal, eta);
    path.throughput = path.throughput * tint * ((1 - reflected) / (1 - probability));
    path.ray.origin = point.position - point.normal * epsilon;
  }
  path.ray.direction = direction;
}

#if defined(PM_PACKS)
using VertexRandom = VertexRandomOf<Pack>;
using Vertices = VerticesOf<Pack3, ShadowRays>;
extern template PackMask scatter_on_floor(const World&, Vertices&, const FloorPointOf<Pack3>&,
                                          const VertexRandom&, RayStats&);
extern template PackMask scatter_on_mesh(const World&, Vertices&, const SurfacePointOf<Pack3>&,
                                         const BsdfOf<Pack3>&, const VertexRandom&);
#endif

}  // namespace polymorph
