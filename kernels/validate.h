// Input validation of the engine, and the exception by which a backend reports a failure. Host
// only.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include "distance_field.h"
#include "engine.h"
#include "falloff.h"
#include "field_kinds.h"
#include "regression.h"

namespace polymorph {

/// Thrown by a backend inside the passes; never leaves the engine.
struct EngineFailure {
  EngineStatus status;
};

inline bool is_finite(Vec3 a) {
  return std::isfinite(a.x) && std::isfinite(a.y) && std::isfinite(a.z);
}

inline bool is_finite(const Sym3& s) {
  return is_finite(Vec3{s.xx, s.yy, s.zz}) && is_finite(Vec3{s.xy, s.xz, s.yz});
}

inline EngineStatus bad_input(std::string message) {
  return {EngineCode::kBadInput, std::move(message)};
}

/// Throws if `bytes` exceed `limit`, unless that is 0.
inline void check_memory(std::size_t bytes, std::size_t limit) {
  if (limit == 0 || bytes <= limit) return;
  const auto mega = [](std::size_t b) { return std::to_string((b + 999999) / 1000000) + " MB"; };
  throw EngineFailure{{EngineCode::kOutOfMemory, "the surface needs " + mega(bytes) +
                                                     " (the limit is " + mega(limit) +
                                                     "), use a coarser grid or a higher limit"}};
}

inline EngineStatus check_distances(const DistanceGrid& distances) {
  const Int3 n = distances.grid.points;
  if (n.x >= 2 && n.y >= 2 && n.z >= 2 &&
      static_cast<std::int64_t>(distances.values.size()) == std::int64_t{n.x} * n.y * n.z) {
    return {};
  }
  return bad_input("a distance field has " + std::to_string(distances.values.size()) +
                   " values for " + std::to_string(n.x) + " x " + std::to_string(n.y) + " x " +
                   std::to_string(n.z) + " points, look at the model that it was made of");
}

inline EngineStatus check_regression(const Regression& regression) {
  const Int3 n = regression.lattice.points;
  if (n.x < 4 || n.y < 4 || n.z < 4 || !(regression.lattice.cell > 0)) {
    return bad_input("the lattice of a map has " + std::to_string(n.x) + " x " +
                     std::to_string(n.y) + " x " + std::to_string(n.z) +
                     " nodes (each axis needs 4), use a finer one");
  }
  if (regression.samples.empty() || regression.maps < 1 || regression.maps > 2 ||
      regression.values.size() !=
          regression.samples.size() * static_cast<std::size_t>(regression.maps)) {
    return bad_input(std::to_string(regression.values.size()) + " values for " +
                     std::to_string(regression.samples.size()) +
                     " samples of a map (must be one or two for each), give each sample its own");
  }
  for (const RegressionSample& sample : regression.samples) {
    if (!is_finite(sample.center) || !(sample.mass > 0) || !(sample.deviation > 0)) {
      return bad_input(
          "a sample of a map has a place that is not finite, or no mass or deviation, look at the "
          "plan that made it");
    }
  }
  for (const RegressionLandmark& landmark : regression.landmarks) {
    if (!is_finite(landmark.position) || !is_finite(landmark.goal[0]) ||
        !is_finite(landmark.goal[1]) || !(landmark.deviation > 0)) {
      return bad_input(
          "a landmark of a map has a place that is not finite, or no deviation, look at the plan "
          "that made it");
    }
  }
  const auto& [from, to] = regression.thinness;
  if (!from && !to) return {};
  if (!from || !to || regression.maps != 2) {
    return bad_input("the level's weights need two maps and how thin both objects are");
  }
  const EngineStatus status = check_distances(*from);
  return status.code == EngineCode::kOk ? check_distances(*to) : status;
}

inline EngineStatus check_refine_steps(const ExtractSettings& settings) {
  if (settings.refine_steps >= 0 && settings.refine_steps <= 4) return {};
  return bad_input("refine_steps is " + std::to_string(settings.refine_steps) +
                   " (must lie in 0..4), use 1");
}

/// Checks the input of a surface of distances, except the grid on which it is extracted.
inline EngineStatus check_distance_surface(const DistanceGrid* object,
                                           const ExtractSettings& settings) {
  if (!object) return bad_input("a surface of distances needs a distance field");
  if (!(object->lipschitz >= 0) || !std::isfinite(object->lipschitz)) {
    return bad_input("a distance field has the Lipschitz constant " +
                     std::to_string(object->lipschitz) + " (must be 0 or more, and finite)");
  }
  EngineStatus status = check_distances(*object);
  return status.code == EngineCode::kOk ? check_refine_steps(settings) : status;
}

/// Checks the input of a surface between two objects, except the grid on which it is extracted.
inline EngineStatus check_morph_surface(const MorphSurface& surface,
                                        const ExtractSettings& settings) {
  if (!surface.map || !surface.from || !surface.to) {
    return bad_input("a surface between two objects needs a map and both distance fields");
  }
  const auto same_grid = [](const Grid& a, const Grid& b) {
    return a.origin == b.origin && a.cell == b.cell && a.points.x == b.points.x &&
           a.points.y == b.points.y && a.points.z == b.points.z;
  };
  for (const auto& [object, smooth] : {std::pair(surface.from.get(), surface.smooth_from.get()),
                                       std::pair(surface.to.get(), surface.smooth_to.get())}) {
    EngineStatus status = check_distances(*object);
    if (status.code == EngineCode::kOk && smooth) status = check_distances(*smooth);
    if (status.code != EngineCode::kOk) return status;
    if (smooth && !same_grid(object->grid, smooth->grid)) {
      return bad_input("distances without detail lie on another grid than those with it");
    }
  }
  if (!std::isfinite(surface.level) || !(surface.linear_range >= 0)) {
    return bad_input("the level or linear_range of a surface between two objects is out of range");
  }
  EngineStatus status = check_refine_steps(settings);
  return status.code == EngineCode::kOk ? check_regression(*surface.map) : status;
}

inline EngineStatus check_input(const std::vector<Ball>& balls, const ExtractSettings& settings) {
  // The lower bound keeps iso * cutoff within the normal floats.
  if (!(settings.iso >= 1e-20f && settings.iso <= 1e20f)) {
    return bad_input("iso is " + std::to_string(settings.iso) +
                     " (must lie in 1e-20..1e20), use 1");
  }
  if (!(settings.cutoff >= 1e-12f && settings.cutoff <= 0.1f)) {
    return bad_input("cutoff is " + std::to_string(settings.cutoff) +
                     " (must lie in 1e-12..0.1), use 1e-4");
  }
  if (EngineStatus status = check_refine_steps(settings); status.code != EngineCode::kOk) {
    return status;
  }
  if (settings.sample_stride < 1 || settings.sample_stride > 16) {
    return bad_input("influence is " + std::to_string(settings.sample_stride) +
                     " (must lie in 1..16), use 1");
  }
  // A node's balls are counted in floats, which represent all integers up to 2^24.
  constexpr std::size_t kMaxBalls = std::size_t{1} << 20;
  if (balls.size() > kMaxBalls) {
    return bad_input("there are " + std::to_string(balls.size()) +
                     " balls (the maximum is 2^20), use fewer");
  }
  const bool compact =
      visit(settings.field, [](auto field) { return decltype(field)::kCompactSupport; });
  for (std::size_t i = 0; i < balls.size(); ++i) {
    const Ball& ball = balls[i];
    if (!is_finite(ball.center) || !std::isfinite(ball.w) || (compact && !std::isfinite(ball.a))) {
      return bad_input(
          "ball " + std::to_string(i) +
          " has a center, a or w that is not a finite number (an earlier step divided by "
          "zero or overflowed), look at the spheres of this frame");
    }
    if (!compact) continue;
    if (!(ball.a >= 1e-30f)) {
      return bad_input("ball " + std::to_string(i) + " has a = " + std::to_string(ball.a) +
                       " (balls of this field need a > 0), give it a = blobbiness / radius^2");
    }
    double m[6];
    if (!is_round(ball) && !(is_finite(ball.shape) && factor_shape(ball.shape, 1, m))) {
      return bad_input("ball " + std::to_string(i) +
                       " has a shape that is not positive definite (its ellipsoid is no body, or "
                       "one axis is over 1000 times another), look at the fit that made it");
    }
  }
  return {};
}

/// Throws if there are too many vertices for 32-bit indices; the last index is never used.
inline void check_vertex_count(std::int64_t count) {
  if (count < std::int64_t{0xffffffff}) return;
  throw EngineFailure{{EngineCode::kBadInput,
                       "the surface would have " + std::to_string(count) +
                           " vertices or more (32-bit indices do not reach so far), use a coarser "
                           "grid"}};
}

inline EngineStatus check_grid(const Grid& grid) {
  const Int3 n = grid.points;
  const std::string size =
      std::to_string(n.x) + " x " + std::to_string(n.y) + " x " + std::to_string(n.z);
  if (n.x < 2 || n.y < 2 || n.z < 2) {
    return bad_input("the grid has " + size + " points (each axis needs 2), use a finer grid");
  }
  constexpr int kMaxPoints = 1 << 20;
  if (n.x > kMaxPoints || n.y > kMaxPoints || n.z > kMaxPoints) {
    return bad_input("the grid has " + size +
                     " points (the maximum is 2^20 per axis), use a coarser grid");
  }
  if (!(grid.cell > 0) || !std::isfinite(grid.cell) || !is_finite(grid.origin)) {
    return bad_input(
        "the grid's cell or origin is not a finite number or the cell is not positive (the box "
        "around "
        "the balls is empty or too large), look at the placement of the models");
  }
  const Vec3 last = grid_point(grid, {n.x - 1, n.y - 1, n.z - 1});
  float extent = 0;
  for (float a : {grid.origin.x, grid.origin.y, grid.origin.z, last.x, last.y, last.z}) {
    extent = std::max(extent, std::fabs(a));
  }
  // At coordinate x, floats are at most 2^-23 x apart. With fewer than 16 floats per cell the
  // surface would show steps.
  if (!(extent * 0x1p-23f * 16 < grid.cell)) {
    return bad_input(
        "the grid's cells of " + std::to_string(grid.cell) + " are too small at a distance of " +
        std::to_string(extent) +
        " from the origin (float coordinates cannot tell them apart), move the scene closer to "
        "the origin or use a coarser grid");
  }
  return {};
}

/// Adds to the time of pass `name`, or appends the pass. Names are compared as text.
inline void add_pass_time(std::vector<PassTime>& times, const char* name, double seconds) {
  for (PassTime& time : times) {
    if (std::strcmp(time.name, name) == 0) {
      time.seconds += seconds;
      return;
    }
  }
  times.push_back({name, seconds});
}

}  // namespace polymorph
