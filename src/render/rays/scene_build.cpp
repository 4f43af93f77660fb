#include "render/rays/scene_build.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <numeric>

#include "render/math/vector_math.h"
#include "render/rays/surface_point.h"
#include "render/rays/widened.h"

namespace polymorph {
namespace {

#if defined(__x86_64__)
constexpr std::array<const char*, 5> kIsas = {"sse2", "sse4.2", "avx", "avx2", "avx512"};

/// Detects the instruction set that Embree chose, from its native packet widths and the CPU.
std::string detect_isa(RTCDevice device) {
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
std::string device_config(const std::string& isa) { return isa.empty() ? "" : "isa=" + isa; }
#else
// On other processors Embree has only one instruction set, and no name for it.
constexpr std::array<const char*, 1> kIsas = {"neon"};
std::string detect_isa(RTCDevice) { return kIsas[0]; }
bool cpu_supports(const std::string&) { return true; }
std::string device_config(const std::string&) { return ""; }
#endif

/// Embree's callback for errors; keeps the first one.
void note_error(void* user, RTCError code, const char* text) {
  auto* report = static_cast<RayDevice::Report*>(user);
  const std::lock_guard lock(report->mutex);
  if (report->code != RTC_ERROR_NONE) return;
  report->code = code;
  report->text = text ? text : "";
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
  for (const MixedLayer& layer : mesh.upper_layers) check_layer(layer, mesh.triangles.size());
  PM_CHECK(mesh.vertex_colors.empty() || mesh.vertex_colors.size() == mesh.positions.size());
  PM_CHECK(mesh.displacement.empty() || mesh.displacement.size() == mesh.positions.size());
  PM_CHECK(mesh.vertex_labels.empty() || mesh.vertex_labels.size() == mesh.positions.size());
  PM_CHECK(mesh.vertex_progress.empty() || mesh.vertex_progress.size() == mesh.positions.size());
}

/// Upper bound of Embree's error relative to a ray's length: about four times 2^-22.
constexpr float kMaxError = 0x1p-20f;
/// Margin by which Embree's triangles are widened, relative to a ray's length. Seen along a ray,
/// adjacent triangles then overlap, unless the ray grazes both.
constexpr float kWidening = 8 * kMaxError;

/// Computes the length of the longest edge while the shutter is open. Edges change linearly, so the
/// longest one occurs at an end time.
double longest_edge(const MeshToTrace& traced) {
  double longest2 = 0;
  for (const float time : {0.0f, 1.0f}) {
    for (const Triangle& t : traced.mesh->triangles)
      for (int k = 0; k < 3; ++k) {
        const Vec3d edge =
            Vec3d(traced.at(t.v[(k + 1) % 3], time)) - Vec3d(traced.at(t.v[k], time));
        longest2 = std::max(longest2, dot(edge, edge));
      }
    if (!traced.moves()) break;
  }
  return std::sqrt(longest2);
}

/// Lists the triangles around each vertex.
void collect_fans(MeshToTrace& traced) {
  const RenderMesh& mesh = *traced.mesh;
  traced.fan_begin.assign(mesh.positions.size() + 1, 0);
  for (const Triangle& t : mesh.triangles)
    for (const std::uint32_t v : t.v) ++traced.fan_begin[v];
  // Set each entry to the end of its fan. Filling the fans backwards moves it to the begin, and
  // makes each fan ascending, because triangles come in descending order.
  std::uint32_t end = 0;
  for (std::uint32_t& begin : traced.fan_begin) begin = end += begin;
  traced.fans.resize(end);
  for (std::size_t i = mesh.triangles.size(); i-- > 0;)
    for (const std::uint32_t v : mesh.triangles[i].v)
      traced.fans[--traced.fan_begin[v]] = static_cast<std::uint32_t>(i);
}

/// Adds a mesh to Embree's scene as widened triangles. If Embree fails, returns false; it has then
/// called note_error() with the reason.
bool attach_mesh(RTCDevice device, RTCScene scene, MeshToTrace& traced, unsigned id, float margin) {
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  if (!geometry) return false;
  const RenderMesh& mesh = *traced.mesh;
  std::vector<float> fractions;
  if (traced.moves()) fractions = {-0.5f * traced.shutter, 0.5f * traced.shutter};
  const std::vector<std::vector<Vec3>> corners = widen_triangles(mesh, margin, fractions);
  if (traced.moves()) rtcSetGeometryTimeStepCount(geometry, 2);
  bool is_ok = true;
  for (unsigned step = 0; step < corners.size() && is_ok; ++step) {
    // Embree reads 16 bytes at the last vertex. Its own buffers are padded for this, a std::vector
    // is not.
    void* vertices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, step,
                                             RTC_FORMAT_FLOAT3, sizeof(Vec3), corners[step].size());
    is_ok = vertices != nullptr;
    if (is_ok) std::memcpy(vertices, corners[step].data(), corners[step].size() * sizeof(Vec3));
  }
  auto* indices = static_cast<std::uint32_t*>(
      is_ok ? rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                      sizeof(Triangle), mesh.triangles.size())
            : nullptr);
  if (indices) {
    std::iota(indices, indices + mesh.triangles.size() * 3, 0u);
    rtcSetGeometryUserData(geometry, &traced);
    set_filters(geometry);
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(scene, geometry, id);
  }
  rtcReleaseGeometry(geometry);
  return indices != nullptr;
}

/// Calls f(position) for each corner of all triangles; if a mesh moves, for the positions when the
/// shutter opens and closes.
template <class F>
void for_each_corner(const std::vector<MeshToTrace>& meshes, const F& f) {
  for (const MeshToTrace& traced : meshes)
    for (const Triangle& t : traced.mesh->triangles)
      for (const std::uint32_t v : t.v) {
        if (!traced.moves()) {
          f(traced.mesh->positions[v]);
          continue;
        }
        f(displace(*traced.mesh, v, -0.5f * traced.shutter));
        f(displace(*traced.mesh, v, 0.5f * traced.shutter));
      }
}

/// Computes the bounds of all triangles while the shutter is open.
Box compute_bounds(const std::vector<MeshToTrace>& meshes) {
  Box box;
  for_each_corner(meshes, [&](Vec3 position) { box = extend(box, position); });
  return box;
}

}  // namespace

Result<RayDevice> make_ray_device(const std::string& chosen) {
  const char* variable = std::getenv("POLYMORPH_ISA");
  const std::string isa = chosen.empty() && variable ? variable : chosen;
  if (!isa.empty() && std::find(kIsas.begin(), kIsas.end(), isa) == kIsas.end())
    return make_error(
        ErrorCode::kUsage,
        "unknown instruction set \"{}\" for ray tracing - use one of {}, or none for the best", isa,
        fmt::join(kIsas, ", "));
  if (!cpu_supports(isa))
    return make_error(ErrorCode::kResource,
                      "this machine's CPU has no {} (asked for ray tracing) - pin a smaller "
                      "instruction set, or none",
                      isa);
  const std::string config = device_config(isa);
  RayDevice device;
  device.report = std::make_unique<RayDevice::Report>();
  device.device.reset(rtcNewDevice(config.c_str()));
  if (!device.device) {
    const RTCError error = rtcGetDeviceError(nullptr);
    if (error == RTC_ERROR_OUT_OF_MEMORY)
      return make_error(ErrorCode::kResource,
                        "out of memory before the first ray - allow the process more (ulimit -v)");
    return make_error(ErrorCode::kResource, "embree gives no device (error {}, config \"{}\")",
                      static_cast<int>(error), config);
  }
  rtcSetDeviceErrorFunction(device.device.get(), note_error, device.report.get());
  device.isa = isa.empty() ? detect_isa(device.device.get()) : isa;
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

TracedScene::TracedScene(const std::vector<RenderMesh>& meshes, float shutter,
                         float max_start_distance, const Box& sequence_bounds) {
  for (const RenderMesh& mesh : meshes) {
    check_mesh(mesh);
    meshes_.push_back(
        {&mesh, shutter, /*margin2=*/0, /*near_limit=*/0, /*fan_begin=*/{}, /*fans=*/{}});
    collect_fans(meshes_.back());
  }
  bounds_ = compute_bounds(meshes_);
  if (bounds_.empty()) return;
  // Positions have an error of about 2^-23 of the largest coordinate; epsilon is at least 32 times
  // as large.
  const Vec3 low = bounds_.low, high = bounds_.high;
  const Box all = sequence_bounds.empty() ? bounds_ : unite(sequence_bounds, bounds_);
  const float size = std::max(max_component(max(all.high, -all.low)), all.diagonal());
  epsilon_ = size * 0x1p-18f;
  max_length_ = size + std::max(size, max_start_distance);
  const auto margin = static_cast<double>(max_length_ * kMaxError);
  for (MeshToTrace& mesh : meshes_) {
    mesh.margin2 = margin * margin;
    // The factor covers rounding of the product.
    mesh.near_limit = 1.000001 * margin * longest_edge(mesh);
  }
  const Vec3 pad = Vec3{1, 1, 1} * epsilon_;  // more than the rounding errors of misses_box()
  bounds_ = {low - pad, high + pad};
  const Vec3 center = bounds_.center();
  float radius2 = 0;
  for_each_corner(meshes_, [&](Vec3 position) {
    const Vec3 offset = position - center;
    radius2 = std::max(radius2, offset.x * offset.x + offset.z * offset.z);
  });
  upright_radius_ = std::sqrt(radius2) + epsilon_;
}

Status TracedScene::build_hierarchy(const RayDevice& device) {
  scene_.reset(rtcNewScene(device.device.get()));
  if (!scene_) {
    PM_TRY_STATUS(take_device_error(device));
    return make_error(ErrorCode::kResource, "embree gives no scene");
  }
  rtcSetSceneBuildQuality(scene_.get(), RTC_BUILD_QUALITY_MEDIUM);
  for (std::size_t i = 0; i < meshes_.size(); ++i)
    if (!meshes_[i].mesh->triangles.empty() &&
        !attach_mesh(device.device.get(), scene_.get(), meshes_[i], static_cast<unsigned>(i),
                     max_length_ * kWidening))
      break;  // take_device_error() below returns the reason
  rtcCommitScene(scene_.get());
  return take_device_error(device);
}

Result<TracedScene> TracedScene::build(const RayDevice& device,
                                       const std::vector<RenderMesh>& meshes, float shutter,
                                       float max_start_distance, const Box& sequence_bounds) {
  TracedScene scene(meshes, shutter, max_start_distance, sequence_bounds);
  PM_TRY_STATUS(scene.build_hierarchy(device));
  return scene;
}

SurfacePoint TracedScene::surface_point(const Ray& ray, const MeshHit& hit) const {
  CornersOf<Vec3> p, n;
  read_triangle(meshes_[hit.mesh], hit.triangle, ray.time, p, n);
  return make_surface_point(p, n, ray, hit);
}

SurfacePointOf<Pack3> TracedScene::surface_point(const RayOf<Pack3>& ray,
                                                 const MeshHitOf<Pack>& hit) const {
  // Eight rows with the 18 numbers of a triangle, padded to 24.
  struct Row {
    CornersOf<Vec3> p, n;
    float padding[6] = {};
  };
  std::array<Row, kLanes> rows;
  const float* starts[kLanes];
  for (int l = 0; l < kLanes; ++l) {
    read_triangle(meshes_[hit.mesh[l]], hit.triangle[l], ray.time[l], rows[l].p, rows[l].n);
    starts[l] = &rows[l].p.a.x;
  }
  Pack columns[24];
  load_rows<24>(starts, columns);
  CornersOf<Pack3> corners[2];
  std::memcpy(corners, columns, sizeof corners);
  return make_surface_point(corners[0], corners[1], ray, hit);
}

}  // namespace polymorph
