#include "morph/parts.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>

#include "base/exact_math.h"
#include "base/parallel.h"
#include "base/procrustes.h"
#include "base/result.h"
#include "morph/cost.h"
#include "morph/features.h"

namespace polymorph {
namespace {

/// Max number of clusters, min mean number of pairs per cluster, number of neighbours that each
/// ball is linked to, and number of solves of BallGraph::join_balls().
constexpr std::size_t kMaxClusters = 8;
constexpr std::size_t kMinMeanPairs = 12;
constexpr std::size_t kNeighbors = 8;
constexpr int kSolves = 3;
/// Weight of a ball's position by its part, relative to the weight of an edge. It is small because
/// a limb that kept to the straight path of its part would be torn off.
constexpr double kAnchor = 0.01;

/// Fits a similarity to the pairs `members`. Where they do not determine the rotation, the plan's
/// alignment does. A rotation has several rotation vectors; the one nearest to `reference_turn` is
/// taken.
Alignment fit_part(const MorphPlan& plan, const std::vector<std::uint32_t>& members,
                   Vec3d reference_turn) {
  const PairMoments moments = pair_moments(members.size(), [&](std::size_t i) {
    const Pair& pair = plan.pairs[members[i]];
    return WeightedPair{Vec3d(plan.from[pair.from].center), Vec3d(plan.to[pair.to].center),
                        pair.mass};
  });
  Alignment fit;
  fit.from_center = moments.from_center;
  fit.to_center = moments.to_center;
  Mat3 sum = moments.covariance;
  const double from_square = moments.from_square, to_square = moments.to_square;
  // The points of a straight limb do not determine its rotation about its own axis. The whole
  // object's rotation, added with a small weight, does.
  constexpr double kAlignmentWeight = 1e-3;
  const double weight = kAlignmentWeight * std::sqrt(from_square * to_square) + 1e-30;  // > 0
  for (std::size_t k = 0; k < 9; ++k) sum.m[k] += weight * plan.alignment.rotation.m[k];
  fit.rotation = nearest_rotation(sum);
  fit.rotation_vector = log_rotation_near(fit.rotation, reference_turn);
  constexpr double kMaxScale = 4;
  fit.scale = from_square > 0 && to_square > 0
                  ? std::clamp(std::sqrt(to_square / from_square), 1 / kMaxScale, kMaxScale)
                  : plan.alignment.scale;
  return fit;
}

/// The part of each pair: one part per label that both balls have, and part 0 for other pairs.
/// Empty if there are fewer than two such labels or they hold no more than half of the mass.
std::vector<std::uint32_t> parts_by_label(const MorphPlan& plan) {
  if (plan.from_labels.empty() || plan.to_labels.empty()) return {};
  std::map<std::int32_t, std::uint32_t> parts;
  std::vector<std::uint32_t> part_of(plan.pairs.size(), 0);
  double labelled_mass = 0, total_mass = 0;
  for (std::size_t e = 0; e < plan.pairs.size(); ++e) {
    const Pair& pair = plan.pairs[e];
    const std::int32_t label = plan.from_labels[pair.from];
    total_mass += pair.mass;
    if (label == kNoLabel || label != plan.to_labels[pair.to]) continue;
    labelled_mass += pair.mass;
    part_of[e] = parts.emplace(label, static_cast<std::uint32_t>(parts.size() + 1)).first->second;
  }
  return parts.size() >= 2 && labelled_mass > 0.5 * total_mass ? part_of
                                                               : std::vector<std::uint32_t>{};
}

/// Clusters the pairs by their positions in both objects, which form a point in 6 dimensions:
/// k-means, seeded by farthest point sampling. The source is rotated by the alignment, and the
/// alignment's scale is divided between both objects.
std::vector<std::uint32_t> parts_by_position(const MorphPlan& plan) {
  const Alignment& alignment = plan.alignment;
  const std::size_t n = plan.pairs.size();
  struct Point {
    Vec3d p, q;
  };
  std::vector<Point> points;
  for (const Pair& pair : plan.pairs)
    points.push_back(
        {alignment.rotation * (Vec3d(plan.from[pair.from].center) - alignment.from_center) *
             std::sqrt(alignment.scale),
         (Vec3d(plan.to[pair.to].center) - alignment.to_center) *
             (1 / std::sqrt(alignment.scale))});
  const auto distance2 = [](const Point& a, const Point& b) {
    return dot(a.p - b.p, a.p - b.p) + dot(a.q - b.q, a.q - b.q);
  };
  const std::size_t count = std::clamp<std::size_t>(n / kMinMeanPairs, 1, kMaxClusters);
  // The first centre is the point farthest from the origin; each further centre is the point
  // farthest from the centres so far. The origin is only in the list for the first search.
  std::vector<Point> centers{{{}, {}}};
  for (std::size_t k = 0; k <= count; ++k) {
    std::size_t farthest = 0;
    double largest = -1;
    for (std::size_t e = 0; e < n; ++e) {
      double nearest = std::numeric_limits<double>::infinity();
      for (const Point& center : centers) nearest = std::min(nearest, distance2(points[e], center));
      // The margin lets ties go to the lower index despite rounding.
      if (nearest > largest * (1 + 1e-9)) largest = nearest, farthest = e;
    }
    if (k == 0) centers.clear();
    if (centers.size() < count) centers.push_back(points[farthest]);
  }
  std::vector<std::uint32_t> part_of(n, 0);
  // Ten rounds of Lloyd's algorithm: assign each point to its nearest centre, then average.
  for (int round = 0; round < 10; ++round) {
    for (std::size_t e = 0; e < n; ++e)
      for (std::uint32_t k = 0; k < centers.size(); ++k)
        if (distance2(points[e], centers[k]) < distance2(points[e], centers[part_of[e]]))
          part_of[e] = k;
    std::vector<Point> sums(centers.size());
    std::vector<double> masses(centers.size(), 0);
    for (std::size_t e = 0; e < n; ++e) {
      const double m = plan.pairs[e].mass;
      sums[part_of[e]].p = sums[part_of[e]].p + points[e].p * m;
      sums[part_of[e]].q = sums[part_of[e]].q + points[e].q * m;
      masses[part_of[e]] += m;
    }
    for (std::size_t k = 0; k < centers.size(); ++k)
      if (masses[k] > 0) centers[k] = {sums[k].p * (1 / masses[k]), sums[k].q * (1 / masses[k])};
  }
  return part_of;
}

/// A directed edge of the graph: the offset of one ball from a neighbour, in the source and in the
/// target. `to` is rotated and scaled back to the source; the lengths are those in the scene.
struct Edge {
  std::uint32_t other = 0;  ///< the neighbour's pair
  Vec3d from, to;
  double from_length = 0, to_length = 0;

  /// The target of the edge at eased time u, in the source's orientation. It has the direction of
  /// the mixture of both offsets; if these nearly cancel, it is the mixture itself.
  Vec3d target_at(double u) const {
    const Vec3d mixture = from * (1 - u) + to * u;
    const double target_length = (1 - u) * from_length + u * to_length,
                 mixture_length = length(mixture);
    return mixture_length > 1e-3 * target_length ? mixture * (target_length / mixture_length)
                                                 : mixture;
  }
};

}  // namespace

std::vector<std::uint32_t> parts_by_limb(const MorphPlan& plan) {
  if (plan.from_limbs.empty()) return {};
  std::vector<std::uint32_t> part_of;
  for (const Pair& pair : plan.pairs) {
    const std::int32_t limb = plan.from_limbs[pair.from];
    const bool is_within_limb = limb != kNoLabel && limb == plan.to_limbs[pair.to];
    part_of.push_back(is_within_limb ? static_cast<std::uint32_t>(limb) + 1 : 0);
  }
  return part_of;
}

struct BallGraph::System {
  std::vector<std::vector<Edge>>
      edges;  ///< the edges of each pair; every edge is listed in both directions
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver;
};

BallGraph::Links BallGraph::find_links(const MorphPlan& plan) {
  const std::size_t n = plan.pairs.size();
  std::vector<Vec3> from, to;
  for (const Pair& pair : plan.pairs) {
    from.push_back(plan.from[pair.from].center);
    to.push_back(plan.to[pair.to].center);
  }
  Links links;
  for (const auto& neighbors :
       {nearest_neighbors(from, kNeighbors), nearest_neighbors(to, kNeighbors)})
    for (std::uint32_t e = 0; e < n; ++e)
      for (const std::uint32_t f : neighbors[e]) {
        links.emplace_back(e, f);
        links.emplace_back(f, e);
      }
  std::sort(links.begin(), links.end());
  links.erase(std::unique(links.begin(), links.end()), links.end());
  return links;
}

BallGraph::BallGraph(const MorphPlan& plan, const RigidParts& parts)
    : BallGraph(plan, parts, find_links(plan)) {}

BallGraph::BallGraph(const MorphPlan& plan, const RigidParts& parts, const BallGraph& reference)
    : BallGraph(plan, parts, [&] {
        Links links;
        for (std::uint32_t e = 0; e < reference.system_->edges.size(); ++e)
          for (const Edge& edge : reference.system_->edges[e]) links.emplace_back(e, edge.other);
        return links;
      }()) {}

BallGraph::BallGraph(const MorphPlan& plan, const RigidParts& parts, const Links& links) {
  const std::size_t n = plan.pairs.size();
  auto system = std::make_unique<System>();
  system->edges.resize(n);
  // The matrix is the Laplacian of the graph, plus kAnchor on the diagonal.
  std::vector<Eigen::Triplet<double>> entries;
  for (const auto& [e, f] : links) {
    const Alignment& part = parts.alignments[parts.part_of[e]];
    Edge edge;
    edge.other = f;
    const Pair &pair_e = plan.pairs[e], &pair_f = plan.pairs[f];
    edge.from = Vec3d(plan.from[pair_e.from].center) - Vec3d(plan.from[pair_f.from].center);
    const Vec3d to_offset = Vec3d(plan.to[pair_e.to].center) - Vec3d(plan.to[pair_f.to].center);
    edge.from_length = length(edge.from);
    edge.to_length = length(to_offset);
    edge.to = transposed(part.rotation) * to_offset * (1 / part.scale);
    const auto row = static_cast<int>(e), column = static_cast<int>(f);
    entries.emplace_back(row, row, 1.0);
    entries.emplace_back(row, column, -1.0);
    system->edges[e].push_back(edge);
  }
  for (int e = 0; e < static_cast<int>(n); ++e) entries.emplace_back(e, e, kAnchor);
  Eigen::SparseMatrix<double> matrix(static_cast<Eigen::Index>(n), static_cast<Eigen::Index>(n));
  matrix.setFromTriplets(entries.begin(), entries.end());
  system->solver.compute(matrix);
  PM_CHECK(system->solver.info() == Eigen::Success);  // diagonally dominant
  system_ = std::move(system);
}

BallGraph::~BallGraph() = default;

std::vector<Vec3d> BallGraph::join_balls(std::span<const Vec3d> part_positions,
                                         std::span<const Mat3> part_rotations,
                                         std::span<const double> progress) const {
  const std::size_t n = system_->edges.size();
  PM_CHECK(part_positions.size() == n && part_rotations.size() == n && progress.size() == n);
  // Alternate between a solve for the positions and a fit of the balls' rotations.
  std::vector<Mat3> rotations(part_rotations.begin(), part_rotations.end());
  std::vector<Vec3d> positions(part_positions.begin(), part_positions.end());
  Eigen::MatrixXd right_hand_side(static_cast<Eigen::Index>(n), 3);
  // The edge's target, not yet rotated with ball e. Its u is the mean of both balls' u.
  const auto target_edge = [&](std::size_t e, const Edge& edge) {
    return edge.target_at((progress[e] + progress[edge.other]) / 2);
  };
  for (int round = 0; round < kSolves; ++round) {
    parallel_for(
        static_cast<std::int64_t>(n),
        [&](std::int64_t index) {
          const auto e = static_cast<std::size_t>(index);
          // The target of an edge is the mean of those seen from its two balls.
          Vec3d sum = part_positions[e] * kAnchor;
          for (const Edge& edge : system_->edges[e]) {
            const auto& neighbours = system_->edges[edge.other];
            const auto reverse_edge = std::lower_bound(
                neighbours.begin(), neighbours.end(), static_cast<std::uint32_t>(e),
                [](const Edge& edge_of_neighbour, std::uint32_t other) {
                  return edge_of_neighbour.other < other;
                });
            const Vec3d edge_sum = rotations[e] * target_edge(e, edge) -
                                   rotations[edge.other] * target_edge(edge.other, *reverse_edge);
            sum = sum + edge_sum * 0.5;
          }
          right_hand_side(index, 0) = sum.x;
          right_hand_side(index, 1) = sum.y;
          right_hand_side(index, 2) = sum.z;
        },
        /*grain=*/64);
    const Eigen::MatrixXd solution = system_->solver.solve(right_hand_side);
    for (std::size_t e = 0; e < n; ++e) {
      const auto row = static_cast<Eigen::Index>(e);
      positions[e] = {solution(row, 0), solution(row, 1), solution(row, 2)};
    }
    if (round + 1 == kSolves) break;
    parallel_for(
        static_cast<std::int64_t>(n),
        [&](std::int64_t index) {
          const auto e = static_cast<std::size_t>(index);
          Mat3 sum{{0, 0, 0, 0, 0, 0, 0, 0, 0}};
          double weight = 0;
          for (const Edge& edge : system_->edges[e]) {
            const Vec3d p = target_edge(e, edge), q = positions[e] - positions[edge.other];
            add_outer_product(sum, 1, q, p);
            weight += length(p) * length(q);
          }
          // The part's rotation, with a small weight, decides where the edges do not determine one.
          for (std::size_t k = 0; k < 9; ++k) sum.m[k] += 0.1 * weight * part_rotations[e].m[k];
          rotations[e] = nearest_rotation(sum);
        },
        /*grain=*/64);
  }
  return positions;
}

namespace {

/// Measures how much the parts stretch the object: the sum, over pairs of neighbours, of ln^2 of
/// their distance at u = 1/2 divided by the mean of their distances at both ends.
double measure_strain(const MorphPlan& plan, const RigidParts& parts) {
  // Positions and rotations of the balls half way by their parts alone.
  std::vector<Vec3d> positions;
  std::vector<Mat3> rotations;
  std::vector<Vec3> from;
  for (std::size_t e = 0; e < plan.pairs.size(); ++e) {
    const Alignment& part = parts.alignments[parts.part_of[e]];
    const Vec3d p = Vec3d(plan.from[plan.pairs[e].from].center) - part.from_center;
    const Vec3d q = Vec3d(plan.to[plan.pairs[e].to].center) - part.to_center;
    rotations.push_back(exp_rotation(part.rotation_vector * 0.5));
    positions.push_back((part.from_center + part.to_center) * 0.5 +
                        rotations.back() * (p + transposed(part.rotation) * q * (1 / part.scale)) *
                            (0.5 * std::sqrt(part.scale)));
    from.push_back(plan.from[plan.pairs[e].from].center);
  }
  const std::vector<double> half_progress(positions.size(), 0.5);
  const std::vector<Vec3d> joined_positions =
      BallGraph(plan, parts).join_balls(positions, rotations, half_progress);
  const auto neighbors = nearest_neighbors(from, kNeighbors);
  double sum = 0;
  for (std::size_t e = 0; e < joined_positions.size(); ++e)
    for (const std::uint32_t f : neighbors[e]) {
      const auto center_distance = [&](const std::vector<Ball>& balls, std::uint32_t i,
                                       std::uint32_t k) {
        return length(Vec3d(balls[i].center) - Vec3d(balls[k].center));
      };
      const double mean_distance =
          0.5 * (center_distance(plan.from, plan.pairs[e].from, plan.pairs[f].from) +
                 center_distance(plan.to, plan.pairs[e].to, plan.pairs[f].to));
      const double distance = length(joined_positions[e] - joined_positions[f]);
      // Coincident balls are left out: the logarithm would be unbounded.
      if (mean_distance > 1e-3 * plan.size && distance > 1e-6 * plan.size) {
        const double strain = exact::log(distance / mean_distance);
        sum += strain * strain;
      }
    }
  return sum;
}

/// Lists the pairs of each of `count` parts.
std::vector<std::vector<std::uint32_t>> list_members(const std::vector<std::uint32_t>& part_of,
                                                     std::size_t count) {
  std::vector<std::vector<std::uint32_t>> members(count);
  for (std::uint32_t e = 0; e < part_of.size(); ++e) members[part_of[e]].push_back(e);
  return members;
}

/// Fits the alignments of the parts. If `first_is_whole`, part 0 has the alignment of the whole
/// object.
RigidParts make_rigid_parts(const MorphPlan& plan, std::vector<std::uint32_t> part_of,
                            bool first_is_whole) {
  RigidParts parts;
  parts.part_of = std::move(part_of);
  const std::uint32_t count = *std::max_element(parts.part_of.begin(), parts.part_of.end()) + 1;
  const auto members = list_members(parts.part_of, count);
  for (std::uint32_t k = 0; k < count; ++k)
    parts.alignments.push_back(members[k].empty() || (first_is_whole && k == 0)
                                   ? plan.alignment
                                   : fit_part(plan, members[k], plan.alignment.rotation_vector));
  return parts;
}

bool is_equal(const Alignment& a, const Alignment& b) {
  return std::equal(std::begin(a.rotation.m), std::end(a.rotation.m), b.rotation.m) &&
         a.scale == b.scale && length(a.from_center - b.from_center) == 0 &&
         length(a.to_center - b.to_center) == 0;
}

}  // namespace

RigidParts rigid_parts(const MorphPlan& plan) {
  if (std::vector<std::uint32_t> by_label = parts_by_label(plan); !by_label.empty())
    return make_rigid_parts(plan, std::move(by_label), /*first_is_whole=*/true);
  if (std::vector<std::uint32_t> by_limb = parts_by_limb(plan); !by_limb.empty())
    return make_rigid_parts(plan, std::move(by_limb), /*first_is_whole=*/true);
  RigidParts one_part = make_rigid_parts(plan, std::vector<std::uint32_t>(plan.pairs.size(), 0),
                                         /*first_is_whole=*/true);
  RigidParts clusters = make_rigid_parts(plan, parts_by_position(plan), /*first_is_whole=*/false);
  return measure_strain(plan, clusters) < measure_strain(plan, one_part) ? clusters : one_part;
}

RigidParts refit_parts(const MorphPlan& plan, const MorphPlan& reference) {
  RigidParts parts;
  for (const BallPath& path : reference.paths->balls) parts.part_of.push_back(path.part);
  if (!reference.graph) {  // one part, with the plan's alignment or a mere translation
    Alignment translation;
    translation.from_center = plan.alignment.from_center;
    translation.to_center = plan.alignment.to_center;
    parts.alignments = {is_equal(reference.parts[0], reference.alignment) ? plan.alignment
                                                                          : translation};
    return parts;
  }
  const auto members = list_members(parts.part_of, reference.parts.size());
  for (std::size_t k = 0; k < members.size(); ++k)
    parts.alignments.push_back(
        is_equal(reference.parts[k], reference.alignment)
            ? plan.alignment
            : fit_part(plan, members[k], reference.parts[k].rotation_vector));
  return parts;
}

}  // namespace polymorph
