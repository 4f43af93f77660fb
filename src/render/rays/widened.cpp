#include "render/rays/widened.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/parallel.h"
#include "kernels/linear.h"

namespace polymorph {
namespace {

using Corners = std::array<Vec3d, 3>;

// A corner may be this many radii of the inscribed circle away from its centre; an angle of 7
// degrees is.
constexpr double kFarthest = 16;
// A right triangle around a rectangle of the width and height 1: so much wider and higher.
constexpr double kWider = 1.5, kHigher = 6;

double size(Vec3d a) { return std::sqrt(dot(a, a)); }

/// The lengths of the sides opposite to the corners.
Vec3d sides(const Corners& c) { return {size(c[2] - c[1]), size(c[0] - c[2]), size(c[1] - c[0])}; }

struct Circle {
  Vec3d center;
  double radius = 0;
};
Circle inscribed(const Corners& c) {
  const Vec3d s = sides(c);
  const double around = s.x + s.y + s.z;
  if (!(around > 0)) return {c[0], 0};
  return {(c[0] * s.x + c[1] * s.y + c[2] * s.z) * (1 / around),
          size(cross(c[1] - c[0], c[2] - c[0])) / around};
}

bool sharp(const Corners& c) {
  const Circle circle = inscribed(c);
  double farthest = 0;
  for (const Vec3d& corner : c) farthest = std::max(farthest, size(corner - circle.center));
  return !(farthest <= kFarthest * circle.radius);
}

Corners scaled(const Corners& c, double by) {
  const Circle circle = inscribed(c);
  Corners out;
  for (int i = 0; i < 3; ++i)
    out[i] = circle.center + (c[i] - circle.center) * (1 + by / circle.radius);
  return out;
}

/// A right triangle around the one whose longest side begins at corner `first`.
Corners covering(const Corners& c, int first, double by) {
  const Vec3d p = c[first], q = c[(first + 1) % 3], r = c[(first + 2) % 3];
  const double length = size(q - p);
  const Vec3d along = length > 0 ? (q - p) * (1 / length) : Vec3d{1, 0, 0};
  Vec3d up = r - p - along * dot(r - p, along);
  const double height = size(up);
  if (height > 1e-12 * length)
    up = up * (1 / height);
  else
    up = std::fabs(along.x) < 0.6 ? cross(along, {1, 0, 0}) : cross(along, {0, 1, 0});
  up = up * (1 / size(up));
  const Vec3d corner = p - (along + up) * by;
  return {corner, corner + along * (kWider * (length + 2 * by)),
          corner + up * (kHigher * (height + 2 * by))};
}

int longest_side(const Corners& c) {
  const Vec3d s = sides(c);
  return s.z >= s.x && s.z >= s.y ? 0 : s.x >= s.y ? 1 : 2;
}

}  // namespace

std::vector<std::vector<Vec3>> widened_corners(const RenderMesh& mesh, float by,
                                               const std::vector<float>& ways) {
  const std::size_t steps = std::max<std::size_t>(1, ways.size());
  std::vector<std::vector<Vec3>> out(steps, std::vector<Vec3>(mesh.triangles.size() * 3));
  parallel_for(
      static_cast<std::int64_t>(mesh.triangles.size()),
      [&](std::int64_t i) {
        const Triangle& triangle = mesh.triangles[static_cast<std::size_t>(i)];
        const auto corners_at = [&](std::size_t step) {
          Corners c;
          for (int k = 0; k < 3; ++k)
            c[k] = Vec3d(ways.empty() ? mesh.positions[triangle.v[k]]
                                      : moved(mesh, triangle.v[k], ways[step]));
          return c;
        };
        // The corners of all steps must go together.
        bool cover = false;
        for (std::size_t step = 0; step < steps; ++step) cover = cover || sharp(corners_at(step));
        const int first = longest_side(corners_at(0));
        for (std::size_t step = 0; step < steps; ++step) {
          const Corners c = corners_at(step);
          const Corners wide = cover ? covering(c, first, static_cast<double>(by))
                                     : scaled(c, static_cast<double>(by));
          for (std::size_t k = 0; k < 3; ++k)
            out[step][static_cast<std::size_t>(i) * 3 + k] = {static_cast<float>(wide[k].x),
                                                              static_cast<float>(wide[k].y),
                                                              static_cast<float>(wide[k].z)};
        }
      },
      1024);
  return out;
}

}  // namespace polymorph
