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
template <class T3>
struct CornersOf {
  T3 a, b, c;
};

template <class T3>
T3 interpolate(const CornersOf<T3>& c, ComponentOf<T3> u, ComponentOf<T3> v) {
  return c.a * (1.0f - u - v) + c.b * u + c.c * v;
}

/// Bends a shading normal so that the mirrored view ray stays above the triangle (Keller et al.
/// 2017, "The Iray light transport simulation and rendering system"): no black rims on coarse,
/// shiny meshes.
template <class T3>
T3 bend_to_valid_reflection(T3 shading, T3 normal, T3 view) {
  using V = ComponentOf<T3>;
  const T3 mirrored = shading * (2.0f * dot(shading, view)) - view;
  const V above = dot(mirrored, normal);
  const V least_above = min(0.9f * dot(view, normal), 0.01f);
  const MaskOf<T3> low = above < least_above;
  if (!any(low)) return shading;
  const T3 bent = normalized(normalized(mirrored + normal * (least_above - above)) + view);
  return select(low, select(dot(bent, normal) > 0.0f, bent, normal), shading);
}

/// Moves a point of a flat triangle onto the smooth surface its vertex normals describe (Hanika
/// 2021, "Hacking the shadow terminator"): no faceted terminator on coarse meshes.
template <class T3>
T3 lift(T3 position, const CornersOf<T3>& p, const CornersOf<T3>& n, ComponentOf<T3> u,
        ComponentOf<T3> v, ComponentOf<T3> side) {
  using V = ComponentOf<T3>;
  const auto above = [&](T3 vertex, T3 normal, V weight) {
    const V below = min(side * dot(position - vertex, normal), 0.0f);
    return normal * (-below * side * weight);
  };
  return position + above(p.a, n.a, 1.0f - u - v) + above(p.b, n.b, u) + above(p.c, n.c, v);
}

/// `n` zero: the triangle has no shading normals.
template <class T3>
SurfacePointOf<T3> point_on(const CornersOf<T3>& p, const CornersOf<T3>& n, const RayOf<T3>& ray,
                            const MeshHitOf<ComponentOf<T3>>& hit) {
  using V = ComponentOf<T3>;
  const T3 view = -ray.direction;
  SurfacePointOf<T3> point;
  point.position = interpolate(p, hit.u, hit.v);
  const T3 normal = normalized(cross(p.b - p.a, p.c - p.a));
  point.normal = select(dot(normal, normal) > 0.5f, normal, view);
  const V side = copysign(broadcast<V>(1), dot(point.normal, view));
  point.normal = point.normal * side;
  point.inside = side < 0.0f;
  point.shading = point.normal;
  point.lifted = point.position;

  const T3 smooth = normalized(interpolate(n, hit.u, hit.v));
  const MaskOf<T3> has_smooth = dot(smooth, smooth) > 0.5f;
  if (any(has_smooth)) {
    // Some files have normals that disagree with their triangles; the triangle decides.
    const V agree = copysign(broadcast<V>(1), dot(smooth, point.normal));
    const T3 bent = bend_to_valid_reflection(smooth * agree, point.normal, view);
    point.shading = select(has_smooth, bent, point.shading);
    const T3 lifted = lift(point.position, p, n, hit.u, hit.v, agree);
    point.lifted = select(has_smooth, lifted, point.lifted);
  }
  return point;
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
  PM_CHECK(mesh.vertex_colors.empty() || mesh.vertex_colors.size() == mesh.positions.size());
  PM_CHECK(mesh.displacement.empty() || mesh.displacement.size() == mesh.positions.size());
  PM_CHECK(mesh.vertex_labels.empty() || mesh.vertex_labels.size() == mesh.positions.size());
  PM_CHECK(mesh.vertex_blend.empty() || mesh.vertex_blend.size() == mesh.positions.size());
}

/// Where a vertex is at a share of the frame's way to the next, -0.5 to 0.5 of a shutter of 1.
Vec3 moved(const RenderMesh& mesh, std::size_t vertex, float way) {
  return mesh.positions[vertex] + mesh.displacement[vertex] * way;
}

/// Corners and shading normals of a triangle at a time of the shutter.
void read_triangle(const RenderMesh& m, std::uint32_t triangle, float shutter, float time,
                   CornersOf<Vec3>& p, CornersOf<Vec3>& n) {
  const Triangle& t = m.triangles[triangle];
  p = {m.positions[t.v[0]], m.positions[t.v[1]], m.positions[t.v[2]]};
  if (shutter > 0 && !m.displacement.empty()) {
    const float way = shutter * (time - 0.5f);
    p = {moved(m, t.v[0], way), moved(m, t.v[1], way), moved(m, t.v[2], way)};
  }
  n = {};
  if (!m.vertex_normals.empty())
    n = {m.vertex_normals[t.v[0]], m.vertex_normals[t.v[1]], m.vertex_normals[t.v[2]]};
  else if (!m.corner_normals.empty())
    n = {m.corner_normals[std::size_t{triangle} * 3],
         m.corner_normals[std::size_t{triangle} * 3 + 1],
         m.corner_normals[std::size_t{triangle} * 3 + 2]};
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
                                       const std::vector<RenderMesh>& meshes, float shutter,
                                       const Box& stage) {
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
  const Box& whole = stage.empty() ? traced.bounds_ : stage;
  const float reach = std::max(max_component(max(whole.high, -whole.low)), whole.diagonal());
  traced.epsilon_ = reach * 0x1p-18f;
  const Vec3 pad = Vec3{1, 1, 1} * traced.epsilon_;
  traced.bounds_ = {low - pad, high + pad};
  return traced;
}

namespace {

RTCRay embree_ray(const Ray& ray) {
  return {ray.origin.x,
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
}

/// Fills the packet and says which rays to follow: those that do not pass by everything.
bool fill(const TracedScene& scene, const RayOf<Pack3>* rays, int count, RTCRay16& packet,
          int* valid) {
  // Debian's Embree asserts that lanes which are switched off hold numbers, too.
  if (count <= kLanes) std::memset(&packet, 0, sizeof packet);
  std::memset(valid, 0, kPacket * sizeof(int));
  bool some = false;
  for (int first = 0; first < count; first += kLanes) {
    const RayOf<Pack3>& ray = rays[first / kLanes];
    const PackMask follow = (!scene.misses_bounds(ray)) & first_lanes(count - first);
    some = some || any(follow);
    std::memcpy(valid + first, &follow, sizeof follow);
    Lanes<Pack>::store(packet.org_x + first, ray.origin.x);
    Lanes<Pack>::store(packet.org_y + first, ray.origin.y);
    Lanes<Pack>::store(packet.org_z + first, ray.origin.z);
    Lanes<Pack>::store(packet.tnear + first, broadcast<Pack>(0));
    Lanes<Pack>::store(packet.dir_x + first, ray.direction.x);
    Lanes<Pack>::store(packet.dir_y + first, ray.direction.y);
    Lanes<Pack>::store(packet.dir_z + first, ray.direction.z);
    Lanes<Pack>::store(packet.time + first, ray.time);
    Lanes<Pack>::store(packet.tfar + first, ray.far);
    const PackBits all = PackBits{} + 0xffffffffu, none{};
    std::memcpy(packet.mask + first, &all, sizeof all);
    std::memcpy(packet.id + first, &none, sizeof none);
    std::memcpy(packet.flags + first, &none, sizeof none);
  }
  return some;
}

}  // namespace

MeshHit TracedScene::closest(const Ray& ray) const {
  if (misses_bounds(ray)) return {};
  RTCRayHit query;
  query.ray = embree_ray(ray);
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(scene_.get(), &context, &query);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return {};
  return {query.hit.geomID, query.hit.primID, query.ray.tfar, query.hit.u, query.hit.v};
}

void TracedScene::closest(const RayOf<Pack3>* rays, MeshHitOf<Pack>* hits, int count,
                          bool alike) const {
  alignas(64) int valid[kPacket];
  alignas(64) RTCRayHit16 query;
  std::memset(query.hit.geomID, 0xff, sizeof query.hit.geomID);
  std::memset(query.hit.instID, 0xff, sizeof query.hit.instID);
  if (fill(*this, rays, count, query.ray, valid)) {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    if (alike) context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    rtcIntersect16(valid, scene_.get(), &context, &query);
  }
  for (int first = 0; first < count; first += kLanes) {
    MeshHitOf<Pack>& hit = hits[first / kLanes];
    std::memcpy(&hit.mesh, query.hit.geomID + first, sizeof hit.mesh);
    std::memcpy(&hit.triangle, query.hit.primID + first, sizeof hit.triangle);
    hit.distance = Lanes<Pack>::load(query.ray.tfar + first);
    hit.u = Lanes<Pack>::load(query.hit.u + first);
    hit.v = Lanes<Pack>::load(query.hit.v + first);
  }
}

std::uint32_t TracedScene::blocked(const RayOf<Pack3>* rays, int count) const {
  alignas(64) int valid[kPacket];
  alignas(64) RTCRay16 query;
  if (!fill(*this, rays, count, query, valid)) return 0;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded16(valid, scene_.get(), &context, &query);
  std::uint32_t bits = 0;
  for (int first = 0; first < count; first += kLanes)
    bits |= Lanes<Pack>::bits(Lanes<Pack>::load(query.tfar + first) < 0.0f) << first;
  return bits;
}

SurfacePoint TracedScene::surface_point(const Ray& ray, const MeshHit& hit) const {
  CornersOf<Vec3> p, n;
  read_triangle((*meshes_)[hit.mesh], hit.triangle, shutter_, ray.time, p, n);
  return point_on(p, n, ray, hit);
}

SurfacePointOf<Pack3> TracedScene::surface_point(const RayOf<Pack3>& ray,
                                                 const MeshHitOf<Pack>& hit) const {
  // Eight rows of the 18 numbers of a triangle.
  struct Row {
    CornersOf<Vec3> p, n;
    float rest[6] = {};
  };
  std::array<Row, kLanes> rows;
  const float* starts[kLanes];
  for (int l = 0; l < kLanes; ++l) {
    read_triangle((*meshes_)[hit.mesh[l]], hit.triangle[l], shutter_, ray.time[l], rows[l].p,
                  rows[l].n);
    starts[l] = &rows[l].p.a.x;
  }
  Pack columns[24];
  load_rows<24>(starts, columns);
  CornersOf<Pack3> corners[2];
  std::memcpy(corners, columns, sizeof corners);
  return point_on(corners[0], corners[1], ray, hit);
}

}  // namespace polymorph
