#include "spheres/hubbard.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <queue>
#include <tuple>
#include <unordered_set>

#include "base/parallel.h"
#include "base/random.h"
#include "mesh/sample_surface.h"
#include "spheres/delaunay.h"

namespace polymorph {
namespace {

constexpr std::uint32_t kNone = 0xffffffffu;
// How many of the nearest clusters a cluster without neighbours may be merged with.
constexpr std::size_t kNearest = 8;
// Leaves no smaller than this share of the model's diagonal, for samples that nothing else covers.
constexpr double kMinRadius = 1e-4;
// Merges that cost this share of the diagonal more than the cheapest are as good: balls around one
// centre, as of a sphere, are not sorted by rounding errors.
constexpr double kTolerance = 1e-5;

/// A ball centre and the samples that its ball has to reach.
struct Cluster {
  Vec3d center;
  double clearance = 0;               ///< distance from the centre to the nearest sample
  double radius = 0;                  ///< to the furthest of `points`
  std::vector<std::uint32_t> points;  ///< each sample belongs to one living cluster
  std::array<std::uint32_t, 2> merged{kNone, kNone};
};

/// A pair that may be merged and what that costs: at least, if clusters of it were merged since.
struct Merge {
  double cost;
  std::uint32_t a, b;                                      ///< a < b
  friend bool operator<(const Merge& x, const Merge& y) {  // the cheapest on top of a heap
    return std::tie(x.cost, x.a, x.b) > std::tie(y.cost, y.a, y.b);
  }
};

class Merger {
 public:
  Merger(std::vector<Vec3d> points, double tolerance)
      : points_(std::move(points)), tolerance_(tolerance) {}

  std::uint32_t add(Vec3d center, double clearance) {
    clusters_.push_back({center, clearance, clearance, {}, {kNone, kNone}});
    into_.push_back(static_cast<std::uint32_t>(into_.size()));
    ++alive_;
    return into_.back();
  }
  void give(std::uint32_t cluster, std::uint32_t point) {
    clusters_[cluster].points.push_back(point);
    clusters_[cluster].radius =
        std::max(clusters_[cluster].radius, length(points_[point] - clusters_[cluster].center));
  }
  /// The pairs (a < b) that may be merged.
  void start(std::vector<std::array<std::uint32_t, 2>> pairs);
  /// Merges until `count` clusters are left (or one).
  void merge_down_to(std::size_t count);

  bool alive(std::uint32_t cluster) const { return into_[cluster] == cluster; }
  const std::vector<Cluster>& clusters() const { return clusters_; }
  const std::vector<Vec3d>& points() const { return points_; }

 private:
  Cluster merged(std::uint32_t a, std::uint32_t b) const;
  std::uint32_t find(std::uint32_t cluster);
  void join_nearest();

  std::vector<Vec3d> points_;
  double tolerance_;
  std::vector<Cluster> clusters_;
  std::vector<std::uint32_t> into_;  ///< what a cluster was merged into; itself while it lives
  std::priority_queue<Merge> heap_;
  std::unordered_set<std::uint64_t> judged_;  ///< pairs in the heap with their true cost
  std::size_t alive_ = 0;
};

/// How far a ball stands out above the surface at most: nothing is nearer to its centre than the
/// clearance.
double overhang(const Cluster& c) { return c.radius - c.clearance; }

/// The two as one: around the centre of either, whichever stands out less.
Cluster Merger::merged(std::uint32_t a, std::uint32_t b) const {
  Cluster best;
  double smallest = INFINITY;
  for (const auto& [mine, other] : {std::pair(a, b), std::pair(b, a)}) {
    const Cluster& c = clusters_[mine];
    double radius2 = c.radius * c.radius;
    for (const std::uint32_t i : clusters_[other].points) {
      const Vec3d r = points_[i] - c.center;
      radius2 = std::max(radius2, dot(r, r));
    }
    const Cluster grown{c.center, c.clearance, std::sqrt(radius2), {}, {a, b}};
    if (overhang(grown) < smallest) {
      smallest = overhang(grown);
      best = grown;
    }
  }
  return best;
}

std::uint32_t Merger::find(std::uint32_t cluster) {
  while (into_[cluster] != cluster) {
    into_[cluster] = into_[into_[cluster]];
    cluster = into_[cluster];
  }
  return cluster;
}

void Merger::start(std::vector<std::array<std::uint32_t, 2>> pairs) {
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  for (const auto& [a, b] : pairs) heap_.push({overhang(merged(a, b)), a, b});
}

/// The graph has run dry: each living cluster may be merged with the nearest others.
void Merger::join_nearest() {
  std::vector<std::uint32_t> living;
  for (std::uint32_t i = 0; i < clusters_.size(); ++i)
    if (alive(i)) living.push_back(i);
  std::vector<std::array<std::uint32_t, 2>> pairs;
  std::vector<std::pair<double, std::uint32_t>> others;
  for (const std::uint32_t a : living) {
    others.clear();
    for (const std::uint32_t b : living)
      if (a != b)
        others.emplace_back(length(clusters_[a].center - clusters_[b].center) + clusters_[b].radius,
                            b);
    const std::size_t count = std::min(kNearest, others.size());
    std::partial_sort(others.begin(), others.begin() + static_cast<std::ptrdiff_t>(count),
                      others.end());
    for (std::size_t k = 0; k < count; ++k)
      pairs.push_back({std::min(a, others[k].second), std::max(a, others[k].second)});
  }
  start(std::move(pairs));
}

void Merger::merge_down_to(std::size_t count) {
  while (alive_ > std::max<std::size_t>(count, 1)) {
    if (heap_.empty()) join_nearest();
    const Merge next = heap_.top();
    heap_.pop();
    const std::uint32_t a = std::min(find(next.a), find(next.b)),
                        b = std::max(find(next.a), find(next.b));
    if (a == b) continue;
    // What was judged before its clusters grew is judged now, and once for all pairs that have
    // become the same.
    const bool stale = a != next.a || b != next.b;
    if (stale && judged_.contains(static_cast<std::uint64_t>(a) << 32 | b)) continue;
    Cluster cluster = merged(a, b);
    if (stale && !heap_.empty() && overhang(cluster) > heap_.top().cost + tolerance_) {
      judged_.insert(static_cast<std::uint64_t>(a) << 32 | b);
      heap_.push({overhang(cluster), a, b});
      continue;
    }
    std::merge(clusters_[a].points.begin(), clusters_[a].points.end(), clusters_[b].points.begin(),
               clusters_[b].points.end(), std::back_inserter(cluster.points));
    clusters_[a].points = {};
    clusters_[b].points = {};
    const auto self = static_cast<std::uint32_t>(clusters_.size());
    clusters_.push_back(std::move(cluster));
    into_.push_back(self);
    into_[a] = into_[b] = self;
    --alive_;
  }
}

/// Each sample belongs to the largest ball inside that it forms, its pole; a sample without one, as
/// on parts thinner than the samples are apart, to a ball of no radius.
Merger make_clusters(const std::vector<Tetrahedron>& tetrahedra,
                     const std::vector<std::uint8_t>& inside, std::vector<Vec3d> points,
                     double tolerance) {
  std::vector<std::uint32_t> pole(points.size(), kNone);
  for (std::uint32_t t = 0; t < tetrahedra.size(); ++t) {
    if (!inside[t]) continue;
    for (const std::uint32_t i : tetrahedra[t].points)
      if (pole[i] == kNone || tetrahedra[t].radius > tetrahedra[pole[i]].radius) pole[i] = t;
  }
  Merger merger(std::move(points), tolerance);
  std::vector<std::uint32_t> cluster_of(tetrahedra.size(), kNone), owner(pole.size());
  for (std::uint32_t i = 0; i < pole.size(); ++i) {
    if (pole[i] == kNone) {
      owner[i] = merger.add(merger.points()[i], 0);
    } else {
      std::uint32_t& cluster = cluster_of[pole[i]];
      if (cluster == kNone)
        cluster = merger.add(tetrahedra[pole[i]].center, tetrahedra[pole[i]].radius);
      owner[i] = cluster;
    }
    merger.give(owner[i], i);
  }
  // Neighbours: balls that are so in the diagram, and balls of samples that are so.
  std::vector<std::array<std::uint32_t, 2>> pairs;
  const auto join = [&](std::uint32_t a, std::uint32_t b) {
    if (a != b && a != kNone && b != kNone) pairs.push_back({std::min(a, b), std::max(a, b)});
  };
  for (std::size_t t = 0; t < tetrahedra.size(); ++t) {
    for (const std::uint32_t n : tetrahedra[t].neighbors)
      if (n != kNone && n > t) join(cluster_of[t], cluster_of[n]);
    // Outside, samples without a pole have no other neighbours, and would stay alone to the end.
    const auto& p = tetrahedra[t].points;
    for (std::size_t i = 0; i < 4; ++i)
      for (std::size_t j = i + 1; j < 4; ++j)
        if (inside[t] || pole[p[i]] == kNone || pole[p[j]] == kNone) join(owner[p[i]], owner[p[j]]);
  }
  merger.start(std::move(pairs));
  return merger;
}

Sphere rounded_sphere(const Cluster& cluster, double min_radius) {
  return {to_float(cluster.center), static_cast<float>(std::max(cluster.radius, min_radius))};
}

/// A sample is kept by the leaf in which it lies deepest; each leaf shrinks to what it keeps. A few
/// rounds; every one leaves all samples covered. Gives the leaf that keeps each sample.
std::vector<std::uint32_t> shrink_to_samples(std::vector<Sphere>& leaves,
                                             std::span<const Vec3d> points) {
  constexpr int kRounds = 4;
  std::vector<std::uint32_t> owner(points.size());
  std::vector<double> distance(points.size());
  for (int round = 0; round < kRounds; ++round) {
    parallel_for(
        static_cast<std::int64_t>(points.size()),
        [&](std::int64_t i) {
          const auto k = static_cast<std::size_t>(i);
          double best = INFINITY;
          for (std::size_t s = 0; s < leaves.size(); ++s) {
            const double d = length(points[k] - Vec3d(leaves[s].center));
            const double depth = d - static_cast<double>(leaves[s].radius);
            if (depth >= best) continue;
            best = depth;
            owner[k] = static_cast<std::uint32_t>(s);
            distance[k] = d;
          }
        },
        64);
    std::vector<double> reach(leaves.size(), 0);
    for (std::size_t i = 0; i < points.size(); ++i)
      reach[owner[i]] = std::max(reach[owner[i]], distance[i]);
    // What keeps nothing covers nothing alone: left as it is.
    for (std::size_t s = 0; s < leaves.size(); ++s)
      if (reach[s] > 0) leaves[s].radius = std::nextafter(static_cast<float>(reach[s]), INFINITY);
  }
  return owner;
}

/// The merged clusters from the root down to those that lived at the budget; `owner` says which
/// leaf keeps each sample.
SphereTree tree_of(const Merger& merger, const std::vector<std::uint32_t>& leaf_clusters,
                   const std::vector<Sphere>& leaf_spheres, const std::vector<std::uint32_t>& owner,
                   double min_radius) {
  const std::vector<Cluster>& clusters = merger.clusters();
  std::vector<std::uint32_t> leaf_of(clusters.size(), kNone);
  for (std::uint32_t i = 0; i < leaf_clusters.size(); ++i) leaf_of[leaf_clusters[i]] = i;
  std::vector<std::int32_t> node_of(leaf_clusters.size(), -1);
  SphereTree tree;
  std::vector<std::pair<std::uint32_t, std::int32_t>> waiting{
      {static_cast<std::uint32_t>(clusters.size() - 1), -1}};
  while (!waiting.empty()) {
    const auto [c, parent] = waiting.back();
    waiting.pop_back();
    SphereNode node;
    node.parent = parent;
    node.level =
        parent < 0
            ? std::int16_t{0}
            : static_cast<std::int16_t>(tree.nodes[static_cast<std::size_t>(parent)].level + 1);
    node.leaf = leaf_of[c] != kNone;
    node.sphere = node.leaf ? leaf_spheres[leaf_of[c]] : rounded_sphere(clusters[c], min_radius);
    const auto self = static_cast<std::int32_t>(tree.nodes.size());
    if (node.leaf) node_of[leaf_of[c]] = self;
    tree.nodes.push_back(node);
    if (!node.leaf)
      for (const std::uint32_t child : {clusters[c].merged[1], clusters[c].merged[0]})
        waiting.emplace_back(child, self);
  }
  // A sample may have gone over to another branch's leaf: that branch covers it, too.
  for (std::size_t i = 0; i < owner.size(); ++i)
    for (std::int32_t n = node_of[owner[i]]; n >= 0;
         n = tree.nodes[static_cast<std::size_t>(n)].parent) {
      Sphere& sphere = tree.nodes[static_cast<std::size_t>(n)].sphere;
      const double reach = length(merger.points()[i] - Vec3d(sphere.center));
      if (reach > static_cast<double>(sphere.radius))
        sphere.radius = std::nextafter(static_cast<float>(reach), INFINITY);
    }
  return tree;
}

Error no_ball_inside(const Model& model, int samples) {
  return make_error(
      ErrorCode::kInput,
      "model \"{}\": none of the Voronoi balls of {} surface samples lies inside it (it is open, "
      "flat, or thinner than the samples are apart) - close or solidify it, thicken it, or take "
      "another sphere method",
      model.name, samples);
}

}  // namespace

int hubbard_samples(int spheres) { return std::clamp(16 * spheres, 4000, 40000); }

Result<SphereTree> hubbard_spheres(const Model& model, const InsideTest& test,
                                   const HubbardSettings& settings) {
  PM_CHECK(settings.spheres >= 1);
  const int count = settings.samples > 0 ? settings.samples : hubbard_samples(settings.spheres);
  const std::vector<SurfaceSample> samples =
      sample_surface(model, static_cast<std::size_t>(count), settings.seed);
  const double diagonal = static_cast<double>(model.box().diagonal());
  std::vector<Vec3d> points, moved;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    points.emplace_back(samples[i].point);
    // Samples of flat sides lie in one plane, which the diagram cannot take; a ten-millionth of the
    // size is far below what the samples resolve.
    const auto shift = [&](std::uint64_t axis) {
      return (static_cast<double>(random_float(settings.seed, 3 + axis, i)) - 0.5) * 2e-7 *
             diagonal;
    };
    moved.push_back(points.back() + Vec3d(shift(0), shift(1), shift(2)));
  }
  if (points.size() < 5) return no_ball_inside(model, count);
  auto triangulated = delaunay_tetrahedra(moved);
  if (!triangulated)
    return make_error(ErrorCode::kInput, "model \"{}\": {} - take another sphere method",
                      model.name, triangulated.error().message);
  const std::vector<Tetrahedron>& tetrahedra = *triangulated;
  std::vector<Vec3> centers;
  for (const Tetrahedron& t : tetrahedra) centers.push_back(to_float(t.center));
  const std::vector<std::uint8_t> inside = test.inside(centers);
  if (std::find(inside.begin(), inside.end(), 1) == inside.end())
    return no_ball_inside(model, count);

  const double min_radius = kMinRadius * diagonal;
  Merger merger = make_clusters(tetrahedra, inside, points, kTolerance * diagonal);
  merger.merge_down_to(static_cast<std::size_t>(settings.spheres));
  std::vector<std::uint32_t> leaf_clusters;
  std::vector<Sphere> spheres;
  for (std::uint32_t i = 0; i < merger.clusters().size(); ++i)
    if (merger.alive(i)) {
      leaf_clusters.push_back(i);
      spheres.push_back(rounded_sphere(merger.clusters()[i], min_radius));
    }
  const std::vector<std::uint32_t> owner = shrink_to_samples(spheres, points);
  for (Sphere& s : spheres) s.radius = std::max(s.radius, static_cast<float>(min_radius));
  merger.merge_down_to(1);
  return tree_of(merger, leaf_clusters, spheres, owner, min_radius);
}

}  // namespace polymorph
