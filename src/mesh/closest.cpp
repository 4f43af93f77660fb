#include "mesh/closest.h"

#include "base/parallel.h"
#include "mesh/vertex_clustering.h"

namespace polymorph {
namespace {

/// The triangles of a leaf as structure of arrays, in single precision: arrays are indexed by
/// coordinate and triangle. One vectorized pass decides which triangles need a test in double
/// precision.
struct Leaf {
  static constexpr int kWidth = TriangleBvh::kLeafTriangles;
  float a[3][kWidth], ab[3][kWidth], ac[3][kWidth];  ///< corner a and the edges from it
  /// Gradients of the barycentric weights: that of b is dot(gradients_b, p - a), that of c
  /// dot(gradients_c, p - a).
  float gradients_b[3][kWidth], gradients_c[3][kWidth];

  explicit Leaf(const TriangleBvh::Corners* corners) {
    for (int k = 0; k < kWidth; ++k) {
      const Vec3d p(corners[k].p[0]), to_b = Vec3d(corners[k].p[1]) - p,
                                      to_c = Vec3d(corners[k].p[2]) - p;
      const Vec3d n = cross(to_b, to_c);
      const double n2 = dot(n, n);
      // The gradients of a triangle without area are 0. All points then count as outside its
      // interior, so only its edges are tested.
      const Vec3d gradient_b = n2 > 0 ? cross(to_c, n) * (1 / n2) : Vec3d{},
                  gradient_c = n2 > 0 ? cross(n, to_b) * (1 / n2) : Vec3d{};
      set(a, k, p);
      set(ab, k, to_b);
      set(ac, k, to_c);
      set(gradients_b, k, gradient_b);
      set(gradients_c, k, gradient_c);
    }
  }

  /// Computes a lower bound of each triangle's squared distance from p: the distance in floats,
  /// less a bound of its rounding. With s and t the weights of b and c, the plane's closest point
  /// lies in the triangle if s, t and 1 - s - t are above 0; else the closest point is on an edge.
  void bound_distances(Vec3 p, float (&min_distance2)[kWidth]) const {
    for (int k = 0; k < kWidth; ++k) {
      const float x = p.x - a[0][k], y = p.y - a[1][k], z = p.z - a[2][k];
      const float bx = ab[0][k], by = ab[1][k], bz = ab[2][k];
      const float cx = ac[0][k], cy = ac[1][k], cz = ac[2][k];
      const float pp = x * x + y * y + z * z, bb = bx * bx + by * by + bz * bz,
                  cc = cx * cx + cy * cy + cz * cz, bc = bx * cx + by * cy + bz * cz;
      const float pb = x * bx + y * by + z * bz, pc = x * cx + y * cy + z * cz;
      // Squared distance of p from the point with weights (1 - s - t, s, t).
      const auto distance2 = [=](float s, float t) {
        const float rx = x - s * bx - t * cx, ry = y - s * by - t * cy, rz = z - s * bz - t * cz;
        return rx * rx + ry * ry + rz * rz;
      };
      const auto clamped_ratio = [](float along, float total) {  // 1e-37f avoids 0 / 0
        return min(max(along / max(total, 1e-37f), 0.0f), 1.0f);
      };
      const float on_bc = clamped_ratio(pc - pb + bb - bc, bb - 2 * bc + cc);
      const float edge_distance2 =
          min(min(distance2(clamped_ratio(pb, bb), 0), distance2(0, clamped_ratio(pc, cc))),
              distance2(1 - on_bc, on_bc));
      const float s = x * gradients_b[0][k] + y * gradients_b[1][k] + z * gradients_b[2][k];
      const float t = x * gradients_c[0][k] + y * gradients_c[1][k] + z * gradients_c[2][k];
      const float face_distance2 = min(min(s, t), 1 - s - t) > 0 ? distance2(s, t) : edge_distance2;
      min_distance2[k] = min(edge_distance2, face_distance2) - 4e-6f * (pp + bb + cc);
    }
  }

 private:
  static void set(float (&to)[3][kWidth], int k, Vec3d from) {
    to[0][k] = static_cast<float>(from.x);
    to[1][k] = static_cast<float>(from.y);
    to[2][k] = static_cast<float>(from.z);
  }
};

/// Candidates of find_closest(): the triangles that single precision cannot exclude, the one of the
/// smallest bound first. A split hierarchy, where the order decides between equally close points,
/// has them in ascending order.
struct LeafCandidates {
  const std::vector<Leaf>& leaves;
  Vec3 from;
  bool is_ordered;
  struct Queue {
    float min_distance2[Leaf::kWidth];
    unsigned mask;
    bool is_ordered;

    int take(float limit) {
      if (mask == 0) return -1;
      int nearest = countr_zero(mask);
      if (!is_ordered) {
        for (unsigned more = mask & (mask - 1); more != 0; more &= more - 1)
          if (const int k = countr_zero(more); min_distance2[k] < min_distance2[nearest])
            nearest = k;
        if (min_distance2[nearest] > limit) return -1;
      }
      mask &= ~(1u << nearest);
      return nearest;
    }
  };
  Queue operator()(std::uint32_t slot, std::uint32_t count, float limit) const {
    Queue queue;
    leaves[slot / TriangleBvh::kLeafTriangles].bound_distances(from, queue.min_distance2);
    const auto is_far = Lanes<Pack>::load(queue.min_distance2) > limit;
    queue.mask = ~Lanes<Pack>::bits(is_far) & ((1u << count) - 1);
    queue.is_ordered = is_ordered;
    return queue;
  }
};

std::vector<Triangle> select_triangles(MeshView mesh, std::span<const std::uint32_t> faces) {
  std::vector<Triangle> selected;
  for (const std::uint32_t face : faces) selected.push_back(mesh.triangles[face]);
  return selected;
}

}  // namespace

struct ClosestPointQuery::Tree {
  TriangleBvh bvh;
  std::vector<Leaf> leaves;
};

ClosestPointQuery::ClosestPointQuery(MeshView mesh) : tree_(std::make_unique<Tree>()) {
  tree_->bvh = build_split_bvh(mesh.points, mesh.triangles);
  // Where thousands of long triangles are scattered or share a point, nearly all are about as close
  // as the closest one, so some of them suffice. Long triangles of a coarse surface have boxes that
  // overlap little; their hierarchy is not split, and they all stay.
  const std::vector<std::uint32_t> representatives =
      tree_->bvh.is_split ? list_representative_triangles(mesh) : std::vector<std::uint32_t>();
  if (!representatives.empty())
    tree_->bvh = build_split_bvh(mesh.points, select_triangles(mesh, representatives));
  const std::vector<TriangleBvh::Corners>& corners = tree_->bvh.corners;
  tree_->leaves.reserve(corners.size() / TriangleBvh::kLeafTriangles);
  for (std::size_t slot = 0; slot < corners.size(); slot += TriangleBvh::kLeafTriangles)
    tree_->leaves.emplace_back(&corners[slot]);
  // Indices become those of the mesh; kNone stays.
  for (std::uint32_t& triangle : tree_->bvh.triangles)
    if (triangle < representatives.size()) triangle = representatives[triangle];
}
ClosestPointQuery::ClosestPointQuery(MeshView mesh, std::span<const std::uint32_t> faces)
    : ClosestPointQuery(MeshView(mesh.points, select_triangles(mesh, faces))) {
  for (std::uint32_t& triangle : tree_->bvh.triangles)
    if (triangle < faces.size()) triangle = faces[triangle];
}
ClosestPointQuery::~ClosestPointQuery() = default;
ClosestPointQuery::ClosestPointQuery(ClosestPointQuery&&) noexcept = default;
ClosestPointQuery& ClosestPointQuery::operator=(ClosestPointQuery&&) noexcept = default;

TriangleBvhView ClosestPointQuery::view() const {
  const TriangleBvh& bvh = tree_->bvh;
  return {bvh.nodes, bvh.corners, bvh.triangles, bvh.is_split};
}

ClosestPoint ClosestPointQuery::closest(Vec3 from, float max_distance) const {
  return find_closest(view(), from, max_distance,
                      LeafCandidates{tree_->leaves, from, tree_->bvh.is_split});
}

ClosestPoint ClosestPointQuery::closest(Vec3 from, Vec3 neighbour,
                                        const ClosestPoint& neighbour_hit,
                                        float max_distance) const {
  return find_closest_near(view(), from, neighbour, neighbour_hit, max_distance,
                           LeafCandidates{tree_->leaves, from, tree_->bvh.is_split});
}

std::vector<ClosestPoint> ClosestPointQuery::closest(std::span<const Vec3> from,
                                                     float max_distance) const {
  std::vector<ClosestPoint> hits(from.size());
  // Consecutive points are usually close to each other, so the last hit bounds the next distance.
  parallel_ranges(static_cast<std::int64_t>(from.size()), /*grain=*/256,
                  [&](std::int64_t begin, std::int64_t end) {
                    for (auto k = static_cast<std::size_t>(begin);
                         k < static_cast<std::size_t>(end); ++k)
                      hits[k] = k > static_cast<std::size_t>(begin)
                                    ? closest(from[k], from[k - 1], hits[k - 1], max_distance)
                                    : closest(from[k], max_distance);
                  });
  return hits;
}

TriangleWeights weights_at(MeshView mesh, const ClosestPoint& hit) {
  const Triangle& t = mesh.triangles[hit.triangle];
  return closest_on_triangle(hit.point, mesh.points[t.v[0]], mesh.points[t.v[1]],
                             mesh.points[t.v[2]]);
}

Vec3 interpolate_normal(MeshView mesh, std::span<const Vec3> corner_normals,
                        const ClosestPoint& hit) {
  const TriangleWeights w = weights_at(mesh, hit);
  const std::size_t c = 3 * std::size_t{hit.triangle};
  return corner_normals[c] * static_cast<float>(w.a) +
         corner_normals[c + 1] * static_cast<float>(w.b) +
         corner_normals[c + 2] * static_cast<float>(w.c);
}

}  // namespace polymorph
