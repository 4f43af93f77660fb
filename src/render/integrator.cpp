#include "render/integrator.h"

#include <algorithm>
#include <cstring>

#include "render/ggx.h"
#include "render/glass.h"
#include "render/shadow_rays.h"
#include "render/surface_shading.h"

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
constexpr std::uint32_t kFreeGlass = 8;
// With a single bounce (previews) what hides the sky is taken to send back this share of it, for
// all the bounces that are left out: fewer black grains, and shadows about as deep as they are.
constexpr float kGuessedBounce = 0.4f;
// The density of a direction that a smooth mirror or glass leaves no choice of.
constexpr float kCertain = 1e30f;
// The sampler's sets beside those of the vertices themselves; beyond any depth.
constexpr std::uint32_t kSkySets = 1024, kGlassSets = 2048, kLightSets = 8192, kMostLights = 32;

// What a path knows about itself, one bit each; above them, the boundaries of glass it may still
// pass.
constexpr std::uint32_t kMeetsLights = 1;    ///< suns and lamps count for its ray
constexpr std::uint32_t kFromCamera = 2;     ///< nothing but clear glass between
constexpr std::uint32_t kThroughGlass = 4;   ///< there was some
constexpr std::uint32_t kOnShadowFloor = 8;  ///< its first vertex: only the shadows are kept
/// By a diffuse or rough surface. From then on glossy lobes are followed as diffuse ones of the
/// same colour: their caustics would be noise at any sample count that one would wait for, and
/// the light they lose is kept.
constexpr std::uint32_t kScattered = 16;
constexpr std::uint32_t kGlassShift = 8;

/// A path on its way, or eight: the same 24 numbers, as a row or as columns.
template <class T3>
struct PathOf {
  using V = NumberOf<T3>;
  RayOf<T3> ray;
  T3 radiance{};
  T3 throughput = same3<T3>({1, 1, 1});
  /// Control variate. Every diffuse vertex adds at once all the light it would get from an
  /// unobstructed calm sky (known exactly), and lets the next ray correct it: if the sky is seen
  /// after all, nothing is left to add; if not, the sky's share is taken back. So unshadowed
  /// surfaces have no noise from the sky. This is the throughput of that known share.
  T3 foreseen{};
  V density{};  ///< of the ray's direction, per solid angle
  V alpha = same<V>(1);
  V unlit{};
  V left{};                           ///< surfaces that it may still scatter at
  V mirrors = same<V>(kFreeMirrors);  ///< and of sharp mirrors
  BitsOf<V> flags = BitsOf<V>{} + (kFromCamera | (kFreeGlass << kGlassShift));
  BitsOf<V> sample{};  ///< SampleIndex::reversed
};
using PathRow = PathOf<Vec3>;
using Paths = PathOf<Pack3>;
constexpr int kPathWidth = 24;
static_assert(sizeof(PathRow) == kPathWidth * sizeof(float));
static_assert(sizeof(Paths) == kPathWidth * sizeof(Pack));

PackMask has(const Paths& path, std::uint32_t flag) { return (path.flags & flag) != 0u; }
bool has(const PathRow& path, std::uint32_t flag) { return (path.flags & flag) != 0; }
void set(Paths& path, std::uint32_t flag, PackMask on) {
  path.flags = (path.flags & ~flag) | (reinterpret_cast<PackBits>(on) & flag);
}
PackMask all() { return mask_of<PackMask>(true); }

template <class T3>
T3 limited(T3 light, float limit) {
  const NumberOf<T3> most_light = max_component(light);
  return select(most_light > limit, light * (limit / most_light), light);
}

/// What is left of light that a path brings to the camera: all of it straight from the first
/// vertex.
Pack3 kept_light(const World& world, const Paths& path, const Pack3& light) {
  return select(has(path, kFromCamera), light, limited(light, kIndirectLimit * world.white));
}

/// Weight of one of two ways to find the same light (Veach 1997).
Pack power_heuristic(Pack own, Pack other) {
  const Pack ratio = other / own;
  return kept_if(own > 0.0f, 1.0f / (1.0f + ratio * ratio));
}
Pack balance_heuristic(Pack own, Pack other) { return own / (own + other); }

/// The ray leaves the scene, or the share of it that a floor lets pass which has faded into what
/// lies behind; none where it met a mesh.
void add_sky(const World& world, Paths& path, Pack share, PackMask where) {
  const PackMask camera = has(path, kFromCamera);
  const PackMask seen_first = where & camera & (share > 0.0f);
  if (any(seen_first)) {
    const PackMask open =
        seen_first & mask_of<PackMask>(world.transparent) & opposite(has(path, kThroughGlass));
    path.alpha = path.alpha - kept_if(open, share);
    const PackMask shown = seen_first & opposite(open);
    if (any(shown))
      path.radiance =
          path.radiance +
          kept_if(shown,
                  path.throughput * backdrop_radiance(world.backdrop, path.ray.direction) * share);
  }
  const Pack3 seen = path.throughput * share;
  const Pack3 unknown = seen - path.foreseen;
  const PackMask later = where & opposite(camera) &
                         (mask_of<PackMask>(world.sky->has_bright) | opposite(is_black(unknown)));
  path.foreseen = kept_if(opposite(where), path.foreseen);
  if (!any(later)) return;
  const SkySplitOf<Pack3> sky =
      split_radiance(*world.sky, sky_radiance(*world.sky, path.ray.direction));
  path.radiance = path.radiance + kept_if(later, unknown * sky.calm);
  if (!world.sky->has_bright) return;
  const Pack weight =
      power_heuristic(path.density, bright_sky_density(*world.sky, path.ray.direction));
  // A mirror shows it as it is.
  const Pack3 light = seen * sky.bright * weight;
  const Pack3 kept =
      select(has(path, kScattered), limited(light, kIndirectLimit * world.white), light);
  path.radiance = path.radiance + kept_if(later, kept);
}

/// Light of a sun or lamp that the ray meets, where `met`; its own sampling has this density.
void add_met_light(const World& world, Paths& path, Vec3 radiance, Pack density, PackMask met) {
  const Pack weight = balance_heuristic(path.density, density);
  path.radiance = path.radiance + kept_if(met, limited(path.throughput * radiance * weight,
                                                       kDiscLimit * world.white));
}

/// Lamps that the ray meets before `distance`; they do not stop it.
void add_met_lamps(const World& world, Paths& path, Pack distance, PackMask where) {
  where = where & has(path, kMeetsLights);
  if (!any(where)) return;
  RayOf<Pack3> way = path.ray;
  way.far = distance;
  for (const Lamp& lamp : world.lamps) {
    const Pack met = meets_lamp(lamp, way);
    add_met_light(world, path, lamp.radiance, lamp_density(lamp, way, met),
                  where & (met < distance));
  }
}

/// The ray meets nothing more.
void leave_scene(const World& world, Paths& path, PackMask where) {
  add_met_lamps(world, path, same<Pack>(kInfinity), where);
  add_sky(world, path, same<Pack>(1), where);
  where = where & has(path, kMeetsLights);
  if (!any(where)) return;
  for (const KeyLight& sun : world.suns)
    add_met_light(world, path, sun.radiance, same<Pack>(sun.density),
                  where & hits_key(sun, path.ray.direction));
}

/// The numbers of a vertex: `own` for its key light and next direction.
struct VertexRandom {
  Sample4Of<Pack> own;
  const PathSamplerOf<Pack>* sampler;
  std::uint32_t set;
  Sample4Of<Pack> sky() const { return sampler->get(kSkySets + set); }
  Sample4Of<Pack> light(std::size_t i) const {
    return sampler->get(kLightSets + set * kMostLights + static_cast<std::uint32_t>(i));
  }
};

/// Eight vertices of as many paths, as far as lights are concerned.
struct Vertices {
  Paths& path;
  PackBits rows;  ///< where the paths stand in the wave
  Pack3 origin;   ///< of rays that leave
  PackMask live;
  PackMask shared{};  ///< the next ray may meet suns and lamps as well
  ShadowRays& shadows;
};

/// Asks for the light that comes straight from a light. Where `unlit`, what it would be with
/// nothing in the way is noted as well.
void add_direct(const World& world, Vertices& at, const Pack3& direction, Pack distance,
                const Pack3& light, PackMask wanted, PackMask unlit) {
  at.path.unlit = at.path.unlit + kept_if(unlit & wanted, luminance(light));
  at.shadows.add({at.origin, direction, at.path.ray.time, distance},
                 kept_light(world, at.path, light), at.rows, wanted);
}

/// Light from one sun. `scatter(direction)` gives bsdf times cosine and density.
template <class Scatter>
void add_sun(const World& world, Vertices& at, const KeyLight& sun, Pack u, Pack v,
             const Scatter& scatter, PackMask wanted, PackMask unlit) {
  const Pack3 direction = sample_key(sun, u, v);
  const BsdfValueOf<Pack3> bsdf = scatter(direction);
  const PackMask shared = at.shared & mask_of<PackMask>(sun.density > 0);
  const Pack weight =
      select(shared, balance_heuristic(same<Pack>(sun.density), bsdf.density), same<Pack>(1));
  add_direct(world, at, direction, same<Pack>(kInfinity),
             at.path.throughput * bsdf.value * sun.sample_power * weight, wanted, unlit);
}

template <class Scatter>
void add_lamp(const World& world, Vertices& at, const Lamp& lamp, Pack u, Pack v,
              const Scatter& scatter, PackMask unlit) {
  const LampSampleOf<Pack3> sample = sample_lamp(lamp, at.origin, u, v);
  const BsdfValueOf<Pack3> bsdf = scatter(sample.direction);
  const Pack weight = select(at.shared & (sample.density > 0.0f),
                             balance_heuristic(sample.density, bsdf.density), same<Pack>(1));
  add_direct(world, at, sample.direction, sample.distance,
             at.path.throughput * bsdf.value * sample.power * weight,
             at.live & opposite(is_black(sample.power)), unlit);
}

/// Light from the bright part of the sky.
template <class Scatter>
void add_bright_sky(const World& world, Vertices& at, const Sample4Of<Pack>& random,
                    const Scatter& scatter, PackMask unlit) {
  Pack3 direction;
  Pack density;
  for (int l = 0; l < kLanes; ++l) {
    const SkySample sample = sample_bright_sky(*world.sky, random.a[l], random.b[l]);
    set_lane(direction, l, sample.direction);
    density[l] = sample.density;
  }
  const BsdfValueOf<Pack3> bsdf = scatter(direction);
  const Pack3 bright = split_radiance(*world.sky, sky_radiance(*world.sky, direction)).bright;
  add_direct(
      world, at, direction, same<Pack>(kInfinity),
      at.path.throughput * bsdf.value * bright * (power_heuristic(density, bsdf.density) / density),
      at.live & (density > 0.0f), unlit);
}

/// All lights but the key light.
template <class Scatter>
void add_more_lights(const World& world, Vertices& at, const VertexRandom& random,
                     const Scatter& scatter, PackMask unlit) {
  std::size_t light = 0;
  for (const KeyLight& sun : world.suns.subspan(1)) {
    const Sample4Of<Pack> r = random.light(light++);
    add_sun(world, at, sun, r.a, r.b, scatter, at.live, unlit);
  }
  for (const Lamp& lamp : world.lamps) {
    const Sample4Of<Pack> r = random.light(light++);
    add_lamp(world, at, lamp, r.a, r.b, scatter, unlit);
  }
  if (world.sky->has_bright) add_bright_sky(world, at, random.sky(), scatter, unlit);
}

/// How much of the calm sky's light on the floor to foresee: the share that a ball of 0.6 of the
/// objects' radius would leave (Howell, catalog of radiation configuration factors, B-38). Any
/// share is right on average; where most of the sky is hidden, foreseeing all of it would only add
/// noise. Measured on a knot and a cow, against 1 everywhere: 25 to 29 % less variance.
Pack foreseen_share(const World& world, const Pack3& point) {
  if (!(world.radius > 0)) return same<Pack>(1);  // nothing there
  const Pack3 to_center = world.center - point;
  const Pack distance2 = dot(to_center, to_center);
  const float radius = 0.6f * world.radius;
  const Pack hidden =
      clamp01(most(to_center.y, 0.0f) * (radius * radius) / (distance2 * square_root(distance2)));
  // Far away rays that pass by everything need not even look at the sky.
  return select(hidden < 0.1f, same<Pack>(1), 1.0f - hidden);
}

/// Returns the lanes whose paths go on.
PackMask scatter_on_floor(const World& world, Vertices& at, const FloorPointOf<Pack3>& point,
                          const VertexRandom& random, Tally& tally) {
  Paths& path = at.path;
  const Pack3 albedo = world.floor.color * point.tone;
  at.origin = point.position + Vec3{0, world.geometry->epsilon(), 0};
  const auto lambert = [&](const Pack3& d) {
    const Pack cosine = kInvPi * most(d.y, 0.0f);
    return BsdfValueOf<Pack3>{albedo * cosine, cosine};
  };
  const PackMask notes_unlit = mask_of<PackMask>(world.shadow_only) & has(path, kFromCamera) &
                               opposite(has(path, kThroughGlass));
  set(path, kOnShadowFloor, has(path, kOnShadowFloor) | notes_unlit);
  const KeyLight& key = world.suns.front();
  // A disc that is wholly above the floor's horizon gives its irradiance times the cosine, without
  // noise.
  const bool whole = key.frame.z.y >= key.sin_radius;
  PackMask clear{};
  if (whole) {
    const Pack3 light =
        path.throughput * albedo * ((kInvPi * std::max(0.0f, key.frame.z.y)) * key.irradiance);
    clear = key_is_clear(key, at.origin, world.center, world.radius);
    path.radiance = path.radiance + kept_if(clear, kept_light(world, path, light));
    path.unlit = path.unlit + kept_if(notes_unlit, luminance(light));
  }
  const PackMask doubtful = at.live & opposite(clear);
  if (any(doubtful))
    add_sun(world, at, key, random.own.a, random.own.b, lambert, doubtful,
            notes_unlit & mask_of<PackMask>(!whole));
  add_more_lights(world, at, random, lambert, notes_unlit);
  const Pack share = foreseen_share(world, at.origin);
  const Pack3 sky_light = path.throughput * albedo * kInvPi * world.sky->upper_irradiance;
  path.unlit = path.unlit + kept_if(notes_unlit, luminance(sky_light));
  path.radiance = path.radiance + sky_light * share;

  const Pack3 local = cosine_direction(random.own.c, random.own.d);
  const Pack3 direction{local.x, local.z, -local.y};
  path.ray = {at.origin, direction, path.ray.time};
  path.density = kInvPi * direction.y;
  path.throughput = path.throughput * albedo;
  path.foreseen = path.throughput * share;
  set(path, kMeetsLights | kFromCamera, PackMask{});
  set(path, kScattered, all());
  const PackMask up = at.live & (direction.y > 0.0f);
  if (world.sky->has_bright) return up;
  // Past everything: the calm sky is as foreseen.
  const PackMask past = up & (share == 1.0f) & world.geometry->misses_bounds(path.ray);
  tally.rays += static_cast<std::uint64_t>(count_bits(Lanes<Pack>::bits(past)));
  return up & opposite(past);
}

/// Fades light out before it would slip below the triangle while it still is above the smooth
/// surface. After Chiang et al. 2019, "Taming the shadow terminator", but only next to it: their
/// term shows every facet of a coarse mesh.
Pack terminator(const SurfacePointOf<Pack3>& point, const Pack3& direction) {
  const Pack flat = dot(point.normal, direction);
  const Pack smooth = dot(point.shading, direction) * dot(point.shading, point.normal);
  return kept_if(flat > 0.0f,
                 select(flat >= smooth, same<Pack>(1), smoothstep(0, 0.5f, flat / smooth)));
}

/// Returns the lanes whose paths go on.
PackMask scatter_on_mesh(const World& world, Vertices& at, const SurfacePointOf<Pack3>& point,
                         const BsdfOf<Pack3>& bsdf, const VertexRandom& random) {
  Paths& path = at.path;
  at.origin = point.lifted + point.normal * world.geometry->epsilon();
  at.shared = bsdf.has_gloss;
  const auto scatter = [&](const Pack3& d) {
    BsdfValueOf<Pack3> value = evaluate_bsdf(bsdf, to_local(bsdf.frame, d));
    value.value = value.value * terminator(point, d);
    return value;
  };
  add_sun(world, at, world.suns.front(), random.own.a, random.own.b, scatter, at.live, PackMask{});
  add_more_lights(world, at, random, scatter, PackMask{});
  if (bsdf.diffuse_count > 0)
    path.radiance = path.radiance + path.throughput * bsdf.diffuse_albedo * kInvPi *
                                        sky_irradiance(*world.sky, point.shading);

  const Pack3 local = sample_bsdf(bsdf, random.own.c, random.own.d);
  const BsdfValueOf<Pack3> value = evaluate_bsdf(bsdf, local);
  const PackMask scattered = at.live & (value.density > 0.0f);
  const Pack3 direction = to_world(bsdf.frame, local);
  path.foreseen = path.throughput * bsdf.diffuse_albedo * (kInvPi * local.z / value.density);
  path.throughput = path.throughput * value.value / value.density;
  path.ray = {at.origin, direction, path.ray.time};
  path.density = value.density;
  set(path, kMeetsLights, bsdf.has_gloss);
  set(path, kScattered,
      has(path, kScattered) | (bsdf.sharpest_alpha > kMirrorAlpha) |
          (random.own.c < bsdf.choose_diffuse));
  set(path, kFromCamera, PackMask{});
  const PackMask mirror =
      opposite(bsdf.has_diffuse) & (bsdf.sharpest_alpha < kMirrorAlpha) & (path.mirrors > 0.0f);
  path.mirrors = path.mirrors - kept_if(mirror, same<Pack>(1));
  path.left = path.left - kept_if(opposite(mirror), same<Pack>(1));
  // Above the shading normal's horizon, below the triangle's: no light, and what was foreseen is
  // taken back.
  const PackMask above = dot(direction, point.normal) > 0.0f;
  const PackMask lost = scattered & opposite(above);
  if (any(lost)) add_sky(world, path, Pack{}, lost);
  return scattered & above;
}

/// Light goes through a boundary of glass, or is thrown back there.
void pass_glass(const World& world, PathRow& path, const SurfacePoint& point, const Shading& glass,
                const Sample4& random) {
  const float eta = point.inside ? glass.ior : 1 / glass.ior;
  const float off = world.geometry->epsilon();
  const Vec3 tint = glass_tint(glass) / std::max(glass.transmission, 1e-6f);
  const bool first = has(path, kFromCamera) && !has(path, kThroughGlass);
  path.flags |= kThroughGlass | kMeetsLights;
  path.density = kCertain;
  if (has(path, kScattered)) {
    // What it would gather up is lost, but nothing sparkles: straight on.
    const float cosine = -dot(path.ray.direction, point.shading);
    path.throughput = path.throughput * tint * (1 - dielectric_fresnel(cosine, eta));
    path.ray.origin = point.position - point.normal * off;
    path.flags &= ~kMeetsLights;
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
    path.flags &= ~kFromCamera;
  } else {
    direction = refracted(path.ray.direction, normal, eta);
    if (dot(direction, point.normal) >= 0)
      direction = refracted(path.ray.direction, point.normal, eta);
    path.throughput = path.throughput * tint * ((1 - reflected) / (1 - choose));
    path.ray.origin = point.position - point.normal * off;
  }
  path.ray.direction = direction;
}

PathLight result_of(const PathRow& path, Vec3 direct) {
  const Vec3 radiance = path.radiance + direct;
  const PathLight light{radiance, std::max(path.alpha, 0.0f), 0, 0, 0};
  if (!has(path, kOnShadowFloor)) return light;
  // alpha is what the floor's fading left; it is the pixel's business how much of it is shadow.
  return {{}, 0, light.alpha, luminance(radiance), path.unlit};
}

SurfacePoint lane(const SurfacePointOf<Pack3>& p, int l) {
  return {lane(p.position, l), lane(p.normal, l), lane(p.shading, l), lane(p.lifted, l),
          p.inside[l] != 0};
}
Shading lane(const ShadingOf<Pack3>& s, int l) {
  return {lane(s.color, l), lane(s.specular, l), s.roughness[l],
          s.metallic[l],    s.transmission[l],   s.ior[l]};
}
Sample4 lane(const Sample4Of<Pack>& s, int l) { return {s.a[l], s.b[l], s.c[l], s.d[l]}; }

/// Numbers of paths in the wave.
struct List {
  std::array<std::uint16_t, Wave::kMost> items;
  int count = 0;
  void add(std::uint32_t item) { items[count++] = static_cast<std::uint16_t>(item); }
  void add(PackBits rows, PackMask where) {
    for (std::uint32_t bits = Lanes<Pack>::bits(where); bits != 0; bits &= bits - 1)
      add(rows[lowest_bit(bits)]);
  }
};

/// Follows all paths of a wave from surface to surface. At each step paths are sorted by what they
/// met, and those that met the same kind of thing are taken eight at a time.
class Tracer {
 public:
  Tracer(const World& world, const FrameSampler& sampler, const Wave& wave, Tally& tally)
      : world_(world), sampler_(sampler), wave_(wave), tally_(tally) {
    for (int i = 0; i < wave.count; ++i) {
      PathRow& path = paths_[i] = {};
      path.ray = wave.rays[i];
      path.ray.far = kInfinity;
      path.left = static_cast<float>(world.max_depth);
      path.sample = wave.samples[i];
      going_.add(static_cast<std::uint32_t>(i));
      direct_[i] = {};
    }
  }

  void run() {
    for (set_ = 1; going_.count > 0; ++set_) {
      meet_all();
      going_.count = 0;
      each_eight(meshes_, [&](Paths& path, PackBits rows, PackMask live) {
        return at_meshes(path, rows, live);
      });
      each_eight(floors_, [&](Paths& path, PackBits rows, PackMask live) {
        return at_floor(path, rows, live);
      });
      each_eight(leaving_, [&](Paths& path, PackBits, PackMask live) {
        leave_scene(world_, path, live);
        return PackMask{};
      });
      each_eight(trapped_, [&](Paths& path, PackBits, PackMask live) {
        add_sky(world_, path, same<Pack>(1), live);
        return PackMask{};
      });
      each_eight(last_, [&](Paths& path, PackBits rows, PackMask live) {
        look_last(path, rows, live);
        return PackMask{};
      });
    }
    shadows_.flush();
  }

  PathLight result(int path) const { return result_of(paths_[path], direct_[path]); }

 private:
  struct MeetingRow {
    Meeting meeting;
    float rest[2];
  };
  static_assert(sizeof(MeetingRow) == 8 * sizeof(float));

  /// Eight rows of a list; beyond its end the last one again.
  PackBits rows_of(const List& list, int first) const {
    PackBits rows;
    for (int l = 0; l < kLanes; ++l) rows[l] = list.items[std::min(first + l, list.count - 1)];
    return rows;
  }
  Paths load(PackBits rows) const {
    const float* starts[kLanes];
    for (int l = 0; l < kLanes; ++l) starts[l] = &paths_[rows[l]].ray.origin.x;
    Pack columns[kPathWidth];
    load_rows<kPathWidth>(starts, columns);
    Paths path;
    std::memcpy(&path, columns, sizeof path);
    return path;
  }
  void store(const Paths& path, PackBits rows, PackMask where) {
    Pack columns[kPathWidth];
    std::memcpy(columns, &path, sizeof path);
    PathRow unused;
    float* starts[kLanes];
    for (int l = 0; l < kLanes; ++l)
      starts[l] = &(where[l] ? paths_[rows[l]] : unused).ray.origin.x;
    store_rows<kPathWidth>(columns, starts);
  }
  MeetingOf<Pack> load_meeting(PackBits rows) const {
    const float* starts[kLanes];
    for (int l = 0; l < kLanes; ++l)
      starts[l] = reinterpret_cast<const float*>(&meetings_[rows[l]]);
    Pack columns[8];
    load_rows<8>(starts, columns);
    MeetingOf<Pack> meeting;
    std::memcpy(&meeting, columns, sizeof meeting);
    return meeting;
  }

  /// f(paths, rows, live lanes) -> lanes that go on.
  template <class F>
  void each_eight(const List& list, const F& f) {
    for (int first = 0; first < list.count; first += kLanes) {
      const PackBits rows = rows_of(list, first);
      const PackMask live = first_lanes(list.count - first);
      Paths path = load(rows);
      const PackMask goes_on = f(path, rows, live);
      store(path, rows, live & opposite(taken_));
      taken_ = PackMask{};
      going_.add(rows, goes_on);
    }
  }

  /// Finds what the paths' rays meet and sorts them by it.
  void meet_all() {
    leaving_.count = floors_.count = meshes_.count = trapped_.count = last_.count = 0;
    List asking;
    for (int i = 0; i < going_.count; ++i) {
      const std::uint32_t row = going_.items[i];
      (paths_[row].left > 0 ? asking : last_).add(row);
    }
    for (int first = 0; first < asking.count; first += kPacket) {
      const int count = std::min(kPacket, asking.count - first);
      RayOf<Pack3> rays[2];
      MeetingOf<Pack> meetings[2];
      for (int k = 0; k < count; k += kLanes)
        rays[k / kLanes] = load(rows_of(asking, first + k)).ray;
      meet(world_, rays, meetings, count, set_ == 1, tally_);
      for (int i = 0; i < count; ++i) {
        const std::uint32_t row = asking.items[first + i];
        const Meeting met = lane(meetings[i / kLanes], i % kLanes);
        meetings_[row].meeting = met;
        (met.mesh.mesh != kNoMesh ? meshes_ : met.floor < kInfinity ? floors_ : leaving_).add(row);
      }
    }
  }

  PathSamplerOf<Pack> sampler_of(const Paths& path) const {
    return {sampler_, wave_.sequence, path.sample};
  }

  PackMask at_floor(Paths& path, PackBits rows, PackMask live) {
    const Pack distance = load_meeting(rows).floor;
    add_met_lamps(world_, path, distance, live);
    const FloorPointOf<Pack3> point = floor_point(world_.floor, path.ray, distance);
    add_sky(world_, path, point.fade, live);
    path.throughput = path.throughput * (1.0f - point.fade);
    const PathSamplerOf<Pack> sampler = sampler_of(path);
    Vertices at{path, rows, {}, live, {}, shadows_};
    const PackMask goes_on =
        scatter_on_floor(world_, at, point, {sampler.get(set_), &sampler, set_}, tally_);
    path.left = path.left - 1.0f;
    return goes_on;
  }

  PackMask at_meshes(Paths& path, PackBits rows, PackMask live) {
    const MeshHitOf<Pack> hit = load_meeting(rows).mesh;
    add_met_lamps(world_, path, hit.distance, live);
    add_sky(world_, path, Pack{}, live);
    const SurfacePointOf<Pack3> point = world_.geometry->surface_point(path.ray, hit);
    const PathSamplerOf<Pack> sampler = sampler_of(path);
    if (world_.has_glass) {
      taken_ = through_glass(path, rows, live, hit, point, sampler.get(kGlassSets + set_));
      live = live & opposite(taken_);
      if (!any(live)) return PackMask{};
    }
    const BsdfOf<Pack3> bsdf =
        bsdf_at(world_, hit, point.shading, -path.ray.direction, has(path, kScattered));
    Vertices at{path, rows, {}, live, {}, shadows_};
    return scatter_on_mesh(world_, at, point, bsdf, {sampler.get(set_), &sampler, set_});
  }

  /// Sends on the paths that meet glass, one by one; says which lanes they are.
  PackMask through_glass(const Paths& path, PackBits rows, PackMask live,
                         const MeshHitOf<Pack>& hit, const SurfacePointOf<Pack3>& point,
                         const Sample4Of<Pack>& random) {
    const ShadingOf<Pack3> shading = mixed_shading(world_, hit);
    const PackMask glass = live & (shading.transmission > random.b);
    store(path, rows, glass);
    for (int l = 0; l < kLanes; ++l) {
      if (!glass[l]) continue;
      PathRow& row = paths_[rows[l]];
      if (row.flags >> kGlassShift == 0) {
        // What is trapped for so long is let out straight on.
        trapped_.add(rows[l]);
        continue;
      }
      row.flags -= 1u << kGlassShift;
      pass_glass(world_, row, lane(point, l), lane(shading, l), lane(random, l));
      going_.add(rows[l]);
    }
    return glass;
  }

  /// The last ray asks only for the sky; it takes the floor for the sky's lower half.
  void look_last(Paths& path, PackBits rows, PackMask live) {
    Pack3 share = same3<Pack3>({1, 1, 1});
    if (world_.has_glass) {
      for (int l = 0; l < kLanes; ++l)
        if (live[l]) set_lane(share, l, through_meshes(world_, paths_[rows[l]].ray, tally_));
    } else {
      const int count = count_bits(Lanes<Pack>::bits(live));
      tally_.rays += static_cast<std::uint64_t>(count);
      const std::uint32_t blocked = world_.geometry->blocked(&path.ray, count);
      for (int l = 0; l < count; ++l)
        if ((blocked >> l) & 1) set_lane(share, l, {});
    }
    const PackMask hidden = live & is_black(share);
    if (any(hidden))
      add_sky(world_, path, same<Pack>(world_.max_depth == 1 ? kGuessedBounce : 0), hidden);
    const PackMask seen = live & opposite(hidden);
    // Unshaded, what was foreseen is what it is.
    const PackMask shaded = seen & (min_component(share) < 1.0f);
    if (any(shaded)) add_sky(world_, path, Pack{}, shaded);
    path.throughput = path.throughput * share;
    leave_scene(world_, path, seen);
  }

  const World& world_;
  const FrameSampler& sampler_;
  const Wave& wave_;
  Tally& tally_;
  std::uint32_t set_ = 1;
  PackMask taken_{};  ///< lanes of the eight at hand whose rows are seen to already
  List going_, leaving_, floors_, meshes_, trapped_, last_;
  std::array<PathRow, Wave::kMost> paths_;
  std::array<MeetingRow, Wave::kMost> meetings_;
  std::array<Vec3, Wave::kMost> direct_;
  ShadowRays shadows_{world_, tally_, direct_.data()};
};

}  // namespace

void trace(const World& world, const FrameSampler& sampler, Wave& wave, Tally& tally) {
  tally.paths += static_cast<std::uint64_t>(wave.count);
  Tracer tracer(world, sampler, wave, tally);
  tracer.run();
  for (int i = 0; i < wave.count; ++i) wave.lights[i] = tracer.result(i);
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
  } else if (first.floor < kInfinity) {
    const FloorPointOf<Vec3> point = floor_point(world.floor, ray, first.floor);
    shown.depth = first.floor;
    shown.normal = {0, 1, 0};
    shown.id = 1;
    shown.position = shown.next = point.position;
    shown.albedo = world.floor.color * point.tone;
  }
  return shown;
}

}  // namespace polymorph
