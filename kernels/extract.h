// The order of all passes, once for every backend.
//
// A backend gives: kLanes; for_each(n, functor, name); exclusive_scan(counts, offsets, name);
// Buffer<T> with resize(backend, n) -> View<T>; and the copies upload, download, fill_zero,
// start_frame, finish_frame. What it cannot do (memory, a failing device) it throws as
// ExtractFailure or std::bad_alloc; both end here and leave as a status.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <new>
#include <string>
#include <type_traits>
#include <vector>

#include "bricks.h"
#include "cells.h"
#include "extract_surface.h"
#include "field.h"
#include "mc_tables.h"
#include "validate.h"
#include "vertices.h"

namespace polymorph {

/// Calls f with the Field to compile for: round balls alone keep the short path.
template <class Function>
void with_field(const std::vector<Ball>& balls, FieldKind kind, const Function& f) {
  const bool round = std::all_of(balls.begin(), balls.end(), is_round);
  switch (kind) {
    case FieldKind::kGaussian:
      return round ? f(Field<FieldKind::kGaussian, RoundBall>{})
                   : f(Field<FieldKind::kGaussian, EllipsoidBall>{});
    case FieldKind::kWyvill:
      return round ? f(Field<FieldKind::kWyvill, RoundBall>{})
                   : f(Field<FieldKind::kWyvill, EllipsoidBall>{});
    case FieldKind::kInverseSquare:
      return f(Field<FieldKind::kInverseSquare, RoundBall>{});
  }
}

/// Buffers and passes of one extractor. Memory grows with the bricks at the surface, plus five
/// bytes for each brick of the grid.
template <class B>
class Extraction final : public SurfaceExtractor {
 public:
  explicit Extraction(B backend = B()) : backend_(std::move(backend)) {}

  ExtractStatus extract(const std::vector<Ball>& balls, const Grid& grid,
                        const ExtractSettings& settings, Mesh& mesh) override {
    mesh.positions.clear();
    mesh.normals.clear();
    mesh.triangles.clear();
    ExtractStatus status = check_input(balls, settings);
    if (status.code == ExtractCode::kOk) status = check_grid(grid);
    if (status.code != ExtractCode::kOk || balls.empty()) return status;
    return guarded([&] {
      with_field(balls, settings.field,
                 [&](auto field) { extract_field<decltype(field)>(balls, grid, settings, mesh); });
    });
  }

  ExtractStatus sample(const std::vector<Ball>& balls, const std::vector<Vec3>& points,
                       const ExtractSettings& settings, std::vector<float>& values) override {
    values.assign(points.size(), 0.0f);
    ExtractStatus status = check_input(balls, settings);
    if (status.code != ExtractCode::kOk || balls.empty() || points.empty()) return status;
    return guarded([&] {
      with_field(balls, settings.field, [&](auto field) {
        sample_field<decltype(field)>(balls, points, settings, values);
      });
    });
  }

  std::vector<PassTime> pass_times() const override { return backend_.pass_times(); }

 private:
  template <class T>
  using Buffer = typename B::template Buffer<T>;

  /// The balls as the kernels read them, and the list of all of them.
  template <class F>
  struct BallViews {
    View<typename F::Ball> balls;
    View<std::uint32_t> everyone;
  };
  /// The nodes of one level with their ball lists.
  struct NodeViews {
    View<Node> nodes;
    View<std::uint32_t> entries;
  };
  /// Bricks in lattice order with their samples.
  struct BrickViews {
    View<Node> bricks;
    View<std::uint32_t> entries;
    View<float> values;
    RowOrder order;
  };
  struct RowViews {
    View<std::uint16_t> masks;
    View<std::uint8_t> vertices;
    View<std::int64_t> first_vertex, first_triangle;
  };

  template <class Passes>
  ExtractStatus guarded(const Passes& passes) {
    try {
      backend_.start_frame();
      passes();
      backend_.finish_frame();
    } catch (const ExtractFailure& failure) {
      return failure.status;
    } catch (const std::bad_alloc&) {
      return {ExtractCode::kOutOfMemory,
              "out of memory while extracting the surface (the grid needs more than this machine "
              "has), use "
              "a coarser grid"};
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

  template <class F>
  BallViews<F> prepare(const std::vector<Ball>& balls, const ExtractSettings& settings) {
    const auto n = static_cast<std::int64_t>(balls.size());
    const View<Ball> raw = raw_balls_.resize(backend_, n);
    const BallViews<F> out = {prepared<F>(n), everyone_.resize(backend_, n)};
    backend_.upload(raw, balls.data());
    const float log2_floor = log_of_two(settings.cutoff * settings.iso);
    backend_.for_each(n, PrepareBalls<F>{raw, out.balls, out.everyone, log2_floor}, "prepare");
    return out;
  }

  template <class F>
  void sample_field(const std::vector<Ball>& balls, const std::vector<Vec3>& points,
                    const ExtractSettings& settings, std::vector<float>& values) {
    const BallViews<F> in = prepare<F>(balls, settings);
    const auto n = static_cast<std::int64_t>(points.size());
    const View<Vec3> at = sample_points_.resize(backend_, n);
    const View<float> out = sample_values_.resize(backend_, n);
    backend_.upload(at, points.data());
    const BallList all = {in.everyone.data, static_cast<std::uint32_t>(in.everyone.size)};
    backend_.for_each((n + B::kLanes - 1) / B::kLanes,
                      SamplePoints<F, B::kLanes>{at, in.balls, all, out}, "sample");
    backend_.download(values.data(), out);
  }

  template <class F>
  void extract_field(const std::vector<Ball>& balls, const Grid& grid,
                     const ExtractSettings& settings, Mesh& mesh) {
    const BallViews<F> in = prepare<F>(balls, settings);
    BrickViews bricks;
    if (!find_bricks<F>(in, grid, settings.iso, bricks)) return;
    bricks.values = values_.resize(backend_, bricks.bricks.size * kBrickStride);
    backend_.for_each(bricks.values.size / B::kLanes,
                      SampleBricks<F, B::kLanes>{grid, bricks.order.nodes, bricks.bricks,
                                                 bricks.entries, in.balls, bricks.values},
                      "sample");
    const RowViews rows = count_rows(bricks, settings.iso);
    const std::int64_t row_count = rows.masks.size;
    const std::int64_t vertex_count = last_of(rows.first_vertex);
    const std::int64_t triangle_count = last_of(rows.first_triangle);
    if (vertex_count == 0) return;
    if (vertex_count >= std::numeric_limits<std::uint32_t>::max()) {
      throw ExtractFailure{{ExtractCode::kBadInput,
                            "the surface would have " + std::to_string(vertex_count) +
                                " vertices (more than 32-bit indices reach), use a coarser grid"}};
    }
    const View<Vec3> positions = positions_.resize(backend_, vertex_count);
    const View<Vec3> normals = normals_.resize(backend_, vertex_count);
    const View<Triangle> triangles = triangles_.resize(backend_, triangle_count);
    const VertexNumbers numbers = {bricks.order, rows.masks, rows.first_vertex};
    const View<VertexJob> jobs = list_jobs(bricks, rows, numbers);
    PlaceVertices<F, B::kLanes> place;
    place.grid = grid;
    place.iso = settings.iso;
    place.floor = settings.iso * settings.cutoff;
    place.refine_steps = settings.refine_steps;
    place.brick_nodes = bricks.order.nodes;
    place.bricks = bricks.bricks;
    place.entries = bricks.entries;
    place.balls = in.balls;
    place.values = bricks.values;
    place.jobs = jobs;
    place.positions = positions;
    place.normals = normals;
    backend_.for_each(jobs.size / B::kLanes, place, "vertices");
    backend_.for_each(row_count,
                      EmitTriangles{settings.iso, table_view(), bricks.bricks, bricks.values,
                                    numbers, rows.first_triangle, triangles},
                      "triangles");
    deliver(positions, normals, triangles, mesh);
  }

  /// Walks the tree from its root to the bricks. False when the surface crosses none.
  template <class F>
  bool find_bricks(const BallViews<F>& in, const Grid& grid, float iso, BrickViews& out) {
    const std::vector<Level> levels = tree_levels(grid);
    const Node root = {0, static_cast<std::uint32_t>(in.balls.size), 0};
    NodeViews parents = {nodes_[0].resize(backend_, 1), in.everyone};
    backend_.upload(parents.nodes, &root);
    Int3 parent_nodes = {1, 1, 1};
    for (std::size_t l = levels.size(); l-- > 0;) {
      parents = children<F>(in, grid, iso, levels[l], parent_nodes, parents, l % 2);
      if (parents.nodes.size == 0) return false;
      parent_nodes = levels[l].nodes;
    }
    order_bricks(parents, parent_nodes, out);
    return true;
  }

  /// The levels of the tree below its root, bricks first.
  static std::vector<Level> tree_levels(const Grid& grid) {
    const auto divided = [](Int3 a, int by) {
      return Int3{(a.x + by - 1) / by, (a.y + by - 1) / by, (a.z + by - 1) / by};
    };
    const Int3 cells = {grid.points.x + 1, grid.points.y + 1, grid.points.z + 1};
    std::vector<Level> levels = {{divided(cells, kBrickCells), kBrickCells}};
    for (Int3 n = levels[0].nodes; n.x > kFan || n.y > kFan || n.z > kFan;
         n = levels.back().nodes) {
      levels.push_back({divided(n, kFan), levels.back().cells * kFan});
    }
    return levels;
  }

  /// `side` alternates between the two sets of node buffers: parents are read while children are
  /// written.
  template <class F>
  NodeViews children(const BallViews<F>& in, const Grid& grid, float iso, const Level& level,
                     Int3 parent_nodes, const NodeViews& parents, std::size_t side) {
    const std::int64_t n = parents.nodes.size * kChildren;
    const View<std::uint8_t> active = active_.resize(backend_, n);
    const View<std::uint32_t> counts = counts_.resize(backend_, n);
    const View<std::uint32_t> slots = slots_.resize(backend_, n + 1);
    const View<std::int64_t> begins = begins_.resize(backend_, n + 1);
    backend_.for_each(n / B::kLanes,
                      ClassifyNodes<F, B::kLanes>{grid, iso, level, parent_nodes, parents.nodes,
                                                  parents.entries, in.balls, active, counts},
                      "bricks");
    backend_.exclusive_scan(active, slots, "bricks");
    backend_.exclusive_scan(counts, begins, "bricks");
    NodeViews out;
    out.nodes = nodes_[1 + side].resize(backend_, last_of(slots));
    out.entries = F::kEnds ? entries_[side].resize(backend_, last_of(begins)) : parents.entries;
    backend_.for_each(n,
                      FillNodes<F>{grid, level, parent_nodes, parents.nodes, parents.entries,
                                   in.balls, active, slots, begins, out.nodes, out.entries},
                      "bricks");
    return out;
  }

  void order_bricks(const NodeViews& found, Int3 nodes, BrickViews& out) {
    const std::int64_t dense = static_cast<std::int64_t>(nodes.x) * nodes.y * nodes.z;
    const View<std::uint8_t> marks = marks_.resize(backend_, dense);
    const View<std::uint32_t> map = map_.resize(backend_, dense + 1);
    out.bricks = bricks_.resize(backend_, found.nodes.size);
    out.entries = found.entries;
    out.order = {nodes, map};
    backend_.fill_zero(marks);
    backend_.for_each(found.nodes.size, MarkBricks{found.nodes, marks}, "bricks");
    backend_.exclusive_scan(marks, map, "bricks");
    backend_.for_each(found.nodes.size, OrderBricks{found.nodes, map, out.bricks}, "bricks");
  }

  RowViews count_rows(const BrickViews& bricks, float iso) {
    const std::int64_t n = bricks.bricks.size * kRows;
    RowViews rows;
    rows.masks = masks_.resize(backend_, n);
    rows.vertices = row_vertices_.resize(backend_, n);
    rows.first_vertex = first_vertex_.resize(backend_, n + 1);
    rows.first_triangle = first_triangle_.resize(backend_, n + 1);
    const View<std::uint8_t> triangles = row_triangles_.resize(backend_, n);
    backend_.for_each(n,
                      CountRows{iso, table_view(), bricks.bricks, bricks.values, bricks.order,
                                rows.masks, rows.vertices, triangles},
                      "count");
    backend_.exclusive_scan(rows.vertices, rows.first_vertex, "count");
    backend_.exclusive_scan(triangles, rows.first_triangle, "count");
    return rows;
  }

  View<VertexJob> list_jobs(const BrickViews& bricks, const RowViews& rows,
                            const VertexNumbers& numbers) {
    const std::int64_t n = bricks.bricks.size;
    const View<std::uint32_t> counts = job_counts_.resize(backend_, n);
    const View<std::int64_t> first = first_job_.resize(backend_, n + 1);
    backend_.for_each(n, CountJobs<B::kLanes>{bricks.bricks, bricks.order, rows.vertices, counts},
                      "jobs");
    backend_.exclusive_scan(counts, first, "jobs");
    const View<VertexJob> jobs = jobs_.resize(backend_, last_of(first));
    backend_.for_each(n, EmitJobs{bricks.bricks, numbers, first, jobs}, "jobs");
    return jobs;
  }

  void deliver(View<Vec3> positions, View<Vec3> normals, View<Triangle> triangles, Mesh& mesh) {
    mesh.positions.resize(static_cast<std::size_t>(positions.size));
    mesh.normals.resize(static_cast<std::size_t>(normals.size));
    mesh.triangles.resize(static_cast<std::size_t>(triangles.size));
    backend_.download(mesh.positions.data(), positions);
    backend_.download(mesh.normals.data(), normals);
    backend_.download(mesh.triangles.data(), triangles);
  }

  template <class T>
  std::int64_t last_of(View<T> offsets) {
    T last{};
    backend_.download(&last, View<T>{offsets.data + offsets.size - 1, 1});
    return static_cast<std::int64_t>(last);
  }

  View<McTable> table_view() {
    const View<McTable> view = table_.resize(backend_, 1);
    if (!table_ready_) backend_.upload(view, &mc_table());
    table_ready_ = true;
    return view;
  }

  B backend_;
  bool table_ready_ = false;
  Buffer<McTable> table_;
  Buffer<Ball> raw_balls_;
  Buffer<RoundBall> round_balls_;
  Buffer<EllipsoidBall> ellipsoids_;
  Buffer<std::uint32_t> everyone_;
  Buffer<Vec3> sample_points_;
  Buffer<float> sample_values_;
  Buffer<Node> nodes_[3];  ///< root; even and odd levels
  Buffer<std::uint32_t> entries_[2];
  Buffer<std::uint8_t> active_, marks_;
  Buffer<std::uint32_t> counts_, slots_, map_;
  Buffer<std::int64_t> begins_;
  Buffer<Node> bricks_;
  Buffer<float> values_;
  Buffer<std::uint16_t> masks_;
  Buffer<std::uint8_t> row_vertices_, row_triangles_;
  Buffer<std::int64_t> first_vertex_, first_triangle_;
  Buffer<std::uint32_t> job_counts_;
  Buffer<std::int64_t> first_job_;
  Buffer<VertexJob> jobs_;
  Buffer<Vec3> positions_, normals_;
  Buffer<Triangle> triangles_;
};

}  // namespace polymorph
