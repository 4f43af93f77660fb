// Passes from a tree of bricks to a mesh: sample and count, assign indices, place vertices, emit
// triangles. These passes are the same for every field and every backend.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <vector>

#include "bricks.h"
#include "cubes.h"
#include "engine.h"
#include "mc_tables.h"
#include "mesh.h"
#include "tree.h"
#include "triangles.h"
#include "types.h"
#include "validate.h"
#include "vertices.h"
#include "view.h"
#include "workspace.h"

namespace polymorph {

/// The levels below the roots, bricks first, and the number of roots along each axis.
struct TreeShape {
  std::vector<Level> levels;
  Int3 roots = {1, 1, 1};
};

inline Int3 ceil_divide(Int3 a, int divisor) {
  return {(a.x + divisor - 1) / divisor, (a.y + divisor - 1) / divisor,
          (a.z + divisor - 1) / divisor};
}

/// Lays out a tree below one root or, with `many_roots`, below up to 4^3 roots: a GPU takes no
/// longer for the children of all these roots than for those of one.
inline TreeShape tree_shape(const Grid& grid, bool many_roots) {
  TreeShape out;
  out.levels = {{ceil_divide(lattice_cells(grid), kBrickCells), kBrickCells}};
  for (Int3 n = out.levels[0].nodes; n.x > kBranching || n.y > kBranching || n.z > kBranching;
       n = out.levels.back().nodes) {
    out.levels.push_back({ceil_divide(n, kBranching), out.levels.back().cells * kBranching});
  }
  if (many_roots && out.levels.size() > 1) {
    out.roots = out.levels.back().nodes;
    out.levels.pop_back();
  }
  return out;
}

inline std::int64_t count_roots(const TreeShape& shape) {
  return std::int64_t{shape.roots.x} * shape.roots.y * shape.roots.z;
}

/// Guesses how many bricks a surface crosses, before they are counted: as many as three sides of
/// the grid have, and a few more.
inline std::int64_t guess_bricks(const Grid& grid) {
  const Int3 n = ceil_divide(lattice_cells(grid), kBrickCells);
  const auto area = [](int a, int b) { return static_cast<std::int64_t>(a) * b; };
  return area(n.x, n.y) + area(n.y, n.z) + area(n.z, n.x) + kChildren;
}
/// Guesses the number of nodes at the top level of a tree. A surface crosses about a 16th as many
/// nodes of the next higher level, because these are 4 times as wide; an 8th leaves room.
inline std::int64_t guess_top_nodes(const Grid& grid, const TreeShape& shape) {
  std::int64_t guess = guess_bricks(grid);
  for (std::size_t l = 1; l < shape.levels.size(); ++l) guess = guess / 8 + kChildren;
  return guess;
}

/// Bricks with their values and counts, in backend memory.
struct BrickViews {
  Tree tree;
  const std::int64_t* count = nullptr;  ///< number of bricks
  /// Number of bricks that each view below can hold; `values` holds only one block where bricks are
  /// processed in blocks.
  std::int64_t capacity = std::numeric_limits<std::int64_t>::max();
  View<Node> nodes;
  View<std::uint32_t> entries;  ///< the bricks' ball lists; empty for level sets
  View<FarField> far;           ///< per brick, where balls have infinite support; else empty
  View<float> values;           ///< kBrickValues per brick, on a CPU only for a block
  View<std::uint8_t> inside;    ///< kLines per brick
  View<std::uint32_t> rows;     ///< kRows per brick
  View<Counts> counts;          ///< per brick: its numbers of vertices and triangles
  View<Offsets> first;          ///< per brick: its first vertex and triangle
};

/// Returns the number of bricks that a CPU samples before the next pass runs on them (a block): 256
/// per thread, whose values take 0.5 MB, half of a core's second-level cache.
template <class B>
std::int64_t brick_block(const B& backend) {
  return 256 * backend.threads();
}

/// Allocates the buffers that have items per brick.
template <class B>
void fit_bricks(Workspace<B>& work, const Grid& grid, BrickViews& bricks) {
  const std::int64_t guess = guess_bricks(grid);
  if constexpr (B::kHostMemory) {
    const std::int64_t block = std::min(brick_block(work.backend), *bricks.count);
    bricks.values = work.values.resize(work.backend, kBrickValues * block);
  } else {
    bricks.values = work.values.fit(work.backend, bricks.count, kBrickValues, guess);
    bricks.capacity = bricks.values.size / kBrickValues;
  }
  bricks.inside = work.inside.fit(work.backend, bricks.count, kLines, guess);
  bricks.rows = work.rows.fit(work.backend, bricks.count, kRows, guess);
  bricks.counts = work.brick_counts.fit(work.backend, bricks.count, 1, guess);
  bricks.first = work.brick_first.fit(work.backend, bricks.count, 1, guess);
  bricks.capacity = std::min({bricks.capacity, bricks.nodes.size, bricks.inside.size / kLines,
                              bricks.rows.size / kRows, bricks.counts.size, bricks.first.size});
}

/// Bricks, the pass that samples them, and the Source of PlaceVertices (vertices.h).
template <class Sample, class Source>
struct SampledBricks {
  BrickViews bricks;
  Sample sample;
  Source source;
};

template <class B>
View<BrickTable> upload_table(Workspace<B>& work) {
  const View<BrickTable> view = work.table.resize(work.backend, 1);
  if (!work.has_table) work.backend.upload(view, &brick_table());
  work.has_table = true;
  return view;
}

/// Prepares the counting part of a pass that samples bricks. `outside`: the value of points beyond
/// the grid.
template <class B>
CountBricks prepare_counting(Workspace<B>& work, const Grid& grid, const ExtractSettings& settings,
                             const BrickViews& bricks, float outside) {
  CountBricks count;
  count.grid = grid;
  count.iso = settings.iso;
  count.outside = outside;
  count.faces = settings.method == SurfaceMethod::kMatrix;
  count.table = upload_table(work);
  count.bricks = bricks.nodes;
  count.values = bricks.values;
  count.inside = bricks.inside;
  count.rows = bricks.rows;
  count.counts = bricks.counts;
  return count;
}

/// Turns a tree of bricks into a mesh. One object per call of extract_bricks().
template <class B>
class MeshPasses {
 public:
  MeshPasses(Workspace<B>& work, const Grid& grid, const ExtractSettings& settings, Mesh& mesh)
      : work_(work), backend_(work.backend), grid_(grid), settings_(settings), mesh_(mesh) {}

  /// Samples the bricks, numbers their vertices and triangles, places the vertices of marching
  /// cubes, and emits the triangles.
  ///
  /// If the host knows the counts, bricks are processed in blocks. A block's values stay in the
  /// caches from one pass to the next, and need no more memory for a finer grid. The values of all
  /// bricks at once would dominate the memory traffic.
  template <class Sample, class Source>
  void make_mesh(const SampledBricks<Sample, Source>& sampled) {
    const BrickViews& bricks = sampled.bricks;
    Sample sample = sampled.sample;
    Offsets* total = &work_.totals[kMeshTotal];
    const bool places_vertices = settings_.method == SurfaceMethod::kMarchingCubes;
    if constexpr (B::kHostMemory) {
      *total = {};
      for (std::int64_t begin = 0; begin < *bricks.count; begin += brick_block(backend_)) {
        const std::int64_t n = std::min(brick_block(backend_), *bricks.count - begin);
        sample.begin = begin;
        backend_.for_teams(&n, n, sample, "sample");
        const Offsets previous = *total;
        backend_.scan({bricks.counts.data + begin, n}, &n, {bricks.first.data + begin, n}, total,
                      "number", previous);
        check_vertex_count(total->vertices());
        if (!places_vertices) continue;
        const double fraction = static_cast<double>(begin + n) / static_cast<double>(*bricks.count);
        positions_ =
            backend_.grow(mesh_.positions, previous.vertices(), total->vertices(), fraction);
        normals_ = backend_.grow(mesh_.normals, previous.vertices(), total->vertices(), fraction);
        backend_.for_teams(&n, n, place_vertices(sampled.source, bricks, begin), "vertices");
      }
      mesh_.positions.resize(static_cast<std::size_t>(total->vertices()));
      mesh_.normals.resize(static_cast<std::size_t>(total->vertices()));
      emit(bricks);
    } else {
      backend_.for_teams(bricks.count, bricks.capacity, sample, "sample");
      backend_.scan({bricks.counts.data, bricks.capacity}, bricks.count, bricks.first, total,
                    "number");
      // The host needs the totals early for a download. Else they come last, because a copy keeps
      // the passes around it apart.
      if (settings_.download) backend_.fetch_totals(work_.totals, /*beside_passes=*/true);
      // Triangles come first, so that they are downloaded while vertices are placed.
      emit(bricks);
      if (settings_.download) backend_.written(Written::kTriangles);
      if (places_vertices) {
        allocate_vertices();
        backend_.template for_teams</*kBesideLast=*/true>(
            bricks.count, bricks.capacity, place_vertices(sampled.source, bricks, /*begin=*/0),
            "vertices");
        if (settings_.download) backend_.written(Written::kMesh);
      }
      if (!settings_.download) backend_.fetch_totals(work_.totals, /*beside_passes=*/false);
    }
  }

  /// Queues the copying of the mesh to the caller, which finish_frame() does. A CPU has written the
  /// mesh there already. `sizes`: the mesh's numbers of vertices and triangles.
  void download(Offsets sizes) {
    check_vertex_count(sizes.vertices());
    if (!settings_.download) return;
    backend_.queue_download(mesh_.triangles, triangles_, sizes.triangles(), Written::kTriangles);
    // Cubes have their vertices with their triangles.
    const Written vertices =
        settings_.method == SurfaceMethod::kMatrix ? Written::kTriangles : Written::kMesh;
    backend_.queue_download(mesh_.positions, positions_, sizes.vertices(), vertices);
    if (settings_.flat) {
      mesh_.normals.clear();
    } else {
      backend_.queue_download(mesh_.normals, normals_, sizes.vertices(), vertices);
    }
  }

 private:
  void emit(const BrickViews& bricks) {
    if (settings_.method == SurfaceMethod::kMatrix) {
      emit_cubes(bricks);
    } else {
      emit_triangles(bricks);
    }
  }

  template <class Source>
  PlaceVertices<Source> place_vertices(const Source& source, const BrickViews& bricks,
                                       std::int64_t begin) const {
    PlaceVertices<Source> pass;
    pass.grid = grid_;
    pass.iso = settings_.iso;
    // A refining step evaluates the field itself, whose root differs from that of the values that
    // are interpolated between every sample_stride-th point.
    pass.refine_steps = settings_.sample_stride > 1 ? 0 : settings_.refine_steps;
    pass.midpoint = settings_.placement == Placement::kMidpoint;
    pass.source = source;
    pass.begin = begin;
    pass.bricks = bricks.nodes;
    pass.values = bricks.values;
    pass.rows = bricks.rows;
    pass.counts = bricks.counts;
    pass.first = bricks.first;
    pass.positions = positions_;
    pass.normals = normals_;
    return pass;
  }

  void allocate_vertices() {
    const std::int64_t* count = &work_.totals[kMeshTotal].vertices();
    // Before the first frame, a brick is guessed to have 100 vertices, and in allocate_triangles()
    // 200 triangles.
    const std::int64_t guess = guess_bricks(grid_) * 100;
    positions_ = backend_.output(mesh_.positions, work_.positions, count, guess);
    normals_ = backend_.output(mesh_.normals, work_.normals, count, guess);
  }
  void allocate_triangles() {
    const std::int64_t* count = &work_.totals[kMeshTotal].triangles();
    triangles_ =
        backend_.output(mesh_.triangles, work_.triangles, count, guess_bricks(grid_) * 200);
  }

  void emit_cubes(const BrickViews& bricks) {
    allocate_vertices();
    allocate_triangles();
    const EmitCubes emit = {grid_,        bricks.nodes, bricks.inside, bricks.rows, bricks.counts,
                            bricks.first, positions_,   normals_,      triangles_};
    backend_.for_teams(bricks.count, bricks.capacity, emit, "triangles");
  }

  /// A CPU emits in blocks, too, because a new piece of the result's memory is cleared when it is
  /// allocated, and is then still in the caches when its triangles are written. 8 times the
  /// bricks of make_mesh() have about 5 MB of triangles per thread, at 200 triangles per brick.
  void emit_triangles(const BrickViews& bricks) {
    const Offsets* total = &work_.totals[kMeshTotal];
    EmitTriangles emit = {/*begin=*/0,     upload_table(work_), bricks.tree,
                          bricks.inside,   bricks.rows,         bricks.counts,
                          bricks.first,    bricks.capacity,
                          /*triangles=*/{}};
    if constexpr (B::kHostMemory) {
      const std::int64_t count = *bricks.count, block = 8 * brick_block(backend_);
      // Drops surplus triangles of an earlier, larger mesh.
      mesh_.triangles.resize(
          std::min(mesh_.triangles.size(), static_cast<std::size_t>(total->triangles())));
      std::int64_t emitted = 0;
      for (std::int64_t begin = 0; begin < count; begin += block) {
        const std::int64_t n = std::min(block, count - begin);
        const std::int64_t end =
            begin + n < count ? bricks.first[begin + n].triangles() : total->triangles();
        const double fraction = static_cast<double>(end) / static_cast<double>(total->triangles());
        triangles_ = backend_.grow(mesh_.triangles, emitted, end, fraction);
        emitted = end;
        emit.begin = begin;
        emit.triangles = triangles_;
        backend_.for_teams(&n, n, emit, "triangles");
      }
    } else {
      allocate_triangles();
      emit.triangles = triangles_;
      backend_.for_teams(bricks.count, bricks.capacity, emit, "triangles");
    }
  }

  Workspace<B>& work_;
  B& backend_;
  const Grid& grid_;
  const ExtractSettings& settings_;
  Mesh& mesh_;
  View<Vec3> positions_, normals_;
  View<Triangle> triangles_;
};

/// Extracts a mesh. `find` finds the bricks and returns them as SampledBricks. If a buffer was too
/// small, all passes run again, `find` included.
template <class B, class Find>
void extract_bricks(Workspace<B>& work, const Grid& grid, const ExtractSettings& settings,
                    Mesh& mesh, const Find& find) {
  work.totals = work.totals_buffer.resize(work.backend, kMeshTotal + 1);
  Offsets totals[kMeshTotal + 1];
  MeshPasses<B> passes(work, grid, settings, mesh);
  do {
    passes.make_mesh(find());
    // everything_fitted() also gives the totals to the host: with a download as soon as the
    // counting passes end.
  } while (!work.backend.everything_fitted(work.totals, totals));
  passes.download(totals[kMeshTotal]);
}

}  // namespace polymorph
