// Surface points: position and normals of a hit for shading, for one hit or for eight.
#pragma once

#include "render/math/vector_math.h"
#include "render/rays/ray.h"

namespace polymorph {

/// Positions or shading normals of a triangle's corners.
template <class T3>
struct CornersOf {
  T3 a, b, c;
};

template <class T3>
PM_HD T3 interpolate(const CornersOf<T3>& c, ComponentOf<T3> u, ComponentOf<T3> v) {
  return c.a * (1.0f - u - v) + c.b * u + c.c * v;
}

/// Bends a shading normal so that the mirrored view ray stays above the triangle (Keller et al.
/// 2017, "The Iray light transport simulation and rendering system"); this avoids black edges on
/// coarse, shiny meshes.
template <class T3>
PM_HD T3 bend_to_valid_reflection(T3 shading, T3 normal, T3 view) {
  using V = ComponentOf<T3>;
  const T3 mirrored = shading * (2.0f * dot(shading, view)) - view;
  const V cosine = dot(mirrored, normal);
  // The limit is below the view ray's own cosine, so that even a grazing view can meet it.
  const V min_cosine = min(0.9f * dot(view, normal), 0.01f);
  const MaskOf<T3> too_low = cosine < min_cosine;
  if (!any(too_low)) return shading;
  const T3 bent = normalized(normalized(mirrored + normal * (min_cosine - cosine)) + view);
  return select(too_low, select(dot(bent, normal) > 0.0f, bent, normal), shading);
}

/// Moves a point of a flat triangle onto the smooth surface that its vertex normals describe
/// (Hanika 2021, "Hacking the shadow terminator"); this avoids a faceted terminator on coarse
/// meshes. `position`: the point of `hit`; `side`: 1 or -1, the sign that turns the normals `n` to
/// the ray's side.
template <class T3>
PM_HD T3 lift(T3 position, const CornersOf<T3>& p, const CornersOf<T3>& n,
              const MeshHitOf<ComponentOf<T3>>& hit, ComponentOf<T3> side) {
  using V = ComponentOf<T3>;
  const auto displacement = [&](T3 vertex, T3 normal, V weight) {
    const V below = min(side * dot(position - vertex, normal), 0.0f);
    return normal * (-below * side * weight);
  };
  return position + displacement(p.a, n.a, 1.0f - hit.u - hit.v) + displacement(p.b, n.b, hit.u) +
         displacement(p.c, n.c, hit.v);
}

/// Makes the surface point of a hit. `p`: corners; `n`: shading normals, 0 if the triangle has
/// none.
template <class T3>
PM_HD SurfacePointOf<T3> make_surface_point(const CornersOf<T3>& p, const CornersOf<T3>& n,
                                            const RayOf<T3>& ray,
                                            const MeshHitOf<ComponentOf<T3>>& hit) {
  using V = ComponentOf<T3>;
  const T3 view = -ray.direction;
  SurfacePointOf<T3> point;
  point.position = interpolate(p, hit.u, hit.v);
  const T3 normal = normalized(cross(p.b - p.a, p.c - p.a));
  // A triangle without an area has the cross product 0; its normal is the direction to the viewer.
  point.normal = select(dot(normal, normal) > 0.5f, normal, view);
  const V side = copysign(broadcast<V>(1), dot(point.normal, view));
  point.normal = point.normal * side;
  point.inside = side < 0.0f;
  point.shading = point.normal;
  point.lifted = point.position;

  const T3 smooth = normalized(interpolate(n, hit.u, hit.v));
  const MaskOf<T3> has_smooth = dot(smooth, smooth) > 0.5f;
  if (any(has_smooth)) {
    // In some files normals point to the wrong side, so the triangle's orientation decides.
    const V normal_sign = copysign(broadcast<V>(1), dot(smooth, point.normal));
    const T3 bent = bend_to_valid_reflection(smooth * normal_sign, point.normal, view);
    point.shading = select(has_smooth, bent, point.shading);
    const T3 lifted = lift(point.position, p, n, hit, normal_sign);
    point.lifted = select(has_smooth, lifted, point.lifted);
  }
  return point;
}

/// Reads the corners and shading normals of a triangle at a time while the shutter is open, [0, 1].
/// `n` becomes 0 if the mesh has no normals.
template <class Traced>
PM_HD void read_triangle(const Traced& traced, std::uint32_t triangle, float time,
                         CornersOf<Vec3>& p, CornersOf<Vec3>& n) {
  const auto& m = *traced.mesh;
  const Triangle& t = m.triangles[triangle];
  p = {traced.at(t.v[0], time), traced.at(t.v[1], time), traced.at(t.v[2], time)};
  n = {};
  if (!m.vertex_normals.empty())
    n = {m.vertex_normals[t.v[0]], m.vertex_normals[t.v[1]], m.vertex_normals[t.v[2]]};
  else if (!m.corner_normals.empty())
    n = {m.corner_normals[std::size_t{triangle} * 3],
         m.corner_normals[std::size_t{triangle} * 3 + 1],
         m.corner_normals[std::size_t{triangle} * 3 + 2]};
}

}  // namespace polymorph
