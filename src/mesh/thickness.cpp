#include "mesh/thickness.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "base/parallel.h"
#include "kernels/linear.h"
#include "mesh/normals.h"
#include "mesh/sample_surface.h"

namespace polymorph {
namespace {

constexpr double kManyBalls = 1500;  // walls that need more balls are thin
// Maximum number of triangles tested per ray, reached only where many faces coincide.
constexpr std::size_t kMaxTests = 16384;

/// Distance along the ray at which it hits the triangle, or infinity (Moeller and Trumbore 1997,
/// in double precision; edges count).
double intersect(Vec3d origin, Vec3d direction, const TriangleBvh::Corners& c) {
  const Vec3d a(c.p[0]), ab = Vec3d(c.p[1]) - a, ac = Vec3d(c.p[2]) - a;
  const Vec3d p = cross(direction, ac);
  const double determinant = dot(ab, p);
  if (determinant == 0) return INFINITY;
  const Vec3d s = origin - a, q = cross(s, ab);
  const double u = dot(s, p) / determinant, v = dot(direction, q) / determinant;
  if (u < 0 || v < 0 || u + v > 1) return INFINITY;
  return dot(ac, q) / determinant;
}

struct Hit {
  double distance = INFINITY;  ///< no hit: infinite, or the search's maximum
  double cosine = -1;          ///< between ray and face normal; > 0 where the ray leaves the solid
  Vec3d normal;                ///< unit normal of the face
};

/// Range of distances along a ray, without its ends.
struct Reach {
  double min, max;
};

/// Finds the nearest hit in `reach` that is not on triangle `excluded`. Returns no hit if that
/// takes more than kMaxTests tests.
Hit first_hit(const TriangleBvh& bvh, Vec3d origin, Vec3d direction, Reach reach,
              std::uint32_t excluded) {
  const double min_distance = reach.min;
  Hit hit;
  hit.distance = reach.max;
  std::size_t tested = 0;
  struct Entry {
    double enter = 0;  // distance at which the ray enters the node's box
    std::uint32_t node = 0;
  };
  Entry stack[TriangleBvh::kStackSize];
  int stack_size = 0;
  if (!bvh.nodes.empty()) stack[stack_size++] = {min_distance, 0};
  const double o[3] = {origin.x, origin.y, origin.z},
               d[3] = {direction.x, direction.y, direction.z};
  // The factor 1 + 1e-12 covers the rounding of distances.
  while (stack_size > 0 && tested < kMaxTests) {
    const Entry entry = stack[--stack_size];
    if (entry.enter > hit.distance * (1 + 1e-12)) continue;
    const TriangleBvh::Node& node = bvh.nodes[entry.node];
    const int bottom = stack_size;
    for (int k = 0; k < TriangleBvh::kWidth; ++k) {
      if (node.child[k] == TriangleBvh::kNone) continue;
      double enter = min_distance, leave = hit.distance;  // the ray's interval in the box
      for (int axis = 0; axis < 3; ++axis) {
        const double low = static_cast<double>(node.low[axis][k]) - o[axis],
                     high = static_cast<double>(node.high[axis][k]) - o[axis];
        if (d[axis] == 0) {
          if (low > 0 || high < 0) leave = -1;  // the ray misses the box
          continue;
        }
        const double x = low / d[axis], y = high / d[axis];
        enter = std::max(enter, std::min(x, y));
        leave = std::min(leave, std::max(x, y));
      }
      if (enter > leave * (1 + 1e-12)) continue;
      if (node.count[k] == 0) {
        // Nearer children are visited first, so that most of the others are skipped.
        int top = stack_size++;
        for (; top > bottom && stack[top - 1].enter < enter; --top) stack[top] = stack[top - 1];
        stack[top] = {enter, node.child[k]};
        continue;
      }
      tested += node.count[k];
      for (std::uint32_t slot = node.child[k]; slot < node.child[k] + node.count[k]; ++slot) {
        if (bvh.triangles[slot] == excluded) continue;
        const TriangleBvh::Corners& c = bvh.corners[slot];
        const double t = intersect(origin, direction, c);
        if (!(t > min_distance) || !(t < hit.distance)) continue;
        const Vec3d n = cross(Vec3d(c.p[1]) - Vec3d(c.p[0]), Vec3d(c.p[2]) - Vec3d(c.p[0]));
        const Vec3d unit = n * (1 / std::max(std::sqrt(dot(n, n)), 1e-300));
        hit = {t, dot(unit, direction), unit};
      }
    }
  }
  return tested < kMaxTests ? hit : Hit{};
}

/// Casts a ray of the given length from each sample against its normal.
std::vector<Hit> intersect_inward(MeshView mesh, const TriangleBvh& bvh,
                                  const std::vector<SurfaceSample>& samples,
                                  double max_distance = INFINITY) {
  // Nearer hits are the adjacent face at an edge, or a duplicate of the same face.
  const double min_distance = 1e-6 * static_cast<double>(mesh.box().diagonal());
  std::vector<Hit> hits(samples.size());
  parallel_for(
      static_cast<std::int64_t>(samples.size()),
      [&](std::int64_t i) {
        const auto k = static_cast<std::size_t>(i);
        hits[k] = first_hit(bvh, Vec3d(samples[k].point), Vec3d(samples[k].normal) * -1,
                            {min_distance, max_distance}, samples[k].triangle);
      },
      /*grain=*/64);
  return hits;
}

/// Doubles the spacing until sample_evenly() makes at most kMaxSamples plus one per face. Without
/// this bound, each long thin triangle of a fan would get samples in proportion to its longest
/// edge.
double coarsen_spacing(MeshView mesh, double spacing) {
  constexpr double kMaxSamples = 1 << 20;
  for (;; spacing *= 2) {
    double samples = 0;  // upper bound, in addition to one per face
    for (const Triangle& t : mesh.triangles) {
      const Vec3d a(mesh.points[t.v[0]]), b(mesh.points[t.v[1]]), c(mesh.points[t.v[2]]);
      const double longest = std::max({length(b - a), length(c - b), length(a - c)});
      const double height = length(cross(b - a, c - a)) / std::max(longest, 1e-300);
      samples += (longest / spacing + 1) * (height / spacing + 1) - 1;
    }
    if (!(samples > kMaxSamples)) return spacing;
  }
}

/// Places samples on each face in columns perpendicular to its longest edge. With random sampling
/// by area, a wire would get fewer samples the thinner it is.
std::vector<SurfaceSample> sample_evenly(MeshView mesh, double requested_spacing) {
  const double spacing = coarsen_spacing(mesh, requested_spacing);
  const auto count_steps = [&](double extent) {
    return std::max(static_cast<int>(std::ceil(extent / spacing)), 1);
  };
  std::vector<SurfaceSample> samples;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    Vec3d p[3];
    for (int k = 0; k < 3; ++k) p[k] = Vec3d(mesh.points[mesh.triangles[t].v[k]]);
    const Vec3d normal = cross(p[1] - p[0], p[2] - p[0]);
    const double twice_area = std::sqrt(dot(normal, normal));
    if (!(twice_area > 0)) continue;
    const auto edge_length2 = [&](int k) {
      const Vec3d edge = p[(k + 1) % 3] - p[k];
      return dot(edge, edge);
    };
    // The longest edge, from corner `first` on, is the base. `apex` is the fraction of the base at
    // which the height of the triangle stands.
    int first = 0;
    for (int k = 1; k < 3; ++k)
      if (edge_length2(k) > edge_length2(first)) first = k;
    const Vec3d a = p[first], base = p[(first + 1) % 3] - a, to_apex = p[(first + 2) % 3] - a;
    const double apex = dot(to_apex, base) / dot(base, base);
    const Vec3d height = to_apex - base * apex;
    const int columns = count_steps(std::sqrt(dot(base, base)));
    for (int i = 0; i < columns; ++i) {
      const double u = (i + 0.5) / columns;
      // Fraction of `height` at the fraction u of the base.
      const double column_height = u < apex ? u / apex : (1 - u) / (1 - apex);
      const int rows = count_steps(column_height * std::sqrt(dot(height, height)));
      for (int j = 0; j < rows; ++j)
        samples.push_back({to_float(a + base * u + height * (column_height * (j + 0.5) / rows)),
                           to_float(normal * (1 / twice_area)), t});
    }
  }
  return samples;
}

/// Finds the midpoint between a sample and the face opposite to it, if the wall is thin there. Two
/// faces at a wide angle may form an edge of something thick. They count only if a third face lies
/// near behind them, as in a wire with a triangular cross-section.
std::optional<Vec3> find_wall_midpoint(const TriangleBvh& bvh, const SurfaceSample& sample,
                                       const Hit& hit, double max_thickness, double min_cosine) {
  if (!(hit.distance < max_thickness) || !(hit.cosine > 0)) return std::nullopt;
  const Vec3 middle = sample.point - sample.normal * static_cast<float>(0.5 * hit.distance);
  if (hit.cosine > min_cosine) return middle;
  const Vec3d inward = (Vec3d(sample.normal) + hit.normal) * -1;
  const double length = std::sqrt(dot(inward, inward));
  if (!(length > 0)) return std::nullopt;
  const Hit behind =
      first_hit(bvh, Vec3d(middle), inward * (1 / length), {0, max_thickness}, sample.triangle);
  if (!(behind.distance < max_thickness) || !(behind.cosine > 0)) return std::nullopt;
  return middle + to_float(inward * (0.5 * behind.distance / length));
}

}  // namespace

Thickness measure_thickness(MeshView mesh, const TriangleBvh& bvh, std::size_t samples) {
  const std::vector<SurfaceSample> surface_samples = sample_surface(mesh, samples);
  std::vector<double> lengths;
  for (const Hit& hit : intersect_inward(mesh, bvh, surface_samples))
    if (hit.cosine > 0 && !std::isinf(hit.distance)) lengths.push_back(hit.distance);
  Thickness result;
  result.rays = lengths.size();
  if (!surface_samples.empty())
    result.open =
        1 - static_cast<double>(lengths.size()) / static_cast<double>(surface_samples.size());
  if (lengths.empty()) return result;
  std::sort(lengths.begin(), lengths.end());
  const auto at = [&](double fraction) {
    return lengths[static_cast<std::size_t>(fraction * static_cast<double>(lengths.size() - 1))];
  };
  result.low = at(0.05);
  result.median = at(0.5);
  result.high = at(0.95);
  result.balls = area_of(mesh) / (result.median * result.median);
  return result;
}

std::vector<double> measure_wall_thicknesses(MeshView mesh, const TriangleBvh& bvh,
                                             const std::vector<SurfaceSample>& samples) {
  std::vector<double> lengths;
  for (const Hit& hit : intersect_inward(mesh, bvh, samples))
    lengths.push_back(hit.cosine > 0 ? hit.distance : INFINITY);
  return lengths;
}

std::vector<Vec3> find_thin_wall_midpoints(MeshView mesh, const TriangleBvh& bvh, double spacing,
                                           double max_thickness, double min_cosine) {
  const std::vector<SurfaceSample> samples = sample_evenly(mesh, spacing);
  const std::vector<Hit> hits = intersect_inward(mesh, bvh, samples, max_thickness);
  std::vector<std::optional<Vec3>> midpoint_of_sample(samples.size());
  parallel_for(
      static_cast<std::int64_t>(samples.size()),
      [&](std::int64_t i) {
        const auto k = static_cast<std::size_t>(i);
        midpoint_of_sample[k] =
            find_wall_midpoint(bvh, samples[k], hits[k], max_thickness, min_cosine);
      },
      /*grain=*/64);
  std::vector<Vec3> middles;
  for (const std::optional<Vec3>& middle : midpoint_of_sample)
    if (middle) middles.push_back(*middle);
  return middles;
}

bool is_thin(const Thickness& thickness) { return thickness.balls > kManyBalls; }

}  // namespace polymorph
