#include "leg/project.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "base/morton.h"
#include "base/parallel.h"
#include "base/result.h"
#include "field/near_balls.h"
#include "mesh/normals.h"

namespace polymorph {
namespace {

/// Estimates the distance to the surface to first order, positive inside: value over slope. Returns
/// 1e30 if the field has no slope.
float first_order_distance(const LogField& field) {
  const float slope = length(field.gradient);
  return slope > 0 ? static_cast<float>(field.value) / slope : 1e30f;
}

/// Finds a root of the field on the line through p along `direction`, within `max_distance` of p.
/// It is the nearest root on the side of p where the surface is expected or, without one there, the
/// nearest on the other side.
std::optional<Vec3> root_along(const NearBalls& balls, std::span<const std::uint32_t> list, Vec3 p,
                               Vec3 direction, float max_distance) {
  const auto value_at = [&](float t) { return balls.log_field(p + direction * t, list).value; };
  const bool inside = value_at(0) > 0;
  // Search outwards from inside, inwards from outside; then the other way, if a bulge hides the
  // root.
  constexpr int kRootSteps = 12;
  for (const float sign : {inside ? 1.0f : -1.0f, inside ? -1.0f : 1.0f}) {
    float near = 0;
    for (int i = 1; i <= kRootSteps; ++i) {
      const float distance = sign * max_distance * static_cast<float>(i) / kRootSteps;
      if ((value_at(distance) > 0) == inside) {
        near = distance;
        continue;
      }
      // Bisection, down to 2^-14 of a step: `a` is on the side of p, `b` on the other.
      float a = near, b = distance;
      for (int step = 0; step < 14; ++step) {
        const float middle = (a + b) / 2;
        ((value_at(middle) > 0) == inside ? a : b) = middle;
      }
      return p + direction * ((a + b) / 2);
    }
  }
  return std::nullopt;
}

/// Follows the gradient from p towards a root for at most 20 steps, and returns the last point
/// within twice `max_distance`.
Vec3 root_along_gradient(const NearBalls& balls, std::span<const std::uint32_t> list, Vec3 p,
                         float max_distance) {
  Vec3 x = p;
  for (int step = 0; step < 20; ++step) {
    const LogField field = balls.log_field(x, list);
    const float slope = length(field.gradient), distance = first_order_distance(field);
    if (!(slope > 0) || !std::isfinite(distance)) break;
    const float step_length = std::clamp(distance, -max_distance / 4, max_distance / 4);
    const Vec3 next = x - field.gradient * (step_length / slope);
    if (length(next - p) > 2 * max_distance) break;
    x = next;
    if (std::abs(distance) < 1e-4f * max_distance) break;  // converged
  }
  return x;
}

/// Marks the points on the solid's boundary, from which a step along the normal or against it leads
/// outside. The others lie inside, where parts overlap.
std::vector<std::uint8_t> find_boundary(const Model& model, const std::vector<Vec3>& normals,
                                        const InsideTest& inside, float step) {
  std::vector<Vec3> probes;
  for (std::size_t i = 0; i < model.points.size(); ++i) {
    probes.push_back(model.points[i] + normals[i] * step);
    probes.push_back(model.points[i] - normals[i] * step);
  }
  const std::vector<std::uint8_t> in = inside.inside(probes);
  std::vector<std::uint8_t> boundary(model.points.size());
  for (std::size_t i = 0; i < boundary.size(); ++i) boundary[i] = !(in[2 * i] && in[2 * i + 1]);
  return boundary;
}

/// Computes Projection::arrived. `near`: maximum distance of an arrived point from the surface.
double arrived_share(const Model& model, const Projection& projection,
                     const std::vector<std::uint8_t>& boundary, const NearBalls& balls,
                     float near) {
  std::vector<Vec3> centroids(model.triangles.size());
  for (std::size_t t = 0; t < centroids.size(); ++t) {
    const auto& v = model.triangles[t].v;
    centroids[t] =
        (projection.points[v[0]] + projection.points[v[1]] + projection.points[v[2]]) / 3.0f;
  }
  std::vector<std::uint8_t> point_arrived(model.points.size()), centroid_arrived(centroids.size());
  const auto mark_arrived = [&](const std::vector<Vec3>& points,
                                std::vector<std::uint8_t>& arrived) {
    for_each_near(balls, points, near, [&](std::size_t begin, std::size_t end, auto list) {
      for (std::size_t i = begin; i < end; ++i)
        arrived[i] = std::abs(first_order_distance(balls.log_field(points[i], list))) <= near;
    });
  };
  mark_arrived(projection.points, point_arrived);
  mark_arrived(centroids, centroid_arrived);
  double arrived_area = 0, visible_area = 0;
  for (std::size_t t = 0; t < centroids.size(); ++t) {
    const auto& v = model.triangles[t].v;
    if (!boundary[v[0]] || !boundary[v[1]] || !boundary[v[2]]) continue;
    const double area = static_cast<double>(length(
        cross(model.points[v[1]] - model.points[v[0]], model.points[v[2]] - model.points[v[0]])));
    visible_area += area;
    if (centroid_arrived[t] && point_arrived[v[0]] && point_arrived[v[1]] && point_arrived[v[2]])
      arrived_area += area;
  }
  return visible_area > 0 ? arrived_area / visible_area : 0;
}

}  // namespace

Projection project_model(const Model& model, const InsideTest& inside,
                         std::span<const Ball> leg_balls, FieldKind kind) {
  const Box box = model.box();
  // Maximum distances of a point from its projection, and of an arrived point from the surface.
  const float size = box.diagonal(), max_distance = 0.05f * size, near = 0.005f * size;
  const NearBalls balls(leg_balls, kind);
  const std::vector<Vec3> normals = point_normals(model);
  const std::vector<std::uint8_t> boundary =
      find_boundary(model, normals, inside, /*step=*/2e-4f * size);
  // In Morton order, consecutive points have the same balls nearby.
  const std::vector<std::uint32_t> order = sort_by_morton_key(model.points, box);
  std::vector<Vec3> sorted;
  for (const std::uint32_t i : order) sorted.push_back(model.points[i]);

  // Points inside the solid stay, so projections start as the model's points and normals.
  Projection projection;
  projection.points = model.points;
  projection.normals = normals;
  for_each_near(balls, sorted, max_distance, [&](std::size_t begin, std::size_t end, auto list) {
    for (std::size_t k = begin; k < end; ++k) {
      const std::size_t i = order[k];
      if (!boundary[i]) continue;
      const std::optional<Vec3> along_normal =
          root_along(balls, list, model.points[i], normals[i], max_distance);
      const Vec3 root = along_normal
                            ? *along_normal
                            : root_along_gradient(balls, list, model.points[i], max_distance);
      projection.points[i] = root;
      const Vec3 outward = -normalized(balls.log_field(root, list).gradient);
      // A normal opposite to the model's belongs to the other side of a thin wall.
      if (dot(outward, normals[i]) > 0) projection.normals[i] = outward;
    }
  });
  projection.arrived = arrived_share(model, projection, boundary, balls, near);
  return projection;
}

MovingMesh projected_mesh(const Model& model, const Projection& projection, float progress) {
  PM_CHECK(projection.points.size() == model.points.size());
  MovingMesh mesh;
  mesh.points.resize(model.points.size());
  for (std::size_t i = 0; i < mesh.points.size(); ++i)
    mesh.points[i] = (1 - progress) * model.points[i] + progress * projection.points[i];
  mesh.corner_normals.resize(model.triangles.size() * 3);
  for (std::size_t t = 0; t < model.triangles.size(); ++t)
    for (std::size_t c = 0; c < 3; ++c) {
      const Vec3 from = model.corner_normals[3 * t + c];
      const Vec3 to = projection.normals[model.triangles[t].v[c]];
      const Vec3 n = normalized((1 - progress) * from + progress * to);
      mesh.corner_normals[3 * t + c] = dot(n, n) > 0 ? n : from;
    }
  return mesh;
}

}  // namespace polymorph
