// isa_bench [--rays N] [--exact 0|1] MODEL.obj...: the same rays against the same meshes under
// every instruction set of Embree that this processor has. Counts the rays whose mesh or triangle,
// whose t, u or v, or whose shadow differs from that of the first, and prints a hash of all hits,
// which is to be the same on every machine. A third of the rays come from outside, a third leave
// the surface in random directions, and a third aim at vertices and at the middles of edges. With
// --exact 0 Embree answers alone, in its robust mode.
#include <fmt/format.h>

#include <atomic>
#include <chrono>
#include <cstring>

#include "base/hash.h"
#include "base/parallel.h"
#include "base/random.h"
#include "kernels/floating_point.h"
#include "model/load/load_obj.h"
#include "render/math/vector_math.h"
#include "render/rays/scene_build.h"

namespace polymorph {
namespace {

constexpr std::int64_t kChunk = 1 << 16;  // rays whose hits are kept at a time

/// Embree as it is, in its robust mode.
class Plain {
 public:
  Plain(const RayDevice& device, const RenderMesh& mesh) {
    RTCGeometry geometry = rtcNewGeometry(device.device.get(), RTC_GEOMETRY_TYPE_TRIANGLE);
    scene_ = rtcNewScene(device.device.get());
    void* to = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                       sizeof(Vec3), mesh.positions.size());
    std::memcpy(to, mesh.positions.data(), mesh.positions.size_bytes());
    to = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                 sizeof(Triangle), mesh.triangles.size());
    std::memcpy(to, mesh.triangles.data(), mesh.triangles.size_bytes());
    rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene_, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(scene_);
  }
  MeshHit closest(const Ray& ray) const {
    RTCRayHit query{};
    query.ray = {ray.origin.x,
                 ray.origin.y,
                 ray.origin.z,
                 0,
                 ray.direction.x,
                 ray.direction.y,
                 ray.direction.z,
                 ray.time,
                 ray.far,
                 ~0u,
                 0,
                 0};
    query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcIntersect1(scene_, &context, &query);
    if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return {};
    return {0, query.hit.primID, query.ray.tfar, query.hit.u, query.hit.v};
  }

 private:
  RTCScene scene_;
};

Vec3 direction_of(std::uint64_t key, std::uint64_t stream) {
  const float z = 2 * random_float(stream, key, 0) - 1;
  const Vec2 around = cos_sin_turns(random_float(stream, key, 1));
  const float r = std::sqrt(std::max(0.0f, 1 - z * z));
  return {r * around.x, r * around.y, z};
}

/// The n-th ray. `base`: what the rays that leave the surface start from.
Ray ray_of(const Model& model, const TracedScene& base, std::uint64_t n) {
  const Box box = base.bounds();
  const Vec3 from = box.center() + direction_of(n, 1) * (1.5f * box.diagonal());
  Vec3 to = box.center() + Vec3{random_float(2, n, 0) - 0.5f, random_float(2, n, 1) - 0.5f,
                                random_float(2, n, 2) - 0.5f} *
                               box.diagonal() * 0.6f;
  if (n % 3 == 2) {
    const auto count = static_cast<std::uint32_t>(model.triangles.size());
    const Triangle& t = model.triangles[random_below(count, 3, n, 0)];
    const std::uint32_t i = random_below(3, 3, n, 1);
    to = model.points[t.v[i]];
    if (random_below(2, 3, n, 2) == 1) to = (to + model.points[t.v[(i + 1) % 3]]) * 0.5f;
  }
  const Ray ray{from, normalized(to - from)};
  if (n % 3 != 1) return ray;
  const MeshHit hit = base.closest(ray);
  if (hit.mesh == kNoMesh) return ray;
  const SurfacePoint point = base.surface_point(ray, hit);
  const Vec3 local = cosine_direction(random_float(4, n, 0), random_float(4, n, 1));
  return {point.lifted + point.normal * base.epsilon(), to_world(make_frame(point.normal), local)};
}

struct Answer {
  MeshHit hit;
  std::uint32_t occluded = 0;
};

struct Differences {
  std::atomic<std::int64_t> triangle{0}, numbers{0}, occluded{0};
};

bool same_bits(float a, float b) { return float_bits(a) == float_bits(b); }

Result<int> run(const std::vector<std::string>& models, std::int64_t rays, bool exact) {
  std::vector<RayDevice> devices;
  for (const char* isa : {"sse2", "sse4.2", "avx", "avx2", "avx512"}) {
    auto device = make_ray_device(isa);
    if (device)
      devices.push_back(std::move(*device));
    else
      fmt::print("{}: left out, this processor lacks it\n", isa);
  }
  int code = 0;
  for (const std::string& name : models) {
    PM_TRY(const LoadedModel loaded, load_obj(name, {.textures = false}));
    RenderMesh mesh;
    mesh.positions = loaded.model.points;
    mesh.triangles = loaded.model.triangles;
    const std::vector<RenderMesh> meshes{mesh};
    std::vector<TracedScene> scenes;
    std::vector<Plain> plain;
    const float reach = 3 * bounding_box(mesh.positions).diagonal();
    for (const RayDevice& device : devices) {
      PM_TRY(TracedScene scene, TracedScene::build(device, meshes, 0, reach));
      scenes.push_back(std::move(scene));
      if (!exact) plain.emplace_back(device, mesh);
    }
    std::vector<Differences> differences(devices.size());
    std::vector<double> seconds(devices.size());
    std::atomic<std::int64_t> hits{0};
    Hasher hasher;
    std::vector<Ray> chunk(kChunk);
    std::vector<std::vector<Answer>> answers(devices.size(), std::vector<Answer>(kChunk));
    for (std::int64_t first = 0; first < rays; first += kChunk) {
      const std::int64_t count = std::min(kChunk, rays - first);
      parallel_for(
          count,
          [&](std::int64_t i) {
            const FlushDenormals flush;
            chunk[i] = ray_of(loaded.model, scenes[0], static_cast<std::uint64_t>(first + i));
          },
          256);
      for (std::size_t d = 0; d < devices.size(); ++d) {
        const auto start = std::chrono::steady_clock::now();
        parallel_for(
            (count + kPacket - 1) / kPacket,
            [&](std::int64_t packet) {
              const FlushDenormals flush;
              const std::int64_t begin = packet * kPacket;
              const int n = static_cast<int>(std::min<std::int64_t>(kPacket, count - begin));
              if (!exact) {
                for (int i = 0; i < n; ++i)
                  answers[d][begin + i] = {plain[d].closest(chunk[begin + i])};
                return;
              }
              RayOf<Pack3> packs[2];
              for (int i = 0; i < 2 * kLanes; ++i) {
                const Ray& ray = chunk[begin + std::min(i, n - 1)];
                set_lane(packs[i / kLanes].origin, i % kLanes, ray.origin);
                set_lane(packs[i / kLanes].direction, i % kLanes, ray.direction);
              }
              MeshHitOf<Pack> met[2];
              scenes[d].closest(packs, met, n, false);
              const std::uint32_t occluded = scenes[d].test_occlusion(packs, n);
              for (int i = 0; i < n; ++i) {
                const MeshHitOf<Pack>& m = met[i / kLanes];
                const int l = i % kLanes;
                answers[d][begin + i] = {{m.mesh[l], m.triangle[l], m.distance[l], m.u[l], m.v[l]},
                                         (occluded >> i) & 1};
                if (m.mesh[l] == kNoMesh) answers[d][begin + i].hit = {};
              }
            },
            16);
        seconds[d] +=
            std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
        std::int64_t met = 0;
        for (std::int64_t i = 0; i < count; ++i) {
          const Answer &a = answers[0][i], &b = answers[d][i];
          met += a.hit.mesh != kNoMesh;
          differences[d].triangle += a.hit.mesh != b.hit.mesh || a.hit.triangle != b.hit.triangle;
          differences[d].numbers += !same_bits(a.hit.distance, b.hit.distance) ||
                                    !same_bits(a.hit.u, b.hit.u) || !same_bits(a.hit.v, b.hit.v);
          differences[d].occluded += a.occluded != b.occluded;
        }
        if (d == 0) hits += met;
      }
      hasher.add_bytes(answers[0].data(), static_cast<std::size_t>(count) * sizeof(Answer));
    }
    fmt::print("{}: {} triangles, {} rays, {} hits, hash {}\n", name, mesh.triangles.size(), rays,
               hits.load(), hasher.hex());
    for (std::size_t d = 0; d < devices.size(); ++d) {
      const Differences& other = differences[d];
      fmt::print("  {:7} {:7.2f} s, differ from {}: mesh or triangle {}, t, u or v {}, shadow {}\n",
                 devices[d].isa, seconds[d], devices[0].isa, other.triangle.load(),
                 other.numbers.load(), other.occluded.load());
      if (other.triangle + other.numbers + other.occluded > 0) code = 1;
    }
    std::fflush(stdout);
  }
  return code;
}

}  // namespace
}  // namespace polymorph

int main(int argc, char** argv) {
  std::vector<std::string> models;
  std::int64_t rays = 1 << 20;
  bool exact = true;
  for (int i = 1; i < argc; ++i) {
    if (std::strcmp(argv[i], "--rays") == 0 && i + 1 < argc)
      rays = std::atoll(argv[++i]);
    else if (std::strcmp(argv[i], "--exact") == 0 && i + 1 < argc)
      exact = std::atoi(argv[++i]) != 0;
    else
      models.emplace_back(argv[i]);
  }
  if (models.empty()) {
    fmt::print(stderr, "isa_bench [--rays N] [--exact 0|1] MODEL.obj...\n");
    return 2;
  }
  const auto code = polymorph::run(models, rays, exact);
  if (code) return *code;
  fmt::print(stderr, "{}\n", code.error().message);
  return 3;
}
