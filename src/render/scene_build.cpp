#include "render/scene_build.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "render/vector_math.h"

namespace polymorph {
namespace {

constexpr std::array<const char*, 5> kIsas = {"sse2", "sse4.2", "avx", "avx2", "avx512"};

/// Embree does not tell what it chose; the native packet widths and the CPU do.
std::string chosen_isa(RTCDevice device) {
  if (rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED)) return "avx512";
  if (rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_NATIVE_RAY8_SUPPORTED))
    return __builtin_cpu_supports("avx2") ? "avx2" : "avx";
  return __builtin_cpu_supports("sse4.2") ? "sse4.2" : "sse2";
}

bool cpu_supports(const std::string& isa) {
  if (isa == "avx512")
    return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl");
  if (isa == "avx2") return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  if (isa == "avx") return __builtin_cpu_supports("avx");
  return true;
}

void note_error(void* user, RTCError code, const char* text) {
  auto* report = static_cast<RayDevice::Report*>(user);
  const std::lock_guard lock(report->mutex);
  if (report->code != RTC_ERROR_NONE) return;
  report->code = code;
  report->text = text ? text : "";
}

/// The triangle's corners, or its shading normals.
struct Corners {
  Vec3 a, b, c;
};

Vec3 interpolate(const Corners& c, float u, float v) {
  return c.a * (1 - u - v) + c.b * u + c.c * v;
}

bool shading_normals(const RenderMesh& mesh, std::uint32_t triangle, Corners& out) {
  if (!mesh.vertex_normals.empty()) {
    const Triangle& t = mesh.triangles[triangle];
    out = {mesh.vertex_normals[t.v[0]], mesh.vertex_normals[t.v[1]], mesh.vertex_normals[t.v[2]]};
    return true;
  }
  if (!mesh.corner_normals.empty()) {
    const std::size_t i = std::size_t{triangle} * 3;
    out = {mesh.corner_normals[i], mesh.corner_normals[i + 1], mesh.corner_normals[i + 2]};
    return true;
  }
  return false;
}

/// Bends a shading normal so that the mirrored view ray stays above the triangle (Keller et al.
/// 2017, "The Iray light transport simulation and rendering system"): no black rims on coarse,
/// shiny meshes.
Vec3 bend_to_valid_reflection(Vec3 shading, Vec3 normal, Vec3 view) {
  const Vec3 mirrored = shading * (2 * dot(shading, view)) - view;
  const float above = dot(mirrored, normal);
  const float least = std::min(0.9f * dot(view, normal), 0.01f);
  if (above >= least) return shading;
  const Vec3 bent = normalized(normalized(mirrored + normal * (least - above)) + view);
  return dot(bent, normal) > 0 ? bent : normal;
}

/// Moves a point of a flat triangle onto the smooth surface its vertex normals describe (Hanika
/// 2021, "Hacking the shadow terminator"): no faceted terminator on coarse meshes.
Vec3 lift(Vec3 position, const Corners& p, const Corners& n, float u, float v, float side) {
  const auto above = [&](Vec3 vertex, Vec3 normal) {
    return normal * (-std::min(0.0f, side * dot(position - vertex, normal)) * side);
  };
  return position + above(p.a, n.a) * (1 - u - v) + above(p.b, n.b) * u + above(p.c, n.c) * v;
}

void check_layer(const MaterialLayer& layer, std::size_t triangles) {
  PM_CHECK(layer.corner_uvs.empty() || layer.corner_uvs.size() == 3 * triangles);
  PM_CHECK(layer.triangle_materials.empty() || layer.triangle_materials.size() == triangles);
  for (std::uint32_t m : layer.triangle_materials)
    PM_CHECK(layer.materials.empty() || m < layer.materials.size());
}

void check_mesh(const RenderMesh& mesh) {
  const std::size_t corners = mesh.triangles.size() * 3;
  PM_CHECK(mesh.vertex_normals.empty() || mesh.vertex_normals.size() == mesh.positions.size());
  PM_CHECK(mesh.corner_normals.empty() || mesh.corner_normals.size() == corners);
  for (const Triangle& t : mesh.triangles)
    for (std::uint32_t v : t.v) PM_CHECK(v < mesh.positions.size());
  check_layer(mesh, mesh.triangles.size());
  for (const MixedLayer& layer : mesh.over) check_layer(layer, mesh.triangles.size());
  PM_CHECK(mesh.displacement.empty() || mesh.displacement.size() == mesh.positions.size());
  PM_CHECK(mesh.vertex_labels.empty() || mesh.vertex_labels.size() == mesh.positions.size());
  PM_CHECK(mesh.vertex_blend.empty() || mesh.vertex_blend.size() == mesh.positions.size());
}

/// Where a vertex is at a share of the frame's way to the next, -0.5 to 0.5 of a shutter of 1.
Vec3 moved(const RenderMesh& mesh, std::size_t vertex, float way) {
  return mesh.positions[vertex] + mesh.displacement[vertex] * way;
}

bool attach_mesh(RTCDevice device, RTCScene scene, const RenderMesh& mesh, unsigned id,
                 float shutter) {
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  if (!geometry) return false;
  const bool moves = shutter > 0 && !mesh.displacement.empty();
  if (moves) rtcSetGeometryTimeStepCount(geometry, 2);
  bool whole = true;
  for (unsigned step = 0; step < (moves ? 2u : 1u); ++step) {
    // Embree reads 16 bytes at the last vertex; its own buffer has that room, a caller's span has
    // not.
    auto* vertices = static_cast<Vec3*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, step, RTC_FORMAT_FLOAT3,
                                sizeof(Vec3), mesh.positions.size()));
    whole = whole && vertices;
    if (!vertices) break;
    const float way = shutter * (static_cast<float>(step) - 0.5f);
    if (moves)
      for (std::size_t v = 0; v < mesh.positions.size(); ++v) vertices[v] = moved(mesh, v, way);
    else
      std::memcpy(vertices, mesh.positions.data(), mesh.positions.size_bytes());
  }
  if (whole) {
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                               mesh.triangles.data(), 0, sizeof(Triangle), mesh.triangles.size());
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(scene, geometry, id);
  }
  rtcReleaseGeometry(geometry);
  return whole;
}

}  // namespace

Result<RayDevice> make_ray_device(const std::string& isa) {
  if (!isa.empty() && std::find(kIsas.begin(), kIsas.end(), isa) == kIsas.end())
    return make_error(
        ErrorCode::kUsage,
        "unknown instruction set \"{}\" for ray tracing - use sse2, sse4.2, avx, avx2 "
        "or avx512, or none for the best",
        isa);
  if (!cpu_supports(isa))
    return make_error(ErrorCode::kResource,
                      "this machine's CPU has no {} (asked for ray tracing) - pin a smaller "
                      "instruction set, or none",
                      isa);
  const std::string config = isa.empty() ? "" : "isa=" + isa;
  RayDevice device;
  device.report = std::make_unique<RayDevice::Report>();
  device.device.reset(rtcNewDevice(config.c_str()));
  if (!device.device)
    return make_error(ErrorCode::kResource, "embree gives no device (error {}, config \"{}\")",
                      static_cast<int>(rtcGetDeviceError(nullptr)), config);
  rtcSetDeviceErrorFunction(device.device.get(), note_error, device.report.get());
  device.isa = isa.empty() ? chosen_isa(device.device.get()) : isa;
  return device;
}

Status take_device_error(const RayDevice& device) {
  const std::lock_guard lock(device.report->mutex);
  const RTCError code = std::exchange(device.report->code, RTC_ERROR_NONE);
  if (code == RTC_ERROR_NONE) return Ok{};
  const std::string text = std::exchange(device.report->text, {});
  if (code == RTC_ERROR_OUT_OF_MEMORY)
    return make_error(ErrorCode::kResource,
                      "out of memory while building the scene to trace ({}) - lower the surface "
                      "resolution or free memory",
                      text);
  return make_error(ErrorCode::kResource, "embree failed with error {}: {}", static_cast<int>(code),
                    text);
}

Result<TracedScene> TracedScene::build(const RayDevice& device,
                                       const std::vector<RenderMesh>& meshes, float shutter) {
  TracedScene traced;
  traced.shutter_ = shutter;
  traced.meshes_ = &meshes;
  traced.scene_.reset(rtcNewScene(device.device.get()));
  if (!traced.scene_) {
    PM_TRY_STATUS(take_device_error(device));
    return make_error(ErrorCode::kResource, "embree gives no scene");
  }
  RTCScene scene = traced.scene_.get();
  // Without it 8 of 15 million rays slipped out of a closed sphere between two triangles; it costs
  // a tenth.
  rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
  rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_MEDIUM);
  for (std::size_t i = 0; i < meshes.size(); ++i) {
    if (meshes[i].triangles.empty()) continue;
    check_mesh(meshes[i]);
    if (!attach_mesh(device.device.get(), scene, meshes[i], static_cast<unsigned>(i), shutter))
      break;
  }
  rtcCommitScene(scene);
  PM_TRY_STATUS(take_device_error(device));

  RTCBounds bounds;
  rtcGetSceneBounds(scene, &bounds);
  traced.bounds_ = {{bounds.lower_x, bounds.lower_y, bounds.lower_z},
                    {bounds.upper_x, bounds.upper_y, bounds.upper_z}};
  if (traced.bounds_.empty()) return traced;
  // Positions carry a relative error of some 2^-23 of the largest coordinate; a little above that.
  const Vec3 low = traced.bounds_.low, high = traced.bounds_.high;
  const float reach = std::max(max_component(max(high, -low)), traced.bounds_.diagonal());
  traced.epsilon_ = reach * 0x1p-18f;
  const Vec3 pad = Vec3{1, 1, 1} * traced.epsilon_;
  traced.bounds_ = {low - pad, high + pad};
  return traced;
}

MeshHit TracedScene::closest(const Ray& ray) const {
  if (misses_bounds(ray)) return {};
  RTCRayHit query;
  query.ray = {ray.origin.x,
               ray.origin.y,
               ray.origin.z,
               0.0f,
               ray.direction.x,
               ray.direction.y,
               ray.direction.z,
               ray.time,
               ray.far,
               0xffffffffu,
               0,
               0};
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(scene_.get(), &context, &query);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return {};
  return {query.hit.geomID, query.hit.primID, query.ray.tfar, query.hit.u, query.hit.v};
}

void TracedScene::closest(const Ray* rays, MeshHit* hits, int count) const {
  alignas(64) int valid[kPacket] = {};
  // Zeros: Debian's Embree asserts that lanes which are switched off hold numbers, too.
  alignas(64) RTCRayHit16 query{};
  bool any = false;
  for (int i = 0; i < count; ++i) {
    hits[i] = {};
    if (misses_bounds(rays[i])) continue;
    any = true;
    valid[i] = -1;
    const Ray& r = rays[i];
    query.ray.org_x[i] = r.origin.x;
    query.ray.org_y[i] = r.origin.y;
    query.ray.org_z[i] = r.origin.z;
    query.ray.tnear[i] = 0;
    query.ray.dir_x[i] = r.direction.x;
    query.ray.dir_y[i] = r.direction.y;
    query.ray.dir_z[i] = r.direction.z;
    query.ray.time[i] = r.time;
    query.ray.tfar[i] = r.far;
    query.ray.mask[i] = 0xffffffffu;
    query.ray.id[i] = 0;
    query.ray.flags[i] = 0;
    query.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
    query.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
  }
  if (!any) return;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  rtcIntersect16(valid, scene_.get(), &context, &query);
  for (int i = 0; i < count; ++i)
    if (valid[i] && query.hit.geomID[i] != RTC_INVALID_GEOMETRY_ID)
      hits[i] = {query.hit.geomID[i], query.hit.primID[i], query.ray.tfar[i], query.hit.u[i],
                 query.hit.v[i]};
}

bool TracedScene::blocked(const Ray& ray) const {
  if (misses_bounds(ray)) return false;
  RTCRay query{ray.origin.x,
               ray.origin.y,
               ray.origin.z,
               0.0f,
               ray.direction.x,
               ray.direction.y,
               ray.direction.z,
               ray.time,
               ray.far,
               0xffffffffu,
               0,
               0};
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded1(scene_.get(), &context, &query);
  return query.tfar < 0;
}

SurfacePoint TracedScene::surface_point(const Ray& ray, const MeshHit& hit) const {
  const RenderMesh& m = (*meshes_)[hit.mesh];
  const Triangle& t = m.triangles[hit.triangle];
  Corners p{m.positions[t.v[0]], m.positions[t.v[1]], m.positions[t.v[2]]};
  if (shutter_ > 0 && !m.displacement.empty()) {
    const float way = shutter_ * (ray.time - 0.5f);
    p = {moved(m, t.v[0], way), moved(m, t.v[1], way), moved(m, t.v[2], way)};
  }
  const Vec3 view = -ray.direction;
  SurfacePoint point;
  point.position = interpolate(p, hit.u, hit.v);
  point.normal = normalized(cross(p.b - p.a, p.c - p.a));
  if (!(dot(point.normal, point.normal) > 0.5f)) point.normal = view;
  const float side = dot(point.normal, view) < 0 ? -1.0f : 1.0f;
  point.normal = point.normal * side;
  point.inside = side < 0;
  point.shading = point.normal;
  point.lifted = point.position;

  Corners n;
  if (shading_normals(m, hit.triangle, n)) {
    const Vec3 smooth = normalized(interpolate(n, hit.u, hit.v));
    if (dot(smooth, smooth) > 0.5f) {
      // Some files have normals that disagree with their triangles; the triangle decides.
      const float agree = dot(smooth, point.normal) < 0 ? -1.0f : 1.0f;
      point.shading = bend_to_valid_reflection(smooth * agree, point.normal, view);
      point.lifted = lift(point.position, p, n, hit.u, hit.v, agree);
    }
  }
  return point;
}

}  // namespace polymorph
