// Embree scene: the device, the acceleration structure of one frame, and the geometry of a hit.
#pragma once

#include <embree3/rtcore.h>

#include <cstdint>
#include <limits>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "base/box.h"
#include "base/result.h"
#include "render/math/simd.h"
#include "render/rays/intersect_triangle.h"
#include "render/render.h"

namespace polymorph {

struct RayDevice {
  struct Release {
    void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
  };
  std::unique_ptr<RTCDeviceTy, Release> device;
  std::string isa;

  /// The first error reported by Embree's callback; written on any thread.
  struct Report {
    std::mutex mutex;
    RTCError code = RTC_ERROR_NONE;
    std::string text;
  };
  std::unique_ptr<Report> report;
};

/// Creates a device. `chosen`: "" = POLYMORPH_ISA or else the best of the machine, or one of sse2,
/// sse4.2, avx, avx2, avx512. Errors: kUsage for another name; kResource if the machine lacks it or
/// Embree gives no device.
Result<RayDevice> make_ray_device(const std::string& chosen);

/// Returns the first error since the device was made or last checked, if there is one (kResource).
Status take_device_error(const RayDevice& device);

/// A ray, or eight.
template <class T3>
struct RayOf {
  T3 origin;
  T3 direction;  ///< unit
  ComponentOf<T3> time =
      broadcast<ComponentOf<T3>>(0.5f);  ///< time while the shutter is open, [0, 1]
  ComponentOf<T3> far = broadcast<ComponentOf<T3>>(std::numeric_limits<float>::infinity());
};
using Ray = RayOf<Vec3>;

/// Number of rays in an Embree packet.
inline constexpr int kPacket = 16;

inline constexpr std::uint32_t kNoMesh = 0xffffffffu;

template <class V>
struct MeshHitOf {
  BitsOf<V> mesh = BitsOf<V>{} + kNoMesh;
  BitsOf<V> triangle{};
  V distance{};
  V u{}, v{};  ///< weights of the triangle's second and third corner
};
using MeshHit = MeshHitOf<float>;

/// Geometry of a hit, as shading needs it.
template <class T3>
struct SurfacePointOf {
  T3 position;
  T3 normal;   ///< the triangle's, towards the ray's origin; unit
  T3 shading;  ///< interpolated, on the same side and visible to the ray; unit
  T3 lifted;   ///< position on the smooth surface that the shading normals describe, the origin of
               ///< further rays
  MaskOf<T3> inside{};  ///< the ray came from behind the triangle
};
using SurfacePoint = SurfacePointOf<Vec3>;

/// A mesh under Embree, for its callbacks.
struct MeshToTrace {
  const RenderMesh* mesh = nullptr;
  float shutter = 0;
  double margin2 = 0;  ///< square of the maximum error of Embree's floats, in units of length
  double clear = 0;    ///< beyond this distance (EdgeSides::at) no edge of the mesh is near
  /// The triangles around vertex v are fans[fan_begin[v]] ... fans[fan_begin[v + 1] - 1].
  std::vector<std::uint32_t> fan_begin, fans;

  bool moves() const { return shutter > 0 && !mesh->displacement.empty(); }
  /// Position of a vertex at a time of the shutter, [0, 1].
  Vec3 at(std::uint32_t vertex, float time) const {
    const Vec3 p = mesh->positions[vertex];
    return moves() ? p + mesh->displacement[vertex] * (shutter * (time - 0.5f)) : p;
  }
};

/// Tests whether the line of a ray hits a triangle of the mesh, and computes the intersection. The
/// line passes through the interior; where it passes an edge or corner so closely that floats
/// cannot decide the side, there must be mesh on the other side too. So a mesh ends about a
/// millionth of the stage's size inside its outline, where Embree finds it with any instruction
/// set, and there are no gaps between triangles.
bool intersects_triangle(const MeshToTrace& traced, std::uint32_t triangle, const Ray& ray,
                         TriangleIntersection& intersection);

/// Installs the callbacks with which closest() and test_occlusion() decide about every triangle
/// that Embree finds.
void set_filters(RTCGeometry geometry);

/// One frame's meshes.
///
/// Embree only finds candidates: its triangles are slightly widened, so that it finds every one
/// that a ray may hit, and a callback tests each exactly (intersect_triangle.h). The nearest hit
/// counts, and of equally near ones the first. So hits have the same bits with any instruction set,
/// packet width and order of traversal. Borrows the spans of the RenderMeshes for its lifetime.
class TracedScene {
 public:
  /// Builds the scene. With a `shutter` meshes move by their displacement while it is open.
  /// `max_start_distance`: no ray starts further than this from the meshes; those that do may miss
  /// edges. `stage`: bounds of all frames, so that the offsets of rays are the same in all of them;
  /// empty: the meshes' own bounds. Errors: kResource (memory), kInternal (an index beyond the
  /// positions).
  static Result<TracedScene> build(const RayDevice& device, const std::vector<RenderMesh>& meshes,
                                   float shutter = 0, float max_start_distance = 0,
                                   const Box& stage = {});

  /// Finds the nearest mesh in (0, ray.far).
  MeshHit closest(const Ray& ray) const;
  /// Does the same for up to kPacket rays, the first `count` lanes of one or two packs. Several
  /// times faster for rays of similar directions, `coherent`.
  void closest(const RayOf<Pack3>* rays, MeshHitOf<Pack>* hits, int count, bool coherent) const;
  /// Tests whether there is any mesh in (0, ray.far); bit i for the i-th of `count` rays.
  std::uint32_t test_occlusion(const RayOf<Pack3>* rays, int count) const;
  SurfacePoint surface_point(const Ray& ray, const MeshHit& hit) const;
  /// Computes eight surface points; every lane must have a hit.
  SurfacePointOf<Pack3> surface_point(const RayOf<Pack3>& ray, const MeshHitOf<Pack>& hit) const;

  /// Tests whether the ray misses the bounds of all meshes. Most rays of a studio picture do, and
  /// this costs a tenth of a call of Embree.
  template <class T3>
  MaskOf<T3> misses_bounds(const RayOf<T3>& ray) const;

  const RenderMesh& mesh(std::uint32_t index) const { return *meshes_[index].mesh; }
  const MeshToTrace& mesh_to_trace(std::uint32_t index) const { return meshes_[index]; }
  const Box& bounds() const {
    return bounds_;
  }                                           ///< bounds of all triangles; empty without triangles
  float epsilon() const { return epsilon_; }  ///< offset of rays from the surface that they leave
  /// Maximum error of Embree's distances, for rays that do not graze.
  float slack() const { return max_length_ * 0x1p-14f; }

 private:
  struct Release {
    void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
  };
  TracedScene() = default;
  std::unique_ptr<RTCSceneTy, Release> scene_;
  std::vector<MeshToTrace> meshes_;
  Box bounds_;
  float epsilon_ = 0;
  float max_length_ = 0;  ///< maximum length of a ray
};

template <class T3>
inline MaskOf<T3> TracedScene::misses_bounds(const RayOf<T3>& ray) const {
  using V = ComponentOf<T3>;
  if (bounds_.empty()) return broadcast_mask<MaskOf<T3>>(true);
  V near = broadcast<V>(0), far = ray.far;
  const auto clip = [&](V origin, V direction, float low, float high) {
    const V inverse = 1.0f / direction;
    const V a = (low - origin) * inverse, b = (high - origin) * inverse;
    // A ray in the plane of a side makes a NaN here; these comparisons then keep the interval as it
    // is.
    near = max(min(a, b), near);
    far = min(max(a, b), far);
  };
  clip(ray.origin.x, ray.direction.x, bounds_.low.x, bounds_.high.x);
  clip(ray.origin.y, ray.direction.y, bounds_.low.y, bounds_.high.y);
  clip(ray.origin.z, ray.direction.z, bounds_.low.z, bounds_.high.z);
  return near > far;
}

}  // namespace polymorph
