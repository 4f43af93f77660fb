#include "mesh/carry/carry_moves.h"

#include <algorithm>
#include <limits>

#include "base/parallel.h"

namespace polymorph {
namespace {

/// Minimum triangle_quality() after a move, unless it was lower before.
constexpr float kMinQuality = 0.1f;

Vec3 normal_at(const Mesh& surface, const ClosestPoint& hit) {
  return normalized(
      interpolate(surface.normals, surface.triangles[hit.triangle], weights_at(surface, hit)));
}

/// Normal and distance of the surface at the point closest to a triangle's centroid.
struct TriangleFit {
  Vec3 normal;  ///< the surface's smooth normal or its face normal, whichever deviates more
  float distance = 0;
  std::uint32_t nearest = ClosestPoint::kNoTriangle;
};
TriangleFit fit_to_surface(Vec3 a, Vec3 b, Vec3 c, const CarryTarget& target, std::uint32_t hint) {
  const Vec3 middle = (a + b + c) / 3, area_vector = cross(b - a, c - a);
  const ClosestPoint hit = closest_near(target, middle, hint);
  const Vec3 smooth = normal_at(target.surface, hit),
             flat = face_normal_at(target, middle, hit, area_vector);
  return {dot(area_vector, flat) < dot(area_vector, smooth) ? flat : smooth, hit.distance,
          hit.triangle};
}

struct Mover {
  const MovedMesh& mesh;
  std::span<const Vec3> normals;  ///< surface normals, per triangle

  /// Minimum quality of the triangles around `v` if it were at `at`.
  float min_quality(std::uint32_t v, Vec3 at) const {
    float result = 1;
    for (const std::uint32_t f : mesh.fans.around(v)) {
      const Triangle& t = mesh.triangles[f];
      const int k = t.v[0] == v ? 0 : t.v[1] == v ? 1 : 2;
      result = std::min(result, triangle_quality(at, mesh.points[t.v[(k + 1) % 3]],
                                                 mesh.points[t.v[(k + 2) % 3]], normals[f]));
    }
    return result;
  }
  /// Moves a point towards `to` as far as the qualities of its triangles allow (kMinQuality).
  /// Returns false if it did not move.
  bool move(std::uint32_t v, Vec3 to) {
    const Vec3 from = mesh.points[v];
    const float before = std::min(min_quality(v, from), kMinQuality);
    for (float step = 1; step > 0.1f; step *= 0.5f) {
      const Vec3 at = lerp(from, to, step);
      if (min_quality(v, at) >= before) {
        mesh.points[v] = at;
        return true;
      }
    }
    return false;
  }
};

std::vector<Vec3> triangle_normals(std::span<const Triangle> triangles,
                                   std::span<const Vec3> normals) {
  std::vector<Vec3> result(triangles.size());
  for (std::size_t f = 0; f < result.size(); ++f) {
    const Triangle& t = triangles[f];
    result[f] = normalized(normals[t.v[0]] + normals[t.v[1]] + normals[t.v[2]]);
  }
  return result;
}

/// The target position of point `i`: on the surface, whose closest point is `foot` with the normal
/// `n`, and, by the fraction `relax`, towards the centroid of the point's fan.
Vec3 target_position(const MovedMesh& mesh, std::size_t i, Vec3 foot, Vec3 n, float relax) {
  Vec3 centroid, fan_normal;
  float weight = 0;
  for (const std::uint32_t f : mesh.fans.around(i)) {
    const Triangle& t = mesh.triangles[f];
    const Vec3 a = area_normal(mesh.points, t);
    const float area = length(a);
    fan_normal = fan_normal + a;
    centroid =
        centroid + (mesh.points[t.v[0]] + mesh.points[t.v[1]] + mesh.points[t.v[2]]) * (area / 3);
    weight += area;
  }
  const Vec3 p = mesh.points[i];
  const bool is_facing = dot(fan_normal, n) > 0;
  if (!(relax > 0 && weight > 0)) {
    // Points that lie on the surface up to rounding stay; their triangles need no new measurement.
    const bool is_on_surface = length(foot - p) <= 4e-6f * length(p);
    return is_facing && !is_on_surface ? foot : p;
  }
  // Move onto the tangent plane: on a ridge, many points share one closest point.
  const Vec3 offset = centroid / weight - p, along = (offset - n * dot(offset, n)) * relax;
  return is_facing ? p + along - n * dot(p - foot, n) : p + along;
}

void fit_to_surface(const MovedMesh& mesh, std::span<const std::uint32_t> faces,
                    const CarryTarget& target, std::vector<TriangleFit>& fits) {
  parallel_for(
      static_cast<std::int64_t>(faces.size()),
      [&](std::int64_t i) {
        const Triangle& t = mesh.triangles[faces[i]];
        TriangleFit& fit = fits[faces[i]];
        fit = fit_to_surface(mesh.points[t.v[0]], mesh.points[t.v[1]], mesh.points[t.v[2]], target,
                             fit.nearest);
      },
      /*grain=*/256);
}

constexpr float kBadQuality = 0.05f;  // triangles below this are nearly inverted

/// Lists the triangles that may be nearly inverted or further than `max_distance` from the surface,
/// judged by the triangles of the surface that are near their corners.
std::vector<std::uint32_t> list_doubtful_faces(const MovedMesh& mesh, const CarryTarget& target,
                                               std::span<const std::uint32_t> near,
                                               float max_distance) {
  constexpr float kSafeQuality = 0.2f;
  const MeshQuery surface = target.query();
  std::vector<std::uint8_t> is_doubtful(mesh.triangles.size(), 1);
  parallel_for(
      static_cast<std::int64_t>(mesh.triangles.size()),
      [&](std::int64_t f) {
        const Triangle& t = mesh.triangles[f];
        const Vec3 a = mesh.points[t.v[0]], b = mesh.points[t.v[1]], c = mesh.points[t.v[2]];
        for (const std::uint32_t v : t.v) {
          // A triangle without guesses, or of low quality, stays doubtful.
          if (v >= near.size() || near[v] >= surface.triangles.size()) return;
          const Vec3 n = area_normal(surface.points, surface.triangles[near[v]]);
          if (!(triangle_quality(a, b, c, normalized(n)) >= kSafeQuality)) return;
        }
        is_doubtful[f] =
            closest_near(target, (a + b + c) / 3, near[t.v[0]]).distance > max_distance;
      },
      /*grain=*/256);
  std::vector<std::uint32_t> faces;
  for (std::uint32_t f = 0; f < is_doubtful.size(); ++f)
    if (is_doubtful[f]) faces.push_back(f);
  return faces;
}

/// Moves a point that is stuck: far from the surface, or at a triangle that is nearly inverted.
/// Candidate positions are scored with the surface normals there, which differ on ridges and in
/// grooves from those at the point.
void move_stuck_point(const MovedMesh& mesh, const CarryTarget& target,
                      std::span<const TriangleFit> fits, std::uint32_t v, float max_distance) {
  constexpr float kSufficientQuality = 0.25f;
  std::vector<Vec3>& points = mesh.points;
  const std::span<const std::uint32_t> fan = mesh.fans.around(v);
  const std::uint32_t hint = fits[fan.front()].nearest;
  // Returns a score, lower being better, and whether the point would be stuck there.
  const auto score_at = [&](Vec3 at) {
    float min_quality = 1, deficit = 0;
    const float distance = closest_near(target, at, hint).distance;
    for (const std::uint32_t f : fan) {
      const Triangle& t = mesh.triangles[f];
      Vec3 p[3];
      for (int k = 0; k < 3; ++k) p[k] = t.v[k] == v ? at : points[t.v[k]];
      const Vec3 normal = fit_to_surface(p[0], p[1], p[2], target, fits[f].nearest).normal;
      const float quality = triangle_quality(p[0], p[1], p[2], normal);
      min_quality = std::min(min_quality, quality);
      deficit += std::max(kSufficientQuality - quality, 0.0f);
    }
    const float excess = std::max(distance / max_distance - 1, 0.0f) * 0.5f;
    return std::pair(deficit + excess, min_quality < kBadQuality || excess > 0);
  };
  auto [best, is_stuck] = score_at(points[v]);
  if (!is_stuck) return;
  const Vec3 from = points[v];
  std::vector<Vec3> ring;
  Vec3 sum;
  for (const std::uint32_t f : fan)
    for (int k = 0; k < 3; ++k)
      if (mesh.triangles[f].v[k] == v) ring.push_back(points[mesh.triangles[f].v[(k + 1) % 3]]);
  for (const Vec3 p : ring) sum = sum + p;
  const Vec3 middle = sum / static_cast<float>(ring.size()),
             foot = closest_near(target, from, hint).point,
             middle_foot = closest_near(target, middle, hint).point;
  std::vector<Vec3> candidates = {foot,
                                  middle_foot,
                                  middle,
                                  lerp(from, foot, 0.5f),
                                  lerp(from, middle_foot, 0.5f),
                                  lerp(from, middle, 0.5f),
                                  lerp(foot, middle_foot, 0.5f)};
  for (const Vec3 p : ring) candidates.push_back(lerp(from, p, 0.4f));
  // Between pairs of neighbours, on the surface.
  for (std::size_t i = 0; i < ring.size(); ++i)
    for (const float step : {0.15f, 0.4f, 0.7f}) {
      const Vec3 to = (ring[i] + ring[(i + 1) % ring.size()]) * 0.5f;
      candidates.push_back(closest_near(target, lerp(from, to, step), hint).point);
    }
  for (const Vec3 to : candidates) {
    const float score = score_at(to).first;
    if (score < best) best = score, points[v] = to;
  }
}

/// Moves a point towards `to`, if the triangles around it then agree with the surface at their
/// middles. The walls of a crease face across it, and not as the surface does at their corners.
bool move_into_crease(const MovedMesh& mesh, const CarryTarget& target, std::uint32_t v, Vec3 to,
                      std::uint32_t hint) {
  const auto min_quality_at = [&](Vec3 at) {
    float result = 1;
    for (const std::uint32_t f : mesh.fans.around(v)) {
      const Triangle& t = mesh.triangles[f];
      Vec3 p[3];
      for (int k = 0; k < 3; ++k) p[k] = t.v[k] == v ? at : mesh.points[t.v[k]];
      result =
          std::min(result, triangle_quality(p[0], p[1], p[2],
                                            fit_to_surface(p[0], p[1], p[2], target, hint).normal));
    }
    return result;
  };
  const Vec3 from = mesh.points[v];
  const float before = std::min(min_quality_at(from), kMinQuality);
  for (const float step : {1.0f, 0.5f, 0.25f})
    if (const Vec3 at = lerp(from, to, step); min_quality_at(at) >= before) {
      mesh.points[v] = at;
      return true;
    }
  return false;
}

/// Adds `rings` rings of neighbours to a list of points; sorts it and removes duplicates.
void add_rings(std::vector<std::uint32_t>& points, const MovedMesh& mesh, int rings) {
  for (int r = 0;; ++r) {
    std::sort(points.begin(), points.end());
    points.erase(std::unique(points.begin(), points.end()), points.end());
    if (r == rings) return;
    const std::size_t n = points.size();
    for (std::size_t i = 0; i < n; ++i)
      for (const std::uint32_t f : mesh.fans.around(points[i]))
        for (const std::uint32_t v : mesh.triangles[f].v) points.push_back(v);
  }
}

/// Lists the triangles around points, sorted.
std::vector<std::uint32_t> list_faces_around(std::span<const std::uint32_t> points,
                                             const Fans& fans) {
  std::vector<std::uint32_t> faces;
  for (const std::uint32_t v : points)
    faces.insert(faces.end(), fans.around(v).begin(), fans.around(v).end());
  std::sort(faces.begin(), faces.end());
  faces.erase(std::unique(faces.begin(), faces.end()), faces.end());
  return faces;
}

}  // namespace

SurfaceProjection project_onto_surface(std::span<const Vec3> points, const CarryTarget& target,
                                       std::vector<std::uint32_t>& near) {
  SurfaceProjection foot;
  foot.points.resize(points.size());
  foot.normals.resize(points.size());
  near.resize(points.size(), ClosestPoint::kNoTriangle);
  parallel_for(
      static_cast<std::int64_t>(points.size()),
      [&](std::int64_t i) {
        const ClosestPoint hit = closest_near(target, points[i], near[i]);
        foot.points[i] = hit.point;
        foot.normals[i] = normal_at(target.surface, hit);
        near[i] = hit.triangle;
      },
      /*grain=*/256);
  return foot;
}

float triangle_quality(Vec3 a, Vec3 b, Vec3 c, Vec3 normal) {
  const Vec3 ab = b - a, ac = c - a, bc = c - b;
  const float edges = dot(ab, ab) + dot(ac, ac) + dot(bc, bc);
  // The factor is 2 sqrt 3: the quality of an equilateral triangle is 1.
  return edges > 0 ? 3.4641016f * dot(cross(ab, ac), normal) / edges : 0.0f;
}

void move_onto_surface(const MovedMesh& mesh, const CarryTarget& target, float relax,
                       std::vector<std::uint32_t>& near) {
  constexpr int kRelaxSteps = 5;
  const SurfaceProjection foot = project_onto_surface(mesh.points, target, near);
  const std::vector<Vec3> normals = triangle_normals(mesh.triangles, foot.normals);
  Mover mover{mesh, normals};
  for (int k = 0; k < (relax > 0 ? kRelaxSteps : 1); ++k)
    for (std::uint32_t i = 0; i < mesh.points.size(); ++i)
      mover.move(i, target_position(mesh, i, foot.points[i], foot.normals[i], relax));
}

void repair(const MovedMesh& mesh, const CarryTarget& target, float max_distance,
            std::span<const std::uint32_t> near, std::span<const std::uint32_t> seeds) {
  constexpr int kMaxAttempts = 30, kMaxIdle = 6, kSeededAttempts = 6, kRelaxSteps = 5, kRings = 3;
  std::vector<TriangleFit> fits(mesh.triangles.size());
  std::vector<std::uint32_t> faces = list_doubtful_faces(mesh, target, near, max_distance), active;
  for (std::uint32_t f = 0; f < mesh.triangles.size(); ++f)
    if (const std::uint32_t v = mesh.triangles[f].v[0]; v < near.size()) fits[f].nearest = near[v];
  std::size_t fewest_stuck = std::numeric_limits<std::size_t>::max();
  int last_gain = 0;
  for (int k = 0;; ++k) {
    if (mesh.keep_going && !(*mesh.keep_going)()) return;
    fit_to_surface(mesh, faces, target, fits);
    std::vector<std::uint32_t> stuck;  // points of triangles that are nearly inverted or distant
    for (const std::uint32_t f : faces) {
      const Triangle& t = mesh.triangles[f];
      const float quality = triangle_quality(mesh.points[t.v[0]], mesh.points[t.v[1]],
                                             mesh.points[t.v[2]], fits[f].normal);
      if (quality < kBadQuality || fits[f].distance > max_distance)
        stuck.insert(stuck.end(), t.v, t.v + 3);
    }
    if (stuck.size() < fewest_stuck) fewest_stuck = stuck.size(), last_gain = k;
    if ((stuck.empty() && (seeds.empty() || k >= kSeededAttempts)) || k == kMaxAttempts ||
        (!stuck.empty() && k - last_gain >= kMaxIdle))
      return;
    std::vector<std::uint32_t> ring = stuck;
    if (k == 0)
      for (const std::uint32_t f : seeds)
        ring.insert(ring.end(), mesh.triangles[f].v, mesh.triangles[f].v + 3);
    if (k % 4 == 0) {  // widen the active region
      add_rings(ring, mesh, kRings);
      active.insert(active.end(), ring.begin(), ring.end());
      add_rings(active, mesh, 0);
      faces = list_faces_around(active, mesh.fans);
      fit_to_surface(mesh, faces, target, fits);
    }
    // Relax the active points, then move the stuck ones.
    std::vector<Vec3> positions, normals(mesh.triangles.size());
    std::vector<std::uint32_t> hints;
    for (const std::uint32_t v : active) {
      positions.push_back(mesh.points[v]);
      hints.push_back(fits[mesh.fans.around(v).front()].nearest);
    }
    const SurfaceProjection foot = project_onto_surface(positions, target, hints);
    for (const std::uint32_t f : faces) normals[f] = fits[f].normal;
    Mover mover{mesh, normals};
    for (int inner = 0; inner < kRelaxSteps; ++inner)
      for (std::size_t i = 0; i < active.size(); ++i)
        mover.move(active[i],
                   target_position(mesh, active[i], foot.points[i], foot.normals[i], kRelax));
    add_rings(stuck, mesh, 0);
    for (const std::uint32_t v : stuck) move_stuck_point(mesh, target, fits, v, max_distance);
  }
}

void spread_points(const MovedMesh& mesh, const CarryTarget& target,
                   std::span<const std::uint32_t> seeds, std::span<const std::uint32_t> near,
                   int rings) {
  constexpr int kSweeps = 20;
  std::vector<std::uint32_t> region;
  for (const std::uint32_t f : seeds)
    region.insert(region.end(), mesh.triangles[f].v, mesh.triangles[f].v + 3);
  add_rings(region, mesh, rings);
  std::vector<std::uint32_t> hints;
  for (const std::uint32_t v : region)
    hints.push_back(v < near.size() ? near[v] : ClosestPoint::kNoTriangle);
  for (int sweep = 0; sweep < kSweeps; ++sweep)
    for (std::size_t i = 0; i < region.size(); ++i) {
      Vec3 sum;
      float count = 0;
      for (const std::uint32_t f : mesh.fans.around(region[i]))
        for (const std::uint32_t v : mesh.triangles[f].v)
          if (v != region[i]) sum = sum + mesh.points[v], count += 1;
      const ClosestPoint hit = closest_near(target, sum / count, hints[i]);
      mesh.points[region[i]] = hit.point;
      hints[i] = hit.triangle;
    }
}

void pull_towards_misses(const MovedMesh& mesh, const CarryTarget& target,
                         std::vector<Deviation::Listed> misses, float large_miss,
                         std::vector<std::uint32_t>& near) {
  std::stable_sort(misses.begin(), misses.end(),
                   [](const auto& a, const auto& b) { return a.distance > b.distance; });
  const SurfaceProjection foot = project_onto_surface(mesh.points, target, near);
  std::vector<std::uint8_t> is_moved(mesh.points.size(), 0);
  const std::vector<Vec3> normals = triangle_normals(mesh.triangles, foot.normals);
  Mover mover{mesh, normals};
  for (const Deviation::Listed& miss : misses) {
    const Triangle& t = mesh.triangles[miss.triangle];
    std::uint32_t order[3] = {t.v[0], t.v[1], t.v[2]};
    std::sort(order, order + 3, [&](std::uint32_t a, std::uint32_t b) {
      return length(mesh.points[a] - miss.point) < length(mesh.points[b] - miss.point);
    });
    // Move the nearest corner that can move, unless it was moved to a larger miss before.
    const auto pull = [&](const auto& try_move) {
      for (const std::uint32_t v : order) {
        if (is_moved[v]) return true;
        if (try_move(v)) {
          is_moved[v] = 1;
          return true;
        }
      }
      return false;
    };
    if (pull([&](std::uint32_t v) { return mover.move(v, miss.point); })) continue;
    if (miss.distance > large_miss)
      pull([&](std::uint32_t v) { return move_into_crease(mesh, target, v, miss.point, near[v]); });
  }
}

}  // namespace polymorph
