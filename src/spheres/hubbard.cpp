#include "spheres/hubbard.h"

#include <algorithm>
#include <array>
#include <cmath>
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
// If no pairs are left to merge, each cluster is paired with this many of its nearest clusters.
constexpr std::size_t kNearest = 8;
// Minimum radius of a leaf relative to the model's diagonal.
constexpr double kMinRadius = 1e-4;
// Merges whose cost exceeds the lowest by less than this fraction of the diagonal count as equal,
// so that rounding errors do not order balls around a common centre, as in a sphere.
constexpr double kTolerance = 1e-5;

/// A ball centre and the samples that its ball must contain.
struct Cluster {
  Vec3d center;
  double clearance = 0;               ///< distance from the centre to the nearest sample
  double radius = 0;                  ///< distance to the furthest of `points`, at least clearance
  std::vector<std::uint32_t> points;  ///< each sample belongs to one active cluster
  /// The two clusters that it replaces; kNone for a ball of the diagram.
  std::array<std::uint32_t, 2> merged{kNone, kNone};
};

/// A pair of clusters that may be merged. If one of them has been merged since, the cost is only a
/// lower bound of the cost of merging the clusters that now contain them.
struct Merge {
  double cost;         ///< bound_overhang() of the merged cluster
  std::uint32_t a, b;  ///< a < b
  friend bool operator<(const Merge& x, const Merge& y) {  // makes the cheapest the top of a heap
    return std::tie(x.cost, x.a, x.b) > std::tie(y.cost, y.a, y.b);
  }
};

/// The clusters, as a forest of their merges, and a heap of the pairs that may be merged next.
class Merger {
 public:
  Merger(std::vector<Vec3d> points, double tolerance)
      : points_(std::move(points)), tolerance_(tolerance) {}

  /// Adds a cluster without samples; returns its index.
  std::uint32_t add(Vec3d center, double clearance) {
    clusters_.push_back({center, clearance, clearance, /*points=*/{}, {kNone, kNone}});
    parent_.push_back(static_cast<std::uint32_t>(parent_.size()));
    ++active_count_;
    return parent_.back();
  }
  void assign_sample(std::uint32_t cluster, std::uint32_t point) {
    clusters_[cluster].points.push_back(point);
    clusters_[cluster].radius =
        std::max(clusters_[cluster].radius, length(points_[point] - clusters_[cluster].center));
  }
  /// Adds pairs (a < b) that may be merged.
  void add_pairs(std::vector<std::array<std::uint32_t, 2>> pairs);
  /// Merges until `count` active clusters are left, but at least one.
  void merge_down_to(std::size_t count);

  /// Tests whether the cluster has not been merged into another one.
  bool is_active(std::uint32_t cluster) const { return parent_[cluster] == cluster; }
  const std::vector<Cluster>& clusters() const { return clusters_; }
  const std::vector<Vec3d>& points() const { return points_; }

 private:
  Cluster merge(std::uint32_t a, std::uint32_t b) const;
  /// Returns the active cluster that contains `cluster`.
  std::uint32_t find_root(std::uint32_t cluster);
  void add_nearest_pairs();

  std::vector<Vec3d> points_;
  double tolerance_;
  std::vector<Cluster> clusters_;
  /// Per cluster, the cluster that it was merged into, or itself while it is active.
  std::vector<std::uint32_t> parent_;
  std::priority_queue<Merge> heap_;
  /// Pairs (a << 32 | b) in the heap with their exact cost.
  std::unordered_set<std::uint64_t> exact_pairs_;
  std::size_t active_count_ = 0;
};

/// Computes an upper bound of the distance by which a ball protrudes from the surface, which is no
/// nearer to its centre than the clearance.
double bound_overhang(const Cluster& c) { return c.radius - c.clearance; }

/// Merges two clusters around the centre of the one whose ball protrudes less. The result has no
/// points yet: merge_down_to() adds them if it accepts the merge.
Cluster Merger::merge(std::uint32_t a, std::uint32_t b) const {
  Cluster best;
  double smallest = INFINITY;
  for (const auto& [centered, other] : {std::pair(a, b), std::pair(b, a)}) {
    const Cluster& c = clusters_[centered];
    double radius2 = c.radius * c.radius;
    for (const std::uint32_t i : clusters_[other].points) {
      const Vec3d r = points_[i] - c.center;
      radius2 = std::max(radius2, dot(r, r));
    }
    const Cluster candidate{c.center, c.clearance, std::sqrt(radius2), /*points=*/{}, {a, b}};
    if (bound_overhang(candidate) < smallest) {
      smallest = bound_overhang(candidate);
      best = candidate;
    }
  }
  return best;
}

std::uint32_t Merger::find_root(std::uint32_t cluster) {
  while (parent_[cluster] != cluster) {
    parent_[cluster] = parent_[parent_[cluster]];
    cluster = parent_[cluster];
  }
  return cluster;
}

void Merger::add_pairs(std::vector<std::array<std::uint32_t, 2>> pairs) {
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  for (const auto& [a, b] : pairs) heap_.push({bound_overhang(merge(a, b)), a, b});
}

/// Adds pairs when the heap is empty: each active cluster with its nearest others.
void Merger::add_nearest_pairs() {
  std::vector<std::uint32_t> active;
  for (std::uint32_t i = 0; i < clusters_.size(); ++i)
    if (is_active(i)) active.push_back(i);
  std::vector<std::array<std::uint32_t, 2>> pairs;
  std::vector<std::pair<double, std::uint32_t>> others;  // distance to the far end of a ball
  for (const std::uint32_t a : active) {
    others.clear();
    for (const std::uint32_t b : active)
      if (a != b)
        others.emplace_back(length(clusters_[a].center - clusters_[b].center) + clusters_[b].radius,
                            b);
    const std::size_t count = std::min(kNearest, others.size());
    std::partial_sort(others.begin(), others.begin() + static_cast<std::ptrdiff_t>(count),
                      others.end());
    for (std::size_t k = 0; k < count; ++k)
      pairs.push_back({std::min(a, others[k].second), std::max(a, others[k].second)});
  }
  add_pairs(std::move(pairs));
}

void Merger::merge_down_to(std::size_t count) {
  while (active_count_ > std::max<std::size_t>(count, 1)) {
    if (heap_.empty()) add_nearest_pairs();
    const Merge next = heap_.top();
    heap_.pop();
    const std::uint32_t a = std::min(find_root(next.a), find_root(next.b)),
                        b = std::max(find_root(next.a), find_root(next.b));
    if (a == b) continue;
    // A pair whose clusters were merged since is evaluated again, once for all pairs that have
    // become equal.
    const bool is_outdated = a != next.a || b != next.b;
    if (is_outdated && exact_pairs_.contains(static_cast<std::uint64_t>(a) << 32 | b)) continue;
    Cluster cluster = merge(a, b);
    if (is_outdated && !heap_.empty() && bound_overhang(cluster) > heap_.top().cost + tolerance_) {
      exact_pairs_.insert(static_cast<std::uint64_t>(a) << 32 | b);
      heap_.push({bound_overhang(cluster), a, b});
      continue;
    }
    std::merge(clusters_[a].points.begin(), clusters_[a].points.end(), clusters_[b].points.begin(),
               clusters_[b].points.end(), std::back_inserter(cluster.points));
    clusters_[a].points = {};
    clusters_[b].points = {};
    const auto index = static_cast<std::uint32_t>(clusters_.size());
    clusters_.push_back(std::move(cluster));
    parent_.push_back(index);
    parent_[a] = parent_[b] = index;
    --active_count_;
  }
}

/// Assigns each sample to its pole, the largest ball inside the model that touches it. A sample
/// without a pole, as on parts thinner than the samples' spacing, gets a ball of radius 0.
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
  std::vector<std::uint32_t> cluster_index(tetrahedra.size(), kNone), owner(pole.size());
  for (std::uint32_t i = 0; i < pole.size(); ++i) {
    if (pole[i] == kNone) {
      owner[i] = merger.add(merger.points()[i], 0);
    } else {
      std::uint32_t& cluster = cluster_index[pole[i]];
      if (cluster == kNone)
        cluster = merger.add(tetrahedra[pole[i]].center, tetrahedra[pole[i]].radius);
      owner[i] = cluster;
    }
    merger.assign_sample(owner[i], i);
  }
  // Pairs are balls that are adjacent in the diagram, and balls of adjacent samples.
  std::vector<std::array<std::uint32_t, 2>> pairs;
  const auto add_pair = [&](std::uint32_t a, std::uint32_t b) {
    if (a != b && a != kNone && b != kNone) pairs.push_back({std::min(a, b), std::max(a, b)});
  };
  for (std::size_t t = 0; t < tetrahedra.size(); ++t) {
    for (const std::uint32_t n : tetrahedra[t].neighbors)
      if (n != kNone && n > t) add_pair(cluster_index[t], cluster_index[n]);
    // Outside the model only samples without a pole are paired: they have no other neighbours.
    const auto& p = tetrahedra[t].points;
    for (std::size_t i = 0; i < 4; ++i)
      for (std::size_t j = i + 1; j < 4; ++j)
        if (inside[t] || pole[p[i]] == kNone || pole[p[j]] == kNone)
          add_pair(owner[p[i]], owner[p[j]]);
  }
  merger.add_pairs(std::move(pairs));
  return merger;
}

Sphere make_sphere(const Cluster& cluster, double min_radius) {
  return {to_float(cluster.center), static_cast<float>(std::max(cluster.radius, min_radius))};
}

/// Shrinks the leaves: a sample is assigned to the leaf in which it lies deepest, and each leaf
/// shrinks to its samples, in a few rounds that keep all samples covered. Returns the leaf of each
/// sample.
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
          double smallest = INFINITY;
          for (std::size_t s = 0; s < leaves.size(); ++s) {
            const double d = length(points[k] - Vec3d(leaves[s].center));
            const double signed_distance = d - static_cast<double>(leaves[s].radius);
            if (signed_distance >= smallest) continue;
            smallest = signed_distance;
            owner[k] = static_cast<std::uint32_t>(s);
            distance[k] = d;
          }
        },
        /*grain=*/64);
    std::vector<double> radius(leaves.size(), 0);
    for (std::size_t i = 0; i < points.size(); ++i)
      radius[owner[i]] = std::max(radius[owner[i]], distance[i]);
    // A leaf without samples stays unchanged.
    for (std::size_t s = 0; s < leaves.size(); ++s)
      if (radius[s] > 0) leaves[s].radius = std::nextafter(static_cast<float>(radius[s]), INFINITY);
  }
  return owner;
}

/// Makes the tree of the merged clusters from the root down to `leaf_clusters`, whose spheres are
/// `leaf_spheres`. `owner`: the index of the leaf of each sample.
SphereTree make_tree(const Merger& merger, const std::vector<std::uint32_t>& leaf_clusters,
                     const std::vector<Sphere>& leaf_spheres,
                     const std::vector<std::uint32_t>& owner, double min_radius) {
  const std::vector<Cluster>& clusters = merger.clusters();
  std::vector<std::uint32_t> leaf_index(clusters.size(), kNone);
  for (std::uint32_t i = 0; i < leaf_clusters.size(); ++i) leaf_index[leaf_clusters[i]] = i;
  std::vector<std::int32_t> node_index(leaf_clusters.size(), -1);
  SphereTree tree;
  std::vector<std::pair<std::uint32_t, std::int32_t>> stack{
      {static_cast<std::uint32_t>(clusters.size() - 1), -1}};
  while (!stack.empty()) {
    const auto [c, parent] = stack.back();
    stack.pop_back();
    SphereNode node;
    node.parent = parent;
    node.level =
        parent < 0
            ? std::int16_t{0}
            : static_cast<std::int16_t>(tree.nodes[static_cast<std::size_t>(parent)].level + 1);
    node.leaf = leaf_index[c] != kNone;
    node.sphere = node.leaf ? leaf_spheres[leaf_index[c]] : make_sphere(clusters[c], min_radius);
    const auto index = static_cast<std::int32_t>(tree.nodes.size());
    if (node.leaf) node_index[leaf_index[c]] = index;
    tree.nodes.push_back(node);
    if (!node.leaf)
      for (const std::uint32_t child : {clusters[c].merged[1], clusters[c].merged[0]})
        stack.emplace_back(child, index);
  }
  // shrink_to_samples() may have assigned a sample to a leaf of another branch, which must then
  // cover the sample too.
  for (std::size_t i = 0; i < owner.size(); ++i)
    for (std::int32_t n = node_index[owner[i]]; n >= 0;
         n = tree.nodes[static_cast<std::size_t>(n)].parent) {
      Sphere& sphere = tree.nodes[static_cast<std::size_t>(n)].sphere;
      const double distance_to_center = length(merger.points()[i] - Vec3d(sphere.center));
      if (distance_to_center > static_cast<double>(sphere.radius))
        sphere.radius = std::nextafter(static_cast<float>(distance_to_center), INFINITY);
    }
  return tree;
}

Error make_no_ball_error(const Model& model, int samples) {
  return make_error(
      ErrorCode::kInput,
      "model \"{}\": none of the Voronoi balls of {} surface samples lies inside it (it is open, "
      "flat, or thinner than the samples are apart) - close or solidify it, thicken it, or take "
      "another sphere method",
      model.name, samples);
}

}  // namespace

int choose_hubbard_samples(int spheres) { return std::clamp(16 * spheres, 4000, 40000); }

Result<SphereTree> build_hubbard_tree(const Model& model, const InsideTest& test,
                                      const HubbardSettings& settings) {
  PM_CHECK(settings.spheres >= 1);
  const int count =
      settings.samples > 0 ? settings.samples : choose_hubbard_samples(settings.spheres);
  const std::vector<SurfaceSample> samples =
      sample_surface(model, static_cast<std::size_t>(count), settings.seed);
  const double diagonal = static_cast<double>(model.box().diagonal());
  // The vertices of the samples' Voronoi diagram are the centres of the Delaunay spheres.
  std::vector<Vec3d> points, jittered;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    points.emplace_back(samples[i].point);
    // Samples of flat sides are coplanar, which the diagram does not permit; an offset of 1e-7 of
    // the size is well below the samples' resolution.
    const auto shift = [&](std::uint64_t axis) {  // sample_surface() uses the streams 0 to 2
      return (static_cast<double>(random_float(settings.seed, 3 + axis, i)) - 0.5) * 2e-7 *
             diagonal;
    };
    jittered.push_back(points.back() + Vec3d(shift(0), shift(1), shift(2)));
  }
  if (points.size() < 5) return make_no_ball_error(model, count);
  auto triangulated = delaunay_tetrahedra(jittered);
  if (!triangulated)
    return make_error(ErrorCode::kInput, "model \"{}\": {} - take another sphere method",
                      model.name, triangulated.error().message);
  const std::vector<Tetrahedron>& tetrahedra = *triangulated;
  std::vector<Vec3> centers;
  for (const Tetrahedron& t : tetrahedra) centers.push_back(to_float(t.center));
  const std::vector<std::uint8_t> inside = test.inside(centers);
  if (std::find(inside.begin(), inside.end(), 1) == inside.end())
    return make_no_ball_error(model, count);
  // Merge to the leaves, shrink these to the samples, and merge the clusters on to a single root.
  const double min_radius = kMinRadius * diagonal;
  Merger merger = make_clusters(tetrahedra, inside, points, kTolerance * diagonal);
  merger.merge_down_to(static_cast<std::size_t>(settings.spheres));
  std::vector<std::uint32_t> leaf_clusters;
  std::vector<Sphere> spheres;
  for (std::uint32_t i = 0; i < merger.clusters().size(); ++i)
    if (merger.is_active(i)) {
      leaf_clusters.push_back(i);
      spheres.push_back(make_sphere(merger.clusters()[i], min_radius));
    }
  const std::vector<std::uint32_t> owner = shrink_to_samples(spheres, points);
  for (Sphere& s : spheres) s.radius = std::max(s.radius, static_cast<float>(min_radius));
  merger.merge_down_to(1);
  return make_tree(merger, leaf_clusters, spheres, owner, min_radius);
}

}  // namespace polymorph
