#include "spheres/boundary.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <nanoflann.hpp>

#include "base/morton.h"
#include "base/parallel.h"
#include "mesh/closest.h"
#include "mesh/sample_surface.h"

namespace polymorph {
namespace {

/// The samples in the form that nanoflann's k-d tree requires.
struct Points {
  const std::vector<BoundarySample>& samples;
  std::size_t kdtree_get_point_count() const { return samples.size(); }
  float kdtree_get_pt(std::size_t i, std::size_t axis) const {
    const Vec3& p = samples[i].point;
    return axis == 0 ? p.x : axis == 1 ? p.y : p.z;
  }
  template <class B>
  bool kdtree_get_bbox(B&) const {
    return false;  // the tree computes the bounding box itself
  }
};
using Tree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, Points>,
                                                 Points, 3, std::uint32_t>;

constexpr int kMaxShrinkSteps = 30;  // per ball

/// nanoflann's result set of one search: the nearest sample, if its squared distance is below that
/// with which the search begins. A small one spares most of the tree.
struct NearestSample {
  using DistanceType = float;
  float distance2;
  std::uint32_t index;
  bool is_found = false;

  float worstDist() const { return distance2; }
  bool full() const { return is_found; }
  std::size_t size() const { return is_found ? 1 : 0; }
  bool addPoint(float squared, std::uint32_t sample) {
    if (squared < distance2) distance2 = squared, index = sample, is_found = true;
    return true;  // the search goes on
  }
};

/// For each step of shrink_ball(), the sample nearest to the centre of the ball before, which was
/// a neighbour's and is thus near this one's, too.
using NearestBefore = std::array<std::uint32_t, kMaxShrinkSteps>;

float squared_distance(Vec3 a, Vec3 b) { return dot(a - b, a - b); }

/// Computes the radius of the largest ball that touches the boundary in sample `i`, on the side
/// that the normal `inward` points to, and contains no other sample. A ball through the sample's
/// point p, with its centre on the normal, shrinks until the sample q nearest to its centre lies on
/// it: r <- |q - p|^2 / (2 inward . (q - p)) (Ma, Bae and Choi 2012). `radius`: the initial radius.
/// `before` makes searches shorter, and does not change their results.
float shrink_ball(const Tree& tree, const std::vector<BoundarySample>& samples, std::size_t i,
                  Vec3 inward, float radius, NearestBefore& before) {
  // Samples p and q of the same smooth sheet enclose a small angle at the centre. A ball that
  // shrinks to such a q measures facets and noise, not the solid.
  constexpr float kMaxCosine = 0.87f;      // of the angle: at least 30 degrees
  constexpr float kUnchanged = 1 - 1e-4f;  // ratios of radii above it are taken for rounding
  constexpr float kRounding = 1 + 1e-4f;   // more than a search's squared distances are off
  const Vec3 p = samples[i].point;
  for (int step = 0; step < kMaxShrinkSteps; ++step) {
    const Vec3 c = p + inward * radius;
    const float query[3] = {c.x, c.y, c.z};
    // The nearest sample is no further away than p and the one before.
    const float max_distance2 =
        std::min(radius * radius, squared_distance(samples[before[step]].point, c));
    NearestSample nearest{max_distance2 * kRounding, static_cast<std::uint32_t>(i)};
    tree.findNeighbors(nearest, query, nanoflann::SearchParams());
    before[step] = nearest.index;
    const bool is_empty = nearest.index == i || !(nearest.distance2 < radius * radius * kUnchanged);
    if (is_empty) break;
    const Vec3 q = samples[nearest.index].point, d = q - p;
    const float projection = dot(d, inward);
    if (!(projection > 0)) break;  // no ball through p on this side touches q
    const float next = dot(d, d) / (2 * projection);
    // The angle is measured at the new centre.
    const Vec3 center = p + inward * next;
    if (step > 0 && dot(normalized(p - center), normalized(q - center)) > kMaxCosine) break;
    if (!(next < radius * kUnchanged)) break;
    radius = next;
  }
  return radius;
}

/// Sets the radii of the samples' inner and outer balls, as far as other samples limit them.
void measure_balls(std::vector<BoundarySample>& samples, float diagonal) {
  const Points points{samples};
  const Tree tree(3, points, nanoflann::KDTreeSingleIndexAdaptorParams(/*leaf_max_size=*/12));
  parallel_ranges(
      static_cast<std::int64_t>(samples.size()), /*grain=*/64,
      [&](std::int64_t begin, std::int64_t end) {
        NearestBefore inner{}, outer{};
        for (std::int64_t k = begin; k < end; ++k) {
          const auto i = static_cast<std::size_t>(k);
          const Vec3 n = samples[i].normal;
          samples[i].inner_radius = shrink_ball(tree, samples, i, -n, diagonal / 2, inner);
          samples[i].outer_radius = shrink_ball(tree, samples, i, n, diagonal / 2, outer);
        }
      });
}

/// Shrinks balls that pass through a wall thinner than the samples' spacing: a ball with a probe on
/// the wrong side of the boundary shrinks until it contains no face. Other balls do not, because
/// faces inside the solid, where components overlap, must not limit them.
void shrink_to_walls(std::vector<BoundarySample>& samples, const Model& model,
                     const InsideTest& inside) {
  // Positions along the ball's diameter, from the sample inwards, in radii.
  constexpr float kProbePositions[] = {0.3f, 0.6f, 1.0f, 1.6f};
  constexpr std::size_t kCount = std::size(kProbePositions);
  // Consecutive samples are near to each other, and so are their probes at one position, which are
  // then tested faster.
  std::vector<Vec3> probes;
  probes.reserve(2 * kCount * samples.size());
  for (const float t : kProbePositions) {
    for (const BoundarySample& s : samples)
      probes.push_back(s.point - s.normal * (t * s.inner_radius));
    for (const BoundarySample& s : samples)
      probes.push_back(s.point + s.normal * (t * s.outer_radius));
  }
  const std::vector<std::uint8_t> is_inside = inside.inside(probes);
  // Probes of inner balls (side 0) must be inside, those of outer balls (side 1) outside.
  std::vector<std::size_t> leaking_balls;  // 2 i: inner ball of sample i; 2 i + 1: outer
  for (std::size_t i = 0; i < samples.size(); ++i)
    for (const std::size_t side : {0u, 1u})
      for (std::size_t k = 0; k < kCount; ++k)
        if ((is_inside[(2 * k + side) * samples.size() + i] != 0) != (side == 0)) {
          leaking_balls.push_back(2 * i + side);
          break;
        }
  if (leaking_balls.empty()) return;
  const ClosestPointQuery faces(model);
  parallel_for(
      static_cast<std::int64_t>(leaking_balls.size()),
      [&](std::int64_t k) {
        const std::size_t ball = leaking_balls[static_cast<std::size_t>(k)];
        BoundarySample& s = samples[ball / 2];
        float& radius = ball % 2 ? s.outer_radius : s.inner_radius;
        const Vec3 n = ball % 2 ? s.normal : -s.normal;
        for (int step = 0; step < kMaxShrinkSteps; ++step) {
          // The factor excludes the sample's own face, which the ball touches.
          const ClosestPoint q = faces.closest(s.point + n * radius, radius * 0.999f);
          if (q.triangle == ClosestPoint::kNoTriangle) break;
          const Vec3 d = q.point - s.point;
          const float projection = dot(d, n), next = dot(d, d) / (2 * projection);
          if (!(projection > 0) || !(next < radius)) break;
          radius = next;
        }
      },
      /*grain=*/64);
}

/// Selects the surface samples that have the inside on exactly one side, and orients their normals
/// outward.
std::vector<BoundarySample> select_boundary(const std::vector<SurfaceSample>& surface,
                                            const InsideTest& inside, float diagonal) {
  const float probe_distance = 2e-4f * diagonal;
  std::vector<Vec3> probes;
  probes.reserve(2 * surface.size());
  for (const SurfaceSample& s : surface) {
    probes.push_back(s.point + s.normal * probe_distance);
    probes.push_back(s.point - s.normal * probe_distance);
  }
  const std::vector<std::uint8_t> is_inside = inside.inside(probes);
  std::vector<BoundarySample> samples;
  for (std::size_t i = 0; i < surface.size(); ++i) {
    const bool front = is_inside[2 * i] != 0, back = is_inside[2 * i + 1] != 0;
    if (front == back) continue;
    samples.push_back({surface[i].point, front ? -surface[i].normal : surface[i].normal,
                       /*inner_radius=*/0, /*outer_radius=*/0});
  }
  return samples;
}

}  // namespace

std::vector<BoundarySample> sample_boundary(const Model& model, const InsideTest& inside,
                                            std::size_t count) {
  const Box box = model.box();
  const float diagonal = box.diagonal();
  std::vector<BoundarySample> samples =
      select_boundary(sample_surface(model, count), inside, diagonal);
  // If more than a tenth of the samples lie on faces inside or outside the solid, a larger number
  // is drawn, of which about `count` should remain.
  if (samples.size() * 10 < count * 9 && !samples.empty()) {
    const std::size_t larger_count = std::min(count * count / samples.size(), 8 * count);
    samples = select_boundary(sample_surface(model, larger_count), inside, diagonal);
  }
  std::vector<Vec3> points;
  for (const BoundarySample& sample : samples) points.push_back(sample.point);
  std::vector<BoundarySample> sorted;
  sorted.reserve(samples.size());
  for (const std::uint32_t i : sort_by_morton_key(points, box)) sorted.push_back(samples[i]);
  measure_balls(sorted, diagonal);
  shrink_to_walls(sorted, model, inside);
  return sorted;
}

}  // namespace polymorph
