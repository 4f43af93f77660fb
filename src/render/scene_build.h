// Triangles under Embree: the device, one frame's scene, and what a hit looks like.
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

struct Ray {
  Vec3 origin;
  Vec3 direction;  ///< unit
  float far = std::numeric_limits<float>::infinity();
  float time = 0.5f;  ///< [0, 1] of the shutter's
};

/// How many rays closest() takes at once.
inline constexpr int kPacket = 16;

inline constexpr std::uint32_t kNoMesh = 0xffffffffu;

struct MeshHit {
  std::uint32_t mesh = kNoMesh;
  std::uint32_t triangle = 0;
  float distance = 0;
  float u = 0, v = 0;  ///< weights of the triangle's second and third corner
};

/// Where a ray met a mesh, ready to shade.
struct SurfacePoint {
  Vec3 position;
  Vec3 normal;   ///< of the triangle, towards the ray's origin; unit
  Vec3 shading;  ///< interpolated, on the same side and visible to the ray; unit
  Vec3 lifted;   ///< on the smooth surface that the shading normals describe; where rays leave from
  bool inside = false;  ///< the ray came from behind the triangle
};

/// One frame's meshes. Borrows the spans of the RenderMeshes for its lifetime.
class TracedScene {
 public:
  /// Errors: kResource (memory), kInternal (an index beyond the positions).
  /// With a `shutter` meshes move by their displacement while it is open.
  static Result<TracedScene> build(const RayDevice& device, const std::vector<RenderMesh>& meshes,
                                   float shutter = 0);

  /// The nearest mesh in (0, ray.far).
  MeshHit closest(const Ray& ray) const;
  /// The same for up to kPacket rays that go about the same way: three to four times faster.
  void closest(const Ray* rays, MeshHit* hits, int count) const;
  /// Is there any mesh in (0, ray.far)?
  bool blocked(const Ray& ray) const;
  SurfacePoint surface_point(const Ray& ray, const MeshHit& hit) const;

  /// Does the ray pass by all meshes? Most rays of a studio picture do, and this costs a tenth of a
  /// call of Embree.
  bool misses_bounds(const Ray& ray) const;

  const RenderMesh& mesh(std::uint32_t index) const { return (*meshes_)[index]; }
  const Box& bounds() const { return bounds_; }  ///< of all triangles; empty when there are none
  float epsilon() const { return epsilon_; }     ///< how far rays start off a surface

 private:
  struct Release {
    void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
  };
  TracedScene() = default;
  std::unique_ptr<RTCSceneTy, Release> scene_;
  const std::vector<RenderMesh>* meshes_ = nullptr;
  Box bounds_;
  float epsilon_ = 0;
  float shutter_ = 0;
};

inline bool TracedScene::misses_bounds(const Ray& ray) const {
  if (bounds_.empty()) return true;
  float near = 0, far = ray.far;
  const auto clip = [&](float origin, float direction, float low, float high) {
    const float inverse = 1.0f / direction;
    const float a = (low - origin) * inverse, b = (high - origin) * inverse;
    const float first = a < b ? a : b, last = a < b ? b : a;
    // A ray in the plane of a side makes a NaN here; these comparisons then keep the interval as it
    // is.
    near = first > near ? first : near;
    far = last < far ? last : far;
  };
  clip(ray.origin.x, ray.direction.x, bounds_.low.x, bounds_.high.x);
  clip(ray.origin.y, ray.direction.y, bounds_.low.y, bounds_.high.y);
  clip(ray.origin.z, ray.direction.z, bounds_.low.z, bounds_.high.z);
  return near > far;
}

}  // namespace polymorph
