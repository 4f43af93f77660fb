// Embree device, and scene of one frame with ray queries and the geometry of hits.
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

/// Embree device with its instruction set.
struct RayDevice {
  struct Release {
    void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
  };
  std::unique_ptr<RTCDeviceTy, Release> device;
  std::string isa;  ///< name of the instruction set in use (make_ray_device() lists them)

  /// The first error reported by Embree's callback; written on any thread.
  struct Report {
    std::mutex mutex;
    RTCError code = RTC_ERROR_NONE;
    std::string text;
  };
  std::unique_ptr<Report> report;
};

/// Creates a device. `chosen`: instruction set, one of sse2, sse4.2, avx, avx2, avx512 (x86-64) or
/// neon (others). If it is empty, the environment variable POLYMORPH_ISA names it; without that it
/// is the machine's best. Errors: kUsage for another name; kResource if the machine lacks it or
/// Embree creates no device.
Result<RayDevice> make_ray_device(const std::string& chosen);

/// Returns and clears the first error since the device was created or last checked (kResource), or
/// Ok.
Status take_device_error(const RayDevice& device);

/// Number of rays in an Embree packet.
inline constexpr int kPacket = 16;

/// A mesh prepared for exact tests on the CPU.
using MeshToTrace = TracedMeshOf<RenderMesh, std::vector<std::uint32_t>>;

/// Installs the callbacks that test every triangle that Embree finds, for closest() and
/// test_occlusion().
void set_filters(RTCGeometry geometry);

/// The meshes of one frame.
///
/// Embree only finds candidates: its triangles are slightly widened, so that it finds every
/// triangle that a ray may hit, and a callback tests each candidate exactly (intersect_triangle.h).
/// The result is the nearest hit; of equally near hits, that with the lowest mesh index, then
/// triangle index. So hits have the same bits with any instruction set, packet width and order of
/// traversal. The scene borrows the spans of the RenderMeshes.
class TracedScene {
 public:
  /// Makes a scene without Embree's hierarchy, which suffices for a GPU. `shutter`: time that the
  /// shutter is open, in frames; per frame, meshes move by their displacement.
  /// `max_start_distance`: maximum distance from the meshes at which rays start; rays from farther
  /// away may miss edges. `sequence_bounds`: bounds of all frames, so that the offsets of rays are
  /// the same in all frames; empty: the meshes' own bounds.
  TracedScene(const std::vector<RenderMesh>& meshes, float shutter, float max_start_distance,
              const Box& sequence_bounds);
  /// Builds Embree's hierarchy, which the functions below need. Errors: kResource (memory).
  Status build_hierarchy(const RayDevice& device);
  /// Makes a scene and builds its hierarchy.
  static Result<TracedScene> build(const RayDevice& device, const std::vector<RenderMesh>& meshes,
                                   float shutter = 0, float max_start_distance = 0,
                                   const Box& sequence_bounds = {});

  /// Finds the nearest hit of a mesh in (0, ray.far).
  MeshHit closest(const Ray& ray) const;
  /// Computes position and normals of a hit.
  SurfacePoint surface_point(const Ray& ray, const MeshHit& hit) const;
#if defined(PM_PACKS)
  /// Finds the nearest hits for up to kPacket rays, the first `count` lanes of one or two packs.
  /// `coherent`: the rays have similar directions, for which this is several times faster.
  void closest(const RayOf<Pack3>* rays, MeshHitOf<Pack>* hits, int count, bool coherent) const;
  /// Tests whether any mesh is hit in (0, ray.far); bit i is the result of ray i of `count`.
  std::uint32_t test_occlusion(const RayOf<Pack3>* rays, int count) const;
  /// Computes eight surface points; every lane must have a hit.
  SurfacePointOf<Pack3> surface_point(const RayOf<Pack3>& ray, const MeshHitOf<Pack>& hit) const;
#endif

  /// Tests whether the ray misses the bounds of all meshes. Most rays of a studio picture do, and
  /// this test costs a tenth of a call of Embree.
  template <class T3>
  MaskOf<T3> misses_bounds(const RayOf<T3>& ray) const {
    return misses_box(bounds_, ray);
  }

  std::uint32_t mesh_count() const { return static_cast<std::uint32_t>(meshes_.size()); }
  const RenderMesh& mesh(std::uint32_t index) const { return *meshes_[index].mesh; }
  const MeshToTrace& mesh_to_trace(std::uint32_t index) const { return meshes_[index]; }
  /// Bounds of all triangles; empty without triangles.
  const Box& bounds() const { return bounds_; }
  /// Radius of the cylinder around all triangles whose axis is vertical (y) and runs through the
  /// centre of bounds(); 0 without triangles.
  float upright_radius() const { return upright_radius_; }
  float epsilon() const { return epsilon_; }  ///< offset of rays from the surface that they leave
  /// Maximum error of Embree's distances, except for grazing rays.
  float slack() const { return max_length_ * 0x1p-14f; }
  /// Distance behind a ray's origin at which Embree's ray begins. Near the origin, Embree's
  /// distance of a hit may be negative although the exact one is positive. Rays that leave a
  /// surface begin in front of it nevertheless.
  float start_margin() const { return 0.5f * epsilon_; }

 private:
  struct Release {
    void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
  };
  std::unique_ptr<RTCSceneTy, Release> scene_;
  std::vector<MeshToTrace> meshes_;
  Box bounds_;
  float upright_radius_ = 0;
  float epsilon_ = 0;
  float max_length_ = 0;  ///< maximum distance from a ray's origin to a hit
};

}  // namespace polymorph
