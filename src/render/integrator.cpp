#include "render/integrator.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "render/ggx.h"
#include "render/glass.h"
#include "render/materials.h"
#include "render/texture.h"

namespace polymorph {
namespace {

// Firefly control. Light from a sun or a lamp that comes by way of another surface is cut
// off here, in units of World::white, and so is the light itself where a mirror shows it: what is
// left is far above white, and edges of highlights can be smoothed. Direct light, and the sky in a
// mirror, are never cut.
constexpr float kIndirectLimit = 2.0f;
constexpr float kDiscLimit = 8.0f;
// Lobes sharper than this count as mirrors: paths remember nothing of passing one.
constexpr float kMirrorAlpha = 0.1f;
// A path may pass this many sharp mirrors without paying from max_depth, so that reflections show
// lit surfaces and not the end of a path.
constexpr int kFreeMirrors = 2;
// And so many boundaries of glass: two balls and what is behind them, with a reflection inside.
constexpr int kFreeGlass = 8;
// With a single bounce (previews) what hides the sky is taken to send back this share of it, for
// all the bounces that are left out: fewer black grains, and shadows about as deep as they are.
constexpr float kGuessedBounce = 0.4f;
// The density of a direction that a smooth mirror or glass leaves no choice of.
constexpr float kCertain = 1e30f;
// The sampler's sets beside those of the vertices themselves; beyond any depth.
constexpr std::uint32_t kSkySets = 1024, kGlassSets = 2048, kLightSets = 8192, kMostLights = 32;

bool is_black(Vec3 c) { return c.x == 0 && c.y == 0 && c.z == 0; }

struct LightPath {
  Ray ray;
  Vec3 radiance;
  Vec3 throughput{1, 1, 1};
  /// Control variate. Every diffuse vertex adds at once all the light it would get from an
  /// unobstructed calm sky (known exactly), and lets the next ray correct it: if the sky is seen
  /// after all, nothing is left to add; if not, the sky's share is taken back. So unshadowed
  /// surfaces have no noise from the sky. This is the throughput of that known share.
  Vec3 foreseen;
  float density = 0;          ///< of the ray's direction, per solid angle
  bool meets_lights = false;  ///< do suns and lamps count for this ray?
  bool from_camera = true;    ///< nothing but clear glass between
  bool through_glass = false;
  /// The first vertex lies on a floor of which only the shadows are kept.
  bool on_shadow_floor = false;
  bool notes_unlit = false;  ///< and the path is there now
  float alpha = 1;
  float unlit = 0;
  /// By a diffuse or rough surface. From then on glossy lobes are followed as diffuse ones of the
  /// same colour: their caustics would be noise at any sample count that one would wait for, and
  /// the light they lose is kept.
  bool scattered = false;
};

Vec3 limited(Vec3 light, float limit) {
  const float most = max_component(light);
  return most > limit ? light * (limit / most) : light;
}

void add_light(const World& world, LightPath& path, Vec3 light) {
  path.radiance =
      path.radiance + (path.from_camera ? light : limited(light, kIndirectLimit * world.white));
}

/// Weight of one of two ways to find the same light (Veach 1997).
float power_heuristic(float own, float other) {
  if (own <= 0) return 0;
  const float ratio = other / own;
  return 1 / (1 + ratio * ratio);
}

/// The ray leaves the scene, or meets a floor that has faded into what lies behind.
void add_sky(const World& world, LightPath& path, float share) {
  if (path.from_camera) {
    if (share == 0) return;
    if (world.transparent && !path.through_glass) {
      path.alpha -= share;
      return;
    }
    path.radiance = path.radiance +
                    path.throughput * backdrop_radiance(world.backdrop, path.ray.direction) * share;
    return;
  }
  const Vec3 seen = path.throughput * share;
  const Vec3 unknown = seen - path.foreseen;
  path.foreseen = {};
  if (is_black(unknown) && !world.sky->has_bright) return;
  const SkySplit sky = split_radiance(*world.sky, sky_radiance(*world.sky, path.ray.direction));
  path.radiance = path.radiance + unknown * sky.calm;
  if (is_black(sky.bright)) return;
  const float weight =
      power_heuristic(path.density, bright_sky_density(*world.sky, path.ray.direction));
  // A mirror shows it as it is.
  const Vec3 light = seen * sky.bright * weight;
  path.radiance =
      path.radiance + (path.scattered ? limited(light, kIndirectLimit * world.white) : light);
}

/// Suns that the ray meets, having left the scene.
void add_sun_discs(const World& world, LightPath& path) {
  if (!path.meets_lights) return;
  for (const KeyLight& sun : world.suns) {
    if (!hits_key(sun, path.ray.direction)) continue;
    const float weight = path.density / (path.density + sun.density);
    path.radiance =
        path.radiance + limited(path.throughput * sun.radiance * weight, kDiscLimit * world.white);
  }
}

/// Lamps that the ray meets on its way; they do not stop it.
void add_met_lamps(const World& world, LightPath& path, float distance) {
  if (!path.meets_lights) return;
  Ray way = path.ray;
  way.far = distance;
  for (const Lamp& lamp : world.lamps) {
    const float met = meets_lamp(lamp, way);
    if (!(met < distance)) continue;
    const float weight = path.density / (path.density + lamp_density(lamp, way, met));
    path.radiance =
        path.radiance + limited(path.throughput * lamp.radiance * weight, kDiscLimit * world.white);
  }
}

/// The mesh's own materials, mixed with what they turn into.
Shading mesh_shading(const RenderMesh& mesh, const MeshHit& hit);
float look_share(const RenderMesh& mesh) {
  return mesh.materials.empty() ? 1.0f : clamp01(mesh.look);
}
/// Of the light that arrives, glass lets this much straight through one boundary.
Vec3 glass_tint(const Shading& shading) {
  const Vec3 c = min(shading.color, {1, 1, 1});
  return Vec3{std::sqrt(c.x), std::sqrt(c.y), std::sqrt(c.z)} * shading.transmission;
}

/// The surface's mixture at a hit, as one material; only glass asks for it.
Shading mixed_shading(const World& world, const MeshHit& hit) {
  const RenderMesh& mesh = world.geometry->mesh(hit.mesh);
  const float share = look_share(mesh);
  if (share >= 1) return look_shading(world.look);
  const Shading own = mesh_shading(mesh, hit);
  return share > 0 ? mix(own, look_shading(world.look), share) : own;
}

/// The share of light that comes along a ray: none past anything opaque; straight through glass.
Vec3 passing(const World& world, const Ray& ray, Tally& tally) {
  FloorHit floor;
  if (meets_floor(world.floor, ray, floor)) {
    ++tally.rays;
    return {};
  }
  if (!world.has_glass) {
    ++tally.rays;
    return world.geometry->blocked(ray) ? Vec3{} : Vec3{1, 1, 1};
  }
  Vec3 share{1, 1, 1};
  Ray way = ray;
  for (int boundary = 0; boundary < 4 * kFreeGlass; ++boundary) {
    ++tally.rays;
    const MeshHit hit = world.geometry->closest(way);
    if (hit.mesh == kNoMesh) return share;
    const Shading shading = mixed_shading(world, hit);
    if (!(shading.transmission > 0)) return {};
    const SurfacePoint point = world.geometry->surface_point(way, hit);
    const float eta = point.inside ? shading.ior : 1 / shading.ior;
    share = share * glass_tint(shading) *
            (1 - dielectric_fresnel(-dot(way.direction, point.shading), eta));
    way.origin = point.position - point.normal * world.geometry->epsilon();
    way.far = ray.far - length(way.origin - ray.origin);
    if (is_black(share) || !(way.far > 0)) break;
  }
  return share;
}

/// Light that reaches a vertex straight from a light. On a shadow floor what it would be with
/// nothing in the way is noted as well.
void add_direct(const World& world, LightPath& path, const Ray& shadow, Vec3 light, Tally& tally) {
  if (path.notes_unlit) path.unlit += luminance(light);
  const Vec3 share = passing(world, shadow, tally);
  if (!is_black(share)) add_light(world, path, light * share);
}

/// The numbers of a vertex: `own` for its key light and next direction.
struct VertexRandom {
  Sample4 own;
  const PathSampler* sampler;
  std::uint32_t set;
  Sample4 sky() const { return sampler->get(kSkySets + set); }
  Sample4 glass() const { return sampler->get(kGlassSets + set); }
  Sample4 light(std::size_t i) const {
    return sampler->get(kLightSets + set * kMostLights + static_cast<std::uint32_t>(i));
  }
};

/// Light from one sun at a floor or mesh. `scatter(direction)` gives bsdf times cosine and density;
/// `shared`: the next ray may meet the disc as well.
template <class Scatter>
void add_sun(const World& world, LightPath& path, const KeyLight& sun, Vec3 origin, float u,
             float v, bool shared, const Scatter& scatter, Tally& tally) {
  const Vec3 direction = sample_key(sun, u, v);
  const BsdfValue bsdf = scatter(direction);
  if (is_black(bsdf.value)) return;
  // Balance heuristic (Veach 1997).
  const float weight =
      shared && sun.density > 0 ? sun.density / (sun.density + bsdf.density) : 1.0f;
  const Ray shadow{origin, direction, std::numeric_limits<float>::infinity(), path.ray.time};
  add_direct(world, path, shadow, path.throughput * bsdf.value * sun.sample_power * weight, tally);
}

template <class Scatter>
void add_lamp(const World& world, LightPath& path, const Lamp& lamp, Vec3 origin, float u, float v,
              bool shared, const Scatter& scatter, Tally& tally) {
  const LampSample sample = sample_lamp(lamp, origin, u, v);
  if (is_black(sample.power)) return;
  const BsdfValue bsdf = scatter(sample.direction);
  if (is_black(bsdf.value)) return;
  const float weight =
      shared && sample.density > 0 ? sample.density / (sample.density + bsdf.density) : 1.0f;
  const Ray shadow{origin, sample.direction, sample.distance, path.ray.time};
  add_direct(world, path, shadow, path.throughput * bsdf.value * sample.power * weight, tally);
}

/// The suns but the key light, and the lamps.
template <class Scatter>
void add_more_lights(const World& world, LightPath& path, Vec3 origin, const VertexRandom& random,
                     bool shared, const Scatter& scatter, Tally& tally) {
  std::size_t light = 0;
  for (const KeyLight& sun : world.suns.subspan(1)) {
    const Sample4 r = random.light(light++);
    add_sun(world, path, sun, origin, r.a, r.b, shared, scatter, tally);
  }
  for (const Lamp& lamp : world.lamps) {
    const Sample4 r = random.light(light++);
    add_lamp(world, path, lamp, origin, r.a, r.b, shared, scatter, tally);
  }
}

/// Light from the bright part of the sky.
template <class Scatter>
void add_bright_sky(const World& world, LightPath& path, Vec3 origin, const Sample4& random,
                    const Scatter& scatter, Tally& tally) {
  const SkySample sample = sample_bright_sky(*world.sky, random.a, random.b);
  if (!(sample.density > 0)) return;
  const BsdfValue bsdf = scatter(sample.direction);
  if (is_black(bsdf.value)) return;
  const Vec3 radiance = sky_radiance(*world.sky, sample.direction);
  const Ray shadow{origin, sample.direction, std::numeric_limits<float>::infinity(), path.ray.time};
  add_direct(world, path, shadow,
             path.throughput * bsdf.value * split_radiance(*world.sky, radiance).bright *
                 (power_heuristic(sample.density, bsdf.density) / sample.density),
             tally);
}

/// How much of the calm sky's light on the floor to foresee: the share that a ball of 0.6 of the
/// objects' radius would leave (Howell, catalog of radiation configuration factors, B-38). Any
/// share is right on average; where most of the sky is hidden, foreseeing all of it would only add
/// noise. Measured on a knot and a cow, against 1 everywhere: 25 to 29 % less variance.
float foreseen_share(const World& world, Vec3 point) {
  if (!(world.radius > 0)) return 1;  // nothing there
  const Vec3 to_center = world.center - point;
  const float distance2 = dot(to_center, to_center), radius = 0.6f * world.radius;
  const float hidden =
      clamp01(std::max(0.0f, to_center.y) * radius * radius / (distance2 * std::sqrt(distance2)));
  // Far away rays that pass by everything need not even look at the sky.
  return hidden < 0.1f ? 1.0f : 1 - hidden;
}

/// Returns false when the path ends here.
bool scatter_on_floor(const World& world, LightPath& path, const FloorHit& hit,
                      const VertexRandom& random, Tally& tally) {
  const Vec3 albedo = world.floor.color * hit.tone;
  const Vec3 origin = hit.position + Vec3{0, world.geometry->epsilon(), 0};
  const auto lambert = [&](Vec3 d) {
    const float cosine = kInvPi * std::max(0.0f, d.y);
    return BsdfValue{albedo * cosine, cosine};
  };
  path.notes_unlit = world.shadow_only && path.from_camera && !path.through_glass;
  path.on_shadow_floor = path.on_shadow_floor || path.notes_unlit;
  const KeyLight& key = world.suns.front();
  // A disc that is wholly above the floor's horizon gives its irradiance times the cosine, without
  // noise.
  const bool whole = key.frame.z.y >= key.sin_radius;
  const Vec3 key_light =
      path.throughput * albedo * (kInvPi * std::max(0.0f, key.frame.z.y)) * key.irradiance;
  const float unlit = path.unlit + luminance(key_light);
  if (whole && key_is_clear(key, origin, world.center, world.radius))
    add_light(world, path, key_light);
  else
    add_sun(world, path, key, origin, random.own.a, random.own.b, false, lambert, tally);
  if (whole) path.unlit = unlit;
  add_more_lights(world, path, origin, random, false, lambert, tally);
  if (world.sky->has_bright) add_bright_sky(world, path, origin, random.sky(), lambert, tally);
  const float share = foreseen_share(world, origin);
  if (path.notes_unlit)
    path.unlit += luminance(path.throughput * albedo * kInvPi * world.sky->upper_irradiance);
  path.notes_unlit = false;
  path.radiance =
      path.radiance + path.throughput * albedo * (kInvPi * share) * world.sky->upper_irradiance;

  const Vec3 local = cosine_direction(random.own.c, random.own.d);
  const Vec3 direction{local.x, local.z, -local.y};
  if (direction.y <= 0) return false;
  path.ray = {origin, direction, std::numeric_limits<float>::infinity(), path.ray.time};
  // Past everything: the calm sky is as foreseen.
  if (share == 1 && !world.sky->has_bright && world.geometry->misses_bounds(path.ray)) {
    ++tally.rays;
    return false;
  }
  path.density = kInvPi * direction.y;
  path.throughput = path.throughput * albedo;
  path.foreseen = path.throughput * share;
  path.meets_lights = false;
  path.scattered = true;
  path.from_camera = false;
  return true;
}

Shading layer_shading(const MaterialLayer& layer, const MeshHit& hit) {
  const std::size_t index =
      layer.triangle_materials.empty() ? 0 : layer.triangle_materials[hit.triangle];
  const Material& material = layer.materials[index];
  const auto texture = static_cast<std::size_t>(std::max(material.texture, 0));
  if (material.texture < 0 || layer.corner_uvs.empty() || texture >= layer.textures.size() ||
      !layer.textures[texture])
    return own_shading(material, {1, 1, 1});
  const Vec2* uv = &layer.corner_uvs[std::size_t{hit.triangle} * 3];
  const Vec2 at = uv[0] * (1 - hit.u - hit.v) + uv[1] * hit.u + uv[2] * hit.v;
  return own_shading(material, sample_texture(*layer.textures[texture], at));
}

Shading mesh_shading(const RenderMesh& mesh, const MeshHit& hit) {
  Shading shading = layer_shading(mesh, hit);
  for (const MixedLayer& layer : mesh.over)
    if (!layer.materials.empty() && layer.share > 0)
      shading = mix(shading, layer_shading(layer, hit), clamp01(layer.share));
  return shading;
}

Bsdf bsdf_at(const World& world, const LightPath& path, const MeshHit& hit,
             const SurfacePoint& point) {
  const RenderMesh& mesh = world.geometry->mesh(hit.mesh);
  Shading look = look_shading(world.look);
  if (path.scattered) look = matte_shading(look);
  const Vec3 view = -path.ray.direction;
  const float share = look_share(mesh);
  if (share >= 1) return make_bsdf(look, look, 1, point.shading, view);
  Shading own = mesh_shading(mesh, hit);
  if (path.scattered) own = matte_shading(own);
  return make_bsdf(own, look, share, point.shading, view);
}

/// Fades light out before it would slip below the triangle while it still is above the smooth
/// surface. After Chiang et al. 2019, "Taming the shadow terminator", but only next to it: their
/// term shows every facet of a coarse mesh.
float terminator(const SurfacePoint& point, Vec3 direction) {
  const float flat = dot(point.normal, direction);
  const float smooth = dot(point.shading, direction) * dot(point.shading, point.normal);
  if (flat <= 0) return 0;
  return flat >= smooth ? 1.0f : smoothstep(0, 0.5f, flat / smooth);
}

/// Returns false when the path ends here.
bool scatter_on_mesh(const World& world, LightPath& path, const SurfacePoint& point,
                     const Bsdf& bsdf, const VertexRandom& random, Tally& tally) {
  const Vec3 origin = point.lifted + point.normal * world.geometry->epsilon();
  const bool shared = bsdf.gloss_count > 0;
  const auto scatter = [&](Vec3 d) {
    BsdfValue value = evaluate_bsdf(bsdf, to_local(bsdf.frame, d));
    value.value = value.value * terminator(point, d);
    return value;
  };
  add_sun(world, path, world.suns.front(), origin, random.own.a, random.own.b, shared, scatter,
          tally);
  add_more_lights(world, path, origin, random, shared, scatter, tally);
  if (world.sky->has_bright) add_bright_sky(world, path, origin, random.sky(), scatter, tally);
  if (bsdf.diffuse_count > 0)
    path.radiance = path.radiance + path.throughput * bsdf.diffuse_albedo * kInvPi *
                                        sky_irradiance(*world.sky, point.shading);

  const Vec3 local = sample_bsdf(bsdf, random.own.c, random.own.d);
  const BsdfValue value = evaluate_bsdf(bsdf, local);
  if (!(value.density > 0)) return false;
  const Vec3 direction = to_world(bsdf.frame, local);
  path.foreseen = path.throughput * bsdf.diffuse_albedo * (kInvPi * local.z / value.density);
  path.throughput = path.throughput * value.value / value.density;
  path.ray = {origin, direction, std::numeric_limits<float>::infinity(), path.ray.time};
  path.density = value.density;
  path.meets_lights = shared;
  path.scattered =
      path.scattered || sharpest_alpha(bsdf) > kMirrorAlpha || random.own.c < bsdf.choose_diffuse;
  path.from_camera = false;
  if (dot(direction, point.normal) > 0) return true;
  // Above the shading normal's horizon, below the triangle's: no light, and what was foreseen is
  // taken back.
  path.throughput = {};
  add_sky(world, path, 0);
  return false;
}

/// Light goes through a boundary of glass, or is thrown back there.
void pass_glass(const World& world, LightPath& path, const SurfacePoint& point,
                const Shading& glass, const Sample4& random) {
  const float eta = point.inside ? glass.ior : 1 / glass.ior;
  const float off = world.geometry->epsilon();
  const Vec3 tint = glass_tint(glass) / std::max(glass.transmission, 1e-6f);
  const bool first = path.from_camera && !path.through_glass;
  path.through_glass = true;
  path.meets_lights = true;
  path.density = kCertain;
  if (path.scattered) {
    // What it would gather up is lost, but nothing sparkles: straight on.
    const float cosine = -dot(path.ray.direction, point.shading);
    path.throughput = path.throughput * tint * (1 - dielectric_fresnel(cosine, eta));
    path.ray.origin = point.position - point.normal * off;
    path.ray.far = std::numeric_limits<float>::infinity();
    path.meets_lights = false;
    return;
  }
  const Vec3 view = -path.ray.direction;
  Vec3 normal = point.shading;
  const float alpha = square(clamp01(glass.roughness));
  if (alpha > kLeastAlpha) {
    const Frame frame = make_frame(point.shading);
    Vec3 local = to_local(frame, view);
    local.z = std::max(local.z, 1e-4f);
    normal = to_world(frame, sample_ggx_normal(local, alpha, random.c, random.d));
  }
  const float reflected = dielectric_fresnel(dot(view, normal), eta);
  // What the glass shows in front is faint and often bright: it gets more paths than its share.
  const float choose = first && reflected > 0 && reflected < 0.25f ? 0.25f : reflected;
  Vec3 direction;
  if (random.a < choose) {
    path.throughput = path.throughput * (reflected / choose);
    direction = normal * (2 * dot(view, normal)) - view;
    // A bent normal may mirror light to below the triangle, where a flat one would not.
    if (dot(direction, point.normal) <= 0)
      direction = point.normal * (2 * dot(view, point.normal)) - view;
    path.ray.origin = point.position + point.normal * off;
    path.from_camera = false;
  } else {
    direction = refracted(path.ray.direction, normal, eta);
    if (dot(direction, point.normal) >= 0)
      direction = refracted(path.ray.direction, point.normal, eta);
    path.throughput = path.throughput * tint * ((1 - reflected) / (1 - choose));
    path.ray.origin = point.position - point.normal * off;
  }
  path.ray.direction = direction;
  path.ray.far = std::numeric_limits<float>::infinity();
}

PathLight result_of(const LightPath& path) {
  PathLight light{path.radiance, std::max(path.alpha, 0.0f), 0, 0, 0};
  if (!path.on_shadow_floor) return light;
  // alpha is what the floor's fading left; it is the pixel's business how much of it is shadow.
  return {{}, 0, light.alpha, luminance(path.radiance), path.unlit};
}

Meeting meeting_of(const World& world, const Ray& ray, Tally& tally) {
  Meeting meeting;
  Ray shortened = ray;
  meeting.on_floor = meets_floor(world.floor, ray, meeting.floor);
  if (meeting.on_floor) shortened.far = meeting.floor.distance;
  ++tally.rays;
  meeting.mesh = world.geometry->closest(shortened);
  return meeting;
}

}  // namespace

void meet(const World& world, const Ray* rays, Meeting* meetings, int count, Tally& tally) {
  std::array<Ray, kPacket> shortened;
  std::array<MeshHit, kPacket> hits;
  for (int i = 0; i < count; ++i) {
    shortened[i] = rays[i];
    meetings[i].on_floor = meets_floor(world.floor, rays[i], meetings[i].floor);
    if (meetings[i].on_floor) shortened[i].far = meetings[i].floor.distance;
  }
  tally.rays += static_cast<std::uint64_t>(count);
  world.geometry->closest(shortened.data(), hits.data(), count);
  for (int i = 0; i < count; ++i) meetings[i].mesh = hits[i];
}

PathLight trace_path(const World& world, const Ray& ray, const Meeting& first,
                     const PathSampler& sampler, Tally& tally) {
  LightPath path;
  path.ray = ray;
  ++tally.paths;
  int left = world.max_depth, mirrors = kFreeMirrors, glasses = kFreeGlass;
  for (std::uint32_t set = 1;; ++set) {
    if (left <= 0) {
      // The last ray asks only for the sky; it takes the floor for the sky's lower half.
      Ray last = path.ray;
      last.far = std::numeric_limits<float>::infinity();
      Vec3 share{1, 1, 1};
      if (world.has_glass) {
        const bool below = world.floor.enabled && last.direction.y < 0;
        if (!below) share = passing(world, last, tally);
      } else {
        ++tally.rays;
        if (world.geometry->blocked(last)) share = {};
      }
      if (is_black(share)) {
        add_sky(world, path, world.max_depth == 1 ? kGuessedBounce : 0);
        return result_of(path);
      }
      add_met_lamps(world, path, std::numeric_limits<float>::infinity());
      // Unshaded: what was foreseen is what it is.
      if (share.x < 1 || share.y < 1 || share.z < 1) {
        add_sky(world, path, 0);
        path.throughput = path.throughput * share;
      }
      add_sky(world, path, 1);
      add_sun_discs(world, path);
      return result_of(path);
    }
    const Meeting meeting = set == 1 ? first : meeting_of(world, path.ray, tally);
    if (meeting.mesh.mesh == kNoMesh) {
      if (!meeting.on_floor) {
        add_met_lamps(world, path, std::numeric_limits<float>::infinity());
        add_sky(world, path, 1);
        add_sun_discs(world, path);
        return result_of(path);
      }
      add_met_lamps(world, path, meeting.floor.distance);
      add_sky(world, path, meeting.floor.fade);
      path.throughput = path.throughput * (1 - meeting.floor.fade);
      const VertexRandom random{sampler.get(set), &sampler, set};
      if (!scatter_on_floor(world, path, meeting.floor, random, tally)) return result_of(path);
      --left;
      continue;
    }
    add_met_lamps(world, path, meeting.mesh.distance);
    add_sky(world, path, 0);
    const SurfacePoint point = world.geometry->surface_point(path.ray, meeting.mesh);
    const VertexRandom random{sampler.get(set), &sampler, set};
    if (world.has_glass) {
      const Shading shading = mixed_shading(world, meeting.mesh);
      const Sample4 numbers = random.glass();
      if (shading.transmission > numbers.b) {
        if (--glasses < 0) {
          // What is trapped for so long is let out straight on.
          add_sky(world, path, 1);
          return result_of(path);
        }
        pass_glass(world, path, point, shading, numbers);
        continue;
      }
    }
    const Bsdf bsdf = bsdf_at(world, path, meeting.mesh, point);
    const bool mirror = bsdf.diffuse_count == 0 && sharpest_alpha(bsdf) < kMirrorAlpha;
    if (!scatter_on_mesh(world, path, point, bsdf, random, tally)) return result_of(path);
    if (mirror && mirrors > 0)
      --mirrors;
    else
      --left;
  }
}

FirstHit first_hit(const World& world, const Ray& ray, const Meeting& first) {
  FirstHit shown;
  if (first.mesh.mesh != kNoMesh) {
    const MeshHit& hit = first.mesh;
    const RenderMesh& mesh = world.geometry->mesh(hit.mesh);
    const SurfacePoint point = world.geometry->surface_point(ray, hit);
    const Triangle& t = mesh.triangles[hit.triangle];
    const auto at = [&](const auto& values) {
      return values[t.v[0]] * (1 - hit.u - hit.v) + values[t.v[1]] * hit.u + values[t.v[2]] * hit.v;
    };
    shown.depth = hit.distance;
    shown.normal = point.shading;
    shown.id = mesh.id;
    shown.position = point.position;
    shown.next =
        mesh.displacement.empty() ? point.position : point.position + at(mesh.displacement);
    shown.albedo = mixed_shading(world, hit).color;
    if (!mesh.corner_uvs.empty()) {
      const Vec2* uv = &mesh.corner_uvs[std::size_t{hit.triangle} * 3];
      shown.uv = uv[0] * (1 - hit.u - hit.v) + uv[1] * hit.u + uv[2] * hit.v;
    }
    shown.blend = mesh.vertex_blend.empty() ? mesh.blend : at(mesh.vertex_blend);
    shown.t = world.moment;
    if (!mesh.vertex_labels.empty()) {
      const float rest = 1 - hit.u - hit.v;
      const int nearest = rest >= hit.u && rest >= hit.v ? 0 : hit.u >= hit.v ? 1 : 2;
      shown.label = static_cast<float>(mesh.first_label + mesh.vertex_labels[t.v[nearest]]);
    }
  } else if (first.on_floor) {
    shown.depth = first.floor.distance;
    shown.normal = {0, 1, 0};
    shown.id = 1;
    shown.position = shown.next = first.floor.position;
    shown.albedo = world.floor.color * first.floor.tone;
  }
  return shown;
}

}  // namespace polymorph
