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
  Vec3d dipole;              ///< sum of area vectors n, times their multiplicities
  /// Moment of the area vectors: with M the sum of n m^T, m a triangle's centroid less `center`,
  /// components xx, yy, zz of M and yz, zx, xy of M + M^T.
  Vec3d diagonal, off_diagonal;
  Vec3d low, high;                     ///< box
  std::uint32_t first = 0, count = 0;  ///< range of Tree::triangles, if count > 0
  std::uint32_t leaf = 0;              ///< index in Tree::leaves, if count > 0
  std::uint32_t mask = 0;    ///< first index in Tree::masks, if triangles have multiplicities
  std::uint32_t digits = 0;  ///< binary digits of the multiplicities; one mask per digit
  std::uint32_t skip = 0;    ///< the node that follows this node's subtree
};

}  // namespace

struct InsideTest::Tree {
  // Transform from model coordinates to a frame in which the model's box has a diagonal of 1,
  // rotated so that the ray of the parity rule is +z.
  Vec3d origin;
  double scale = 1;
  std::array<Vec3d, 3> axis{Vec3d(1, 0, 0), Vec3d(0, 1, 0), Vec3d(0, 0, 1)};
  std::vector<Vec3d> points;
  std::vector<Triangle> triangles;  ///< sorted by leaf
  std::vector<Node> nodes;          ///< depth first
  /// Corners per leaf, in model coordinates: solid angles do not depend on the frame.
  std::vector<AngleSums::Triangles> leaves;
  std::vector<std::uint32_t> multiplicities;  ///< one per model triangle; empty: all 1
  /// Masks per leaf and binary digit, lowest digit first: the triangles whose multiplicity has that
  /// digit.
  std::vector<std::uint8_t> masks;
  std::uint32_t digits = 1;  ///< maximum of Node::digits

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
  /// Computes the node's box, centre, radius and moments.
  void compute_moments(Node& node, std::span<const std::uint32_t> order, MeshView mesh) const;
  /// Adds the node's triangles to `leaves` and `masks`.
  void add_leaf(Node& node, std::span<const std::uint32_t> order, MeshView mesh);
  double winding(Vec3 point) const;
  /// Tests whether the ray from q along +z, in the frame, crosses an odd number of triangles.
  bool parity(Vec3d q) const;
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

void InsideTest::Tree::compute_moments(Node& node, std::span<const std::uint32_t> order,
                                       MeshView mesh) const {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  node.low = {kInfinity, kInfinity, kInfinity};
  node.high = node.low * -1;
  double area = 0;
  Vec3d weighted_sum, centroid_sum;
  for (const std::uint32_t t : order) {
    const auto& v = mesh.triangles[t].v;
    const Vec3d a = points[v[0]], b = points[v[1]], c = points[v[2]];
    const Vec3d doubled_area = cross(b - a, c - a);
    node.dipole = node.dipole + doubled_area * (0.5 * multiplicity(t));
    area += length(doubled_area);
    weighted_sum = weighted_sum + (a + b + c) * (length(doubled_area) / 3);
    centroid_sum = centroid_sum + (a + b + c) * (1.0 / 3);
    for (const Vec3d p : {a, b, c}) {
      node.low = {std::min(node.low.x, p.x), std::min(node.low.y, p.y), std::min(node.low.z, p.z)};
      node.high = {std::max(node.high.x, p.x), std::max(node.high.y, p.y),
                   std::max(node.high.z, p.z)};
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
    node.diagonal = node.diagonal + Vec3d(n.x * m.x, n.y * m.y, n.z * m.z);
    node.off_diagonal = node.off_diagonal +
                        Vec3d(n.y * m.z + n.z * m.y, n.z * m.x + n.x * m.z, n.x * m.y + n.y * m.x);
  }
  node.far_distance2 = kBeta * kBeta * radius2;
}

void InsideTest::Tree::build_node(std::span<std::uint32_t> order, std::uint32_t first,
                                  const std::vector<Vec3d>& centers, MeshView mesh) {
  const std::size_t self = nodes.size();
  nodes.emplace_back();
  Node node;
  compute_moments(node, order, mesh);
  node.first = first;
  if (order.size() <= kLeafTriangles) {
    node.count = static_cast<std::uint32_t>(order.size());
    node.leaf = static_cast<std::uint32_t>(leaves.size());
    for (const std::uint32_t t : order) triangles.push_back(mesh.triangles[t]);
    add_leaf(node, order, mesh);
  } else {
    const Vec3d size = node.high - node.low;
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
  node.skip = static_cast<std::uint32_t>(nodes.size());
  nodes[self] = node;
}

void InsideTest::Tree::add_leaf(Node& node, std::span<const std::uint32_t> order, MeshView mesh) {
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
  node.mask = static_cast<std::uint32_t>(masks.size());
  node.digits = static_cast<std::uint32_t>(std::bit_width(used_digits));
  digits = std::max(digits, node.digits);
  for (std::uint32_t digit = 0; digit < node.digits; ++digit) {
    unsigned mask = 0;
    for (std::size_t k = 0; k < order.size(); ++k)
      mask |= (multiplicity(order[k]) >> digit & 1u) << k;
    masks.push_back(static_cast<std::uint8_t>(mask));
  }
}

double InsideTest::Tree::winding(Vec3 point) const {
  const Vec3d q = to_frame(point), eye(point);
  AngleSums near;  // near triangles; with multiplicities, those of odd multiplicity
  double far_sum = 0;
  std::optional<std::array<AngleSums, kMaxDigits>> digit_sums;
  if (!multiplicities.empty()) digit_sums.emplace();
  for (std::uint32_t i = 0; i < nodes.size();) {
    const Node& node = nodes[i];
    const Vec3d r = node.center - q;
    const double r2 = dot(r, r);
    if (r2 > node.far_distance2) {
      // The first two terms of the Taylor series of n . r / |r|^3 around the node's centre (Barill
      // et al. 2018, equation 9). Without the second term the sum is off by up to 0.14 on flat
      // models.
      const Vec3d squares(r.x * r.x, r.y * r.y, r.z * r.z), mixed(r.y * r.z, r.z * r.x, r.x * r.y);
      const double trace = node.diagonal.x + node.diagonal.y + node.diagonal.z;
      const double r_moment_r = dot(node.diagonal, squares) + dot(node.off_diagonal, mixed);
      far_sum += (dot(r, node.dipole) + trace - 3 * r_moment_r / r2) / (r2 * std::sqrt(r2));
      i = node.skip;
      continue;
    }
    if (node.count > 0 && digit_sums) {
      const AngleSums::Angles angles = AngleSums::angles(leaves[node.leaf], eye);
      for (std::uint32_t digit = 0; digit < node.digits; ++digit)
        if (const unsigned mask = masks[node.mask + digit])
          (digit == 0 ? near : (*digit_sums)[digit]).add(angles, mask);
    } else if (node.count > 0) {
      near.add(leaves[node.leaf], eye);
    }
    ++i;
  }
  double sum = near.sum();
  for (std::uint32_t digit = 1; digit < digits; ++digit)
    sum += std::ldexp((*digit_sums)[digit].sum(), static_cast<int>(digit));
  // `sum` is of half solid angles, far_sum of solid angles.
  return sum / (2 * std::numbers::pi) + far_sum / (4 * std::numbers::pi);
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
    if (q.x < node.low.x || q.x > node.high.x || q.y < node.low.y || q.y > node.high.y ||
        q.z > node.high.z) {
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
                                      : tree_->winding(point) >= 0.5;
}

double InsideTest::winding_number(Vec3 point) const { return tree_->winding(point); }

std::vector<std::uint8_t> InsideTest::inside(std::span<const Vec3> points) const {
  std::vector<std::uint8_t> are_inside(points.size());
  parallel_for(
      static_cast<std::int64_t>(points.size()),
      [&](std::int64_t i) {
        const auto k = static_cast<std::size_t>(i);
        are_inside[k] = inside(points[k]) ? 1 : 0;
      },
      /*grain=*/256);
  return are_inside;
}

}  // namespace polymorph
