// Passes for balls of one field: extraction, sampling, interpolation. F is Field<Kind, Ball>
// (falloff.h). For CUDA these templates are instantiated one field per source file (cuda_*.cu),
// because they take long to compile.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <vector>

#include "ball_set.h"
#include "brick_passes.h"
#include "bricks.h"
#include "engine.h"
#include "expand_far_field.h"
#include "falloff.h"
#include "far_field.h"
#include "field.h"
#include "interpolate_attributes.h"
#include "mesh.h"
#include "tree.h"
#include "types.h"
#include "vertices.h"
#include "view.h"
#include "workspace.h"

namespace polymorph {

/// Returns the balls in backend memory, after uploading them unless they are there already.
template <class B>
View<Ball> upload_balls(Workspace<B>& work, const BallSet& set) {
  const View<Ball> raw = work.raw_balls.resize(work.backend, static_cast<std::int64_t>(set.size()));
  if (!work.uploaded_balls.is(set)) {
    work.uploaded_balls = {};
    work.backend.upload(raw, set.balls().data());
    work.uploaded_balls = set;
  }
  return raw;
}

/// Returns FieldScale::length: the smallest power of two above half the longest side of the
/// centres' box and above the largest radius sqrt(|w|) that a single ball has. The limits 1e-15 and
/// 1e15 keep its square within the normal floats.
inline float field_length(const std::vector<Ball>& balls) {
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

/// The passes for one set of balls. extract_balls(), sample_balls() and interpolate_balls() call
/// them.
template <class B, class F>
class BallPasses {
 public:
  BallPasses(Workspace<B>& work, const BallSet& set, const ExtractSettings& settings)
      : work_(work), backend_(work.backend), set_(set), settings_(settings) {}

  void extract(const Grid& grid, Mesh& mesh) {
    // With infinite support all backends start from one root: each level rounds its polynomials, so
    // only equal levels give equal bits.
    const TreeShape shape = tree_shape(grid, B::kManyRoots && F::kCompactSupport);
    extract_bricks(work_, grid, settings_, mesh, [&] {
      prepare(shape);
      BrickViews bricks = find_bricks(shape, grid);
      fit_bricks(work_, grid, bricks);
      if constexpr (!F::kCompactSupport)
        bricks.capacity = std::min(bricks.capacity, bricks.far.size);
      const SampleBricks<F> sample = {
          prepare_counting(work_, grid, settings_, bricks, /*outside=*/0),
          settings_.sample_stride,
          bricks.entries,
          balls_,
          bricks.far,
          all_balls()};
      return SampledBricks<SampleBricks<F>, BallVertices<F>>{bricks, sample,
                                                             ball_vertices(grid, bricks)};
    });
  }

  void sample(const std::vector<Vec3>& points, std::vector<float>& values) {
    prepare(/*shape=*/{});
    const auto n = static_cast<std::int64_t>(points.size());
    const View<Vec3> at = work_.points.resize(backend_, n);
    const View<float> out = work_.point_values.resize(backend_, n);
    backend_.upload(at, points.data());
    constexpr int kLanes = Lanes<V>::kCount;
    backend_.for_each((n + kLanes - 1) / kLanes, SamplePoints<F, V>{at, balls_, all_balls(), out},
                      "sample");
    backend_.download(values.data(), out);
  }

  template <int kMaps>
  void interpolate(const std::vector<BallAttribute>& attributes, const std::vector<Vec3>& points,
                   std::vector<AttributeValues>& values) {
    using Interpolate = InterpolateAttributes<F, V, kMaps>;
    prepare(/*shape=*/{});
    const auto n = static_cast<std::int64_t>(points.size());
    const View<BallAttribute> uploaded =
        work_.attributes.resize(backend_, static_cast<std::int64_t>(attributes.size()));
    const View<Vec3> at = work_.points.resize(backend_, n);
    const View<AttributeValues> out = work_.attribute_values.resize(backend_, kMaps * n);
    backend_.upload(uploaded, attributes.data());
    backend_.upload(at, points.data());
    backend_.for_teams((n + Interpolate::kRun - 1) / Interpolate::kRun,
                       Interpolate{at, balls_, all_balls(), uploaded, out}, "interpolate");
    backend_.download(values.data(), out);
  }

 private:
  using V = typename B::Team::V;

  BallList all_balls() const {
    return {all_balls_.data, static_cast<std::uint32_t>(all_balls_.size)};
  }
  /// Returns Level::margin: the number of cells around a brick on which its interpolated values
  /// depend.
  int margin() const { return settings_.sample_stride > 1 ? settings_.sample_stride : 0; }

  View<typename F::Ball> resize_balls(std::int64_t n) {
    if constexpr (std::is_same_v<typename F::Ball, RoundBall>) {
      return work_.round_balls.resize(backend_, n);
    } else {
      return work_.ellipsoids.resize(backend_, n);
    }
  }

  /// Prepares the balls and, if `shape` has levels, the roots of the tree.
  void prepare(const TreeShape& shape) {
    const auto n = static_cast<std::int64_t>(set_.size());
    const View<Ball> raw = upload_balls(work_, set_);
    balls_ = resize_balls(n);
    all_balls_ = work_.all_balls.resize(backend_, n);
    FieldScale scale;
    scale.log2_floor = log2(settings_.cutoff * settings_.iso);
    const std::size_t levels = shape.levels.size();
    const std::int64_t roots = levels == 0 ? 0 : count_roots(shape);
    View<Offsets> count;
    if (roots > 0) {
      roots_ = work_.nodes[levels].resize(backend_, roots);
      root_counts_ = work_.node_counts[levels % 2].resize(backend_, roots);
      count = {&work_.totals[static_cast<std::int64_t>(levels)], 1};
    }
    if constexpr (!F::kCompactSupport) {
      scale.length = field_length(set_.balls());
      if (roots > 0) root_far_ = work_.far[levels % 2].resize(backend_, roots);
      length_ = scale.length;
    }
    backend_.for_each(std::max(n, roots),
                      PrepareBalls<F>{raw, balls_, all_balls_, scale, shape.roots, roots_,
                                      root_counts_, count, root_far_},
                      "prepare");
  }

  /// Builds the tree from its roots to the bricks. On each level it finds the children that the
  /// surface can cross, numbers them, and writes them with their lists and far fields.
  BrickViews find_bricks(TreeShape shape, const Grid& grid) {
    std::vector<Level>& levels = shape.levels;
    for (Level& level : levels) {
      level.margin = margin();
      set_reach(level, grid.cell / length_, settings_.iso);
    }
    BrickViews out;
    out.tree.levels = static_cast<int>(levels.size());
    out.tree.roots = shape.roots;
    View<Node> parents = roots_;
    View<Counts> counts = root_counts_;
    View<FarField> far = root_far_;
    View<std::uint32_t> entries = all_balls_;
    // The guessed number of nodes of level l. They have guess / 8 parents; buffers per parent are
    // allocated for twice as many.
    std::int64_t guess = guess_top_nodes(grid, shape);
    for (std::size_t l = levels.size(); l-- > 0; guess *= 8) {
      const auto level = static_cast<std::int64_t>(l);
      const std::int64_t* parent_count = &work_.totals[level + 1].nodes();
      Offsets* total = &work_.totals[level];
      const View<std::uint32_t> child_entries =
          work_.child_entries.fit(backend_, parent_count, kChildren, guess / 4 + 1);
      const View<Offsets> first = work_.first.fit(backend_, parent_count, 1, guess / 4 + 1);
      // The buffers of the passes differ in capacity; none is used beyond the smallest.
      std::int64_t capacity =
          std::min({parents.size, counts.size, child_entries.size / kChildren, first.size});
      if constexpr (!F::kCompactSupport) capacity = std::min(capacity, far.size);
      backend_.for_teams(parent_count, capacity,
                         ClassifyChildren<F>{grid, settings_.iso, levels[l], parents, entries,
                                             balls_, child_entries, counts, far},
                         "bricks", B::Team::kParts);
      backend_.scan({counts.data, capacity}, parent_count, first, total, "bricks");
      const View<Node> nodes = work_.nodes[l].fit(backend_, &total->nodes(), 1, guess);
      View<Counts> node_counts;
      if (l > 0) node_counts = work_.node_counts[l % 2].fit(backend_, &total->nodes(), 1, guess);
      // Before the first frame, a node is guessed to have 48 balls.
      const View<std::uint32_t> node_entries =
          work_.entries[l % 2].fit(backend_, &total->entries(), 1, 48 * guess);
      backend_.for_teams(parent_count, capacity,
                         FillChildren<F>{grid, levels[l], parents, entries, balls_, child_entries,
                                         first, nodes, node_counts, node_entries},
                         "bricks", B::Team::kParts);
      if constexpr (!F::kCompactSupport) {
        const View<FarField> node_far = work_.far[l % 2].fit(backend_, &total->nodes(), 1, guess);
        backend_.for_teams(
            &total->nodes(), std::min(nodes.size, node_far.size),
            ExpandFarField<F>{grid, levels[l], parents, nodes, entries, balls_, far, node_far},
            "bricks");
        far = node_far;
      }
      out.tree.nodes[l + 1] = parents;
      parents = nodes;
      counts = node_counts;
      entries = node_entries;
    }
    out.tree.nodes[0] = parents;
    out.count = &work_.totals[0].nodes();
    out.nodes = parents;
    out.entries = entries;
    out.far = far;
    return out;
  }

  BallVertices<F> ball_vertices(const Grid& grid, const BrickViews& bricks) const {
    BallVertices<F> source;
    source.grid = grid;
    source.iso = settings_.iso;
    source.floor = settings_.iso * settings_.cutoff;
    source.margin = margin();
    source.midpoint = settings_.placement == Placement::kMidpoint;
    source.entries = bricks.entries;
    source.balls = balls_;
    source.far = bricks.far;
    source.all_balls = all_balls();
    return source;
  }

  Workspace<B>& work_;
  B& backend_;
  const BallSet& set_;
  const ExtractSettings& settings_;
  // The balls as the kernels read them, the list of all their indices, and the roots of the tree.
  View<typename F::Ball> balls_;
  View<std::uint32_t> all_balls_;
  View<Node> roots_;
  View<Counts> root_counts_;
  View<FarField> root_far_;  ///< only for infinite support
  float length_ = 1;         ///< FieldScale::length
};

template <class B, class F>
void extract_balls(Workspace<B>& work, const BallSet& set, const Grid& grid,
                   const ExtractSettings& settings, Mesh& mesh) {
  BallPasses<B, F>(work, set, settings).extract(grid, mesh);
}

template <class B, class F>
void sample_balls(Workspace<B>& work, const BallSet& set, const std::vector<Vec3>& points,
                  const ExtractSettings& settings, std::vector<float>& values) {
  BallPasses<B, F>(work, set, settings).sample(points, values);
}

template <class B, class F>
void interpolate_balls(Workspace<B>& work, const BallSet& set,
                       const std::vector<BallAttribute>& attributes,
                       const std::vector<Vec3>& points, const ExtractSettings& settings,
                       std::vector<AttributeValues>& values) {
  BallPasses<B, F> passes(work, set, settings);
  if (attributes.size() == set.size()) {
    passes.template interpolate<1>(attributes, points, values);
  } else {
    passes.template interpolate<2>(attributes, points, values);
  }
}

/// Instantiates the three functions above for backend B and a Field.
#define PM_BALL_PASSES(B, ...)                                                                    \
  template void extract_balls<B, __VA_ARGS__>(Workspace<B>&, const BallSet&, const Grid&,         \
                                              const ExtractSettings&, Mesh&);                     \
  template void sample_balls<B, __VA_ARGS__>(Workspace<B>&, const BallSet&,                       \
                                             const std::vector<Vec3>&, const ExtractSettings&,    \
                                             std::vector<float>&);                                \
  template void interpolate_balls<B, __VA_ARGS__>(                                                \
      Workspace<B>&, const BallSet&, const std::vector<BallAttribute>&, const std::vector<Vec3>&, \
      const ExtractSettings&, std::vector<AttributeValues>&)

}  // namespace polymorph
