#include "spheres/carry_balls.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

#include "base/parallel.h"
#include "base/result.h"
#include "kernels/linear.h"

namespace polymorph {
namespace {

/// The surface as a graph: points in the same place are one.
struct PointGraph {
  std::vector<std::uint32_t> first;                   ///< first point in the place of each
  std::vector<std::vector<std::uint32_t>> neighbors;  ///< neighbours of each first point
  std::vector<float> areas;                           ///< area around each first point
};

PointGraph make_graph(const Model& model) {
  PointGraph graph;
  const std::size_t n = model.points.size();
  std::map<std::array<float, 3>, std::uint32_t> places;
  for (std::uint32_t i = 0; i < n; ++i) {
    const Vec3 p = model.points[i];
    graph.first.push_back(places.try_emplace({p.x, p.y, p.z}, i).first->second);
  }
  graph.neighbors.resize(n);
  graph.areas.assign(n, 0);
  for (const Triangle& t : model.triangles) {
    const Vec3 a = model.points[t.v[0]], b = model.points[t.v[1]], c = model.points[t.v[2]];
    const float share = length(cross(b - a, c - a)) / 6;
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t here = graph.first[t.v[k]], next = graph.first[t.v[(k + 1) % 3]];
      graph.areas[here] += share;
      graph.neighbors[here].push_back(next);
      graph.neighbors[next].push_back(here);
    }
  }
  return graph;
}

/// Lists the points within `reach` of a place that are connected with `seed` there.
std::vector<std::uint32_t> grow_region(const Model& model, const PointGraph& graph,
                                       std::uint32_t seed, Vec3 place, float reach) {
  std::vector<std::uint32_t> region{seed};
  std::vector<bool> seen(model.points.size());
  seen[seed] = true;
  for (std::size_t k = 0; k < region.size(); ++k)
    for (const std::uint32_t next : graph.neighbors[region[k]]) {
      if (seen[next] || !(length(model.points[next] - place) < reach)) continue;
      seen[next] = true;
      region.push_back(next);
    }
  return region;
}

std::vector<BoundPoint> bind_ball(const Model& model, const PointGraph& graph, const Ball& ball,
                                  float size) {
  constexpr float kReach = 1.6f, kGrowth = 1.4f;  // times the way to the surface; per try
  constexpr std::size_t kMin = 12;                // points that tell a rotation
  std::uint32_t seed = 0;
  float nearest = std::numeric_limits<float>::infinity();
  for (std::uint32_t i = 0; i < model.points.size(); ++i)
    if (const float d = length(model.points[i] - ball.center);
        d < nearest && graph.areas[i] > 0 && graph.first[i] == i)
      nearest = d, seed = i;
  float reach = kReach * std::max(nearest, 1 / std::sqrt(ball.a));
  std::vector<std::uint32_t> region = grow_region(model, graph, seed, ball.center, reach);
  while (region.size() < kMin && reach < 2 * size) {
    reach *= kGrowth;
    region = grow_region(model, graph, seed, ball.center, reach);
  }
  std::vector<BoundPoint> bound;
  for (const std::uint32_t i : region) {
    const Vec3 offset = model.points[i] - ball.center;
    const float near = 1 - dot(offset, offset) / (reach * reach);
    bound.push_back({i, graph.areas[i] * (std::max(near, 0.0f) * near + 1e-4f)});
  }
  return bound;
}

/// The similarity x -> to + scale turn (x - from).
struct Motion {
  Vec3d from, to;
  Mat3 turn;
  double scale = 1;
};

Motion fit_motion(std::span<const Vec3> points, std::span<const BoundPoint> bound,
                  std::span<const Vec3> posed) {
  Motion motion;
  double weights = 0;
  for (const auto& [i, weight] : bound) {
    const auto w = static_cast<double>(weight);
    motion.from = motion.from + Vec3d(points[i]) * w;
    motion.to = motion.to + Vec3d(posed[i]) * w;
    weights += w;
  }
  motion.from = motion.from * (1 / weights);
  motion.to = motion.to * (1 / weights);
  Mat3 sum{{0, 0, 0, 0, 0, 0, 0, 0, 0}};
  double from_square = 0, to_square = 0;
  for (const auto& [i, weight] : bound) {
    const auto w = static_cast<double>(weight);
    const Vec3d p = Vec3d(points[i]) - motion.from, q = Vec3d(posed[i]) - motion.to;
    const double a[3] = {p.x, p.y, p.z}, b[3] = {q.x, q.y, q.z};
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) sum.at(r, c) += w * b[r] * a[c];
    from_square += w * dot(p, p);
    to_square += w * dot(q, q);
  }
  motion.turn = nearest_rotation(sum);
  if (from_square > 0 && to_square > 0) motion.scale = std::sqrt(to_square / from_square);
  return motion;
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
      1);
  return bound;
}

CarriedBalls carry_balls(const Model& model, std::span<const Ball> balls,
                         std::span<const std::vector<BoundPoint>> bound,
                         std::span<const Vec3> posed) {
  PM_CHECK(balls.size() == bound.size() && posed.size() == model.points.size());
  CarriedBalls carried;
  for (std::size_t i = 0; i < balls.size(); ++i) {
    const Motion motion = fit_motion(model.points, bound[i], posed);
    Ball ball = balls[i];
    ball.center =
        to_float(motion.to + motion.turn * (Vec3d(ball.center) - motion.from) * motion.scale);
    ball.a = static_cast<float>(static_cast<double>(ball.a) / (motion.scale * motion.scale));
    if (!is_round(ball))
      ball.shape = to_sym3(motion.turn * to_mat3(ball.shape) * transposed(motion.turn));
    carried.balls.push_back(ball);
    carried.turns.push_back(motion.turn);
  }
  return carried;
}

}  // namespace polymorph
