// BackendEngine: the Engine of any backend. It checks the input of each call and runs the passes
// (passes.h).
//
// A backend provides (cpu_backend.h has the simplest one)
//   Team: the threads that share one item of a pass, in groups of kGroup threads. each(n, f) and
//     each_group(n, f) call f(0) to f(n - 1), each in one thread or in one group. group_sum(),
//     group_max() and append() combine the values of a group's threads, scan() those of a team,
//     add() those of all teams; sync() waits for the team's threads. group_rank() numbers a group's
//     threads; leads_group() tests for rank 0. kParts teams share a node of the tree. V is float or
//     a pack;
//   kManyRoots, kHostMemory; for_each(), for_teams(), scan();
//   Buffer<T> with resize() and fit(); upload(), download(), output(), queue_download();
//   start_frame(), everything_fitted(), finish_frame(); pass_times(), memory_used();
//   and grow() and threads() if kHostMemory is true, else fetch_totals() and written().
// If memory runs out or a device fails, a backend throws EngineFailure or std::bad_alloc;
// BackendEngine converts both to a status.
//
// Only the passes know how many nodes, entries, vertices and triangles there are: the counts stay
// in backend memory, where the next pass reads them. The CUDA backend cannot read them between
// passes, so it uses the buffers of the last frame (call of the engine). If one is too small,
// passes write nothing beyond its end, everything_fitted() enlarges it, and the frame runs again.
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <new>
#include <string>
#include <utility>
#include <vector>

#include "engine.h"
#include "falloff.h"
#include "field_kinds.h"
#include "passes.h"
#include "validate.h"
#include "workspace.h"

namespace polymorph {

/// Calls f with the Field of `kind`: the one for round balls, which is faster, if all balls are
/// round.
template <class Function>
void with_field(const std::vector<Ball>& balls, FieldKind kind, const Function& f) {
  const bool round = std::all_of(balls.begin(), balls.end(), is_round);
  visit(kind, [&](auto field) {
    using Kind = decltype(field);
    if constexpr (Kind::kEllipsoids) {
      round ? f(Field<Kind, RoundBall>{}) : f(Field<Kind, EllipsoidBall>{});
    } else {
      f(Field<Kind, RoundBall>{});
    }
  });
}

template <class B>
class BackendEngine final : public Engine {
 public:
  explicit BackendEngine(B backend = B()) : work_(std::move(backend)) {}

  EngineStatus extract(const BallSet& set, const Grid& grid, const ExtractSettings& settings,
                       Mesh& mesh) override {
    EngineStatus status = check_input(set.balls(), settings);
    if (status.code == EngineCode::kOk) status = check_grid(grid);
    if (status.code == EngineCode::kOk && set.empty()) {
      clear(mesh);
      return status;
    }
    return extract_checked(std::move(status), mesh, settings.time_passes, [&] {
      with_field(set.balls(), settings.field, [&](auto field) {
        extract_balls<B, decltype(field)>(work_, set, grid, settings, mesh);
      });
    });
  }

  EngineStatus extract(const MorphSurface& surface, const Grid& grid,
                       const ExtractSettings& settings, Mesh& mesh) override {
    EngineStatus status = check_morph_surface(surface, settings);
    if (status.code == EngineCode::kOk) status = check_grid(grid);
    return extract_checked(std::move(status), mesh, settings.time_passes,
                           [&] { extract_morph(work_, surface, grid, settings, mesh); });
  }

  EngineStatus extract(const std::shared_ptr<const DistanceGrid>& object, const Grid& grid,
                       const ExtractSettings& settings, Mesh& mesh) override {
    EngineStatus status = check_distance_surface(object.get(), settings);
    if (status.code == EngineCode::kOk) status = check_grid(grid);
    return extract_checked(std::move(status), mesh, settings.time_passes,
                           [&] { extract_distances(work_, object, grid, settings, mesh); });
  }

  EngineStatus sample(const BallSet& set, const std::vector<Vec3>& points,
                      const ExtractSettings& settings, std::vector<float>& values) override {
    values.assign(points.size(), 0.0f);
    EngineStatus status = check_input(set.balls(), settings);
    if (status.code != EngineCode::kOk || set.empty() || points.empty()) return status;
    return run_guarded(settings.time_passes, [&] {
      with_field(set.balls(), settings.field, [&](auto field) {
        sample_balls<B, decltype(field)>(work_, set, points, settings, values);
      });
    });
  }

  EngineStatus move_balls(const std::shared_ptr<const BallPaths>& paths, const MotionState& state,
                          const std::vector<float>& eased_times, BallSet& balls) override {
    balls = {};
    const std::size_t count = paths->balls.size(), parts = paths->parts.size();
    if (!eased_times.empty() && eased_times.size() != count) {
      return bad_input(std::to_string(eased_times.size()) + " eased times for " +
                       std::to_string(count) +
                       " balls (must be one for each or none), give each ball its own");
    }
    for (const BallPath& path : paths->balls) {
      if (path.part >= parts) {
        return bad_input("a ball moves with part " + std::to_string(path.part) + " of " +
                         std::to_string(parts) + ", look at the plan");
      }
    }
    if (count == 0) return {};
    return run_guarded(/*time_passes=*/false,
                       [&] { balls = polymorph::move_balls(work_, paths, state, eased_times); });
  }

  EngineStatus interpolate(const BallSet& set, const std::vector<BallAttribute>& attributes,
                           const std::vector<Vec3>& points, const ExtractSettings& settings,
                           std::vector<AttributeValues>& values) override {
    EngineStatus status = check_input(set.balls(), settings);
    const std::size_t maps = set.empty() ? 0 : attributes.size() / set.size();
    if (status.code == EngineCode::kOk && !points.empty() &&
        (maps < 1 || maps > 2 || maps * set.size() != attributes.size())) {
      status = bad_input(std::to_string(attributes.size()) + " values for " +
                         std::to_string(set.size()) +
                         " balls to carry (must be one or two for each), give each ball its own");
    }
    if (status.code != EngineCode::kOk || points.empty()) {
      values.clear();
      return status;
    }
    return run_guarded(settings.time_passes, [&] {
      values.resize(maps * points.size());
      with_field(set.balls(), settings.field, [&](auto field) {
        interpolate_balls<B, decltype(field)>(work_, set, attributes, points, settings, values);
      });
    });
  }

  EngineStatus regress(const std::shared_ptr<const Regression>& regression,
                       const std::vector<Vec3>& points,
                       std::vector<AttributeValues>& values) override {
    values.clear();
    const EngineStatus status = check_regression(*regression);
    if (status.code != EngineCode::kOk || points.empty()) return status;
    return run_guarded(/*time_passes=*/false,
                       [&] { sample_map(work_, regression, points, values); });
  }

  void limit_memory(std::size_t bytes) override { max_memory_ = bytes; }
  std::vector<PassTime> pass_times() const override { return work_.backend.pass_times(); }
  std::size_t memory_used() const override { return work_.backend.memory_used(); }

 private:
  /// Runs passes that extract into `mesh`, unless the check of their input failed with `status`.
  /// Clears the mesh after any failure.
  template <class Passes>
  EngineStatus extract_checked(EngineStatus status, Mesh& mesh, bool time_passes,
                               const Passes& passes) {
    if (status.code == EngineCode::kOk) status = run_guarded(time_passes, passes);
    if (status.code != EngineCode::kOk) clear(mesh);
    return status;
  }
  static void clear(Mesh& mesh) {
    mesh.positions.clear();
    mesh.normals.clear();
    mesh.triangles.clear();
  }

  /// Runs passes and converts what the backend throws to a status.
  template <class Passes>
  EngineStatus run_guarded(bool time_passes, const Passes& passes) {
    try {
      work_.backend.start_frame(max_memory_, time_passes);
      passes();
      work_.backend.finish_frame();
    } catch (const EngineFailure& failure) {
      return failure.status;
    } catch (const std::bad_alloc&) {
      return {EngineCode::kOutOfMemory,
              "out of memory while extracting the surface (the grid needs more than this machine "
              "has), use a coarser grid"};
    }
    return {};
  }

  Workspace<B> work_;
  std::size_t max_memory_ = 0;
};

}  // namespace polymorph
