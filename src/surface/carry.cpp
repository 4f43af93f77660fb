#include "surface/carry.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>

#include "base/log.h"
#include "base/parallel.h"
#include "surface/lay_patch.h"

namespace polymorph {
namespace {

/// What no move may make a triangle worse than: see shape_of().
constexpr float kMinShape = 0.1f;
/// How far a point goes towards the middle of its fan in one move.
constexpr float kRelax = 0.5f;
/// How many cells a surface may be from where the flow leads, before a step is halved.
constexpr float kMaxStep = 0.7f;

Vec3 area_normal(std::span<const Vec3> points, const Triangle& t) {
  return cross(points[t.v[1]] - points[t.v[0]], points[t.v[2]] - points[t.v[0]]);
}

float longest_edge(std::span<const Vec3> points, const Triangle& t) {
  return std::max({length(points[t.v[1]] - points[t.v[0]]), length(points[t.v[2]] - points[t.v[1]]),
                   length(points[t.v[0]] - points[t.v[2]])});
}

/// The triangles around each point.
class Fans {
 public:
  Fans() = default;
  Fans(std::size_t points, std::span<const Triangle> triangles) : first_(points + 1, 0) {
    for (const Triangle& t : triangles)
      for (const std::uint32_t v : t.v) ++first_[v + 1];
    std::partial_sum(first_.begin(), first_.end(), first_.begin());
    list_.resize(3 * triangles.size());
    std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
    for (std::uint32_t t = 0; t < triangles.size(); ++t)
      for (const std::uint32_t v : triangles[t].v) list_[next[v]++] = t;
  }
  std::span<const std::uint32_t> of(std::size_t point) const {
    return {list_.data() + first_[point], list_.data() + first_[point + 1]};
  }
  std::size_t size() const { return first_.empty() ? 0 : first_.size() - 1; }

 private:
  std::vector<std::uint32_t> first_, list_;
};

/// What the surface has nearest to each point.
struct Footprint {
  std::vector<Vec3> points, normals;
};

Vec3 normal_at(const Mesh& surface, const ClosestPoint& hit) {
  const Triangle& t = surface.triangles[hit.triangle];
  const TriangleWeights w = closest_on_triangle(
      hit.point, surface.positions[t.v[0]], surface.positions[t.v[1]], surface.positions[t.v[2]]);
  return normalized(surface.normals[t.v[0]] * static_cast<float>(w.a) +
                    surface.normals[t.v[1]] * static_cast<float>(w.b) +
                    surface.normals[t.v[2]] * static_cast<float>(w.c));
}

Footprint footprint(std::span<const Vec3> points, const CarryTarget& target) {
  Footprint foot;
  foot.points.resize(points.size());
  foot.normals.resize(points.size());
  const std::vector<ClosestPoint> hits = target.closest->closest(points);
  parallel_for(
      static_cast<std::int64_t>(points.size()),
      [&](std::int64_t i) {
        foot.points[i] = hits[i].point;
        foot.normals[i] = normal_at(target.surface, hits[i]);
      },
      1024);
  return foot;
}

/// 1: equilateral and parallel to the surface; 0: without area or upright on it; negative:
/// inverted.
float shape_of(Vec3 a, Vec3 b, Vec3 c, Vec3 normal) {
  const Vec3 ab = b - a, ac = c - a, bc = c - b;
  const float edges = dot(ab, ab) + dot(ac, ac) + dot(bc, bc);
  return edges > 0 ? 3.4641016f * dot(cross(ab, ac), normal) / edges : 0.0f;
}

/// The surface's normals where the middles of triangles are nearest to it.
Vec3 mean_normal(std::span<const Vec3> normals, const Triangle& t) {
  return normalized(normals[t.v[0]] + normals[t.v[1]] + normals[t.v[2]]);
}

/// How a triangle lies to the surface, at what is nearest to its middle.
struct Judgement {
  Vec3 normal;  ///< of the surface: the smooth one or that of the face, which is further off
  float distance = 0;
};
Judgement judge(Vec3 a, Vec3 b, Vec3 c, const CarryTarget& target) {
  const ClosestPoint hit = target.closest->closest((a + b + c) / 3);
  const Vec3 smooth = normal_at(target.surface, hit),
             flat = normalized(
                 area_normal(target.surface.positions, target.surface.triangles[hit.triangle]));
  const Vec3 own = cross(b - a, c - a);
  return {dot(own, flat) < dot(own, smooth) ? flat : smooth, hit.distance};
}

struct Mover {
  std::vector<Vec3>& points;
  std::span<const Triangle> triangles;
  const Fans& fans;
  std::span<const Vec3> normals;  ///< the surface's, of each triangle

  float worst(std::uint32_t v, Vec3 at) const {
    float least = 1;
    for (const std::uint32_t f : fans.of(v)) {
      const Triangle& t = triangles[f];
      const int k = t.v[0] == v ? 0 : t.v[1] == v ? 1 : 2;
      least = std::min(
          least, shape_of(at, points[t.v[(k + 1) % 3]], points[t.v[(k + 2) % 3]], normals[f]));
    }
    return least;
  }
  /// Goes as far towards `to` as no triangle gets worse than it may be. Whether it moved.
  bool move(std::uint32_t v, Vec3 to) {
    const Vec3 from = points[v];
    const float before = std::min(worst(v, from), kMinShape);
    for (float share = 1; share > 0.1f; share *= 0.5f) {
      const Vec3 at = lerp(from, to, share);
      if (worst(v, at) >= before) {
        points[v] = at;
        return true;
      }
    }
    return false;
  }
};

std::vector<Vec3> triangle_normals(std::span<const Triangle> triangles,
                                   std::span<const Vec3> normals) {
  std::vector<Vec3> of(triangles.size());
  for (std::size_t f = 0; f < of.size(); ++f) of[f] = mean_normal(normals, triangles[f]);
  return of;
}

/// Where a point should go: onto the surface and, by `relax`, to the middle of its fan.
Vec3 wanted_place(std::span<const Vec3> points, std::span<const Triangle> triangles,
                  const Fans& fans, std::size_t i, Vec3 foot, Vec3 n, float relax) {
  Vec3 middle, own;
  float weight = 0;
  for (const std::uint32_t f : fans.of(i)) {
    const Triangle& t = triangles[f];
    const Vec3 a = area_normal(points, t);
    const float area = length(a);
    own = own + a;
    middle = middle + (points[t.v[0]] + points[t.v[1]] + points[t.v[2]]) * (area / 3);
    weight += area;
  }
  const Vec3 p = points[i];
  const bool sees = dot(own, n) > 0;
  if (!(relax > 0 && weight > 0)) return sees ? foot : p;
  // Onto the plane there, not to the foot itself: many points have their feet on the same ridge.
  const Vec3 way = middle / weight - p, along = (way - n * dot(way, n)) * relax;
  return sees ? p + along - n * dot(p - foot, n) : p + along;
}

/// One sweep over all points.
void sweep(std::vector<Vec3>& points, std::span<const Triangle> triangles, const Fans& fans,
           const CarryTarget& target, float relax) {
  constexpr int kInner = 5;
  const Footprint foot = footprint(points, target);
  const std::vector<Vec3> normals = triangle_normals(triangles, foot.normals);
  Mover mover{points, triangles, fans, normals};
  for (int k = 0; k < (relax > 0 ? kInner : 1); ++k)
    for (std::uint32_t i = 0; i < points.size(); ++i)
      mover.move(i,
                 wanted_place(points, triangles, fans, i, foot.points[i], foot.normals[i], relax));
}

void judge(std::span<const Vec3> points, std::span<const Triangle> triangles,
           std::span<const std::uint32_t> faces, const CarryTarget& target,
           std::vector<Judgement>& judgements) {
  parallel_for(
      static_cast<std::int64_t>(faces.size()),
      [&](std::int64_t i) {
        const Triangle& t = triangles[faces[i]];
        judgements[faces[i]] = judge(points[t.v[0]], points[t.v[1]], points[t.v[2]], target);
      },
      256);
}

/// Moves a point that is stuck: far from the surface, or at a triangle that is nearly inverted.
/// What is tried is judged by the surface's normals there, which at rims and in grooves are others
/// than those where the point is.
void free_point(std::vector<Vec3>& points, std::span<const Triangle> triangles, const Fans& fans,
                const CarryTarget& target, std::uint32_t v, float far, float bad) {
  constexpr float kWanted = 0.25f;
  const auto score_at = [&](Vec3 at) {
    float least = 1, lacking = 0;
    const float off = target.closest->closest(at).distance;
    for (const std::uint32_t f : fans.of(v)) {
      const Triangle& t = triangles[f];
      Vec3 p[3];
      for (int k = 0; k < 3; ++k) p[k] = t.v[k] == v ? at : points[t.v[k]];
      const float shape = shape_of(p[0], p[1], p[2], judge(p[0], p[1], p[2], target).normal);
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
  for (const std::uint32_t f : fans.of(v))
    for (int k = 0; k < 3; ++k)
      if (triangles[f].v[k] == v) ring.push_back(points[triangles[f].v[(k + 1) % 3]]);
  for (const Vec3 p : ring) sum = sum + p;
  const Vec3 middle = sum / static_cast<float>(ring.size()),
             foot = target.closest->closest(from).point,
             below = target.closest->closest(middle).point;
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
void widen(std::vector<std::uint32_t>& points, std::span<const Triangle> triangles,
           const Fans& fans, int rings) {
  for (int r = 0;; ++r) {
    std::sort(points.begin(), points.end());
    points.erase(std::unique(points.begin(), points.end()), points.end());
    if (r == rings) return;
    const std::size_t n = points.size();
    for (std::size_t i = 0; i < n; ++i)
      for (const std::uint32_t f : fans.of(points[i]))
        for (const std::uint32_t v : triangles[f].v) points.push_back(v);
  }
}

/// Sweeps around triangles that are inverted, nearly so or further than `far` from the surface,
/// until none is, and some times around `seeds`. How many are still inverted.
std::size_t repair(std::vector<Vec3>& points, std::span<const Triangle> triangles, const Fans& fans,
                   const CarryTarget& target, float far,
                   std::span<const std::uint32_t> seeds = {}) {
  constexpr int kTries = 30, kSeeded = 6, kInner = 5, kRings = 3;
  constexpr float kBad = 0.05f;
  std::vector<Judgement> judgements(triangles.size());
  std::vector<std::uint32_t> faces(triangles.size()), active;
  std::iota(faces.begin(), faces.end(), 0u);
  for (int k = 0;; ++k) {
    judge(points, triangles, faces, target, judgements);
    std::vector<std::uint32_t> ring;
    std::size_t inverted = 0;
    for (const std::uint32_t f : faces) {
      const Triangle& t = triangles[f];
      const float shape =
          shape_of(points[t.v[0]], points[t.v[1]], points[t.v[2]], judgements[f].normal);
      inverted += !(shape > 0);
      if (shape < kBad || judgements[f].distance > far) ring.insert(ring.end(), t.v, t.v + 3);
    }
    if ((ring.empty() && (seeds.empty() || k >= kSeeded)) || k == kTries) return inverted;
    if (k == 0)
      for (const std::uint32_t f : seeds)
        ring.insert(ring.end(), triangles[f].v, triangles[f].v + 3);
    if (k % 4 == 0) {
      widen(ring, triangles, fans, kRings);
      active.insert(active.end(), ring.begin(), ring.end());
      widen(active, triangles, fans, 0);
      faces.clear();
      for (const std::uint32_t v : active)
        for (const std::uint32_t f : fans.of(v)) faces.push_back(f);
      std::sort(faces.begin(), faces.end());
      faces.erase(std::unique(faces.begin(), faces.end()), faces.end());
      judge(points, triangles, faces, target, judgements);
    }
    std::vector<Vec3> places;
    for (const std::uint32_t v : active) places.push_back(points[v]);
    const Footprint foot = footprint(places, target);
    std::vector<Vec3> normals(triangles.size());
    for (const std::uint32_t f : faces) normals[f] = judgements[f].normal;
    Mover mover{points, triangles, fans, normals};
    for (int inner = 0; inner < kInner; ++inner)
      for (std::size_t i = 0; i < active.size(); ++i)
        mover.move(active[i], wanted_place(points, triangles, fans, active[i], foot.points[i],
                                           foot.normals[i], kRelax));
    for (const std::uint32_t v : active) free_point(points, triangles, fans, target, v, far, kBad);
  }
}

struct Samples {
  std::vector<Vec3> points;
  std::vector<std::uint32_t> triangle;
};
/// Corners, and middles of edges and faces.
Samples samples_of(std::span<const Vec3> points, std::span<const Triangle> triangles) {
  Samples s;
  for (std::uint32_t f = 0; f < triangles.size(); ++f) {
    const Triangle& t = triangles[f];
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t a = t.v[k], b = t.v[(k + 1) % 3];
      if (a < b) {  // each edge of a closed mesh once
        s.points.push_back((points[a] + points[b]) * 0.5f);
        s.triangle.push_back(f);
      }
    }
    s.points.push_back((points[t.v[0]] + points[t.v[1]] + points[t.v[2]]) / 3);
    s.triangle.push_back(f);
  }
  for (std::uint32_t v = 0; v < points.size(); ++v) {
    s.points.push_back(points[v]);
    s.triangle.push_back(ClosestPoint::kNoTriangle);
  }
  return s;
}

struct Measured {
  CarryFault fault;
  std::vector<float> of_triangle;  ///< how far each triangle is off
  /// Of the surface, what is too far from the mesh, and the triangle of the mesh nearest to it.
  struct Miss {
    Vec3 point;
    float distance;
    std::uint32_t triangle;
  };
  std::vector<Miss> misses;
  std::vector<std::uint32_t> inverted;  ///< triangles
  std::vector<std::uint32_t> nearest;   ///< of each triangle of the surface: triangle of the mesh
};

Measured measure(std::span<const Vec3> points, std::span<const Triangle> triangles,
                 const CarryTarget& target, float miss) {
  Measured m;
  m.of_triangle.assign(triangles.size(), 0);
  const auto add = [&](Vec3 at, float distance, std::uint32_t triangle) {
    if (distance > m.fault.distance) m.fault.distance = distance, m.fault.place = at;
    if (triangle < triangles.size())
      m.of_triangle[triangle] = std::max(m.of_triangle[triangle], distance);
  };
  const Samples own = samples_of(points, triangles);
  const std::vector<ClosestPoint> out = target.closest->closest(own.points);
  for (std::size_t i = 0; i < out.size(); ++i) add(own.points[i], out[i].distance, own.triangle[i]);
  const Samples theirs = samples_of(target.surface.positions, target.surface.triangles);
  const std::vector<ClosestPoint> in = ClosestPointQuery(points, triangles).closest(theirs.points);
  for (std::size_t i = 0; i < in.size(); ++i) {
    add(theirs.points[i], in[i].distance, in[i].triangle);
    if (in[i].distance > miss)
      m.misses.push_back({theirs.points[i], in[i].distance, in[i].triangle});
  }
  std::size_t at = 0;
  for (const Triangle& t : target.surface.triangles) {
    for (int k = 0; k < 3; ++k) at += t.v[k] < t.v[(k + 1) % 3];
    m.nearest.push_back(in[at++].triangle);
  }
  at = 0;
  for (std::uint32_t f = 0; f < triangles.size(); ++f) {
    const Triangle& t = triangles[f];
    for (int k = 0; k < 3; ++k) at += t.v[k] < t.v[(k + 1) % 3];
    const ClosestPoint& hit = out[at++];
    const Vec3 n = area_normal(target.surface.positions, target.surface.triangles[hit.triangle]);
    if (dot(area_normal(points, t), n) > 0) continue;
    if (m.fault.inverted++ == 0) m.fault.inverted_place = hit.point;
    m.inverted.push_back(f);
  }
  return m;
}

/// Draws the mesh's points towards what they miss: corners and ridges, to which no projection
/// leads.
void reach(std::vector<Vec3>& points, std::span<const Triangle> triangles, const Fans& fans,
           const CarryTarget& target, std::vector<Measured::Miss> misses) {
  std::stable_sort(misses.begin(), misses.end(),
                   [](const auto& a, const auto& b) { return a.distance > b.distance; });
  const Footprint foot = footprint(points, target);
  std::vector<std::uint8_t> done(points.size(), 0);
  const std::vector<Vec3> normals = triangle_normals(triangles, foot.normals);
  Mover mover{points, triangles, fans, normals};
  for (const Measured::Miss& miss : misses) {
    const Triangle& t = triangles[miss.triangle];
    std::uint32_t order[3] = {t.v[0], t.v[1], t.v[2]};
    std::sort(order, order + 3, [&](std::uint32_t a, std::uint32_t b) {
      return length(points[a] - miss.point) < length(points[b] - miss.point);
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

using Edge = std::pair<std::uint32_t, std::uint32_t>;
Edge edge_of(std::uint32_t a, std::uint32_t b) { return {std::min(a, b), std::max(a, b)}; }

/// The meshes of several moments, all of the same triangles.
class Carrier {
 public:
  Carrier(const MovingSurface& surface, std::span<const float> moments,
          const CarrySettings& settings)
      : surface_(surface), moments_(moments), settings_(settings), points_(moments.size()) {}

  Status run(std::size_t start);
  Result<CarriedMesh> result();

 private:
  Status advance(std::vector<Vec3>& points, float from, float to, const CarryTarget& target,
                 int depth);
  Measured place(std::vector<Vec3>& points, const CarryTarget& target, int steps);
  void lay(std::vector<Vec3>& points, const CarryTarget& target, Measured& m);
  CarryFault mend(std::vector<Vec3>& points, const CarryTarget& target);
  void finish(std::size_t k, const CarryTarget& target);
  void divide(const std::vector<std::uint32_t>& chosen, const std::vector<Vec3> by);

  const MovingSurface& surface_;
  std::span<const float> moments_;
  CarrySettings settings_;
  std::vector<Triangle> triangles_;
  Fans fans_;
  std::vector<std::vector<Vec3>> points_;
  std::vector<float> residual_;
};

Status Carrier::advance(std::vector<Vec3>& points, float from, float to, const CarryTarget& target,
                        int depth) {
  constexpr int kDepth = 5;
  PM_TRY(std::vector<Vec3> moved, surface_.flow(points, from, to));
  const Footprint foot = footprint(moved, target);
  float far = 0;
  for (std::size_t i = 0; i < moved.size(); ++i)
    far = std::max(far, length(foot.points[i] - moved[i]) - residual_[i]);
  const bool is_torn = std::any_of(triangles_.begin(), triangles_.end(), [&](const Triangle& t) {
    return !(shape_of(moved[t.v[0]], moved[t.v[1]], moved[t.v[2]], mean_normal(foot.normals, t)) >
             0);
  });
  if (depth < kDepth && (far > kMaxStep * settings_.cell || is_torn)) {
    const float middle = 0.5f * (from + to);
    PM_TRY(const CarryTarget half, surface_.at(middle));
    PM_TRY_STATUS(advance(points, from, middle, half, depth + 1));
    return advance(points, middle, to, target, depth + 1);
  }
  points = std::move(moved);
  for (int k = std::min(depth, 2); k < 3; ++k) sweep(points, triangles_, fans_, target, kRelax);
  repair(points, triangles_, fans_, target, 0.3f * settings_.cell);
  const std::vector<ClosestPoint> rest = target.closest->closest(points);
  for (std::size_t i = 0; i < rest.size(); ++i) residual_[i] = rest[i].distance;
  return Ok{};
}

void Carrier::divide(const std::vector<std::uint32_t>& chosen, const std::vector<Vec3> by) {
  // Longest edges, and those of the neighbours that are longer (Rivara 1984).
  std::map<Edge, std::array<std::uint32_t, 2>> beside;
  for (std::uint32_t f = 0; f < triangles_.size(); ++f)
    for (int k = 0; k < 3; ++k) {
      const Edge e = edge_of(triangles_[f].v[k], triangles_[f].v[(k + 1) % 3]);
      const auto [at, fresh] = beside.try_emplace(e, std::array<std::uint32_t, 2>{f, f});
      if (!fresh) at->second[1] = f;
    }
  const auto longest = [&](std::uint32_t f) {
    const Triangle& t = triangles_[f];
    Edge best;
    float most = -1;
    for (int k = 0; k < 3; ++k) {
      const Edge e = edge_of(t.v[k], t.v[(k + 1) % 3]);
      const float d = length(by[e.first] - by[e.second]);
      if (d > most) most = d, best = e;
    }
    return best;
  };
  std::map<Edge, std::uint32_t> middles;
  std::vector<Edge> order;
  std::vector<std::uint32_t> queue = chosen;
  const auto first_new = static_cast<std::uint32_t>(by.size());
  for (std::size_t q = 0; q < queue.size(); ++q) {
    const Edge e = longest(queue[q]);
    if (!middles.try_emplace(e, first_new + static_cast<std::uint32_t>(order.size())).second)
      continue;
    order.push_back(e);
    for (const std::uint32_t g : beside.at(e)) queue.push_back(g);
  }
  for (std::vector<Vec3>& points : points_)
    if (!points.empty())
      for (const Edge& e : order) points.push_back((points[e.first] + points[e.second]) * 0.5f);
  std::vector<Triangle> made;
  for (std::uint32_t f = 0; f < triangles_.size(); ++f) {
    const Triangle& t = triangles_[f];
    const auto middle = [&](std::uint32_t a, std::uint32_t b) -> std::optional<std::uint32_t> {
      const auto found = middles.find(edge_of(a, b));
      if (found == middles.end()) return std::nullopt;
      return found->second;
    };
    if (!middle(t.v[0], t.v[1]) && !middle(t.v[1], t.v[2]) && !middle(t.v[2], t.v[0])) {
      made.push_back(t);
      continue;
    }
    // Halved at the longest edge, and the halves at what they have of the others.
    const Edge e = longest(f);
    int k = 0;
    while (edge_of(t.v[k], t.v[(k + 1) % 3]) != e) ++k;
    const std::uint32_t a = t.v[k], b = t.v[(k + 1) % 3], c = t.v[(k + 2) % 3], m = *middle(a, b);
    const auto half = [&](std::uint32_t p, std::uint32_t q, std::uint32_t r) {
      // The edge pq may be divided; r is the middle of the longest.
      if (const auto n = middle(p, q)) {
        made.push_back({{r, p, *n}});
        made.push_back({{r, *n, q}});
      } else {
        made.push_back({{r, p, q}});
      }
    };
    half(b, c, m);
    half(c, a, m);
  }
  triangles_ = std::move(made);
}

bool is_better(const CarryFault& a, const CarryFault& b) {
  return a.inverted != b.inverted ? a.inverted < b.inverted : a.distance < b.distance;
}

/// Puts points onto the surface and towards what they miss.
Measured Carrier::place(std::vector<Vec3>& points, const CarryTarget& target, int steps) {
  const float enough = 0.7f * settings_.limit, miss = 0.4f * settings_.limit;
  Measured m;
  for (int step = 0;; ++step) {
    sweep(points, triangles_, fans_, target, 0.0f);
    m = measure(points, triangles_, target, miss);
    if (m.fault.distance < enough || step + 1 == steps) break;
    reach(points, triangles_, fans_, target, m.misses);
  }
  if (repair(points, triangles_, fans_, target, enough) > 0 || m.fault.inverted > 0)
    m = measure(points, triangles_, target, miss);
  return m;
}

/// Lays the patches around what is inverted or too far off, where that is better.
void Carrier::lay(std::vector<Vec3>& points, const CarryTarget& target, Measured& m) {
  for (const int rings : {7, 12}) {
    std::vector<std::uint32_t> seeds = m.inverted;
    for (std::uint32_t f = 0; f < triangles_.size(); ++f)
      if (m.of_triangle[f] > settings_.limit) seeds.push_back(f);
    if (seeds.empty()) return;
    std::vector<Vec3> laid = points;
    if (lay_patches(laid, triangles_, seeds, rings, target.surface, *target.closest, m.nearest) ==
        0)
      continue;
    repair(laid, triangles_, fans_, target, 0.7f * settings_.limit, seeds);
    Measured after = measure(laid, triangles_, target, 0.4f * settings_.limit);
    if (is_better(after.fault, m.fault)) m = std::move(after), points = std::move(laid);
    if (m.fault.inverted == 0) return;
  }
}

/// Mends, without dividing any more, what the divisions of other moments brought up.
CarryFault Carrier::mend(std::vector<Vec3>& points, const CarryTarget& target) {
  constexpr int kTries = 6;
  const auto is_good = [&](const CarryFault& fault) {
    return fault.inverted == 0 && fault.distance <= settings_.limit;
  };
  const float miss = 0.4f * settings_.limit;
  // Points that other moments asked for lie on their edges still.
  Measured best = measure(points, triangles_, target, miss);
  std::vector<Vec3> tried = points;
  sweep(tried, triangles_, fans_, target, 0);
  Measured m = measure(tried, triangles_, target, miss);
  for (int k = 0;; ++k) {
    if (is_good(m.fault) || is_better(m.fault, best.fault)) best = m, points = tried;
    if (is_good(best.fault) || k == kTries) return best.fault;
    tried = points;
    m = best;
    if (k % 2 == 0) {
      // Around single triangles a few moves mostly do.
      repair(tried, triangles_, fans_, target, 0.7f * settings_.limit, m.inverted);
      m = measure(tried, triangles_, target, miss);
      if (m.fault.distance > settings_.limit) {
        reach(tried, triangles_, fans_, target, m.misses);
        m = measure(tried, triangles_, target, miss);
      }
    } else {
      lay(tried, target, m);
    }
  }
}

void Carrier::finish(std::size_t k, const CarryTarget& target) {
  constexpr int kRounds = 30;
  std::vector<std::uint32_t> coarse;
  CarryFault best;
  const float enough = 0.7f * settings_.limit, miss = 0.4f * settings_.limit;
  for (int round = 0;; ++round) {
    std::vector<Vec3>& points = points_[k];
    fans_ = Fans(points.size(), triangles_);
    const std::vector<Vec3> base = points;  // as good as the round before left it
    if (round > 0) repair(points, triangles_, fans_, target, enough, coarse);
    Measured m = place(points, target, round == 0 ? 3 : 2);
    lay(points, target, m);
    if (round > 0 && is_better(best, m.fault)) {
      // Neither relaxing nor laying helped here; reaching alone may.
      std::vector<Vec3> reached = base;
      Measured after = place(reached, target, 2);
      if (is_better(after.fault, m.fault)) m = std::move(after), points = std::move(reached);
    }
    best = m.fault;
    coarse.clear();
    for (std::uint32_t f = 0; f < triangles_.size(); ++f)
      if (m.of_triangle[f] > enough &&
          longest_edge(points, triangles_[f]) > 1.5f * m.of_triangle[f])
        coarse.push_back(f);
    log_debug("moment {}, round {}: {} triangles, {:.2f} of the limit, {} inverted, {} to divide",
              k, round, triangles_.size(), m.fault.distance / settings_.limit, m.fault.inverted,
              coarse.size());
    const bool is_good = m.fault.distance < 0.9f * settings_.limit && m.fault.inverted == 0;
    if (is_good || round == kRounds ||
        triangles_.size() + 2 * coarse.size() > settings_.max_triangles)
      break;
    for (int again = 0; again < 3 && !coarse.empty(); ++again) {
      const std::size_t old = points_[k].size();
      divide(coarse, points_[k]);
      coarse.clear();
      for (std::uint32_t f = 0; f < triangles_.size(); ++f) {
        const Triangle& t = triangles_[f];
        if ((t.v[0] >= old || t.v[1] >= old || t.v[2] >= old) &&
            longest_edge(points_[k], t) > 1.5f * settings_.cell)
          coarse.push_back(f);
      }
    }
    // Numbers of triangles change with the division: what was coarse is found by its points.
    coarse.clear();
    std::vector<std::uint8_t> is_new(points_[k].size(), 0);
    std::fill(is_new.begin() + static_cast<std::ptrdiff_t>(std::min(points.size(), fans_.size())),
              is_new.end(), 1);
    for (std::uint32_t f = 0; f < triangles_.size(); ++f)
      if (is_new[triangles_[f].v[0]] || is_new[triangles_[f].v[1]] || is_new[triangles_[f].v[2]])
        coarse.push_back(f);
  }
}

Status Carrier::run(std::size_t start) {
  PM_TRY(CarryTarget target, surface_.at(moments_[start]));
  triangles_ = target.surface.triangles;
  points_[start] = target.surface.positions;
  fans_ = Fans(points_[start].size(), triangles_);
  // Marching cubes leave slivers.
  for (int k = 0; k < 12; ++k) sweep(points_[start], triangles_, fans_, target, kRelax);
  finish(start, target);
  const auto go = [&](std::size_t from, std::size_t to) -> Status {
    residual_.assign(points_[from].size(), 0.0f);
    PM_TRY(const CarryTarget there, surface_.at(moments_[to]));
    std::vector<Vec3> points = points_[from];
    PM_TRY_STATUS(advance(points, moments_[from], moments_[to], there, 0));
    points_[to] = std::move(points);
    finish(to, there);
    return Ok{};
  };
  for (std::size_t k = start; k-- > 0;) PM_TRY_STATUS(go(k + 1, k));
  fans_ = Fans(points_[start].size(), triangles_);
  for (std::size_t k = start + 1; k < moments_.size(); ++k) PM_TRY_STATUS(go(k - 1, k));
  return Ok{};
}

Result<CarriedMesh> Carrier::result() {
  CarriedMesh carried;
  fans_ = Fans(points_.front().size(), triangles_);
  for (std::vector<Vec3>& points : points_) {
    PM_TRY(const CarryTarget target, surface_.at(moments_[carried.faults.size()]));
    carried.faults.push_back(mend(points, target));
  }
  carried.points = std::move(points_);
  carried.triangles = std::move(triangles_);
  return carried;
}

}  // namespace

CarryTarget make_carry_target(Mesh surface) {
  CarryTarget target;
  target.surface = std::move(surface);
  target.closest =
      std::make_shared<const ClosestPointQuery>(target.surface.positions, target.surface.triangles);
  return target;
}

CarryFault carry_fault(std::span<const Vec3> points, std::span<const Triangle> triangles,
                       const CarryTarget& target) {
  return measure(points, triangles, target, 1e30f).fault;
}

Result<CarriedMesh> carry(const MovingSurface& surface, std::span<const float> moments,
                          std::size_t start, const CarrySettings& settings) {
  Carrier carrier(surface, moments, settings);
  PM_TRY_STATUS(carrier.run(start));
  return carrier.result();
}

}  // namespace polymorph
