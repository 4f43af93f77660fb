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

  /// What Embree's error callback was told first; filled on any thread.
  struct Report {
    std::mutex mutex;
    RTCError code = RTC_ERROR_NONE;
    std::string text;
  };
  std::unique_ptr<Report> report;
};

/// `isa`: "" = the best the machine has, or one of sse2, sse4.2, avx, avx2, avx512.
/// Errors: kUsage for another name; kResource where the machine lacks it or Embree gives no device.
Result<RayDevice> make_ray_device(const std::string& isa);

/// The first error since the device was made or last asked, if any (kResource).
Status take_device_error(const RayDevice& device);

/// A ray, or eight.
template <class T3>
struct RayOf {
  T3 origin;
  T3 direction;                                             ///< unit
  ComponentOf<T3> time = broadcast<ComponentOf<T3>>(0.5f);  ///< [0, 1] of the shutter's
  ComponentOf<T3> far = broadcast<ComponentOf<T3>>(std::numeric_limits<float>::infinity());
};
using Ray = RayOf<Vec3>;

/// How many rays Embree takes at once.
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

/// Where a ray met a mesh, ready to shade.
template <class T3>
struct SurfacePointOf {
  T3 position;
  T3 normal;   ///< of the triangle, towards the ray's origin; unit
  T3 shading;  ///< interpolated, on the same side and visible to the ray; unit
  T3 lifted;   ///< on the smooth surface that the shading normals describe; where rays leave from
  MaskOf<T3> inside{};  ///< the ray came from behind the triangle
};
using SurfacePoint = SurfacePointOf<Vec3>;

/// A mesh under Embree, for its callbacks.
struct MeshToTrace {
  const RenderMesh* mesh = nullptr;
  float shutter = 0;
  double margin2 = 0;  ///< the square of how far off Embree's floats may be, in units of length
  double clear = 0;    ///< farther (EdgeSides::at) than this, an edge of the mesh is never near
  /// The triangles around vertex v are fans[fan_begin[v]] ... fans[fan_begin[v + 1] - 1].
  std::vector<std::uint32_t> fan_begin, fans;

  bool moves() const { return shutter > 0 && !mesh->displacement.empty(); }
  /// Where a vertex is at a time of the shutter, [0, 1].
  Vec3 at(std::uint32_t vertex, float time) const {
    const Vec3 p = mesh->positions[vertex];
    return moves() ? p + mesh->displacement[vertex] * (shutter * (time - 0.5f)) : p;
  }
};

/// Whether the line of a ray hits a triangle of the mesh, and where: it passes inside, and where
/// it passes an edge or corner so closely that floats cannot tell on which side, there is mesh on
/// the other side, too. So a mesh ends about a millionth of the stage within its outline, where
/// Embree finds it under any instruction set; there are no gaps between its triangles.
bool intersects_triangle(const MeshToTrace& traced, std::uint32_t triangle, const Ray& ray,
                         TriangleIntersection& intersection);

/// Lets closest() and occluded() decide about every triangle of the geometry that Embree finds.
void set_filters(RTCGeometry geometry);

/// One frame's meshes.
///
/// Embree only proposes: it holds the triangles a little widened, so that it finds every one that a
/// ray may hit, and hands each to a callback. Whether the ray hits the triangle itself, and
/// where, is computed there (intersect_triangle.h); of those that it hits the nearest counts, and
/// of equally near ones the first. So hits are the same bits with any instruction set, packet width
/// and order of traversal. Borrows the spans of the RenderMeshes for its lifetime.
class TracedScene {
 public:
  /// Errors: kResource (memory), kInternal (an index beyond the positions).
  /// With a `shutter` meshes move by their displacement while it is open. `reach`: no ray starts
  /// farther than this from the meshes; those that do may slip past edges. `stage`: of all frames,
  /// so that rays start off surfaces alike in all of them; empty: the meshes' own bounds.
  static Result<TracedScene> build(const RayDevice& device, const std::vector<RenderMesh>& meshes,
                                   float shutter = 0, float reach = 0, const Box& stage = {});

  /// The nearest mesh in (0, ray.far).
  MeshHit closest(const Ray& ray) const;
  /// The same for up to kPacket rays, the first `count` lanes of one or two packs. Several times
  /// faster for rays that go about the same way, `coherent`.
  void closest(const RayOf<Pack3>* rays, MeshHitOf<Pack>* hits, int count, bool coherent) const;
  /// Is there any mesh in (0, ray.far)? Bit i for the i-th of `count` rays.
  std::uint32_t occluded(const RayOf<Pack3>* rays, int count) const;
  SurfacePoint surface_point(const Ray& ray, const MeshHit& hit) const;
  /// Every lane must have met something.
  SurfacePointOf<Pack3> surface_point(const RayOf<Pack3>& ray, const MeshHitOf<Pack>& hit) const;

  /// Does the ray pass by all meshes? Most rays of a studio picture do, and this costs a tenth of a
  /// call of Embree.
  template <class T3>
  MaskOf<T3> misses_bounds(const RayOf<T3>& ray) const;

  const RenderMesh& mesh(std::uint32_t index) const { return *meshes_[index].mesh; }
  const MeshToTrace& traced(std::uint32_t index) const { return meshes_[index]; }
  const Box& bounds() const { return bounds_; }  ///< of all triangles; empty when there are none
  float epsilon() const { return epsilon_; }     ///< how far rays start off a surface
  /// How far Embree's distances may be off, for rays that do not graze.
  float slack() const { return farthest_ * 0x1p-14f; }

 private:
  struct Release {
    void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
  };
  TracedScene() = default;
  std::unique_ptr<RTCSceneTy, Release> scene_;
  std::vector<MeshToTrace> meshes_;
  Box bounds_;
  float epsilon_ = 0;
  float farthest_ = 0;  ///< that a ray goes
};

template <class T3>
inline MaskOf<T3> TracedScene::misses_bounds(const RayOf<T3>& ray) const {
  using V = ComponentOf<T3>;
  if (bounds_.empty()) return mask_of<MaskOf<T3>>(true);
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
