// Rays a second of the renderer against bare loops over Embree on the same mesh and camera. Compare
// the rows of one run with each other; numbers of different machines or days mean nothing.
#include <benchmark/benchmark.h>
#include <embree3/rtcore.h>

#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "base/parallel.h"
#include "base/random.h"
#include "render/floating_point.h"
#include "render/integrator.h"
#include "render/render.h"

namespace polymorph {
namespace {

constexpr int kWidth = 640, kHeight = 480;

/// A trefoil tube of 100 000 triangles: it hides parts of itself, as morphing surfaces do.
struct Knot {
  std::vector<Vec3> positions, normals;
  std::vector<Triangle> triangles;
};

Knot make_knot(int around, int across) {
  constexpr float kTurn = 2 * std::numbers::pi_v<float>;
  const auto spine = [](float t) {
    const float r = 0.62f + 0.28f * std::cos(3 * t);
    return Vec3{r * std::cos(2 * t), 0.5f + 0.30f * std::sin(3 * t), r * std::sin(2 * t)};
  };
  Knot knot;
  for (int i = 0; i < around; ++i) {
    const float t = kTurn * static_cast<float>(i) / static_cast<float>(around);
    const Vec3 along = normalized(spine(t + 1e-3f) - spine(t - 1e-3f));
    const Vec3 side = normalized(cross(along, Vec3{0, 1, 0})), up = cross(side, along);
    for (int j = 0; j < across; ++j) {
      const float a = kTurn * static_cast<float>(j) / static_cast<float>(across);
      knot.normals.push_back(side * std::cos(a) + up * std::sin(a));
      knot.positions.push_back(spine(t) + knot.normals.back() * 0.17f);
      const auto at = [&](int u, int v) {
        return static_cast<std::uint32_t>((u % around) * across + v % across);
      };
      knot.triangles.push_back({{at(i, j), at(i, j + 1), at(i + 1, j)}});
      knot.triangles.push_back({{at(i + 1, j), at(i, j + 1), at(i + 1, j + 1)}});
    }
  }
  return knot;
}

const Knot& knot() {
  static const Knot kKnot = make_knot(1000, 50);
  return kKnot;
}

RenderScene knot_scene(float look) {
  static const std::vector<Material> kMaterials(1);
  RenderScene scene;
  RenderMesh mesh;
  mesh.positions = knot().positions;
  mesh.triangles = knot().triangles;
  mesh.vertex_normals = knot().normals;
  mesh.materials = kMaterials;
  mesh.look = look;
  mesh.id = 2;
  scene.meshes = {mesh};
  scene.bounds = box_of(knot().positions);
  scene.ground.height = scene.bounds.low.y;
  scene.camera = make_camera({}, scene.bounds, kWidth, kHeight);
  return scene;
}

/// One Embree scene with default flags, as a bare loop would use it.
struct Bare {
  RTCDevice device = rtcNewDevice("");
  RTCScene scene = rtcNewScene(device);
  Bare() {
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* vertices = static_cast<Vec3*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0,
                                                                RTC_FORMAT_FLOAT3, sizeof(Vec3),
                                                                knot().positions.size()));
    std::copy(knot().positions.begin(), knot().positions.end(), vertices);
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                               knot().triangles.data(), 0, sizeof(Triangle),
                               knot().triangles.size());
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(scene);
  }
  ~Bare() {
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
  }
  RTCRayHit shoot(Vec3 origin, Vec3 direction) const {
    RTCRayHit query{};
    query.ray = {origin.x,    origin.y, origin.z, 1e-4f, direction.x, direction.y,
                 direction.z, 0,        INFINITY, ~0u,   0,           0};
    query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcIntersect1(scene, &context, &query);
    return query;
  }
};

Vec3 pixel_direction(const Camera& camera, int x, int y) {
  const float scale = 2 * camera.tan_half_fov_y / kHeight;
  return normalized(camera.forward +
                    camera.right * ((static_cast<float>(x) + 0.5f - kWidth / 2) * scale) +
                    camera.up * ((kHeight / 2 - static_cast<float>(y) - 0.5f) * scale));
}

void count_rays(benchmark::State& state, double rays) {
  state.counters["rays"] = benchmark::Counter(rays, benchmark::Counter::kIsIterationInvariantRate);
}

void BareCameraRays(benchmark::State& state) {
  const Bare bare;
  const Camera camera = knot_scene(1).camera;
  std::vector<float> depth(kWidth * kHeight);
  for (auto _ : state)
    parallel_for(kHeight, [&](std::int64_t y) {
      const FlushDenormals flush;
      for (int x = 0; x < kWidth; ++x)
        depth[y * kWidth + x] =
            bare.shoot(camera.position, pixel_direction(camera, x, static_cast<int>(y))).ray.tfar;
    });
  count_rays(state, kWidth * kHeight);
}
BENCHMARK(BareCameraRays)->UseRealTime()->Unit(benchmark::kMillisecond);

/// The best kind of bare loop: packets of 16.
void BareCameraPackets(benchmark::State& state) {
  const Bare bare;
  const Camera camera = knot_scene(1).camera;
  std::vector<float> depth(kWidth * kHeight);
  for (auto _ : state)
    parallel_for(kHeight / 4, [&](std::int64_t row) {
      const FlushDenormals flush;
      for (int x = 0; x < kWidth; x += 4) {
        alignas(64) int valid[16];
        alignas(64) RTCRayHit16 query{};
        for (int i = 0; i < 16; ++i) {
          valid[i] = -1;
          const Vec3 d = pixel_direction(camera, x + i % 4, static_cast<int>(row) * 4 + i / 4);
          query.ray.org_x[i] = camera.position.x;
          query.ray.org_y[i] = camera.position.y;
          query.ray.org_z[i] = camera.position.z;
          query.ray.dir_x[i] = d.x;
          query.ray.dir_y[i] = d.y;
          query.ray.dir_z[i] = d.z;
          query.ray.tnear[i] = 1e-4f;
          query.ray.tfar[i] = INFINITY;
          query.ray.mask[i] = ~0u;
          query.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
        }
        RTCIntersectContext context;
        rtcInitIntersectContext(&context);
        context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
        rtcIntersect16(valid, bare.scene, &context, &query);
        for (int i = 0; i < 16; ++i)
          depth[(row * 4 + i / 4) * kWidth + x + i % 4] = query.ray.tfar[i];
      }
    });
  count_rays(state, kWidth * kHeight);
}
BENCHMARK(BareCameraPackets)->UseRealTime()->Unit(benchmark::kMillisecond);

void CameraRays(benchmark::State& state) {
  RenderScene scene = knot_scene(1);
  RayDevice device = std::move(make_ray_device("")).value();
  const TracedScene geometry = std::move(TracedScene::build(device, scene.meshes)).value();
  World world;
  world.geometry = &geometry;
  std::vector<Meeting> met(kWidth * kHeight);
  for (auto _ : state)
    parallel_for(kHeight / 4, [&](std::int64_t row) {
      const FlushDenormals flush;
      Tally tally;
      for (int x = 0; x < kWidth; x += 4) {
        std::array<Ray, kPacket> rays;
        for (int i = 0; i < kPacket; ++i)
          rays[static_cast<std::size_t>(i)] = {
              scene.camera.position,
              pixel_direction(scene.camera, x + i % 4, static_cast<int>(row) * 4 + i / 4)};
        meet(world, rays.data(), &met[(row * kWidth + x) * 4], kPacket, tally);
      }
    });
  count_rays(state, kWidth * kHeight);
}
BENCHMARK(CameraRays)->UseRealTime()->Unit(benchmark::kMillisecond);

/// Rays that leave the knot's surface in random directions, in the order of the pixels.
void BareScatteredRays(benchmark::State& state) {
  const Bare bare;
  const Camera camera = knot_scene(1).camera;
  std::vector<Ray> rays;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const Vec3 direction = pixel_direction(camera, x, y);
      const RTCRayHit first = bare.shoot(camera.position, direction);
      if (first.hit.geomID == RTC_INVALID_GEOMETRY_ID) continue;
      Vec3 normal = normalized(Vec3{first.hit.Ng_x, first.hit.Ng_y, first.hit.Ng_z});
      if (dot(normal, direction) > 0) normal = -normal;
      const auto pixel = static_cast<std::uint64_t>(y * kWidth + x);
      const Vec3 local = cosine_direction(random_float(0, 1, pixel), random_float(0, 2, pixel));
      rays.push_back({camera.position + direction * first.ray.tfar + normal * 1e-4f,
                      to_world(make_frame(normal), local)});
    }
  std::vector<float> depth(rays.size());
  for (auto _ : state)
    parallel_ranges(static_cast<std::int64_t>(rays.size()), 1024,
                    [&](std::int64_t begin, std::int64_t end) {
                      const FlushDenormals flush;
                      for (std::int64_t i = begin; i < end; ++i)
                        depth[i] = bare.shoot(rays[i].origin, rays[i].direction).ray.tfar;
                    });
  count_rays(state, static_cast<double>(rays.size()));
}
BENCHMARK(BareScatteredRays)->UseRealTime()->Unit(benchmark::kMillisecond);

/// A whole frame, 16 samples a pixel; the argument is the share of metal in per cent.
void Frame(benchmark::State& state) {
  const RenderScene scene = knot_scene(static_cast<float>(state.range(0)) / 100);
  Renderer renderer = std::move(Renderer::create()).value();
  RenderSettings settings;
  settings.image.width = kWidth;
  settings.image.height = kHeight;
  settings.image.samples = 16;
  double rays = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(renderer.render(scene, settings));
    rays = static_cast<double>(renderer.stats().rays);
  }
  count_rays(state, rays);
  state.counters["paths"] =
      benchmark::Counter(kWidth * kHeight * 16, benchmark::Counter::kIsIterationInvariantRate);
}
BENCHMARK(Frame)->Arg(0)->Arg(100)->UseRealTime()->Unit(benchmark::kMillisecond);

void BuildScene(benchmark::State& state) {
  const RenderScene scene = knot_scene(1);
  const RayDevice device = std::move(make_ray_device("")).value();
  for (auto _ : state) benchmark::DoNotOptimize(TracedScene::build(device, scene.meshes));
}
BENCHMARK(BuildScene)->UseRealTime()->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace polymorph

BENCHMARK_MAIN();
