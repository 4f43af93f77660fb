#include "render/ray_bench.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "base/parallel.h"
#include "base/random.h"
#include "base/stopwatch.h"
#include "kernels/floating_point.h"
#include "render/device/device_tracer.h"
#include "render/lights/lights.h"
#include "render/tile.h"

namespace polymorph {
namespace {

template <class F>
double measure_seconds(const F& run) {
  const Stopwatch stopwatch;
  run();
  return stopwatch.seconds();
}

/// An Embree scene with default flags, as a plain loop would use it. Rays begin 1e-4 from their
/// origin, so that they miss the surface that they leave.
class BareScene {
 public:
  BareScene(const RenderMesh& mesh, RTCBuildQuality quality) {
    RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* vertices = static_cast<Vec3*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0,
                                                                RTC_FORMAT_FLOAT3, sizeof(Vec3),
                                                                mesh.positions.size()));
    std::copy(mesh.positions.begin(), mesh.positions.end(), vertices);
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                               mesh.triangles.data(), 0, sizeof(Triangle), mesh.triangles.size());
    rtcSetSceneBuildQuality(scene_, quality);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene_, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(scene_);
  }
  BareScene(const BareScene&) = delete;
  BareScene& operator=(const BareScene&) = delete;
  ~BareScene() {
    rtcReleaseScene(scene_);
    rtcReleaseDevice(device_);
  }
  RTCRayHit intersect(const Ray& ray) const {
    RTCRayHit query{};
    query.ray = {ray.origin.x,
                 ray.origin.y,
                 ray.origin.z,
                 1e-4f,  // tnear
                 ray.direction.x,
                 ray.direction.y,
                 ray.direction.z,
                 0,  // time
                 INFINITY,
                 ~0u,  // mask
                 0,    // id
                 0};   // flags
    query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcIntersect1(scene_, &context, &query);
    return query;
  }
  void intersect_packet(const Ray* rays, float* distances) const {
    alignas(64) int valid[kPacket];
    alignas(64) RTCRayHit16 query{};
    for (int i = 0; i < kPacket; ++i) {
      valid[i] = -1;
      query.ray.org_x[i] = rays[i].origin.x;
      query.ray.org_y[i] = rays[i].origin.y;
      query.ray.org_z[i] = rays[i].origin.z;
      query.ray.dir_x[i] = rays[i].direction.x;
      query.ray.dir_y[i] = rays[i].direction.y;
      query.ray.dir_z[i] = rays[i].direction.z;
      query.ray.tnear[i] = 1e-4f;
      query.ray.tfar[i] = INFINITY;
      query.ray.mask[i] = ~0u;
      query.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
    }
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    rtcIntersect16(valid, scene_, &context, &query);
    for (int i = 0; i < kPacket; ++i) distances[i] = query.ray.tfar[i];
  }

 private:
  RTCDevice device_ = rtcNewDevice("");
  RTCScene scene_ = rtcNewScene(device_);
};

/// Makes one ray per pixel, in blocks of 4 x 4 pixels, each of which is a packet. Pixels of
/// incomplete blocks at the right and lower edge are omitted.
std::vector<Ray> make_camera_rays(const Camera& camera, int width, int height) {
  std::vector<Ray> rays;
  const float scale = 2 * camera.tan_half_fov_y / static_cast<float>(height);
  for (int y = 0; y + 4 <= height; y += 4)
    for (int x = 0; x + 4 <= width; x += 4)
      for (int i = 0; i < kPacket; ++i) {
        const float px = static_cast<float>(x + i % 4) + 0.5f - 0.5f * static_cast<float>(width);
        const float py = 0.5f * static_cast<float>(height) - static_cast<float>(y + i / 4) - 0.5f;
        rays.push_back({camera.position, normalized(camera.forward + camera.right * (px * scale) +
                                                    camera.up * (py * scale))});
      }
  return rays;
}

/// Makes rays that leave the surface where camera rays hit it, in random directions.
std::vector<Ray> make_scattered_rays(const BareScene& bare, const std::vector<Ray>& camera) {
  std::vector<Ray> rays;
  for (std::size_t i = 0; i < camera.size(); ++i) {
    const RTCRayHit first = bare.intersect(camera[i]);
    if (first.hit.geomID == RTC_INVALID_GEOMETRY_ID) continue;
    Vec3 normal = normalized(Vec3{first.hit.Ng_x, first.hit.Ng_y, first.hit.Ng_z});
    if (dot(normal, camera[i].direction) > 0) normal = -normal;
    const Vec3 local = cosine_direction(random_float(/*seed=*/0, /*stream=*/1, i),
                                        random_float(/*seed=*/0, /*stream=*/2, i));
    rays.push_back({camera[i].origin + camera[i].direction * first.ray.tfar + normal * 1e-4f,
                    to_world(make_frame(normal), local)});
  }
  return rays;
}

/// Packs eight rays per pack; the last group of sixteen is padded with the last ray.
std::vector<RayOf<Pack3>> pack_rays(const std::vector<Ray>& rays) {
  std::vector<RayOf<Pack3>> packs((rays.size() + kPacket - 1) / kPacket * kPacket / kLanes);
  for (std::size_t i = 0; i < packs.size() * kLanes; ++i) {
    const Ray& ray = rays[std::min(i, rays.size() - 1)];
    set_lane(packs[i / kLanes].origin, static_cast<int>(i % kLanes), ray.origin);
    set_lane(packs[i / kLanes].direction, static_cast<int>(i % kLanes), ray.direction);
  }
  return packs;
}

/// Calls f(index of the first ray, count) for chunks of the rays, in parallel.
template <class F>
void for_each_chunk(const std::vector<Ray>& rays, const F& f) {
  constexpr std::int64_t kChunk = 1024;
  const auto count = static_cast<std::int64_t>(rays.size());
  parallel_for((count + kChunk - 1) / kChunk, [&](std::int64_t chunk) {
    const FlushDenormals flush;
    const std::int64_t begin = chunk * kChunk;
    f(static_cast<std::size_t>(begin), static_cast<std::size_t>(std::min(kChunk, count - begin)));
  });
}

}  // namespace

Result<std::vector<RayLoop>> measure_rays(const RenderScene& scene, int width, int height,
                                          int repeats) {
  PM_CHECK(scene.meshes.size() == 1);
  const BareScene bare(scene.meshes.front(), RTC_BUILD_QUALITY_MEDIUM);
  PM_TRY(const RayDevice device, make_ray_device(""));
  PM_TRY(const TracedScene geometry, TracedScene::build(device, scene.meshes));
  World world;
  world.geometry = &geometry;
  const std::vector<Ray> camera = make_camera_rays(scene.camera, width, height);
  const std::vector<Ray> scattered = make_scattered_rays(bare, camera);
  const std::vector<RayOf<Pack3>> packed[] = {pack_rays(camera), pack_rays(scattered)};
  std::vector<float> distances(camera.size());
  std::vector<IntersectionOf<Pack>> intersections(packed[0].size());
  // Runs the loop of this index in `loops`: 0 to 2 trace camera rays, 3 and 4 scattered rays.
  const auto run = [&](std::size_t loop) {
    const bool coherent = loop < 3;
    const std::vector<Ray>& rays = coherent ? camera : scattered;
    for_each_chunk(rays, [&](std::size_t begin, std::size_t n) {
      RayStats stats;
      for (std::size_t k = begin; k < begin + n; ++k) {
        const bool begins_packet = (k - begin) % kPacket == 0;
        const int count = static_cast<int>(std::min<std::size_t>(kPacket, begin + n - k));
        if (loop == 1 && count == kPacket && begins_packet)
          bare.intersect_packet(&rays[k], &distances[k]);
        if ((loop == 2 || loop == 4) && begins_packet)
          intersect_closest(world, &packed[coherent ? 0 : 1][k / kLanes],
                            &intersections[k / kLanes], count, coherent, stats);
        if (loop == 0 || loop == 3) distances[k] = bare.intersect(rays[k]).ray.tfar;
      }
    });
  };
  std::vector<RayLoop> loops{{"bare camera rays, singly", camera.size(), /*seconds=*/{}},
                             {"bare camera rays, by 16", camera.size(), /*seconds=*/{}},
                             {"camera rays", camera.size(), /*seconds=*/{}},
                             {"bare scattered rays", scattered.size(), /*seconds=*/{}},
                             {"scattered rays", scattered.size(), /*seconds=*/{}}};
  for (int i = 0; i <= repeats; ++i)
    for (std::size_t loop = 0; loop < loops.size(); ++loop) {
      const double seconds = measure_seconds([&] { run(loop); });
      if (i > 0) loops[loop].seconds.push_back(seconds);  // the first run warms up
    }
  return loops;
}

Result<std::vector<RayLoop>> measure_device_rays(const RenderScene& scene, DeviceTracer& tracer,
                                                 int width, int height, int repeats) {
  PM_CHECK(scene.meshes.size() == 1);
  const BareScene bare(scene.meshes.front(), RTC_BUILD_QUALITY_MEDIUM);
  const TracedScene geometry(scene.meshes, /*shutter=*/0, length(scene.bounds.size()),
                             scene.bounds);
  // Packing a frame needs a sky and a filter, although the rays of this benchmark use neither.
  const Sky sky = make_studio_sky(make_rig(scene.camera), make_key_light({}, scene.camera),
                                  /*floor=*/{}, /*scale=*/1, SkyDomain::kAll);
  const PixelFilter filter = make_pixel_filter(/*radius=*/1);
  FrameJob job;
  job.world.geometry = &geometry;
  job.world.sky = sky;
  job.camera.filter = &filter;
  const std::vector<Ray> camera = make_camera_rays(scene.camera, width, height);
  const std::vector<Ray> scattered = make_scattered_rays(bare, camera);
  std::vector<MeshHit> hits(camera.size());
  std::vector<RayLoop> loops{{"bare camera rays, GPU", camera.size(), /*seconds=*/{}},
                             {"camera rays, GPU", camera.size(), /*seconds=*/{}},
                             {"bare scattered rays, GPU", scattered.size(), /*seconds=*/{}},
                             {"scattered rays, GPU", scattered.size(), /*seconds=*/{}}};
  for (int i = 0; i <= repeats; ++i)
    for (std::size_t loop = 0; loop < loops.size(); ++loop) {
      const std::span<const Ray> rays = loop < 2 ? camera : scattered;
      double seconds = 0;
      const std::string error =
          tracer.find_hits(job, rays, loop % 2 == 0, std::span(hits).first(rays.size()), seconds);
      if (!error.empty()) return make_error(ErrorCode::kResource, "{}", error);
      if (i > 0) loops[loop].seconds.push_back(seconds);  // the first run warms up
    }
  return loops;
}

Result<std::vector<BuildQuality>> measure_builds(const RenderScene& scene) {
  PM_CHECK(scene.meshes.size() == 1);
  std::vector<BuildQuality> qualities;
  const std::vector<Ray> camera = make_camera_rays(scene.camera, 1024, 1024);
  for (const auto& [name, quality] :
       {std::pair{"low", RTC_BUILD_QUALITY_LOW}, std::pair{"medium", RTC_BUILD_QUALITY_MEDIUM},
        std::pair{"high", RTC_BUILD_QUALITY_HIGH}}) {
    BuildQuality result{name};
    std::unique_ptr<BareScene> bare;
    // clang 14 cannot capture a structured binding by reference.
    result.build_seconds = measure_seconds([&, build_quality = quality] {
      bare = std::make_unique<BareScene>(scene.meshes.front(), build_quality);
    });
    const std::vector<Ray> rays = make_scattered_rays(*bare, camera);
    std::vector<float> distances(rays.size());
    const double seconds = measure_seconds([&] {
      for_each_chunk(rays, [&](std::size_t begin, std::size_t n) {
        for (std::size_t k = begin; k < begin + n; ++k)
          distances[k] = bare->intersect(rays[k]).ray.tfar;
      });
    });
    result.trace_seconds = rays.empty() ? 0 : seconds * 1e6 / static_cast<double>(rays.size());
    qualities.push_back(result);
  }
  return qualities;
}

}  // namespace polymorph
