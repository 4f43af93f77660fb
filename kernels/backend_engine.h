// BackendEngine: the sequence of all passes of the engine, written once for every backend.
//
// A backend gives: Team (how the threads that share one item work together: V, kParts, each,
// each_group, group_sum, group_max, sync, scan, append, add); kManyRoots; for_each and for_teams;
// scan; Buffer<T> with resize and fit; upload, download, output; start_frame,
// everything_fitted, finish_frame. What it cannot do
// (memory, a failing device) it throws as EngineFailure or std::bad_alloc; both end here and leave
// as a status.
//
// How many nodes, entries, vertices and triangles there are is known only to the passes: counts
// stay in backend memory, where the next pass reads them. A backend that cannot read them in
// between (CUDA) works with the memory of the last frame; where that was too small, passes write
// nothing beyond it, everything_fitted() makes it larger, and the frame runs again.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <new>
#include <string>
#include <type_traits>
#include <vector>

#include "ball_paths.h"
#include "bricks.h"
#include "cubes.h"
#include "engine.h"
#include "expand_far_field.h"
#include "field.h"
#include "interpolate_attributes.h"
#include "mc_tables.h"
#include "morph_field.h"
#include "regression.h"
#include "tree.h"
#include "triangles.h"
#include "validate.h"
#include "vertices.h"

namespace polymorph {

/// Calls f with the Field to compile for: round balls alone keep the short path.
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

/// The power of two above half the size of the balls' box, or above the largest lone ball's radius.
inline float length_of(const std::vector<Ball>& balls) {
  Vec3 low = balls[0].center, high = low;
  float w = 0;
  for (const Ball& ball : balls) {
    low = min(low, ball.center), high = max(high, ball.center);
    w = std::max(w, std::fabs(ball.w));
  }
  const Vec3 size = high * 0.5f - low * 0.5f;
  const float length = std::max({size.x, size.y, size.z, std::sqrt(w), 1e-15f});
  int exponent = 0;
  std::frexp(std::min(length, 1e15f), &exponent);
  return std::ldexp(1.0f, exponent);
}

/// Buffers and passes of one engine. Memory grows with the bricks at the surface.
template <class B>
class BackendEngine final : public Engine {
 public:
  explicit BackendEngine(B backend = B()) : backend_(std::move(backend)) {}

  EngineStatus extract(const BallSet& set, const Grid& grid, const ExtractSettings& settings,
                       Mesh& mesh) override {
    const std::vector<Ball>& balls = set.balls();
    EngineStatus status = check_input(balls, settings);
    if (status.code == EngineCode::kOk) status = check_grid(grid);
    if (status.code == EngineCode::kOk && !balls.empty()) {
      status = guarded([&] {
        with_field(balls, settings.field,
                   [&](auto field) { extract_field<decltype(field)>(set, grid, settings, mesh); });
      });
      if (status.code == EngineCode::kOk) return status;
    }
    mesh.positions.clear();
    mesh.normals.clear();
    mesh.triangles.clear();
    return status;
  }

  EngineStatus sample(const BallSet& set, const std::vector<Vec3>& points,
                      const ExtractSettings& settings, std::vector<float>& values) override {
    const std::vector<Ball>& balls = set.balls();
    values.assign(points.size(), 0.0f);
    EngineStatus status = check_input(balls, settings);
    if (status.code != EngineCode::kOk || balls.empty() || points.empty()) return status;
    return guarded([&] {
      with_field(balls, settings.field,
                 [&](auto field) { sample_field<decltype(field)>(set, points, settings, values); });
    });
  }

  EngineStatus move_balls(const std::shared_ptr<const BallPaths>& paths, const MotionState& moment,
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
    return guarded([&] { compute_moved_balls(paths, moment, eased_times, balls); });
  }

  EngineStatus interpolate(const BallSet& set, const std::vector<BallAttribute>& carried,
                           const std::vector<Vec3>& points, const ExtractSettings& settings,
                           std::vector<AttributeValues>& values) override {
    const std::vector<Ball>& balls = set.balls();
    EngineStatus status = check_input(balls, settings);
    const std::size_t maps = balls.empty() ? 0 : carried.size() / balls.size();
    if (status.code == EngineCode::kOk && !points.empty() &&
        (maps < 1 || maps > 2 || maps * balls.size() != carried.size())) {
      status =
          bad_input(std::to_string(carried.size()) + " values for " + std::to_string(balls.size()) +
                    " balls to carry (must be one or two for each), give each ball its own");
    }
    if (status.code != EngineCode::kOk || points.empty()) {
      values.clear();
      return status;
    }
    return guarded([&] {
      values.resize(maps * points.size());
      with_field(balls, settings.field, [&](auto field) {
        if (maps == 1)
          interpolate_field<decltype(field), 1>(set, carried, points, settings, values);
        if (maps == 2)
          interpolate_field<decltype(field), 2>(set, carried, points, settings, values);
      });
    });
  }

  EngineStatus extract(const MorphSurface& between, const Grid& grid,
                       const ExtractSettings& settings, Mesh& mesh) override {
    EngineStatus status = check_between(between, settings);
    if (status.code == EngineCode::kOk) status = check_grid(grid);
    if (status.code == EngineCode::kOk) {
      status = guarded([&] { extract_morph(between, grid, settings, mesh); });
      if (status.code == EngineCode::kOk) return status;
    }
    mesh.positions.clear();
    mesh.normals.clear();
    mesh.triangles.clear();
    return status;
  }

  EngineStatus regress(const std::shared_ptr<const Regression>& regression,
                       const std::vector<Vec3>& points,
                       std::vector<AttributeValues>& values) override {
    values.clear();
    const EngineStatus status = check_regression(*regression);
    if (status.code != EngineCode::kOk || points.empty()) return status;
    return guarded([&] {
      const SmoothMap map = smooth_map(regression);
      const auto n = static_cast<std::int64_t>(points.size());
      values.resize(points.size() * static_cast<std::size_t>(regression->maps));
      const View<Vec3> at = sample_points_.resize(backend_, n);
      const View<AttributeValues> out =
          carried_values_.resize(backend_, static_cast<std::int64_t>(values.size()));
      backend_.upload(at, points.data());
      backend_.for_each(n, SampleMap{map, at, out, regression->maps}, "map");
      backend_.download(values.data(), out);
    });
  }

  void limit_memory(std::size_t bytes) override { max_memory_ = bytes; }
  std::vector<PassTime> pass_times() const override { return backend_.pass_times(); }
  std::size_t memory_used() const override { return backend_.memory_used(); }

 private:
  template <class T>
  using Buffer = typename B::template Buffer<T>;
  using V = typename B::Team::V;

  /// The balls as the kernels read them, the list of all of them, and the roots of the tree.
  template <class F>
  struct BallViews {
    View<typename F::Ball> balls;
    View<std::uint32_t> all_balls;
    View<Node> nodes;
    View<Counts> sums;
    View<FarField> far;  ///< of the roots, and the length of the field, where support is infinite
    float length = 1;

    BallList all() const { return {all_balls.data, static_cast<std::uint32_t>(all_balls.size)}; }
  };
  /// The levels below the roots, bricks first, and the roots along each axis.
  struct TreeShape {
    std::vector<Level> levels;
    Int3 roots = {1, 1, 1};
  };
  struct BrickViews {
    Tree tree;
    const std::int64_t* count = nullptr;
    /// Bricks that every view below can hold, but for values where they are kept block by block.
    std::int64_t capacity = std::numeric_limits<std::int64_t>::max();
    View<Node> nodes;
    View<std::uint32_t> entries;
    View<FarField> far;
    View<float> values;
    View<std::uint8_t> inside;
    View<std::uint32_t> rows;
    View<Counts> counts;
    View<Offsets> first;
  };

  /// Bricks, how to sample them, and the field as vertices need it.
  template <class Sample, class Source>
  struct Found {
    BrickViews bricks;
    Sample sample;
    Source source;
  };
  template <class Sample, class Source>
  static Found<Sample, Source> found(const BrickViews& bricks, const Sample& sample,
                                     const Source& source) {
    return {bricks, sample, source};
  }
  struct MeshViews {
    View<Vec3> positions, normals;
    View<Triangle> triangles;
  };

  template <class Passes>
  EngineStatus guarded(const Passes& passes) {
    try {
      backend_.start_frame(max_memory_);
      passes();
      backend_.finish_frame();
    } catch (const EngineFailure& failure) {
      return failure.status;
    } catch (const std::bad_alloc&) {
      return {EngineCode::kOutOfMemory,
              "out of memory while extracting the surface (the grid needs more than this machine "
              "has), use a coarser grid"};
    }
    return {};
  }

  template <class F>
  View<typename F::Ball> prepared(std::int64_t n) {
    if constexpr (std::is_same_v<typename F::Ball, RoundBall>) {
      return round_balls_.resize(backend_, n);
    } else {
      return ellipsoids_.resize(backend_, n);
    }
  }

  void compute_moved_balls(const std::shared_ptr<const BallPaths>& paths, const MotionState& moment,
                           const std::vector<float>& eased_times, BallSet& balls) {
    const auto sized = [&](auto& buffer, const auto& from) {
      return buffer.resize(backend_, static_cast<std::int64_t>(from.size()));
    };
    const View<BallPath> ways = sized(paths_, paths->balls);
    const View<PathPart> parts = sized(parts_, paths->parts);
    if (paths != uploaded_paths_) {
      uploaded_paths_.reset();
      backend_.upload(ways, paths->balls.data());
      backend_.upload(parts, paths->parts.data());
      uploaded_paths_ = paths;
    }
    const std::vector<PartPlace> places = places_at(paths->parts, moment.eased);
    const View<PartPlace> placed = sized(places_, places);
    backend_.upload(placed, places.data());
    const View<float> eased = sized(eased_, eased_times);
    if (!eased_times.empty()) backend_.upload(eased, eased_times.data());
    uploaded_balls_ = {};
    const View<Ball> moved = raw_balls_.resize(backend_, ways.size);
    backend_.for_each(ways.size, MoveBalls{ways, parts, placed, eased, moment, moved}, "step");
    std::vector<Ball> downloaded(paths->balls.size());
    backend_.download(downloaded.data(), moved);
    balls = uploaded_balls_ = BallSet(std::move(downloaded));
  }

  /// The balls in backend memory, where they may be already.
  View<Ball> upload(const BallSet& set) {
    const View<Ball> raw = raw_balls_.resize(backend_, static_cast<std::int64_t>(set.size()));
    if (!uploaded_balls_.is(set)) {
      uploaded_balls_ = {};
      backend_.upload(raw, set.balls().data());
      uploaded_balls_ = set;
    }
    return raw;
  }

  /// Prepares the balls, and the roots of a tree where it has levels.
  template <class F>
  BallViews<F> prepare(const BallSet& balls, const ExtractSettings& settings,
                       const TreeShape& shape = {}) {
    const auto n = static_cast<std::int64_t>(balls.size());
    const View<Ball> raw = upload(balls);
    BallViews<F> out;
    out.balls = prepared<F>(n);
    out.all_balls = all_balls_.resize(backend_, n);
    FieldScale scale;
    scale.log2_floor = log2(settings.cutoff * settings.iso);
    const std::size_t levels = shape.levels.size();
    const std::int64_t roots =
        levels == 0 ? 0 : std::int64_t{shape.roots.x} * shape.roots.y * shape.roots.z;
    View<Offsets> count;
    if (roots > 0) {
      out.nodes = nodes_[levels].resize(backend_, roots);
      out.sums = sums_[levels % 2].resize(backend_, roots);
      count = {&totals_view_[static_cast<std::int64_t>(levels)], 1};
    }
    if constexpr (!F::kCompactSupport) {
      scale.length = length_of(balls.balls());
      if (roots > 0) out.far = far_[levels % 2].resize(backend_, roots);
      out.length = scale.length;
    }
    backend_.for_each(std::max(n, roots),
                      PrepareBalls<F>{raw, out.balls, out.all_balls, scale, shape.roots, out.nodes,
                                      out.sums, count, out.far},
                      "prepare");
    return out;
  }

  template <class F>
  void sample_field(const BallSet& balls, const std::vector<Vec3>& points,
                    const ExtractSettings& settings, std::vector<float>& values) {
    const BallViews<F> in = prepare<F>(balls, settings);
    const auto n = static_cast<std::int64_t>(points.size());
    const View<Vec3> at = sample_points_.resize(backend_, n);
    const View<float> out = sample_values_.resize(backend_, n);
    backend_.upload(at, points.data());
    constexpr int kLanes = Lanes<V>::kCount;
    backend_.for_each((n + kLanes - 1) / kLanes, SamplePoints<F, V>{at, in.balls, in.all(), out},
                      "sample");
    backend_.download(values.data(), out);
  }

  template <class F, int kMaps>
  void interpolate_field(const BallSet& balls, const std::vector<BallAttribute>& carried,
                         const std::vector<Vec3>& points, const ExtractSettings& settings,
                         std::vector<AttributeValues>& values) {
    using Blend = InterpolateAttributes<F, V, kMaps>;
    const BallViews<F> in = prepare<F>(balls, settings);
    const auto n = static_cast<std::int64_t>(points.size());
    const Offsets runs = {(n + Blend::kRun - 1) / Blend::kRun, 0};
    const View<Offsets> count = totals_.resize(backend_, kMaxLevels + 1);
    const View<BallAttribute> from =
        carried_.resize(backend_, static_cast<std::int64_t>(carried.size()));
    const View<Vec3> at = sample_points_.resize(backend_, n);
    const View<AttributeValues> out = carried_values_.resize(backend_, kMaps * n);
    backend_.upload(View<Offsets>{count.data, 1}, &runs);
    backend_.upload(from, carried.data());
    backend_.upload(at, points.data());
    backend_.for_teams(&count[0].first, runs.first, Blend{at, in.balls, in.all(), from, out},
                       "blend");
    backend_.download(values.data(), out);
  }

  template <class F>
  void extract_field(const BallSet& balls, const Grid& grid, const ExtractSettings& settings,
                     Mesh& mesh) {
    const TreeShape shape = tree_shape(grid, B::kManyRoots && F::kCompactSupport);
    extract_bricks(grid, settings, mesh, [&](View<BrickTable> table) {
      const BallViews<F> in = prepare<F>(balls, settings, shape);
      BrickViews bricks = find_bricks<F>(in, shape, grid, settings);
      fit_bricks(grid, bricks);
      if constexpr (!F::kCompactSupport)
        bricks.capacity = std::min(bricks.capacity, bricks.far.size);
      const SampleBricks<F> sample = {counting(grid, settings, table, bricks, 0),
                                      settings.sample_stride,
                                      bricks.entries,
                                      in.balls,
                                      bricks.far,
                                      in.all()};
      return found(bricks, sample, ball_vertices<F>(in, grid, settings, bricks));
    });
  }

  void extract_morph(const MorphSurface& between, const Grid& grid, const ExtractSettings& settings,
                     Mesh& mesh) {
    const TreeShape shape = tree_shape(grid, B::kManyRoots);
    const MorphField field = {smooth_map(between.map),
                              distance_field(between.from),
                              distance_field(between.to),
                              between.from_scale,
                              between.to_scale,
                              between.level,
                              between.linear_range > 0 ? 1 / between.linear_range : 0};
    ExtractSettings at = settings;
    at.iso = 0;
    ClassifyMorph classify;
    classify.grid = grid;
    classify.field = field;
    classify.affine_norm = std::max(between.from_scale * norm_of(between.map->affine[0]),
                                    between.to_scale * norm_of(between.map->affine[1]));
    classify.lipschitz = std::max(between.from->lipschitz, between.to->lipschitz);
    classify.strain = bound_strain(between);
    extract_bricks(grid, at, mesh, [&](View<BrickTable> table) {
      BrickViews bricks = find_morph_bricks(shape, classify);
      fit_bricks(grid, bricks);
      return found(bricks, SampleMorph{counting(grid, at, table, bricks, -grid.cell), field},
                   MorphVertices{{field, 1 / grid.cell}});
    });
  }

  /// From a field to a mesh: `find` finds the bricks, and says how to sample them and what vertices
  /// need to know of the field.
  template <class Find>
  void extract_bricks(const Grid& grid, const ExtractSettings& settings, Mesh& mesh,
                      const Find& find) {
    const View<BrickTable> table = table_view();
    totals_view_ = totals_.resize(backend_, kMaxLevels + 1);
    const Offsets* total = &totals_view_[kMaxLevels];
    const std::int64_t guess = brick_guess(grid) * 100;
    Offsets totals[kMaxLevels + 1];
    MeshViews out;
    do {
      const auto at = find(table);
      const BrickViews& bricks = at.bricks;
      place_bricks(at.sample, at.source, grid, settings, bricks, mesh, out);
      if (settings.method == SurfaceMethod::kMatrix) {
        out.positions = backend_.output(mesh.positions, positions_, &total->first, guess);
        out.normals = backend_.output(mesh.normals, normals_, &total->first, guess);
        out.triangles = backend_.output(mesh.triangles, triangles_, &total->second, 2 * guess);
        const EmitCubes emit = {grid,          bricks.nodes,  bricks.inside,
                                bricks.rows,   bricks.counts, bricks.first,
                                out.positions, out.normals,   out.triangles};
        backend_.for_teams(bricks.count, bricks.capacity, emit, "triangles");
      } else {
        emit_triangles(table, grid, bricks, mesh, out);
      }
    } while (!backend_.everything_fitted(totals_view_, totals));
    const Offsets sizes = totals[kMaxLevels];
    check_vertex_count(sizes.first);
    if (!settings.download) return;
    backend_.download(mesh.positions, out.positions, sizes.first);
    if (settings.flat) {
      mesh.normals.clear();
    } else {
      backend_.download(mesh.normals, out.normals, sizes.first);
    }
    backend_.download(mesh.triangles, out.triangles, sizes.second);
  }

  /// Samples the bricks, numbers what they have, and places the vertices of marching cubes.
  ///
  /// Where the host knows the counts, block by block: values go from one pass to the next in the
  /// caches, and take no more memory for a finer grid. By themselves they would be the most that
  /// memory has to move.
  template <class Sample, class Source>
  void place_bricks(Sample sample, const Source& source, const Grid& grid,
                    const ExtractSettings& settings, const BrickViews& bricks, Mesh& mesh,
                    MeshViews& out) {
    Offsets* total = &totals_view_[kMaxLevels];
    const bool places = settings.method == SurfaceMethod::kMarchingCubes;
    if constexpr (B::kHostMemory) {
      *total = {};
      for (std::int64_t begin = 0; begin < *bricks.count; begin += brick_block()) {
        const std::int64_t n = std::min(brick_block(), *bricks.count - begin);
        sample.begin = begin;
        backend_.for_teams(&n, n, sample, "sample");
        const Offsets before = *total;
        backend_.scan({bricks.counts.data + begin, n}, &n, {bricks.first.data + begin, n}, total,
                      "number", before);
        check_vertex_count(total->first);
        if (!places) continue;
        const double share = static_cast<double>(begin + n) / static_cast<double>(*bricks.count);
        out.positions = backend_.grow(mesh.positions, before.first, total->first, share);
        out.normals = backend_.grow(mesh.normals, before.first, total->first, share);
        backend_.for_teams(
            &n, n, placing(source, grid, settings, bricks, begin, out.positions, out.normals),
            "vertices");
      }
      mesh.positions.resize(static_cast<std::size_t>(total->first));
      mesh.normals.resize(static_cast<std::size_t>(total->first));
    } else {
      backend_.for_teams(bricks.count, bricks.capacity, sample, "sample");
      backend_.scan({bricks.counts.data, bricks.capacity}, bricks.count, bricks.first, total,
                    "number");
      if (!places) return;
      const std::int64_t guess = brick_guess(grid) * 100;
      out.positions = backend_.output(mesh.positions, positions_, &total->first, guess);
      out.normals = backend_.output(mesh.normals, normals_, &total->first, guess);
      backend_.for_teams(bricks.count, bricks.capacity,
                         placing(source, grid, settings, bricks, 0, out.positions, out.normals),
                         "vertices");
    }
  }

  /// Block by block as well where the result is the caller's own memory: what is new in it is
  /// cleared when it grows, and still in the caches when triangles are written.
  void emit_triangles(View<BrickTable> table, const Grid& grid, const BrickViews& bricks,
                      Mesh& mesh, MeshViews& out) {
    const Offsets* total = &totals_view_[kMaxLevels];
    EmitTriangles emit = {0,           table,         bricks.tree,  bricks.inside,
                          bricks.rows, bricks.counts, bricks.first, bricks.capacity,
                          {}};
    if constexpr (B::kHostMemory) {
      const std::int64_t count = *bricks.count, block = 8 * brick_block();
      mesh.triangles.resize(
          std::min(mesh.triangles.size(), static_cast<std::size_t>(total->second)));
      std::int64_t before = 0;
      for (std::int64_t begin = 0; begin < count; begin += block) {
        const std::int64_t n = std::min(block, count - begin);
        const std::int64_t end = begin + n < count ? bricks.first[begin + n].second : total->second;
        const double share = static_cast<double>(end) / static_cast<double>(total->second);
        out.triangles = backend_.grow(mesh.triangles, before, end, share);
        before = end;
        emit.begin = begin;
        emit.triangles = out.triangles;
        backend_.for_teams(&n, n, emit, "triangles");
      }
    } else {
      out.triangles =
          backend_.output(mesh.triangles, triangles_, &total->second, brick_guess(grid) * 200);
      emit.triangles = out.triangles;
      backend_.for_teams(bricks.count, bricks.capacity, emit, "triangles");
    }
  }

  static Int3 divided(Int3 a, int by) {
    return {(a.x + by - 1) / by, (a.y + by - 1) / by, (a.z + by - 1) / by};
  }
  /// Down from one root, or from up to 4^3 of them: a GPU takes no longer for the children of all
  /// than for those of one. Where support is infinite, both begin alike: each level of polynomials
  /// rounds.
  static TreeShape tree_shape(const Grid& grid, bool many_roots) {
    const Int3 cells = {grid.points.x + 1, grid.points.y + 1, grid.points.z + 1};
    TreeShape out;
    out.levels = {{divided(cells, kBrickCells), kBrickCells}};
    for (Int3 n = out.levels[0].nodes; n.x > kBranching || n.y > kBranching || n.z > kBranching;
         n = out.levels.back().nodes) {
      out.levels.push_back({divided(n, kBranching), out.levels.back().cells * kBranching});
    }
    if (many_roots && out.levels.size() > 1) {
      out.roots = out.levels.back().nodes;
      out.levels.pop_back();
    }
    return out;
  }

  /// Cells around a brick in which the points lie that its values come from.
  static int margin_of(const ExtractSettings& settings) {
    return settings.sample_stride > 1 ? settings.sample_stride : 0;
  }

  /// Bricks that a smooth body filling the grid would have: where a backend's memory begins.
  static std::int64_t brick_guess(const Grid& grid) {
    const Int3 n = divided({grid.points.x + 1, grid.points.y + 1, grid.points.z + 1}, kBrickCells);
    const auto area = [](int a, int b) { return static_cast<std::int64_t>(a) * b; };
    return area(n.x, n.y) + area(n.y, n.z) + area(n.z, n.x) + kChildren;
  }

  /// Walks the tree from its roots to the bricks.
  template <class F>
  BrickViews find_bricks(const BallViews<F>& in, TreeShape shape, const Grid& grid,
                         const ExtractSettings& settings) {
    std::vector<Level>& levels = shape.levels;
    for (Level& level : levels) {
      level.margin = margin_of(settings);
      set_reach(level, grid.cell / in.length, settings.iso);
    }
    BrickViews out;
    out.tree.levels = static_cast<int>(levels.size());
    out.tree.roots = shape.roots;
    View<Node> parents = in.nodes;
    View<Counts> sums = in.sums;
    View<FarField> far = in.far;
    View<std::uint32_t> entries = in.all_balls;
    std::int64_t guess = brick_guess(grid);
    for (std::size_t l = 1; l < levels.size(); ++l) guess = guess / 8 + kChildren;
    for (std::size_t l = levels.size(); l-- > 0; guess *= 8) {
      const auto number = static_cast<std::int64_t>(l);
      const std::int64_t* count = &totals_view_[number + 1].first;
      const Offsets* total = &totals_view_[number];
      const View<std::uint32_t> child_entries =
          child_entries_.fit(backend_, count, kChildren, guess / 4 + 1);
      const View<Offsets> first = first_.fit(backend_, count, 1, guess / 4 + 1);
      // The buffers of the passes differ in capacity; none is used beyond the smallest.
      std::int64_t capacity =
          std::min({parents.size, sums.size, child_entries.size / kChildren, first.size});
      if constexpr (!F::kCompactSupport) capacity = std::min(capacity, far.size);
      backend_.for_teams(count, capacity,
                         ClassifyChildren<F>{grid, settings.iso, levels[l], parents, entries,
                                             in.balls, child_entries, sums, far},
                         "bricks", B::Team::kParts);
      backend_.scan({sums.data, capacity}, count, first, &totals_view_[number], "bricks");
      const View<Node> nodes = nodes_[l].fit(backend_, &total->first, 1, guess);
      View<Counts> node_sums;
      if (l > 0) node_sums = sums_[l % 2].fit(backend_, &total->first, 1, guess);
      const View<std::uint32_t> node_entries =
          entries_[l % 2].fit(backend_, &total->second, 1, 48 * guess);
      backend_.for_teams(count, capacity,
                         FillChildren<F>{grid, levels[l], parents, entries, in.balls, child_entries,
                                         first, nodes, node_sums, node_entries},
                         "bricks", B::Team::kParts);
      if constexpr (!F::kCompactSupport) {
        const View<FarField> node_far = far_[l % 2].fit(backend_, &total->first, 1, guess);
        backend_.for_teams(
            &total->first, std::min(nodes.size, node_far.size),
            ExpandFarField<F>{grid, levels[l], parents, nodes, entries, in.balls, far, node_far},
            "bricks");
        far = node_far;
      }
      out.tree.nodes[l + 1] = parents;
      parents = nodes;
      sums = node_sums;
      entries = node_entries;
    }
    out.tree.nodes[0] = parents;
    out.count = &totals_view_[0].first;
    out.nodes = parents;
    out.entries = entries;
    out.far = far;
    return out;
  }

  /// Bricks of a block: 0.5 MB of values for each thread, half of its cache's second level.
  std::int64_t brick_block() const { return 256 * backend_.threads(); }

  /// Allocates what is known of each brick.
  void fit_bricks(const Grid& grid, BrickViews& bricks) {
    const std::int64_t guess = brick_guess(grid);
    if constexpr (B::kHostMemory) {
      bricks.values =
          values_.resize(backend_, kBrickValues * std::min(brick_block(), *bricks.count));
    } else {
      bricks.values = values_.fit(backend_, bricks.count, kBrickValues, guess);
      bricks.capacity = bricks.values.size / kBrickValues;
    }
    bricks.inside = inside_.fit(backend_, bricks.count, kLines, guess);
    bricks.rows = rows_.fit(backend_, bricks.count, kRows, guess);
    bricks.counts = brick_counts_.fit(backend_, bricks.count, 1, guess);
    bricks.first = brick_first_.fit(backend_, bricks.count, 1, guess);
    bricks.capacity = std::min({bricks.capacity, bricks.nodes.size, bricks.inside.size / kLines,
                                bricks.rows.size / kRows, bricks.counts.size, bricks.first.size});
  }

  static CountBricks counting(const Grid& grid, const ExtractSettings& settings,
                              View<BrickTable> table, const BrickViews& bricks, float outside) {
    CountBricks count;
    count.grid = grid;
    count.iso = settings.iso;
    count.outside = outside;
    count.faces = settings.method == SurfaceMethod::kMatrix;
    count.table = table;
    count.bricks = bricks.nodes;
    count.values = bricks.values;
    count.inside = bricks.inside;
    count.rows = bricks.rows;
    count.counts = bricks.counts;
    return count;
  }

  template <class F>
  static BallVertices<F> ball_vertices(const BallViews<F>& in, const Grid& grid,
                                       const ExtractSettings& settings, const BrickViews& bricks) {
    BallVertices<F> source;
    source.grid = grid;
    source.iso = settings.iso;
    source.floor = settings.iso * settings.cutoff;
    source.margin = margin_of(settings);
    source.midpoint = settings.placement == Placement::kMidpoint;
    source.entries = bricks.entries;
    source.balls = in.balls;
    source.far = bricks.far;
    source.all_balls = in.all();
    return source;
  }

  template <class Source>
  static PlaceVertices<Source> placing(const Source& source, const Grid& grid,
                                       const ExtractSettings& settings, const BrickViews& bricks,
                                       std::int64_t begin, View<Vec3> positions,
                                       View<Vec3> normals) {
    PlaceVertices<Source> place;
    place.grid = grid;
    place.iso = settings.iso;
    place.refine_steps = settings.sample_stride > 1 ? 0 : settings.refine_steps;
    place.midpoint = settings.placement == Placement::kMidpoint;
    place.source = source;
    place.begin = begin;
    place.bricks = bricks.nodes;
    place.values = bricks.values;
    place.rows = bricks.rows;
    place.counts = bricks.counts;
    place.first = bricks.first;
    place.positions = positions;
    place.normals = normals;
    return place;
  }

  /// Walks the tree from its roots to the bricks, as find_bricks() does.
  BrickViews find_morph_bricks(const TreeShape& shape, ClassifyMorph classify) {
    const std::vector<Level>& levels = shape.levels;
    const Grid& grid = classify.grid;
    BrickViews out;
    out.tree.levels = static_cast<int>(levels.size());
    out.tree.roots = shape.roots;
    const std::int64_t roots = std::int64_t{shape.roots.x} * shape.roots.y * shape.roots.z;
    View<Node> parents = nodes_[levels.size()].resize(backend_, roots);
    View<Counts> sums = sums_[levels.size() % 2].resize(backend_, roots);
    backend_.for_each(roots,
                      PrepareMorph{shape.roots,
                                   parents,
                                   sums,
                                   {&totals_view_[static_cast<std::int64_t>(levels.size())], 1}},
                      "bricks");
    std::int64_t guess = brick_guess(grid);
    for (std::size_t l = 1; l < levels.size(); ++l) guess = guess / 8 + kChildren;
    for (std::size_t l = levels.size(); l-- > 0; guess *= 8) {
      const auto number = static_cast<std::int64_t>(l);
      const std::int64_t* count = &totals_view_[number + 1].first;
      const Offsets* total = &totals_view_[number];
      const View<Offsets> first = first_.fit(backend_, count, 1, guess / 4 + 1);
      const std::int64_t capacity = std::min({parents.size, sums.size, first.size});
      classify.level = levels[l];
      classify.parents = parents;
      classify.sums = sums;
      backend_.for_teams(count, capacity, classify, "bricks", B::Team::kParts);
      backend_.scan({sums.data, capacity}, count, first, &totals_view_[number], "bricks");
      const View<Node> nodes = nodes_[l].fit(backend_, &total->first, 1, guess);
      View<Counts> node_sums;
      if (l > 0) node_sums = sums_[l % 2].fit(backend_, &total->first, 1, guess);
      backend_.for_teams(count, capacity, FillMorph{parents, first, nodes, node_sums}, "bricks");
      out.tree.nodes[l + 1] = parents;
      parents = nodes;
      sums = node_sums;
    }
    out.tree.nodes[0] = parents;
    out.count = &totals_view_[0].first;
    out.nodes = parents;
    return out;
  }

  /// The largest factor by which a map stretches: all of them are rotations and scalings.
  static float norm_of(const AffineMap& map) {
    float largest = 0;
    for (const Vec3 row : map.rows) largest = std::max(largest, length(row));
    return largest;
  }

  /// The regression's nodes, made where they are not known yet.
  SmoothMap smooth_map(const std::shared_ptr<const Regression>& regression) {
    const Int3 n = regression->lattice.points;
    const std::int64_t nodes = std::int64_t{n.x} * n.y * n.z;
    const View<float> coefficients = lattice_nodes_.resize(backend_, kRegressionValues * nodes);
    if (regression != uploaded_regression_) {
      uploaded_regression_.reset();
      const std::size_t count = regression->samples.size();
      std::vector<KernelSample> samples(count);
      std::vector<BallAttribute> values(2 * count);
      for (std::size_t e = 0; e < count; ++e) {
        const RegressionSample& sample = regression->samples[e];
        const float wide = 4 * sample.deviation;
        constexpr float kHalfLog2E = 0.72134752f;
        samples[e] = {sample.center, kHalfLog2E / (wide * wide), sample.mass,
                      kSecondHeight * sample.mass, kThirdHeight * sample.mass};
        for (int m = 0; m < regression->maps; ++m) {
          values[2 * e + static_cast<std::size_t>(m)] =
              regression->values[e * static_cast<std::size_t>(regression->maps) +
                                 static_cast<std::size_t>(m)];
        }
      }
      const auto size = static_cast<std::int64_t>(count);
      const View<KernelSample> from = kernel_samples_.resize(backend_, size);
      const View<BallAttribute> carried = carried_.resize(backend_, 2 * size);
      backend_.upload(from, samples.data());
      backend_.upload(carried, values.data());
      const Offsets runs = {(nodes + RegressNodes::kNodes - 1) / RegressNodes::kNodes, 0};
      const View<Offsets> number = regress_count_.resize(backend_, 1);
      backend_.upload(number, &runs);
      backend_.for_teams(
          &number[0].first, runs.first,
          RegressNodes{regression->lattice, from, carried, regression->sloped, coefficients},
          "regress");
      if (regression->thinness[0]) {
        WeighLevel weigh;
        weigh.map = SmoothMap(*regression, coefficients.data);
        for (int m = 0; m < 2; ++m) weigh.thinness[m] = distance_field(regression->thinness[m]);
        weigh.nodes = coefficients;
        backend_.for_each(nodes, weigh, "regress");
      }
      uploaded_regression_ = regression;
    }
    return SmoothMap(*regression, coefficients.data);
  }

  View<Strain> bound_strain(const MorphSurface& between) {
    const Regression& map = *between.map;
    const View<Strain> strain = strain_.resize(
        backend_, std::int64_t{map.lattice.points.x} * map.lattice.points.y * map.lattice.points.z);
    BoundStrain bound;
    bound.lattice = map.lattice;
    bound.nodes = {lattice_nodes_.resize(backend_, kRegressionValues * strain.size).data,
                   kRegressionValues * strain.size};
    bound.scale[0] = between.from_scale, bound.scale[1] = between.to_scale;
    bound.strain = strain;
    backend_.for_each(strain.size, bound, "regress");
    return strain;
  }

  /// A grid where the passes run; the last few stay there.
  DistanceField distance_field(const std::shared_ptr<const DistanceGrid>& object) {
    if constexpr (B::kHostMemory) return DistanceField(object->grid, object->values.data());
    for (auto& uploaded : uploaded_distances_) {
      if (uploaded->object == object) return DistanceField(object->grid, uploaded->values.data);
    }
    if (uploaded_distances_.size() >= kMaxGrids)
      uploaded_distances_.erase(uploaded_distances_.begin());
    auto uploaded = std::make_unique<UploadedDistances>();
    uploaded->object = object;
    uploaded->values =
        uploaded->buffer.resize(backend_, static_cast<std::int64_t>(object->values.size()));
    backend_.upload(uploaded->values, object->values.data());
    uploaded_distances_.push_back(std::move(uploaded));
    return DistanceField(object->grid, uploaded_distances_.back()->values.data);
  }

  View<BrickTable> table_view() {
    const View<BrickTable> view = table_.resize(backend_, 1);
    if (!table_ready_) backend_.upload(view, &brick_table());
    table_ready_ = true;
    return view;
  }

  B backend_;
  std::size_t max_memory_ = 0;
  bool table_ready_ = false;
  Buffer<BrickTable> table_;
  Buffer<BallPath> paths_;
  Buffer<PathPart> parts_;
  Buffer<PartPlace> places_;
  Buffer<float> eased_;
  std::shared_ptr<const BallPaths> uploaded_paths_;  ///< what paths_ and parts_ hold
  Buffer<Ball> raw_balls_;
  BallSet uploaded_balls_;  ///< what raw_balls_ holds; empty: nothing known
  Buffer<RoundBall> round_balls_;
  Buffer<EllipsoidBall> ellipsoids_;
  Buffer<std::uint32_t> all_balls_;
  Buffer<Vec3> sample_points_;
  Buffer<float> sample_values_;
  Buffer<BallAttribute> carried_;
  Buffer<KernelSample> kernel_samples_;
  Buffer<float> lattice_nodes_;
  Buffer<Strain> strain_;
  Buffer<Offsets> regress_count_;
  std::shared_ptr<const Regression> uploaded_regression_;  ///< what lattice_nodes_ holds
  /// Grids that stay on a device, two of each object: several actors take turns.
  static constexpr std::size_t kMaxGrids = 16;
  struct UploadedDistances {
    std::shared_ptr<const DistanceGrid> object;
    Buffer<float> buffer;
    View<float> values;
  };
  std::vector<std::unique_ptr<UploadedDistances>> uploaded_distances_;
  Buffer<AttributeValues> carried_values_;
  /// [level]: nodes and entries, or what stands at [kMaxLevels]: vertices and triangles.
  Buffer<Offsets> totals_;
  View<Offsets> totals_view_;
  Buffer<Node> nodes_[kMaxLevels];
  Buffer<std::uint32_t> entries_[2];  ///< of even and of odd levels, as are:
  Buffer<FarField> far_[2];
  Buffer<Counts> sums_[2];
  Buffer<std::uint32_t> child_entries_;
  Buffer<Counts> brick_counts_;
  Buffer<Offsets> first_, brick_first_;
  Buffer<float> values_;
  Buffer<std::uint8_t> inside_;
  Buffer<std::uint32_t> rows_;
  Buffer<Vec3> positions_, normals_;
  Buffer<Triangle> triangles_;
};

}  // namespace polymorph
