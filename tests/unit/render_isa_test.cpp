// What a ray hits is the same under every instruction set of Embree, and is what going through all
// triangles one by one gives.
#include "base/random.h"
#include "kernels/floating_point.h"
#include "render/math/vector_math.h"
#include "render/rays/intersect_triangle.h"
#include "render/rays/scene_build.h"
#include "render/rays/widened.h"
#include "testing/render.h"

namespace polymorph {
namespace {

using namespace testing;

std::vector<RayDevice> all_devices() {
  std::vector<RayDevice> devices;
  for (const char* isa : {"sse2", "sse4.2", "avx", "avx2", "avx512"}) {
    Result<RayDevice> device = make_ray_device(isa);
    if (device)
      devices.push_back(std::move(*device));
    else
      EXPECT_EQ(device.error().code, ErrorCode::kResource) << device.error().message;
  }
  return devices;
}

/// Two balls that cross, twice the same square, needles, a fan of sharp triangles, one without
/// area.
struct Hard {
  TestMesh ball = make_ball(40, 20), other = make_ball(33, 17, 0.8f);
  TestMesh square = make_square({0, 0, 0.3f}, {1, 0, 0}, {0, 1, 0}, 0.9f);
  TestMesh sharp;
  std::vector<RenderMesh> meshes;
  Hard() {
    for (Vec3& p : other.positions) p = p + Vec3{0.4f, 0.1f, 0.2f};
    square.triangles.push_back({{1, 2, 3}});
    square.triangles.push_back({{0, 1, 2}});
    for (int i = 0; i < 60; ++i) {
      const auto first = static_cast<std::uint32_t>(sharp.positions.size());
      const Vec2 a = cos_sin_turns(static_cast<float>(i) / 60);
      const Vec2 b = cos_sin_turns(static_cast<float>(i + 1) / 60);
      sharp.positions.insert(sharp.positions.end(),
                             {{0, -1.2f, 0}, {2 * a.x, -1.2f, 2 * a.y}, {2 * b.x, -1.2f, 2 * b.y}});
      sharp.triangles.push_back({{first, first + 1, first + 2}});
    }
    const auto first = static_cast<std::uint32_t>(sharp.positions.size());
    sharp.positions.insert(sharp.positions.end(),
                           {{-1, -1, -1}, {1, 1, 1}, {1, 1.0001f, 1}, {0, 0, 2}, {0, 0, 2.5f}});
    sharp.triangles.push_back({{first, first + 1, first + 2}});
    sharp.triangles.push_back({{first + 3, first + 4, first + 3}});
    meshes = {view_of(ball), view_of(other), view_of(square), view_of(sharp)};
    for (RenderMesh& mesh : meshes) {
      mesh.vertex_normals = {};
      mesh.corner_uvs = {};
    }
  }
};

Vec3 random_direction(std::uint64_t key, std::uint64_t stream) {
  const Vec2 around = cos_sin_turns(random_float(stream, key, 0));
  const float z = 2 * random_float(stream, key, 1) - 1, r = std::sqrt(1 - z * z);
  return {r * around.x, r * around.y, z};
}

/// A third each: from outside, from within, at vertices and edges.
Ray random_ray(const std::vector<RenderMesh>& meshes, std::uint64_t key) {
  const Vec3 from = random_direction(key, 1) * (key % 3 == 1 ? 0.5f : 4.0f);
  if (key % 3 == 1) return {from, random_direction(key, 2)};
  Vec3 to = random_direction(key, 2) * random_float(3, key, 0) * 1.5f;
  if (key % 3 == 2) {
    const RenderMesh& mesh = meshes[random_below(4, 4, key, 0)];
    const auto count = static_cast<std::uint32_t>(mesh.triangles.size());
    const Triangle& t = mesh.triangles[random_below(count, 4, key, 1)];
    to = lerp(mesh.positions[t.v[0]], mesh.positions[t.v[1]],
              static_cast<float>(random_below(3, 4, key, 2)) * 0.5f);
  }
  return {from, normalized(to - from)};
}

void expect_equal(const MeshHit& a, const MeshHit& b, const std::string& what) {
  EXPECT_EQ(a.mesh, b.mesh) << what;
  if (a.mesh == kNoMesh || b.mesh == kNoMesh) return;
  EXPECT_EQ(a.triangle, b.triangle) << what;
  EXPECT_EQ(a.distance, b.distance) << what;
  EXPECT_EQ(a.u, b.u) << what;
  EXPECT_EQ(a.v, b.v) << what;
}

MeshHit one_by_one(const TracedScene& scene, std::uint32_t meshes, const Ray& ray) {
  MeshHit best;
  double nearest = static_cast<double>(ray.far);
  for (std::uint32_t m = 0; m < meshes; ++m)
    for (std::uint32_t i = 0; i < scene.mesh(m).triangles.size(); ++i) {
      TriangleIntersection intersection;
      if (!intersects_triangle(scene.mesh_to_trace(m), i, ray, intersection) ||
          !(intersection.distance > 0) || intersection.distance >= nearest)
        continue;
      nearest = intersection.distance;
      best = {m, i, static_cast<float>(intersection.distance), static_cast<float>(intersection.u),
              static_cast<float>(intersection.v)};
    }
  return best;
}

TEST(Isa, HitsAreThoseOfAllTrianglesOneByOne) {
  const FlushDenormals flush;
  const Hard hard;
  for (const RayDevice& device : all_devices()) {
    Result<TracedScene> scene = TracedScene::build(device, hard.meshes, 0, 5);
    ASSERT_TRUE(scene) << scene.error().message;
    int hits = 0;
    for (std::uint64_t key = 0; key < 6000; ++key) {
      const Ray ray = random_ray(hard.meshes, key);
      const MeshHit wanted = one_by_one(*scene, 4, ray);
      hits += wanted.mesh != kNoMesh;
      expect_equal(wanted, scene->closest(ray), device.isa + ", ray " + std::to_string(key));
    }
    EXPECT_GT(hits, 4000);
  }
}

TEST(Isa, RaysThatBeginInFrontOfATriangleHitIt) {
  // At such a distance Embree's own one may be negative.
  const FlushDenormals flush;
  const TestMesh ball = make_ball(40, 20);
  const RenderMesh mesh = view_of(ball);
  for (const RayDevice& device : all_devices()) {
    Result<TracedScene> scene = TracedScene::build(device, {mesh}, 0, 5);
    ASSERT_TRUE(scene) << scene.error().message;
    int near_hits = 0;
    for (std::uint64_t key = 0; key < 2000; ++key) {
      const Vec3 direction = random_direction(key, 1);
      const std::size_t triangle = random_u64(/*seed=*/3, key, 0) % ball.triangles.size();
      Vec3 middle;
      for (const std::uint32_t v : ball.triangles[triangle].v)
        middle = middle + ball.positions[v] / 3;
      const Ray ray{middle - direction * 2e-7f, direction, /*time=*/0, /*far=*/kInfinity};
      const MeshHit wanted = one_by_one(*scene, 1, ray);
      near_hits += wanted.mesh != kNoMesh && wanted.distance < 1e-6f;
      const std::string what = device.isa + ", ray " + std::to_string(key);
      expect_equal(wanted, scene->closest(ray), what);
      const RayOf<Pack3> pack{broadcast3<Pack3>(ray.origin), broadcast3<Pack3>(ray.direction),
                              broadcast<Pack>(ray.time), broadcast<Pack>(ray.far)};
      EXPECT_EQ(scene->test_occlusion(&pack, 1) & 1u, wanted.mesh != kNoMesh ? 1u : 0u) << what;
    }
    EXPECT_GT(near_hits, 1000);
  }
}

TEST(Isa, PacketsAndShadowsAreTheSameUnderEveryInstructionSet) {
  const FlushDenormals flush;
  const Hard hard;
  const std::vector<RayDevice> devices = all_devices();
  std::vector<TracedScene> scenes;
  for (const RayDevice& device : devices) {
    Result<TracedScene> scene = TracedScene::build(device, hard.meshes, 0, 5);
    ASSERT_TRUE(scene) << scene.error().message;
    scenes.push_back(std::move(*scene));
  }
  for (std::uint64_t first = 0; first < 48000; first += kPacket) {
    RayOf<Pack3> rays[2];
    for (int i = 0; i < kPacket; ++i) {
      const Ray ray = random_ray(hard.meshes, first + static_cast<std::uint64_t>(i));
      set_lane(rays[i / kLanes].origin, i % kLanes, ray.origin);
      set_lane(rays[i / kLanes].direction, i % kLanes, ray.direction);
      rays[i / kLanes].far[i % kLanes] = i % 5 == 0 ? 3.0f : kInfinity;
    }
    const int count = first % 3 == 0 ? 11 : kPacket;
    for (std::size_t d = 0; d < scenes.size(); ++d) {
      MeshHitOf<Pack> hits[2];
      scenes[d].closest(rays, hits, count, first % 2 == 0);
      const std::uint32_t occluded = scenes[d].test_occlusion(rays, count);
      for (int i = 0; i < count; ++i) {
        const MeshHitOf<Pack>& h = hits[i / kLanes];
        const int l = i % kLanes;
        const Ray ray{lane(rays[i / kLanes].origin, l), lane(rays[i / kLanes].direction, l), 0.5f,
                      rays[i / kLanes].far[l]};
        const MeshHit alone = scenes[0].closest(ray);
        const std::string what = devices[d].isa + ", ray " + std::to_string(first + i);
        expect_equal(alone, {h.mesh[l], h.triangle[l], h.distance[l], h.u[l], h.v[l]}, what);
        EXPECT_EQ((occluded >> i) & 1, alone.mesh != kNoMesh ? 1u : 0u) << what;
      }
      for (int i = count; i < kPacket; ++i)
        EXPECT_EQ(hits[1].mesh[i % kLanes], kNoMesh)
            << devices[d].isa << ": lane " << i << " is off";
      EXPECT_EQ(occluded >> count, 0u) << devices[d].isa << ": lanes beyond " << count;
    }
  }
}

TEST(Isa, MovingMeshesToo) {
  const FlushDenormals flush;
  Hard hard;
  std::vector<Vec3> ways(hard.ball.positions.size());
  for (std::size_t i = 0; i < ways.size(); ++i)
    ways[i] = random_direction(i, 9) * 0.05f + Vec3{0.5f, 0, 0};
  hard.meshes[0].displacement = ways;
  std::vector<RayDevice> devices = all_devices();
  std::vector<MeshHit> first;
  for (const RayDevice& device : devices) {
    Result<TracedScene> scene = TracedScene::build(device, hard.meshes, 0.5f, 5);
    ASSERT_TRUE(scene) << scene.error().message;
    for (std::uint64_t key = 0; key < 6000; ++key) {
      Ray ray = random_ray(hard.meshes, key);
      ray.time = random_float(5, key, 0);
      const MeshHit hit = scene->closest(ray);
      if (&device == &devices[0])
        first.push_back(hit);
      else
        expect_equal(first[key], hit, device.isa + ", ray " + std::to_string(key));
      if (key % 30 == 0)
        expect_equal(one_by_one(*scene, 4, ray), hit, "moving, ray " + std::to_string(key));
    }
  }
}

/// One vertex for all that are at the same place, nearly.
void weld(TestMesh& mesh) {
  for (Triangle& t : mesh.triangles)
    for (std::uint32_t& v : t.v)
      for (std::uint32_t first = 0; first < v; ++first)
        if (length(mesh.positions[first] - mesh.positions[v]) < 1e-5f) v = first;
}

TEST(Isa, NoRaySlipsThroughASharedEdge) {
  // From within a ball, at all its vertices and at points of its edges.
  TestMesh ball = make_ball(64, 32);
  weld(ball);
  std::vector<RenderMesh> meshes{view_of(ball)};
  for (const RayDevice& device : all_devices()) {
    Result<TracedScene> scene = TracedScene::build(device, meshes);
    ASSERT_TRUE(scene) << scene.error().message;
    for (const Triangle& t : ball.triangles)
      for (int i = 0; i < 3; ++i) {
        const Vec3 a = ball.positions[t.v[i]], b = ball.positions[t.v[(i + 1) % 3]];
        const Vec3 origin{0.01f, 0.02f, -0.03f};
        for (const float share : {0.0f, 0.25f, 0.5f})
          EXPECT_NE(scene->closest(Ray{origin, normalized(lerp(a, b, share) - origin)}).mesh,
                    kNoMesh);
      }
  }
}

TEST(Widened, EveryEdgeIsAtLeastSoFarOut) {
  TestMesh mesh;
  for (int i = 0; i < 300; ++i) {
    const auto key = static_cast<std::uint64_t>(i);
    const Vec3 a = random_direction(key, 1), along = random_direction(key, 2);
    const float sharpness = std::pow(10.0f, -6 * random_float(3, key, 0));
    mesh.positions.insert(
        mesh.positions.end(),
        {a, a + along, a + along * random_float(4, key, 0) + random_direction(key, 5) * sharpness});
    mesh.triangles.push_back(
        {{3u * static_cast<std::uint32_t>(i), 3u * static_cast<std::uint32_t>(i) + 1,
          3u * static_cast<std::uint32_t>(i) + 2}});
  }
  constexpr float kBy = 1e-4f;
  const RenderMesh view = view_of(mesh);
  const std::vector<Vec3> wide = widen_triangles(view, kBy, {})[0];
  ASSERT_EQ(wide.size(), mesh.positions.size());
  for (std::size_t i = 0; i < wide.size(); i += 3) {
    const Vec3d a(wide[i]), b(wide[i + 1]), c(wide[i + 2]);
    const Vec3d normal = cross(b - a, c - a);
    for (int k = 0; k < 3; ++k) {
      const Vec3d p(mesh.positions[i + static_cast<std::size_t>(k)]);
      for (const auto& [from, to] : {std::pair{a, b}, {b, c}, {c, a}}) {
        const Vec3d inward = cross(normal, to - from);
        const double inside = dot(p - from, inward) / std::sqrt(dot(inward, inward));
        EXPECT_GT(inside, 0.99 * static_cast<double>(kBy)) << "triangle " << i / 3;
      }
    }
  }
}

}  // namespace
}  // namespace polymorph
