// Scene for a GPU, whose arrays lie in one block of memory: the counterpart of TracedScene, with
// the same hits. The CPU can trace it, too.
#pragma once

#include <span>

#include "image/texture.h"
#include "render/device/bvh.h"
#include "render/path/surface_shading.h"
#include "render/rays/surface_point.h"

namespace polymorph {

/// Counterpart of Material, without its name.
struct DeviceMaterial {
  Vec3 color, specular;
  float roughness = 0, metallic = 0, transmission = 0, ior = 1;
  int texture = -1;
};

/// Counterpart of MaterialBorders.
struct DeviceBorders {
  TriangleBvhView bvh;
  TexturedTriangles model;
  std::span<const BorderTriangle> triangles;
  std::span<const std::uint32_t> border_index;

  /// Not inlined, because few hits lie on borders and the search needs many registers.
  PM_HD_CALL TexturePoint at(std::uint32_t border, float u, float v) const {
    const auto closest = [&](Vec3 from, Vec3 neighbour, const ClosestPoint& hit) {
      return find_closest_near(bvh, from, neighbour, hit, kInfinity, AllOfLeaf{});
    };
    return texture_point(model, triangles[border], u, v, closest);
  }
};

/// Counterpart of MaterialLayer and MixedLayer.
struct DeviceLayer {
  std::span<const Vec2> corner_uvs;
  std::span<const std::uint32_t> triangle_materials;
  std::span<const DeviceMaterial> materials;
  std::span<const TextureView* const> textures;
  DeviceBorders borders;
  float opacity = 0;  ///< MixedLayer::opacity

  PM_HD bool has_uvs() const { return !corner_uvs.empty(); }
};
PM_HD inline TexturePoint texture_point(const DeviceLayer& layer, std::uint32_t triangle, float u,
                                        float v) {
  return find_texture_point(layer, triangle, u, v);
}

/// Counterpart of RenderMesh, without the members that light does not depend on.
struct DeviceMesh : DeviceLayer {
  std::span<const Vec3> positions;
  std::span<const Triangle> triangles;
  std::span<const Vec3> vertex_normals, corner_normals, vertex_colors, displacement;
  std::span<const DeviceLayer> upper_layers;
  float vertex_color_opacity = 0, look = 0;
  bool moves = false;
};
using DeviceTracedMesh = TracedMeshOf<DeviceMesh, std::span<const std::uint32_t>>;

/// Meshes and their hierarchy. Spans are borrowed.
struct DeviceScene {
  std::span<const DeviceTracedMesh> meshes;
  std::span<const BvhNode> nodes;
  std::span<const BvhTriangle> triangles;
  std::int32_t root = 0;  ///< Bvh::root
  Box bounds;             ///< TracedScene::bounds()
  float slack = 0;        ///< TracedScene::slack()

  PM_HD const DeviceMesh& mesh(std::uint32_t index) const { return *meshes[index].mesh; }

  /// Computes the box of a triangle while the shutter is open, with the margin of the hierarchy's
  /// boxes.
  PM_HD Box triangle_box(BvhTriangle t) const {
    const DeviceTracedMesh& traced = meshes[t.mesh];
    Box box;
    for (const std::uint32_t v : traced.mesh->triangles[t.triangle].v)
      box = extend(extend(box, traced.at(v, 0)), traced.at(v, 1));
    // The margin is 64 units in the last place of the longest ray's length; find_entry() is off by
    // a few.
    return widened(box, slack * 0x1p-4f);
  }

  /// Finds the nearest mesh in (0, ray.far).
  PM_HD_CALL MeshHit closest(const Ray& ray) const { return find_closest(ray, ExactTest{*this}); }
  /// Finds the nearest mesh with a plain test in floats (Möller and Trumbore 1997), for benchmarks.
  /// Near edges the hit may differ from that of closest().
  PM_HD_CALL MeshHit closest_in_floats(const Ray& ray) const {
    return find_closest(ray, BareTest{*this});
  }
  /// Tests whether there is any mesh in (0, ray.far).
  PM_HD_CALL bool is_occluded(const Ray& ray) const {
    bool any = false;
    for_each_intersected(ray, ExactTest{*this}, [&](BvhTriangle, const TriangleIntersection&) {
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
  /// A ray prepared for box tests. It reaches the plane of coordinate p along an axis at the
  /// distance p * inverse + shift.
  struct BoxRay {
    Vec3 inverse, shift;
  };
  PM_HD static BoxRay make_box_ray(const Ray& ray) {
    // Inverses are finite, because 0 * infinity would be NaN.
    const auto invert = [](float d) { return 1.0f / copysign(max(abs(d), 1e-20f), d); };
    const Vec3 inverse{invert(ray.direction.x), invert(ray.direction.y), invert(ray.direction.z)};
    return {inverse, -(ray.origin * inverse)};
  }
  /// Computes the distance at which a ray enters a box, or infinity for a miss. The result may
  /// differ between processors; the boxes' margin is larger than its error.
  PM_HD static float find_entry(const Box& box, const BoxRay& ray, float far) {
#if defined(__CUDA_ARCH__)
    const auto at = [](float p, float inverse, float shift) {
      return __fmaf_rn(p, inverse, shift);
    };
    const auto lower = [](float a, float b) { return fminf(a, b); };
    const auto upper = [](float a, float b) { return fmaxf(a, b); };
#else
    const auto at = [](float p, float inverse, float shift) { return p * inverse + shift; };
    const auto lower = [](float a, float b) { return min(a, b); };
    const auto upper = [](float a, float b) { return max(a, b); };
#endif
    const Vec3 i = ray.inverse, s = ray.shift;
    const float ax = at(box.low.x, i.x, s.x), bx = at(box.high.x, i.x, s.x);
    const float ay = at(box.low.y, i.y, s.y), by = at(box.high.y, i.y, s.y);
    const float az = at(box.low.z, i.z, s.z), bz = at(box.high.z, i.z, s.z);
    const float near = upper(upper(lower(ax, bx), lower(ay, by)), upper(lower(az, bz), 0.0f));
    const float end = lower(lower(upper(ax, bx), upper(ay, by)), lower(upper(az, bz), far));
    return near <= end ? near : kInfinity;
  }
  /// Tests exactly whether a ray hits a triangle in (0, ray.far).
  struct ExactTest {
    const DeviceScene& scene;
    /// Not inlined, because its variables would take registers from the loop over nodes.
    PM_HD_CALL bool operator()(BvhTriangle t, const Ray& ray, TriangleIntersection& at) const {
      return intersects_triangle(scene.meshes[t.mesh], t.triangle, ray, at) && at.distance > 0 &&
             at.distance < static_cast<double>(ray.far);
    }
  };
  /// Tests in floats (Möller and Trumbore 1997) whether a ray hits a triangle in (0, ray.far).
  struct BareTest {
    const DeviceScene& scene;
    PM_HD bool operator()(BvhTriangle t, const Ray& ray, TriangleIntersection& at) const {
      const DeviceTracedMesh& traced = scene.meshes[t.mesh];
      const std::uint32_t* corners = traced.mesh->triangles[t.triangle].v;
      const Vec3 a = traced.at(corners[0], ray.time), edge1 = traced.at(corners[1], ray.time) - a,
                 edge2 = traced.at(corners[2], ray.time) - a;
      const Vec3 p = cross(ray.direction, edge2), s = ray.origin - a, q = cross(s, edge1);
      const float scale = 1 / dot(edge1, p);
      const float u = dot(s, p) * scale, v = dot(ray.direction, q) * scale,
                  distance = dot(edge2, q) * scale;
      if (!(u >= 0 && v >= 0 && u + v <= 1 && distance > 0 && distance < ray.far)) return false;
      at = {static_cast<double>(distance), static_cast<double>(u), static_cast<double>(v)};
      return true;
    }
  };
  /// Finds the nearest hit. Among equally near hits, the one with the lowest mesh and then the
  /// lowest triangle counts, whatever the order of the search.
  template <class Test>
  PM_HD MeshHit find_closest(const Ray& ray, const Test& intersects) const {
    MeshHit best;
    auto distance = static_cast<double>(ray.far);
    for_each_intersected(
        ray, intersects, [&](BvhTriangle candidate, const TriangleIntersection& intersection) {
          if (intersection.distance > distance) return ray.far;  // does not shorten the search
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
  /// Calls f(triangle, intersection) for the triangles that the ray hits, in nearer nodes first. f
  /// returns the maximum distance of further hits; if it is negative, the search ends.
  template <class Test, class F>
  PM_HD void for_each_intersected(const Ray& ray, const Test& intersects, const F& f) const {
    if (misses_box(bounds, ray)) return;
    const BoxRay box_ray = make_box_ray(ray);
    float far = ray.far + slack;
    constexpr std::uint32_t kEnd = 0x7fffffff;  // above all nodes, below all triangles
    std::uint32_t stack[kMaxBvhDepth + 1];
    stack[0] = kEnd;
    int count = 1;
    auto next = static_cast<std::uint32_t>(root);
    for (;;) {
      // All threads of a warp first descend to a triangle or to the end, and then test their
      // triangles together (Aila and Laine 2009).
      while (next < kEnd) {
        const BvhNode node = load_node(nodes.data(), next);
        const float left = find_entry(node.boxes[0], box_ray, far),
                    right = find_entry(node.boxes[1], box_ray, far);
        const auto left_child = static_cast<std::uint32_t>(node.children[0]),
                   right_child = static_cast<std::uint32_t>(node.children[1]);
        const bool left_first = left <= right;
        next = left_first ? left_child : right_child;
        if (max(left, right) < kInfinity)
          stack[count++] = left_first ? right_child : left_child;
        else if (!(min(left, right) < kInfinity))
          next = stack[--count];
      }
      if (next == kEnd) return;
      const BvhTriangle candidate = triangles[~next];
      next = stack[--count];
      TriangleIntersection intersection;
      if (!intersects(candidate, ray, intersection)) continue;
      far = min(far, f(candidate, intersection) + slack);
      if (far < 0) return;
    }
  }
};

}  // namespace polymorph
