#include "mesh/carry/carry_moves.h"

#include <algorithm>
#include <numeric>

#include "base/parallel.h"

namespace polymorph {
namespace {

/// What no move may make a triangle worse than: see shape_of().
constexpr float kMinShape = 0.1f;

Vec3 normal_at(const Mesh& surface, const ClosestPoint& hit) {
  const Triangle& t = surface.triangles[hit.triangle];
  const TriangleWeights w = closest_on_triangle(
      hit.point, surface.positions[t.v[0]], surface.positions[t.v[1]], surface.positions[t.v[2]]);
  return normalized(surface.normals[t.v[0]] * static_cast<float>(w.a) +
                    surface.normals[t.v[1]] * static_cast<float>(w.b) +
                    surface.normals[t.v[2]] * static_cast<float>(w.c));
}

/// How a triangle lies to the surface, at what is nearest to its middle.
struct Judgement {
  Vec3 normal;  ///< of the surface: the smooth one or that of a face, which is further off
  float distance = 0;
  std::uint32_t nearest = ClosestPoint::kNoTriangle;
};
Judgement judge(Vec3 a, Vec3 b, Vec3 c, const CarryTarget& target, std::uint32_t hint) {
  const Vec3 middle = (a + b + c) / 3, own = cross(b - a, c - a);
  const ClosestPoint hit = target.query().closest(middle, hint);
  const Vec3 smooth = normal_at(target.surface, hit),
             flat = face_normal_at(target, middle, hit, own);
  return {dot(own, flat) < dot(own, smooth) ? flat : smooth, hit.distance, hit.triangle};
}

struct Mover {
  const MovedMesh& mesh;
  std::span<const Vec3> normals;  ///< the surface's, of each triangle

  float worst(std::uint32_t v, Vec3 at) const {
    float least = 1;
    for (const std::uint32_t f : mesh.fans.of(v)) {
      const Triangle& t = mesh.triangles[f];
      const int k = t.v[0] == v ? 0 : t.v[1] == v ? 1 : 2;
      least = std::min(least, shape_of(at, mesh.points[t.v[(k + 1) % 3]],
                                       mesh.points[t.v[(k + 2) % 3]], normals[f]));
    }
    return least;
  }
  /// Goes as far towards `to` as no triangle gets worse than it may be. Whether it moved.
  bool move(std::uint32_t v, Vec3 to) {
    const Vec3 from = mesh.points[v];
    const float before = std::min(worst(v, from), kMinShape);
    for (float share = 1; share > 0.1f; share *= 0.5f) {
      const Vec3 at = lerp(from, to, share);
      if (worst(v, at) >= before) {
        mesh.points[v] = at;
        return true;
      }
    }
    return false;
  }
};

std::vector<Vec3> triangle_normals(std::span<const Triangle> triangles,
                                   std::span<const Vec3> normals) {
  std::vector<Vec3> of(triangles.size());
  for (std::size_t f = 0; f < of.size(); ++f) {
    const Triangle& t = triangles[f];
    of[f] = normalized(normals[t.v[0]] + normals[t.v[1]] + normals[t.v[2]]);
  }
  return of;
}

/// Where a point should go: onto the surface and, by `relax`, to the middle of its fan.
Vec3 wanted_place(const MovedMesh& mesh, std::size_t i, Vec3 foot, Vec3 n, float relax) {
  Vec3 middle, own;
  float weight = 0;
  for (const std::uint32_t f : mesh.fans.of(i)) {
    const Triangle& t = mesh.triangles[f];
    const Vec3 a = area_normal(mesh.points, t);
    const float area = length(a);
    own = own + a;
    middle =
        middle + (mesh.points[t.v[0]] + mesh.points[t.v[1]] + mesh.points[t.v[2]]) * (area / 3);
    weight += area;
  }
  const Vec3 p = mesh.points[i];
  const bool sees = dot(own, n) > 0;
  if (!(relax > 0 && weight > 0)) {
    // What lies on the surface but for rounding stays, and need not be measured again.
    const bool is_there = length(foot - p) <= 4e-6f * length(p);
    return sees && !is_there ? foot : p;
  }
  // Onto the plane there, not to the foot itself: many points have their feet on the same ridge.
  const Vec3 way = middle / weight - p, along = (way - n * dot(way, n)) * relax;
  return sees ? p + along - n * dot(p - foot, n) : p + along;
}

void judge(const MovedMesh& mesh, std::span<const std::uint32_t> faces, const CarryTarget& target,
           std::vector<Judgement>& judgements) {
  parallel_for(
      static_cast<std::int64_t>(faces.size()),
      [&](std::int64_t i) {
        const Triangle& t = mesh.triangles[faces[i]];
        Judgement& of = judgements[faces[i]];
        of = judge(mesh.points[t.v[0]], mesh.points[t.v[1]], mesh.points[t.v[2]], target,
                   of.nearest);
      },
      256);
}

/// Moves a point that is stuck: far from the surface, or at a triangle that is nearly inverted.
/// What is tried is judged by the surface's normals there, which at rims and in grooves are others
/// than those where the point is.
void free_point(const MovedMesh& mesh, const CarryTarget& target,
                std::span<const Judgement> judgements, std::uint32_t v, float far, float bad) {
  constexpr float kWanted = 0.25f;
  std::vector<Vec3>& points = mesh.points;
  const std::span<const std::uint32_t> fan = mesh.fans.of(v);
  const MeshQuery query = target.query();
  const std::uint32_t hint = judgements[fan.front()].nearest;
  const auto score_at = [&](Vec3 at) {
    float least = 1, lacking = 0;
    const float off = query.closest(at, hint).distance;
    for (const std::uint32_t f : fan) {
      const Triangle& t = mesh.triangles[f];
      Vec3 p[3];
      for (int k = 0; k < 3; ++k) p[k] = t.v[k] == v ? at : points[t.v[k]];
      const Vec3 normal = judge(p[0], p[1], p[2], target, judgements[f].nearest).normal;
      const float shape = shape_of(p[0], p[1], p[2], normal);
      least = std::min(least, shape);
      lacking += std::max(kWanted - shape, 0.0f);
    }
    const float excess = std::max(off / far - 1, 0.0f) * 0.5f;
    return std::pair(lacking + excess, least < bad || excess > 0);
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
  const Vec3 middle = sum / static_cast<float>(ring.size()), foot = query.closest(from, hint).point,
             below = query.closest(middle, hint).point;
  std::vector<Vec3> tries = {foot,
                             below,
                             middle,
                             lerp(from, foot, 0.5f),
                             lerp(from, below, 0.5f),
                             lerp(from, middle, 0.5f),
                             lerp(foot, below, 0.5f)};
  for (const Vec3 p : ring) tries.push_back(lerp(from, p, 0.4f));
  for (const Vec3 to : tries) {
    const float score = score_at(to).first;
    if (score < best) best = score, points[v] = to;
  }
}

/// Adds `rings` of points around those in a list, and sorts it.
void widen(std::vector<std::uint32_t>& points, const MovedMesh& mesh, int rings) {
  for (int r = 0;; ++r) {
    std::sort(points.begin(), points.end());
    points.erase(std::unique(points.begin(), points.end()), points.end());
    if (r == rings) return;
    const std::size_t n = points.size();
    for (std::size_t i = 0; i < n; ++i)
      for (const std::uint32_t f : mesh.fans.of(points[i]))
        for (const std::uint32_t v : mesh.triangles[f].v) points.push_back(v);
  }
}

/// The triangles around points, sorted.
std::vector<std::uint32_t> faces_around(std::span<const std::uint32_t> points, const Fans& fans) {
  std::vector<std::uint32_t> faces;
  for (const std::uint32_t v : points)
    faces.insert(faces.end(), fans.of(v).begin(), fans.of(v).end());
  std::sort(faces.begin(), faces.end());
  faces.erase(std::unique(faces.begin(), faces.end()), faces.end());
  return faces;
}

}  // namespace

Footprint footprint(std::span<const Vec3> points, const CarryTarget& target,
                    std::vector<std::uint32_t>& near) {
  Footprint foot;
  foot.points.resize(points.size());
  foot.normals.resize(points.size());
  const std::vector<ClosestPoint> hits = target.query().closest(points, near);
  for (std::size_t i = 0; i < hits.size(); ++i) {
    foot.points[i] = hits[i].point;
    foot.normals[i] = normal_at(target.surface, hits[i]);
  }
  return foot;
}

float shape_of(Vec3 a, Vec3 b, Vec3 c, Vec3 normal) {
  const Vec3 ab = b - a, ac = c - a, bc = c - b;
  const float edges = dot(ab, ab) + dot(ac, ac) + dot(bc, bc);
  return edges > 0 ? 3.4641016f * dot(cross(ab, ac), normal) / edges : 0.0f;
}

void sweep(const MovedMesh& mesh, const CarryTarget& target, float relax,
           std::vector<std::uint32_t>& near) {
  constexpr int kInner = 5;
  const Footprint foot = footprint(mesh.points, target, near);
  const std::vector<Vec3> normals = triangle_normals(mesh.triangles, foot.normals);
  Mover mover{mesh, normals};
  for (int k = 0; k < (relax > 0 ? kInner : 1); ++k)
    for (std::uint32_t i = 0; i < mesh.points.size(); ++i)
      mover.move(i, wanted_place(mesh, i, foot.points[i], foot.normals[i], relax));
}

void repair(const MovedMesh& mesh, const CarryTarget& target, float far,
            std::span<const std::uint32_t> near, std::span<const std::uint32_t> seeds) {
  constexpr int kTries = 30, kSeeded = 6, kInner = 5, kRings = 3;
  constexpr float kBad = 0.05f;
  std::vector<Judgement> judgements(mesh.triangles.size());
  std::vector<std::uint32_t> faces(mesh.triangles.size()), active;
  std::iota(faces.begin(), faces.end(), 0u);
  for (const std::uint32_t f : faces)
    if (const std::uint32_t v = mesh.triangles[f].v[0]; v < near.size())
      judgements[f].nearest = near[v];
  for (int k = 0;; ++k) {
    judge(mesh, faces, target, judgements);
    std::vector<std::uint32_t> stuck;
    for (const std::uint32_t f : faces) {
      const Triangle& t = mesh.triangles[f];
      const float shape = shape_of(mesh.points[t.v[0]], mesh.points[t.v[1]], mesh.points[t.v[2]],
                                   judgements[f].normal);
      if (shape < kBad || judgements[f].distance > far) stuck.insert(stuck.end(), t.v, t.v + 3);
    }
    if ((stuck.empty() && (seeds.empty() || k >= kSeeded)) || k == kTries) return;
    std::vector<std::uint32_t> ring = stuck;
    if (k == 0)
      for (const std::uint32_t f : seeds)
        ring.insert(ring.end(), mesh.triangles[f].v, mesh.triangles[f].v + 3);
    if (k % 4 == 0) {
      widen(ring, mesh, kRings);
      active.insert(active.end(), ring.begin(), ring.end());
      widen(active, mesh, 0);
      faces = faces_around(active, mesh.fans);
      judge(mesh, faces, target, judgements);
    }
    std::vector<Vec3> places, normals(mesh.triangles.size());
    std::vector<std::uint32_t> hints;
    for (const std::uint32_t v : active) {
      places.push_back(mesh.points[v]);
      hints.push_back(judgements[mesh.fans.of(v).front()].nearest);
    }
    const Footprint foot = footprint(places, target, hints);
    for (const std::uint32_t f : faces) normals[f] = judgements[f].normal;
    Mover mover{mesh, normals};
    for (int inner = 0; inner < kInner; ++inner)
      for (std::size_t i = 0; i < active.size(); ++i)
        mover.move(active[i],
                   wanted_place(mesh, active[i], foot.points[i], foot.normals[i], kRelax));
    widen(stuck, mesh, 0);
    for (const std::uint32_t v : stuck) free_point(mesh, target, judgements, v, far, kBad);
  }
}

void reach(const MovedMesh& mesh, const CarryTarget& target, std::vector<Deviation::Listed> misses,
           std::vector<std::uint32_t>& near) {
  std::stable_sort(misses.begin(), misses.end(),
                   [](const auto& a, const auto& b) { return a.distance > b.distance; });
  const Footprint foot = footprint(mesh.points, target, near);
  std::vector<std::uint8_t> done(mesh.points.size(), 0);
  const std::vector<Vec3> normals = triangle_normals(mesh.triangles, foot.normals);
  Mover mover{mesh, normals};
  for (const Deviation::Listed& miss : misses) {
    const Triangle& t = mesh.triangles[miss.triangle];
    std::uint32_t order[3] = {t.v[0], t.v[1], t.v[2]};
    std::sort(order, order + 3, [&](std::uint32_t a, std::uint32_t b) {
      return length(mesh.points[a] - miss.point) < length(mesh.points[b] - miss.point);
    });
    for (const std::uint32_t v : order) {
      if (done[v]) break;
      if (mover.move(v, miss.point)) {
        done[v] = 1;
        break;
      }
    }
  }
}

}  // namespace polymorph
