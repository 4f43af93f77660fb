#include "mesh/inside.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <optional>

#include "base/parallel.h"
#include "base/result.h"
#include "kernels/linear.h"
#include "mesh/four_doubles.h"
#include "mesh/solid_angle.h"
#include "mesh/vertex_clustering.h"

namespace polymorph {
namespace {

constexpr std::uint32_t kLeafTriangles = AngleSums::kLanes;
// Points further than beta times a node's radius use its expansion (Barill et al. 2018, section 4,
// which advises 2).
constexpr double kBeta = 2;
/// Multiplicities of triangles (ClusteredMesh) are limited to 20 binary digits.
constexpr std::uint32_t kMaxDigits = 20, kMaxMultiplicity = (1u << kMaxDigits) - 1;

struct Node {
  Vec3d center;              ///< area-weighted centroid
  double far_distance2 = 0;  ///< (beta * radius)^2
  std::uint32_t skip = 0;    ///< the node that follows this node's subtree
  std::uint32_t count = 0;   ///< number of triangles of a leaf, else 0
  std::uint32_t leaf = 0;    ///< index in Tree::leaves, if count > 0
  std::uint32_t first = 0;   ///< first index in Tree::triangles
};

struct NodeBox {
  Vec3d low, high;
};

/// Moments of the area vectors of a node's triangles.
struct Moments {
  Vec3d dipole;  ///< sum of area vectors
  /// Components xx, yy, zz of M and yz, zx, xy of M + M^T. M is the sum of n m^T over the
  /// triangles; n is a triangle's area vector, m its centroid relative to the node's centre.
  Vec3d diagonal, off_diagonal;
  double trace = 0;  ///< trace of M
};

constexpr int kMaxQueries = 4;  ///< lanes of QueryPoints

/// Query points: points whose winding numbers are computed at the same time.
struct QueryPoints {
  FourDoubles x = {}, y = {}, z = {};  ///< positions in the frame of the tree, one per lane
  int count = 0;                       ///< number of lanes that are used
};

FourIntegers broadcast_integer(std::int64_t a) { return FourIntegers{a, a, a, a}; }

/// Multiplicities of a leaf's triangles.
struct LeafDigits {
  std::uint32_t first_mask = 0;  ///< index in Tree::masks of the mask of the lowest digit
  std::uint32_t count = 0;       ///< binary digits of the multiplicities; one mask per digit
};

}  // namespace

struct InsideTest::Tree {
  // Transform from model coordinates to a frame in which the model's box has a diagonal of 1,
  // rotated so that the ray of the parity rule is +z.
  Vec3d origin;
  double scale = 1;
  std::array<Vec3d, 3> axis{Vec3d(1, 0, 0), Vec3d(0, 1, 0), Vec3d(0, 0, 1)};
  std::vector<Vec3d> points;
  std::vector<Triangle> triangles;      ///< sorted by leaf
  std::vector<Node> nodes;              ///< depth first
  std::vector<Moments> moments;         ///< one per node
  std::vector<NodeBox> boxes;           ///< one per node
  std::vector<LeafDigits> leaf_digits;  ///< one per leaf, if triangles have multiplicities
  /// Corners per leaf, in model coordinates: solid angles do not depend on the frame.
  std::vector<AngleSums::Triangles> leaves;
  std::vector<std::uint32_t> multiplicities;  ///< one per model triangle; empty: all 1
  /// Masks per leaf and binary digit, lowest digit first: the triangles whose multiplicity has that
  /// digit.
  std::vector<std::uint8_t> masks;
  std::uint32_t digits = 1;  ///< maximum of LeafDigits::count

  Vec3d to_frame(Vec3 p) const {
    const Vec3d q = (Vec3d(p) - origin) * scale;
    return {dot(q, axis[0]), dot(q, axis[1]), dot(q, axis[2])};
  }
  std::uint32_t multiplicity(std::uint32_t triangle) const {
    return multiplicities.empty() ? 1 : multiplicities[triangle];
  }
  void build(MeshView mesh);
  /// Adds the subtree of the triangles `order`, which become `triangles[first]` and so on.
  /// `centers`: centroids of all triangles.
  void build_node(std::span<std::uint32_t> order, std::uint32_t first,
                  const std::vector<Vec3d>& centers, MeshView mesh);
  /// Computes the box, centre, radius and moments of node `index`.
  void compute_moments(std::size_t index, std::span<const std::uint32_t> order, MeshView mesh);
  /// Adds a leaf of these triangles to `leaves` and, if they have multiplicities, to `leaf_digits`
  /// and `masks`.
  void add_leaf(std::span<const std::uint32_t> order, MeshView mesh);
  /// Computes the winding numbers of at most kMaxQueries points. Each is the same alone and beside
  /// others, but points near to each other visit the same nodes.
  void winding(std::span<const Vec3> queries, double* numbers) const;
  /// Calls add_leaf(mask, index) for the leaves that are near a query point, in the order of the
  /// nodes. Bit k of the mask is set if the leaf is near query point k. Returns the sums, per lane,
  /// of the winding numbers of the other nodes.
  template <class AddLeaf>
  FourDoubles visit(const QueryPoints& queries, const AddLeaf& add_leaf) const;
  /// Tests whether the ray from q, in the frame's direction +z, crosses an odd number of triangles.
  bool parity(Vec3d q) const;
  /// Tests whether this ray crosses the triangle.
  bool ray_crosses(const Triangle& t, Vec3d q) const;
};

void InsideTest::Tree::build(MeshView mesh) {
  points.reserve(mesh.points.size());
  for (const Vec3 p : mesh.points) points.push_back(to_frame(p));
  std::vector<Vec3d> centers;
  std::vector<std::uint32_t> order(mesh.triangles.size());
  std::iota(order.begin(), order.end(), 0u);
  for (const Triangle& t : mesh.triangles)
    centers.push_back((points[t.v[0]] + points[t.v[1]] + points[t.v[2]]) * (1.0 / 3));
  triangles.reserve(order.size());
  if (!order.empty()) build_node(order, 0, centers, mesh);
}

void InsideTest::Tree::compute_moments(std::size_t index, std::span<const std::uint32_t> order,
                                       MeshView mesh) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Node& node = nodes[index];
  Moments& sums = moments[index];
  NodeBox& box = boxes[index];
  box.low = {kInfinity, kInfinity, kInfinity};
  box.high = box.low * -1;
  double area = 0;
  Vec3d weighted_sum, centroid_sum;
  for (const std::uint32_t t : order) {
    const auto& v = mesh.triangles[t].v;
    const Vec3d a = points[v[0]], b = points[v[1]], c = points[v[2]];
    const Vec3d doubled_area = cross(b - a, c - a);
    sums.dipole = sums.dipole + doubled_area * (0.5 * multiplicity(t));
    area += length(doubled_area);
    weighted_sum = weighted_sum + (a + b + c) * (length(doubled_area) / 3);
    centroid_sum = centroid_sum + (a + b + c) * (1.0 / 3);
    for (const Vec3d p : {a, b, c}) {
      box.low = {std::min(box.low.x, p.x), std::min(box.low.y, p.y), std::min(box.low.z, p.z)};
      box.high = {std::max(box.high.x, p.x), std::max(box.high.y, p.y), std::max(box.high.z, p.z)};
    }
  }
  node.center = area > 0 ? weighted_sum * (1 / area)
                         : centroid_sum * (1.0 / static_cast<double>(order.size()));
  // Radius and moments about the centre.
  double radius2 = 0;
  for (const std::uint32_t t : order) {
    const auto& v = mesh.triangles[t].v;
    const Vec3d a = points[v[0]] - node.center, b = points[v[1]] - node.center,
                c = points[v[2]] - node.center;
    for (const Vec3d r : {a, b, c}) radius2 = std::max(radius2, dot(r, r));
    const Vec3d n = cross(b - a, c - a) * (0.5 * multiplicity(t)), m = (a + b + c) * (1.0 / 3);
    sums.diagonal = sums.diagonal + Vec3d(n.x * m.x, n.y * m.y, n.z * m.z);
    sums.off_diagonal = sums.off_diagonal +
                        Vec3d(n.y * m.z + n.z * m.y, n.z * m.x + n.x * m.z, n.x * m.y + n.y * m.x);
  }
  sums.trace = sums.diagonal.x + sums.diagonal.y + sums.diagonal.z;
  node.far_distance2 = kBeta * kBeta * radius2;
}

void InsideTest::Tree::build_node(std::span<std::uint32_t> order, std::uint32_t first,
                                  const std::vector<Vec3d>& centers, MeshView mesh) {
  const std::size_t index = nodes.size();
  nodes.emplace_back();
  moments.emplace_back();
  boxes.emplace_back();
  compute_moments(index, order, mesh);
  nodes[index].first = first;
  if (order.size() <= kLeafTriangles) {
    nodes[index].count = static_cast<std::uint32_t>(order.size());
    nodes[index].leaf = static_cast<std::uint32_t>(leaves.size());
    for (const std::uint32_t t : order) triangles.push_back(mesh.triangles[t]);
    add_leaf(order, mesh);
  } else {
    const Vec3d size = boxes[index].high - boxes[index].low;
    const auto along = [&](std::uint32_t t) {
      const Vec3d& c = centers[t];
      return size.x >= size.y && size.x >= size.z ? c.x : size.y >= size.z ? c.y : c.z;
    };
    const std::size_t half = order.size() / 2;
    std::nth_element(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(half), order.end(),
                     [&](std::uint32_t a, std::uint32_t b) {
                       const double x = along(a), y = along(b);
                       return x != y ? x < y : a < b;
                     });
    build_node(order.first(half), first, centers, mesh);
    build_node(order.subspan(half), first + static_cast<std::uint32_t>(half), centers, mesh);
  }
  nodes[index].skip = static_cast<std::uint32_t>(nodes.size());
}

void InsideTest::Tree::add_leaf(std::span<const std::uint32_t> order, MeshView mesh) {
  AngleSums::Triangles& leaf = leaves.emplace_back();
  for (std::size_t k = 0; k < AngleSums::kLanes; ++k)
    for (std::size_t i = 0; i < 3; ++i) {
      // Unused lanes repeat the first triangle's first point, so their solid angle is 0.
      const Vec3 p = mesh.points[k < order.size() ? mesh.triangles[order[k]].v[i]
                                                  : mesh.triangles[order[0]].v[0]];
      leaf.corner[3 * i][k] = p.x;
      leaf.corner[3 * i + 1][k] = p.y;
      leaf.corner[3 * i + 2][k] = p.z;
    }
  if (multiplicities.empty()) return;
  std::uint32_t used_digits = 0;
  for (const std::uint32_t t : order) used_digits |= multiplicity(t);
  const LeafDigits leaf_range{static_cast<std::uint32_t>(masks.size()),
                              static_cast<std::uint32_t>(std::bit_width(used_digits))};
  leaf_digits.push_back(leaf_range);
  digits = std::max(digits, leaf_range.count);
  for (std::uint32_t digit = 0; digit < leaf_range.count; ++digit) {
    unsigned mask = 0;
    for (std::size_t k = 0; k < order.size(); ++k)
      mask |= (multiplicity(order[k]) >> digit & 1u) << k;
    masks.push_back(static_cast<std::uint8_t>(mask));
  }
}

template <class AddLeaf>
FourDoubles InsideTest::Tree::visit(const QueryPoints& queries, const AddLeaf& add_leaf) const {
  FourDoubles sum = {};
  FourIntegers resume = {};  // per query point: the first node that it has not passed yet
  for (int k = queries.count; k < kMaxQueries; ++k)
    resume[k] = std::numeric_limits<std::int64_t>::max();
  for (std::uint32_t i = 0; i < nodes.size();) {
    const Node& node = nodes[i];
    const FourDoubles x = node.center.x - queries.x, y = node.center.y - queries.y,
                      z = node.center.z - queries.z;
    const FourDoubles r2 = x * x + y * y + z * z;
    const FourIntegers is_visiting = resume <= std::int64_t{i},
                       is_far = is_visiting & (r2 > node.far_distance2);
    const unsigned visiting_mask = mask_of(is_visiting), far_mask = mask_of(is_far);
    if (far_mask != 0) {
      // The first two terms of the Taylor series of n . r / |r|^3 around the node's centre (Barill
      // et al. 2018, equation 9). Without the second term the sum is off by up to 0.14 on flat
      // models.
      const auto& [dipole, diagonal, mixed, trace] = moments[i];
      const FourDoubles first = x * dipole.x + y * dipole.y + z * dipole.z;
      const FourDoubles second =
          (diagonal.x * (x * x) + diagonal.y * (y * y) + diagonal.z * (z * z)) +
          (mixed.x * (y * z) + mixed.y * (z * x) + mixed.z * (x * y));
      const FourDoubles next = sum + (first + trace - 3 * second / r2) / (r2 * square_roots(r2));
      sum = is_far ? next : sum;
      resume = is_far ? broadcast_integer(node.skip) : resume;
    }
    if (visiting_mask == far_mask) {
      // No query point enters the node, and none resumes within its subtree.
      i = node.skip;
      continue;
    }
    if (node.count > 0) add_leaf(visiting_mask & ~far_mask, node.leaf);
    ++i;
  }
  return sum / (4 * std::numbers::pi);
}

void InsideTest::Tree::winding(std::span<const Vec3> queries, double* numbers) const {
  QueryPoints in_frame;
  in_frame.count = static_cast<int>(queries.size());
  Vec3d apex[kMaxQueries];  // the query points in model coordinates
  for (int k = 0; k < in_frame.count; ++k) {
    apex[k] = Vec3d(queries[k]);
    const Vec3d q = to_frame(queries[k]);
    in_frame.x[k] = q.x, in_frame.y[k] = q.y, in_frame.z[k] = q.z;
  }
  const auto for_each_bit = [](unsigned mask, const auto& f) {
    for (; mask != 0; mask &= mask - 1) f(std::countr_zero(mask));
  };
  if (multiplicities.empty()) {
    AngleSums near[kMaxQueries];
    const FourDoubles far = visit(in_frame, [&](unsigned mask, std::uint32_t leaf) {
      for_each_bit(mask, [&](int k) { near[k].add(leaves[leaf], apex[k]); });
    });
    for (int k = 0; k < in_frame.count; ++k)
      numbers[k] = near[k].sum() / (2 * std::numbers::pi) + far[k];
    return;
  }
  // One sum per query point and binary digit: of the triangles whose multiplicity has the digit.
  std::array<AngleSums, kMaxDigits> near[kMaxQueries];
  const FourDoubles far = visit(in_frame, [&](unsigned mask, std::uint32_t leaf) {
    for_each_bit(mask, [&](int k) {
      const AngleSums::Angles angles = AngleSums::angles(leaves[leaf], apex[k]);
      for (std::uint32_t digit = 0; digit < leaf_digits[leaf].count; ++digit)
        if (const unsigned taken = masks[leaf_digits[leaf].first_mask + digit])
          near[k][digit].add(angles, taken);
    });
  });
  for (int k = 0; k < in_frame.count; ++k) {
    double sum = near[k][0].sum();
    for (std::uint32_t digit = 1; digit < digits; ++digit)
      sum += std::ldexp(near[k][digit].sum(), static_cast<int>(digit));
    numbers[k] = sum / (2 * std::numbers::pi) + far[k];
  }
}

// Tests first whether q lies in the triangle's projection along the ray (+z). Each edge is
// evaluated in one direction only (from its lower point index) and is half-open in y, so a point on
// the common edge of two triangles lies in exactly one of them: no crossing at an edge or corner is
// counted twice or lost.
bool InsideTest::Tree::ray_crosses(const Triangle& t, Vec3d q) const {
  bool is_in_projection = false;
  for (int k = 0; k < 3; ++k) {
    const std::uint32_t i = t.v[k], j = t.v[(k + 1) % 3];
    const Vec3d &a = points[std::min(i, j)], &b = points[std::max(i, j)];
    if ((a.y > q.y) == (b.y > q.y)) continue;
    const double side = (b.x - a.x) * (q.y - a.y) - (b.y - a.y) * (q.x - a.x);
    if ((side > 0) == (b.y > a.y)) is_in_projection = !is_in_projection;
  }
  if (!is_in_projection) return false;
  const Vec3d a = points[t.v[0]], n = cross(points[t.v[1]] - a, points[t.v[2]] - a);
  // Test whether the plane lies above q. n.z is not 0, because the triangle's projection contains
  // q.
  return n.z > 0 ? dot(a - q, n) > 0 : dot(a - q, n) < 0;
}

bool InsideTest::Tree::parity(Vec3d q) const {
  bool is_odd = false;
  for (std::uint32_t i = 0; i < nodes.size();) {
    const Node& node = nodes[i];
    const NodeBox& box = boxes[i];
    if (q.x < box.low.x || q.x > box.high.x || q.y < box.low.y || q.y > box.high.y ||
        q.z > box.high.z) {
      i = node.skip;
      continue;
    }
    for (std::uint32_t t = node.first; t < node.first + node.count; ++t)
      if (ray_crosses(triangles[t], q)) is_odd = !is_odd;
    ++i;
  }
  return is_odd;
}

InsideTest::InsideTest(MeshView mesh, InsideRule rule)
    : tree_(std::make_unique<Tree>()), rule_(rule) {
  const Box box = mesh.box();
  if (!mesh.points.empty()) {
    tree_->origin = Vec3d(box.center());
    const double size = length(Vec3d(box.high) - Vec3d(box.low));
    tree_->scale = size > 0 ? 1 / size : 1;
  }
  if (rule == InsideRule::kParity) {
    // The ray (1 / pi, golden ratio - 1, sqrt(1/2)) is oblique to the axes and diagonals along
    // which modelled shapes and our sample lattice lie.
    const Vec3d ray = normalized(Vec3d(0.3183098862, 0.6180339887, 0.7071067812));
    const Vec3d u = normalized(cross(Vec3d(0, 0, 1), ray));
    tree_->axis = {u, cross(ray, u), ray};
  }
  const std::optional<ClusteredMesh> clustered =
      rule == InsideRule::kWinding ? cluster_long_triangles(mesh) : std::nullopt;
  if (clustered)
    for (const int multiplicity : clustered->multiplicity)
      tree_->multiplicities.push_back(
          std::min(static_cast<std::uint32_t>(multiplicity), kMaxMultiplicity));
  tree_->build(clustered ? MeshView(clustered->mesh) : mesh);
}

InsideTest::~InsideTest() = default;
InsideTest::InsideTest(InsideTest&&) noexcept = default;
InsideTest& InsideTest::operator=(InsideTest&&) noexcept = default;

bool InsideTest::inside(Vec3 point) const {
  return rule_ == InsideRule::kParity ? tree_->parity(tree_->to_frame(point))
                                      : winding_number(point) >= 0.5;
}

double InsideTest::winding_number(Vec3 point) const {
  double number = 0;
  tree_->winding({&point, 1}, &number);
  return number;
}

void InsideTest::winding_numbers(std::span<const Vec3> points, std::span<double> numbers) const {
  // Points that are further from each other than kNear share too few nodes on their traversals.
  constexpr double kNear = 0.1;  // fraction of the model's diagonal
  for (std::size_t i = 0; i < points.size();) {
    const std::size_t limit = std::min<std::size_t>(kMaxQueries, points.size() - i);
    std::size_t count = 1;
    while (count < limit &&
           static_cast<double>(length(points[i + count] - points[i])) * tree_->scale < kNear)
      ++count;
    tree_->winding(points.subspan(i, count), &numbers[i]);
    i += count;
  }
}

std::vector<std::uint8_t> InsideTest::inside(std::span<const Vec3> points) const {
  std::vector<std::uint8_t> are_inside(points.size());
  parallel_ranges(static_cast<std::int64_t>(points.size()), /*grain=*/256,
                  [&](std::int64_t begin, std::int64_t end) {
                    const auto first = static_cast<std::size_t>(begin),
                               count = static_cast<std::size_t>(end - begin);
                    inside(points.subspan(first, count), std::span(are_inside).subspan(first));
                  });
  return are_inside;
}

void InsideTest::inside(std::span<const Vec3> points, std::span<std::uint8_t> are_inside) const {
  if (rule_ == InsideRule::kParity) {
    for (std::size_t i = 0; i < points.size(); ++i) are_inside[i] = inside(points[i]) ? 1 : 0;
    return;
  }
  constexpr std::size_t kBlock = 64;  // points whose numbers are on the stack
  double numbers[kBlock];
  for (std::size_t first = 0; first < points.size(); first += kBlock) {
    const auto block = points.subspan(first, std::min(kBlock, points.size() - first));
    winding_numbers(block, numbers);
    for (std::size_t k = 0; k < block.size(); ++k) are_inside[first + k] = numbers[k] >= 0.5;
  }
}

}  // namespace polymorph
