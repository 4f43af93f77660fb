#include "render/integrator.h"

#include <algorithm>
#include <cmath>

#include "render/materials.h"
#include "render/texture.h"

namespace polymorph {
namespace {

// Firefly control. Light from a key, a sun or a lamp that comes by way of another surface is cut
// off here, in units of World::white, and so is the key's disc where a mirror shows it: what is
// left is far above white, and edges of highlights can be smoothed. Direct light, and the sky in a
// mirror, are never cut.
constexpr float kIndirectLimit = 2.0f;
constexpr float kDiscLimit = 8.0f;
// Lobes sharper than this count as mirrors: paths remember nothing of passing one.
constexpr float kMirrorAlpha = 0.1f;
// A path may pass this many sharp mirrors without paying from max_depth, so that reflections show
// lit surfaces and not the end of a path.
constexpr int kFreeMirrors = 2;

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
  float density = 0;       ///< of the ray's direction, per solid angle
  bool meets_key = false;  ///< does the key's disc count for this ray?
  bool from_camera = true;
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

void add_key_disc(const World& world, LightPath& path) {
  if (!path.meets_key || !hits_key(*world.key, path.ray.direction)) return;
  const float weight = path.density / (path.density + world.key->density);
  const Vec3 light = path.throughput * world.key->radiance * weight;
  path.radiance = path.radiance + limited(light, kDiscLimit * world.white);
}

bool blocked(const World& world, const Ray& ray, Tally& tally) {
  ++tally.rays;
  FloorHit floor;
  return world.geometry->blocked(ray) || meets_floor(world.floor, ray, floor);
}

/// Light from the key light at a floor or mesh. `scatter(direction)` gives bsdf times cosine and
/// density.
template <class Scatter>
void add_key_light(const World& world, LightPath& path, Vec3 origin, const Sample4& random,
                   bool shared, const Scatter& scatter, Tally& tally) {
  const Vec3 direction = sample_key(*world.key, random.a, random.b);
  const BsdfValue bsdf = scatter(direction);
  if (is_black(bsdf.value)) return;
  const float density = world.key->density;
  // Balance heuristic (Veach 1997) where the next ray may meet the disc as well.
  const float weight = shared && density > 0 ? density / (density + bsdf.density) : 1.0f;
  const Vec3 light = path.throughput * bsdf.value * world.key->sample_power * weight;
  if (blocked(world, {origin, direction}, tally)) return;
  add_light(world, path, light);
}

/// Light from the bright part of the sky.
template <class Scatter>
void add_bright_sky(const World& world, LightPath& path, Vec3 origin, const Sample4& random,
                    const Scatter& scatter, Tally& tally) {
  const SkySample sample = sample_bright_sky(*world.sky, random.a, random.b);
  if (!(sample.density > 0)) return;
  const BsdfValue bsdf = scatter(sample.direction);
  if (is_black(bsdf.value) || blocked(world, {origin, sample.direction}, tally)) return;
  const Vec3 radiance = sky_radiance(*world.sky, sample.direction);
  add_light(world, path,
            path.throughput * bsdf.value * split_radiance(*world.sky, radiance).bright *
                (power_heuristic(sample.density, bsdf.density) / sample.density));
}

/// The numbers of a vertex: `own` for its key light and next direction, `sky` for the bright sky.
struct VertexRandom {
  Sample4 own, sky;
};

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
  const KeyLight& key = *world.key;
  // A disc that is wholly above the floor's horizon gives its irradiance times the cosine, without
  // noise.
  if (key.frame.z.y >= key.sin_radius && key_is_clear(key, origin, world.center, world.radius))
    add_light(world, path, path.throughput * albedo * (kInvPi * key.frame.z.y) * key.irradiance);
  else
    add_key_light(world, path, origin, random.own, false, lambert, tally);
  if (world.sky->has_bright) add_bright_sky(world, path, origin, random.sky, lambert, tally);
  const float share = foreseen_share(world, origin);
  path.radiance =
      path.radiance + path.throughput * albedo * (kInvPi * share) * world.sky->upper_irradiance;

  const Vec3 local = cosine_direction(random.own.c, random.own.d);
  const Vec3 direction{local.x, local.z, -local.y};
  if (direction.y <= 0) return false;
  path.ray = {origin, direction};
  ++tally.rays;
  // Past everything: the calm sky is as foreseen.
  if (share == 1 && !world.sky->has_bright && world.geometry->misses_bounds(path.ray)) return false;
  path.density = kInvPi * direction.y;
  path.throughput = path.throughput * albedo;
  path.foreseen = path.throughput * share;
  path.meets_key = false;
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

/// The mesh's own materials, mixed with what they turn into.
Shading mesh_shading(const RenderMesh& mesh, const MeshHit& hit) {
  const Shading own = layer_shading(mesh, hit);
  const float share = mesh.other.materials.empty() ? 0.0f : clamp01(mesh.other_share);
  return share > 0 ? mix(own, layer_shading(mesh.other, hit), share) : own;
}

Bsdf bsdf_at(const World& world, const LightPath& path, const MeshHit& hit,
             const SurfacePoint& point) {
  const RenderMesh& mesh = world.geometry->mesh(hit.mesh);
  Shading look = look_shading(world.look);
  if (path.scattered) look = matte_shading(look);
  const Vec3 view = -path.ray.direction;
  const float share = mesh.materials.empty() ? 1.0f : clamp01(mesh.look);
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
  const bool shares_key = bsdf.gloss_count > 0 && world.key->density > 0;
  const auto scatter = [&](Vec3 d) {
    BsdfValue value = evaluate_bsdf(bsdf, to_local(bsdf.frame, d));
    value.value = value.value * terminator(point, d);
    return value;
  };
  add_key_light(world, path, origin, random.own, shares_key, scatter, tally);
  if (world.sky->has_bright) add_bright_sky(world, path, origin, random.sky, scatter, tally);
  if (bsdf.diffuse_count > 0)
    path.radiance = path.radiance + path.throughput * bsdf.diffuse_albedo * kInvPi *
                                        sky_irradiance(*world.sky, point.shading);

  const Vec3 local = sample_bsdf(bsdf, random.own.c, random.own.d);
  const BsdfValue value = evaluate_bsdf(bsdf, local);
  if (!(value.density > 0)) return false;
  const Vec3 direction = to_world(bsdf.frame, local);
  path.foreseen = path.throughput * bsdf.diffuse_albedo * (kInvPi * local.z / value.density);
  path.throughput = path.throughput * value.value / value.density;
  path.ray = {origin, direction};
  path.density = value.density;
  path.meets_key = shares_key;
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

}  // namespace

Vec3 trace_path(const World& world, const Ray& ray, const PathSampler& sampler, Tally& tally) {
  LightPath path;
  path.ray = ray;
  int left = world.max_depth, mirrors = kFreeMirrors;
  const auto numbers = [&](std::uint32_t set) {
    constexpr std::uint32_t kSkySets = 1024;  // beyond any depth
    return VertexRandom{sampler.get(set),
                        world.sky->has_bright ? sampler.get(kSkySets + set) : Sample4{}};
  };
  for (std::uint32_t set = 1;; ++set) {
    if (left <= 0) {
      // The last ray asks only for the sky; it takes the floor for the sky's lower half.
      ++tally.rays;
      const bool hidden = world.geometry->blocked(path.ray);
      add_sky(world, path, hidden ? 0.0f : 1.0f);
      if (!hidden) add_key_disc(world, path);
      return path.radiance;
    }
    FloorHit floor;
    const bool on_floor = meets_floor(world.floor, path.ray, floor);
    if (on_floor) path.ray.far = floor.distance;
    ++tally.rays;
    const MeshHit hit = world.geometry->closest(path.ray);
    if (hit.mesh == kNoMesh) {
      if (!on_floor) {
        add_sky(world, path, 1);
        add_key_disc(world, path);
        return path.radiance;
      }
      add_sky(world, path, floor.fade);
      path.throughput = path.throughput * (1 - floor.fade);
      if (!scatter_on_floor(world, path, floor, numbers(set), tally)) return path.radiance;
      --left;
      continue;
    }
    add_sky(world, path, 0);
    const SurfacePoint point = world.geometry->surface_point(path.ray, hit);
    const Bsdf bsdf = bsdf_at(world, path, hit, point);
    const bool mirror = bsdf.diffuse_count == 0 && sharpest_alpha(bsdf) < kMirrorAlpha;
    if (!scatter_on_mesh(world, path, point, bsdf, numbers(set), tally)) return path.radiance;
    if (mirror && mirrors > 0)
      --mirrors;
    else
      --left;
  }
}

FirstHit first_hit(const World& world, const Ray& ray, Tally& tally) {
  FirstHit first;
  FloorHit floor;
  Ray shortened = ray;
  const bool on_floor = meets_floor(world.floor, ray, floor);
  if (on_floor) shortened.far = floor.distance;
  ++tally.rays;
  const MeshHit hit = world.geometry->closest(shortened);
  if (hit.mesh != kNoMesh) {
    first.depth = hit.distance;
    first.normal = world.geometry->surface_point(ray, hit).shading;
    first.id = world.geometry->mesh(hit.mesh).id;
  } else if (on_floor) {
    first.depth = floor.distance;
    first.normal = {0, 1, 0};
    first.id = 1;
  }
  return first;
}

}  // namespace polymorph
