#include "render/rays/widened.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/parallel.h"
#include "base/result.h"
#include "kernels/linear.h"

namespace polymorph {
namespace {

using TriangleCorners = std::array<Vec3d, 3>;

// Maximum distance of a corner from the centre of the inscribed circle, in radii of that circle. A
// corner with an angle of 7 degrees has this distance.
constexpr double kMaxCornerDistance = 16;
// Width w and height h of a right triangle that contains a unit square in the corner of its right
// angle: 1 / w + 1 / h <= 1.
constexpr double kCoverWidth = 1.5, kCoverHeight = 6;

double norm(Vec3d a) { return std::sqrt(dot(a, a)); }

/// Computes the lengths of the sides opposite to the corners.
Vec3d side_lengths(const TriangleCorners& c) {
  return {norm(c[2] - c[1]), norm(c[0] - c[2]), norm(c[1] - c[0])};
}

struct Circle {
  Vec3d center;
  double radius = 0;
};
Circle make_inscribed_circle(const TriangleCorners& c) {
  const Vec3d s = side_lengths(c);
  const double weight_sum = s.x + s.y + s.z;
  if (!(weight_sum > 0)) return {c[0], 0};
  return {(c[0] * s.x + c[1] * s.y + c[2] * s.z) * (1 / weight_sum),
          norm(cross(c[1] - c[0], c[2] - c[0])) / weight_sum};
}

/// Tests whether widening would move a corner too far. `circle`: the inscribed one.
bool is_sliver(const TriangleCorners& c, const Circle& circle) {
  double max_distance2 = 0;
  for (const Vec3d& corner : c) {
    const Vec3d offset = corner - circle.center;
    max_distance2 = std::max(max_distance2, dot(offset, offset));
  }
  return !(std::sqrt(max_distance2) <= kMaxCornerDistance * circle.radius);
}

/// Scales a triangle about the centre of its inscribed circle, whose radius grows by `margin`.
TriangleCorners widen(const TriangleCorners& c, const Circle& circle, double margin) {
  TriangleCorners result;
  for (int i = 0; i < 3; ++i)
    result[i] = circle.center + (c[i] - circle.center) * (1 + margin / circle.radius);
  return result;
}

/// Makes a right triangle that covers a widened triangle whose longest side begins at corner
/// `first`.
TriangleCorners make_cover(const TriangleCorners& c, int first, double margin) {
  const Vec3d p = c[first], q = c[(first + 1) % 3], r = c[(first + 2) % 3];
  // Axes of the cover: along the longest side, and towards r (any perpendicular if r lies on it).
  const double length = norm(q - p);
  const Vec3d along = length > 0 ? (q - p) * (1 / length) : Vec3d{1, 0, 0};
  Vec3d up = r - p - along * dot(r - p, along);
  const double height = norm(up);
  if (height > 1e-12 * length)
    up = up * (1 / height);
  else
    up = std::fabs(along.x) < 0.6 ? cross(along, {1, 0, 0}) : cross(along, {0, 1, 0});
  up = up * (1 / norm(up));
  const Vec3d corner = p - (along + up) * margin;
  return {corner, corner + along * (kCoverWidth * (length + 2 * margin)),
          corner + up * (kCoverHeight * (height + 2 * margin))};
}

/// Returns the corner at which the longest side begins.
int longest_side(const TriangleCorners& c) {
  const Vec3d s = side_lengths(c);
  return s.z >= s.x && s.z >= s.y ? 0 : s.x >= s.y ? 1 : 2;
}

}  // namespace

std::vector<std::vector<Vec3>> widen_triangles(const RenderMesh& mesh, float margin,
                                               const std::vector<float>& fractions) {
  constexpr std::size_t kMaxSteps = 2;
  const std::size_t steps = std::max<std::size_t>(1, fractions.size());
  PM_CHECK(steps <= kMaxSteps);
  std::vector<std::vector<Vec3>> result(steps, std::vector<Vec3>(mesh.triangles.size() * 3));
  parallel_for(
      static_cast<std::int64_t>(mesh.triangles.size()),
      [&](std::int64_t i) {
        const Triangle& triangle = mesh.triangles[static_cast<std::size_t>(i)];
        std::array<TriangleCorners, kMaxSteps> corners;
        std::array<Circle, kMaxSteps> circles;
        // All time steps of a triangle must use the same method.
        bool use_cover = false;
        for (std::size_t step = 0; step < steps; ++step) {
          for (int k = 0; k < 3; ++k)
            corners[step][k] =
                Vec3d(fractions.empty() ? mesh.positions[triangle.v[k]]
                                        : displace(mesh, triangle.v[k], fractions[step]));
          circles[step] = make_inscribed_circle(corners[step]);
          use_cover = use_cover || is_sliver(corners[step], circles[step]);
        }
        const int first = use_cover ? longest_side(corners[0]) : 0;
        for (std::size_t step = 0; step < steps; ++step) {
          const TriangleCorners widened =
              use_cover ? make_cover(corners[step], first, static_cast<double>(margin))
                        : widen(corners[step], circles[step], static_cast<double>(margin));
          for (std::size_t k = 0; k < 3; ++k)
            result[step][static_cast<std::size_t>(i) * 3 + k] = {static_cast<float>(widened[k].x),
                                                                 static_cast<float>(widened[k].y),
                                                                 static_cast<float>(widened[k].z)};
        }
      },
      /*grain=*/1024);
  return result;
}

}  // namespace polymorph
