#include "spheres/carry_balls.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

#include "base/parallel.h"
#include "base/procrustes.h"
#include "base/result.h"
#include "kernels/linear.h"

namespace polymorph {
namespace {

/// The surface as a graph. Its nodes are representatives: the first of each set of coincident
/// points. All lists have one entry per point of the model.
struct PointGraph {
  std::vector<std::uint32_t> representative;
  std::vector<std::vector<std::uint32_t>> neighbors;  ///< adjacent representatives
  std::vector<float> areas;  ///< a third of the area of a representative's triangles, else 0
};

PointGraph make_graph(const Model& model) {
  PointGraph graph;
  const std::size_t n = model.points.size();
  std::map<std::array<float, 3>, std::uint32_t> first_at;
  for (std::uint32_t i = 0; i < n; ++i) {
    const Vec3 p = model.points[i];
    graph.representative.push_back(first_at.try_emplace({p.x, p.y, p.z}, i).first->second);
  }
  graph.neighbors.resize(n);
  graph.areas.assign(n, 0);
  for (const Triangle& t : model.triangles) {
    const Vec3 a = model.points[t.v[0]], b = model.points[t.v[1]], c = model.points[t.v[2]];
    const float third_of_area = length(cross(b - a, c - a)) / 6;
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t here = graph.representative[t.v[k]],
                          next = graph.representative[t.v[(k + 1) % 3]];
      graph.areas[here] += third_of_area;
      graph.neighbors[here].push_back(next);
      graph.neighbors[next].push_back(here);
    }
  }
  return graph;
}

/// Lists the points within `radius` of `center` that are connected with `seed` inside this sphere.
std::vector<std::uint32_t> grow_region(const Model& model, const PointGraph& graph,
                                       std::uint32_t seed, Vec3 center, float radius) {
  std::vector<std::uint32_t> region{seed};
  std::vector<bool> seen(model.points.size());
  seen[seed] = true;
  for (std::size_t k = 0; k < region.size(); ++k)
    for (const std::uint32_t next : graph.neighbors[region[k]]) {
      if (seen[next] || !(length(model.points[next] - center) < radius)) continue;
      seen[next] = true;
      region.push_back(next);
    }
  return region;
}

/// Lists the points that a ball moves with, as bind_balls() does. `size`: the diagonal of the
/// model's box.
std::vector<BoundPoint> bind_ball(const Model& model, const PointGraph& graph, const Ball& ball,
                                  float size) {
  // The region's radius is kRadiusFactor times the distance to the surface, or times the ball's
  // radius if that is larger. It grows by kGrowth until there are enough points to determine a
  // rotation.
  constexpr float kRadiusFactor = 1.6f, kGrowth = 1.4f;
  constexpr std::size_t kMinPoints = 12;
  std::uint32_t seed = 0;
  float nearest = std::numeric_limits<float>::infinity();
  for (std::uint32_t i = 0; i < model.points.size(); ++i)
    if (const float d = length(model.points[i] - ball.center);
        d < nearest && graph.areas[i] > 0 && graph.representative[i] == i)
      nearest = d, seed = i;
  float radius = kRadiusFactor * std::max(nearest, 1 / std::sqrt(ball.a));
  std::vector<std::uint32_t> region = grow_region(model, graph, seed, ball.center, radius);
  while (region.size() < kMinPoints && radius < 2 * size) {
    radius *= kGrowth;
    region = grow_region(model, graph, seed, ball.center, radius);
  }
  std::vector<BoundPoint> bound;
  for (const std::uint32_t i : region) {
    const Vec3 offset = model.points[i] - ball.center;
    const float falloff = 1 - dot(offset, offset) / (radius * radius);
    // The weight has the square of the falloff; 1e-4 keeps the sum of the weights positive.
    bound.push_back({i, graph.areas[i] * (std::max(falloff, 0.0f) * falloff + 1e-4f)});
  }
  return bound;
}

}  // namespace

std::vector<std::vector<BoundPoint>> bind_balls(const Model& model, std::span<const Ball> balls) {
  PM_CHECK(!model.triangles.empty());
  const PointGraph graph = make_graph(model);
  const float size = model.box().diagonal();
  std::vector<std::vector<BoundPoint>> bound(balls.size());
  parallel_for(
      static_cast<std::int64_t>(balls.size()),
      [&](std::int64_t index) {
        const auto i = static_cast<std::size_t>(index);
        bound[i] = bind_ball(model, graph, balls[i], size);
      },
      /*grain=*/1);
  return bound;
}

CarriedBalls carry_balls(const Model& model, std::span<const Ball> balls,
                         std::span<const std::vector<BoundPoint>> bound,
                         std::span<const Vec3> posed) {
  PM_CHECK(balls.size() == bound.size() && posed.size() == model.points.size());
  CarriedBalls carried;
  for (std::size_t i = 0; i < balls.size(); ++i) {
    // The similarity from the points to the posed points, by weighted least squares.
    const PairMoments moments = pair_moments(bound[i].size(), [&](std::size_t k) {
      const auto [point, weight] = bound[i][k];
      return WeightedPair{Vec3d(model.points[point]), Vec3d(posed[point]),
                          static_cast<double>(weight)};
    });
    const Mat3 rotation = nearest_rotation(moments.covariance);
    const double scale = moments.scale();
    Ball ball = balls[i];
    ball.center =
        to_float(moments.to_center + rotation * (Vec3d(ball.center) - moments.from_center) * scale);
    ball.a = static_cast<float>(static_cast<double>(ball.a) / (scale * scale));
    if (!is_round(ball))
      ball.shape = to_sym3(rotation * to_mat3(ball.shape) * transposed(rotation));
    carried.balls.push_back(ball);
    carried.rotations.push_back(rotation);
  }
  return carried;
}

}  // namespace polymorph
