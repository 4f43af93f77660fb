// A scene whose arrays lie in one piece of memory, for a GPU: the counterpart of TracedScene, with
// the same decisions about hits. The CPU can trace it too.
#pragma once

#include <span>

#include "image/texture.h"
#include "render/device/bvh.h"
#include "render/path/surface_shading.h"
#include "render/rays/surface_point.h"

namespace polymorph {

/// Material without its name.
struct DeviceMaterial {
  Vec3 color, specular;
  float roughness = 0, metallic = 0, transmission = 0, ior = 1;
  int texture = -1;
};

/// MaterialLayer, or MixedLayer.
struct DeviceLayer {
  std::span<const Vec2> corner_uvs;
  std::span<const std::uint32_t> triangle_materials;
  std::span<const DeviceMaterial> materials;
  std::span<const TextureView* const> textures;
  float share = 0;
};
PM_HD inline TexturePoint texture_point(const DeviceLayer& layer, std::uint32_t triangle, float u,
                                        float v) {
  return interpolate_texture_point(layer, triangle, u, v);
}

/// RenderMesh, as far as light needs it.
struct DeviceMesh : DeviceLayer {
  std::span<const Vec3> positions;
  std::span<const Triangle> triangles;
  std::span<const Vec3> vertex_normals, corner_normals, vertex_colors, displacement;
  std::span<const DeviceLayer> over;
  float vertex_color_share = 0, look = 0;
  bool moves = false;
};
using DeviceTracedMesh = TracedMeshOf<DeviceMesh, std::span<const std::uint32_t>>;

struct DeviceScene {
  std::span<const DeviceTracedMesh> meshes;
  std::span<const BvhNode> nodes;
  std::span<const BvhTriangle> triangles;
  Box bounds;       ///< TracedScene::bounds()
  float slack = 0;  ///< TracedScene::slack()

  PM_HD const DeviceMesh& mesh(std::uint32_t index) const { return *meshes[index].mesh; }

  /// Finds the nearest mesh in (0, ray.far).
  PM_HD_CALL MeshHit closest(const Ray& ray) const {
    MeshHit best;
    auto distance = static_cast<double>(ray.far);
    for_each_intersected(ray, [&](BvhTriangle candidate, const TriangleIntersection& intersection) {
      if (intersection.distance > distance) return ray.far;
      if (best.mesh != kNoMesh && intersection.distance == distance &&
          (candidate.mesh > best.mesh ||
           (candidate.mesh == best.mesh && candidate.triangle >= best.triangle)))
        return static_cast<float>(distance);
      distance = intersection.distance;
      best = {candidate.mesh, candidate.triangle, static_cast<float>(distance),
              static_cast<float>(intersection.u), static_cast<float>(intersection.v)};
      return best.distance;
    });
    return best;
  }
  /// Tests whether there is any mesh in (0, ray.far).
  PM_HD_CALL bool is_occluded(const Ray& ray) const {
    bool any = false;
    for_each_intersected(ray, [&](BvhTriangle, const TriangleIntersection&) {
      any = true;
      return -kInfinity;
    });
    return any;
  }
  PM_HD SurfacePoint surface_point(const Ray& ray, const MeshHit& hit) const {
    CornersOf<Vec3> p, n;
    read_triangle(meshes[hit.mesh], hit.triangle, ray.time, p, n);
    return make_surface_point(p, n, ray, hit);
  }

 private:
  /// Distance at which a ray enters a box; infinity for a miss. Its error is smaller than the
  /// margin by which boxes are widened.
  PM_HD static float enter(const Box& box, Vec3 origin, Vec3 inverse, float far) {
    const Vec3 a = (box.low - origin) * inverse, b = (box.high - origin) * inverse;
    const float near = max(max_component(min(a, b)), 0.0f);
    return near <= min(min_component(max(a, b)), far) ? near : kInfinity;
  }
  /// Calls f(triangle, intersection) for the triangles that the ray hits, nearer nodes first; f
  /// returns the distance up to which more are of interest.
  template <class F>
  PM_HD void for_each_intersected(const Ray& ray, const F& f) const {
    if (misses_box(bounds, ray)) return;
    // No component is infinite, so that 0 * infinity cannot occur.
    const auto inverse_of = [](float d) { return 1.0f / copysign(max(abs(d), 1e-20f), d); };
    const Vec3 inverse{inverse_of(ray.direction.x), inverse_of(ray.direction.y),
                       inverse_of(ray.direction.z)};
    float far = ray.far + slack;
    std::int32_t waiting[kMaxBvhDepth + 2];
    int count = 0;
    for (std::int32_t at = 0;;) {
      if (at >= 0) {
        const BvhNode& node = nodes[at];
        const float left = enter(node.boxes[0], ray.origin, inverse, far),
                    right = enter(node.boxes[1], ray.origin, inverse, far);
        const bool left_first = left <= right;
        if (max(left, right) < kInfinity) waiting[count++] = node.children[left_first ? 1 : 0];
        if (min(left, right) < kInfinity) {
          at = node.children[left_first ? 0 : 1];
          continue;
        }
      } else {
        const std::int32_t first = ~at >> kLeafBits, end = first + (~at & kLeafMask);
        for (std::int32_t i = first; i < end; ++i) {
          TriangleIntersection intersection;
          const BvhTriangle candidate = triangles[i];
          if (!intersects_triangle(meshes[candidate.mesh], candidate.triangle, ray, intersection) ||
              !(intersection.distance > 0 && intersection.distance < static_cast<double>(ray.far)))
            continue;
          far = min(far, f(candidate, intersection) + slack);
          if (far < 0) return;
        }
      }
      if (count == 0) return;
      at = waiting[--count];
    }
  }
};

}  // namespace polymorph
