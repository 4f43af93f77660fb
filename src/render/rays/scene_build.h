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
#include "render/rays/ray.h"
#include "render/rays/traced_mesh.h"
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

/// Number of rays in an Embree packet.
inline constexpr int kPacket = 16;

/// A mesh that is traced on the CPU.
using MeshToTrace = TracedMeshOf<RenderMesh, std::vector<std::uint32_t>>;

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
  /// Makes a scene that a device other than Embree's can trace. With a `shutter` meshes move by
  /// their displacement while it is open. `max_start_distance`: no ray starts further than this
  /// from the meshes; those that do may miss edges. `stage`: bounds of all frames, so that the
  /// offsets of rays are the same in all of them; empty: the meshes' own bounds.
  TracedScene(const std::vector<RenderMesh>& meshes, float shutter, float max_start_distance,
              const Box& stage);
  /// Builds Embree's hierarchy, which the functions below need. Errors: kResource (memory).
  Status build_hierarchy(const RayDevice& device);
  /// Does both.
  static Result<TracedScene> build(const RayDevice& device, const std::vector<RenderMesh>& meshes,
                                   float shutter = 0, float max_start_distance = 0,
                                   const Box& stage = {});

  /// Finds the nearest mesh in (0, ray.far).
  MeshHit closest(const Ray& ray) const;
  SurfacePoint surface_point(const Ray& ray, const MeshHit& hit) const;
#if defined(PM_PACKS)
  /// Finds the nearest meshes for up to kPacket rays, the first `count` lanes of one or two packs.
  /// Several times faster for rays of similar directions, `coherent`.
  void closest(const RayOf<Pack3>* rays, MeshHitOf<Pack>* hits, int count, bool coherent) const;
  /// Tests whether there is any mesh in (0, ray.far); bit i for the i-th of `count` rays.
  std::uint32_t test_occlusion(const RayOf<Pack3>* rays, int count) const;
  /// Computes eight surface points; every lane must have a hit.
  SurfacePointOf<Pack3> surface_point(const RayOf<Pack3>& ray, const MeshHitOf<Pack>& hit) const;
#endif

  /// Tests whether the ray misses the bounds of all meshes. Most rays of a studio picture do, and
  /// this costs a tenth of a call of Embree.
  template <class T3>
  MaskOf<T3> misses_bounds(const RayOf<T3>& ray) const {
    return misses_box(bounds_, ray);
  }

  std::uint32_t mesh_count() const { return static_cast<std::uint32_t>(meshes_.size()); }
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
  std::unique_ptr<RTCSceneTy, Release> scene_;
  std::vector<MeshToTrace> meshes_;
  Box bounds_;
  float epsilon_ = 0;
  float max_length_ = 0;  ///< maximum length of a ray
};

}  // namespace polymorph
