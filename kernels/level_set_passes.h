// Passes for level sets (level_set.h): the surface of one object's distances, the surface between
// two objects, and the regression of the map from the latter to both objects.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <type_traits>
#include <utility>
#include <vector>

#include "brick_passes.h"
#include "distance_field.h"
#include "engine.h"
#include "level_set.h"
#include "meet_landmarks.h"
#include "mesh.h"
#include "morph_field.h"
#include "morph_surface.h"
#include "regression.h"
#include "sample_blocks.h"
#include "tree.h"
#include "types.h"
#include "view.h"
#include "workspace.h"

namespace polymorph {

/// Builds the tree from its roots to the bricks. On each level it finds the children that the
/// surface can cross, numbers them, and writes them. Returns the bricks, for which fit_bricks()
/// then allocates buffers.
template <class B, class Bounds>
BrickViews find_level_set_bricks(Workspace<B>& work, const TreeShape& shape, const Grid& grid,
                                 const Bounds& bounds) {
  const std::vector<Level>& levels = shape.levels;
  BrickViews out;
  out.tree.levels = static_cast<int>(levels.size());
  out.tree.roots = shape.roots;
  const std::int64_t roots = count_roots(shape);
  View<Node> parents = work.nodes[levels.size()].resize(work.backend, roots);
  View<Counts> counts = work.node_counts[levels.size() % 2].resize(work.backend, roots);
  const View<Offsets> root_count = {&work.totals[static_cast<std::int64_t>(levels.size())], 1};
  work.backend.for_each(roots, PrepareNodes{shape.roots, parents, counts, root_count}, "bricks");
  // The guessed number of nodes of level l.
  std::int64_t guess = guess_top_nodes(grid, shape);
  for (std::size_t l = levels.size(); l-- > 0; guess *= 8) {
    const auto level = static_cast<std::int64_t>(l);
    const std::int64_t* parent_count = &work.totals[level + 1].nodes();
    Offsets* total = &work.totals[level];
    const std::int64_t capacity = std::min(parents.size, counts.size);
    work.backend.for_teams(parent_count, capacity,
                           ClassifyNodes<Bounds>{grid, bounds, levels[l], parents, counts},
                           "bricks", B::Team::kParts);
    View<Node> nodes;
    View<Counts> node_counts;
    const auto fit_nodes = [&] {
      nodes = work.nodes[l].fit(work.backend, &total->nodes(), 1, guess);
      if (l > 0) node_counts = work.node_counts[l % 2].fit(work.backend, &total->nodes(), 1, guess);
    };
    if constexpr (B::kHostMemory) {
      const View<Offsets> first = work.first.fit(work.backend, parent_count, 1, 0);
      work.backend.scan({counts.data, capacity}, parent_count, first, total, "bricks");
      fit_nodes();
      work.backend.for_teams(parent_count, capacity, FillNodes{parents, first, nodes, node_counts},
                             "bricks");
    } else {
      fit_nodes();
      work.backend.for_teams(
          (capacity + NumberNodes::kParents - 1) / NumberNodes::kParents,
          NumberNodes{parent_count, parents, {counts.data, capacity}, nodes, node_counts, total},
          "bricks");
    }
    out.tree.nodes[l + 1] = parents;
    parents = nodes;
    counts = node_counts;
  }
  out.tree.nodes[0] = parents;
  out.count = &work.totals[0].nodes();
  out.nodes = parents;
  return out;
}

/// Extracts the surface on which the field of `bounds` (level_set.h) is 0.
template <class B, class Bounds>
void extract_level_set(Workspace<B>& work, const Bounds& bounds, const Grid& grid,
                       ExtractSettings settings, Mesh& mesh) {
  settings.iso = 0;
  const TreeShape shape = tree_shape(grid, B::kManyRoots);
  extract_bricks(work, grid, settings, mesh, [&] {
    using Field = decltype(bounds.field);
    constexpr bool kPacks = Lanes<typename B::Team::V>::kCount > 1;
    using Sample = std::conditional_t<kPacks, SampleBlocks<Bounds>, SampleLevelSet<Field>>;
    using Vertices = LevelSetVertices<Field>;
    const auto sample = [&](const CountBricks& count) {
      if constexpr (kPacks) {
        return Sample{count, bounds};
      } else {
        return Sample{count, bounds.field};
      }
    };
    BrickViews bricks = find_level_set_bricks(work, shape, grid, bounds);
    fit_bricks(work, grid, bricks);
    // Points beyond the grid are outside, at a distance of one cell.
    return SampledBricks<Sample, Vertices>{
        bricks, sample(prepare_counting(work, grid, settings, bricks, -grid.cell)),
        Vertices{bounds.field, 1 / grid.cell}};
  });
}

/// Returns a generous bound, scene units, of all rounding errors of distances: 1e-4 cells of
/// `grid`.
inline float distance_rounding(const Grid& grid) { return 1e-4f * grid.cell; }

/// Returns distances in backend memory, after uploading them unless they are there already. The
/// kMaxGrids most recently used grids stay there.
template <class B>
DistanceField upload_distances(Workspace<B>& work,
                               const std::shared_ptr<const DistanceGrid>& object) {
  if constexpr (B::kHostMemory) {
    return DistanceField(object->grid, object->values.data());
  } else {
    auto& grids = work.uploaded_distances;
    for (auto known = grids.begin(); known != grids.end(); ++known) {
      if ((*known)->object != object) continue;
      // The most recently used grids are last, so that no grid of the present surface is replaced.
      std::rotate(known, known + 1, grids.end());
      return DistanceField(object->grid, grids.back()->values.data);
    }
    // An object has up to three grids (distances, smoothed distances, thinness), and the surfaces
    // of several actors are extracted in turn.
    constexpr std::size_t kMaxGrids = 24;
    if (grids.size() < kMaxGrids) {
      grids.push_back(std::make_unique<typename Workspace<B>::UploadedDistances>());
    } else {
      // The new grid takes the memory of the least recently used one.
      std::rotate(grids.begin(), grids.begin() + 1, grids.end());
    }
    typename Workspace<B>::UploadedDistances& uploaded = *grids.back();
    uploaded.object = nullptr;  // marks the values as unknown if the next lines throw
    uploaded.values =
        uploaded.buffer.resize(work.backend, static_cast<std::int64_t>(object->values.size()));
    work.backend.upload(uploaded.values, object->values.data());
    uploaded.object = object;
    return DistanceField(object->grid, uploaded.values.data);
  }
}

/// Returns an object's distances in backend memory. If `smooth` is not null, the field also has the
/// smoothed distances, and its detail fades by `fade`.
template <class B>
DistanceField upload_object(Workspace<B>& work, const std::shared_ptr<const DistanceGrid>& object,
                            const std::shared_ptr<const DistanceGrid>& smooth,
                            const DetailFade& fade) {
  DistanceField field = upload_distances(work, object);
  if (smooth) field.set_detail(upload_distances(work, smooth).values, fade);
  return field;
}

template <class B>
void extract_distances(Workspace<B>& work, const std::shared_ptr<const DistanceGrid>& object,
                       const Grid& grid, const ExtractSettings& settings, Mesh& mesh) {
  const DistanceBounds bounds = {upload_distances(work, object), object->lipschitz,
                                 distance_rounding(grid)};
  extract_level_set(work, bounds, grid, settings, mesh);
}

/// A regression's samples and their values as the kernels read them.
struct UploadedSamples {
  View<KernelSample> samples;
  View<BallAttribute> values;  ///< two per sample; the second is 0 if there is one map
};
template <class B>
UploadedSamples upload_samples(Workspace<B>& work, const Regression& regression) {
  const std::size_t count = regression.samples.size();
  std::vector<KernelSample> samples(count);
  std::vector<BallAttribute> values(2 * count);
  for (std::size_t e = 0; e < count; ++e) {
    const RegressionSample& sample = regression.samples[e];
    const float widest_deviation = 4 * sample.deviation;
    // Three Gaussians (regression.h); the widest one is exp(-d^2 / (2 s^2)) =
    // 2^(-kHalfLog2E d^2 / s^2), s = widest_deviation.
    constexpr float kHalfLog2E = 0.72134752f;
    const float mass = kKernelScale * sample.mass;
    samples[e] = {sample.center, kHalfLog2E / (widest_deviation * widest_deviation), mass,
                  kSecondHeight * mass, kThirdHeight * mass};
    const auto maps = static_cast<std::size_t>(regression.maps);
    for (std::size_t m = 0; m < maps; ++m) values[2 * e + m] = regression.values[e * maps + m];
  }
  const auto size = static_cast<std::int64_t>(count);
  const UploadedSamples out = {work.kernel_samples.resize(work.backend, size),
                               work.attributes.resize(work.backend, 2 * size)};
  work.backend.upload(out.samples, samples.data());
  work.backend.upload(out.values, values.data());
  return out;
}

/// Changes the map, whose nodes are `coefficients`, so that it takes the regression's landmarks to
/// their goals (meet_landmarks.h).
template <class B>
void meet_landmarks(Workspace<B>& work, const Regression& regression, const SmoothMap& map,
                    const View<float>& coefficients) {
  std::vector<Vec3> positions;
  for (const RegressionLandmark& landmark : regression.landmarks)
    positions.push_back(landmark.position);
  const auto count = static_cast<std::int64_t>(positions.size());
  const View<Vec3> at = work.landmark_positions.resize(work.backend, count);
  const View<AttributeValues> device_images =
      work.landmark_values.resize(work.backend, regression.maps * count);
  work.backend.upload(at, positions.data());
  work.backend.for_each(count, SampleMap{map, at, device_images, regression.maps}, "regress");
  std::vector<AttributeValues> images(static_cast<std::size_t>(device_images.size));
  work.backend.download(images.data(), device_images);
  const std::vector<LandmarkTerm> host_terms = find_landmark_terms(regression, images);
  const View<LandmarkTerm> terms = work.landmark_terms.resize(work.backend, count);
  work.backend.upload(terms, host_terms.data());
  work.backend.for_each(coefficients.size / kRegressionValues,
                        AddLandmarks{regression.lattice, terms, coefficients}, "regress");
}

/// Lists the nodes on which the regression depends at the points, in ascending order.
inline std::vector<std::uint32_t> list_nodes(const Grid& lattice, const std::vector<Vec3>& points) {
  const Int3 n = lattice.points;
  const float inv_spacing = 1 / lattice.cell;
  const auto columns = static_cast<std::size_t>(n.x), rows = static_cast<std::size_t>(n.y);
  // Most points share their nodes with others, so the lowest of the 3 x 3 x 3 are marked first.
  std::vector<std::uint8_t> is_lowest(columns * rows * static_cast<std::size_t>(n.z), 0);
  std::vector<std::uint8_t> is_needed = is_lowest;
  for (const Vec3 p : points) {
    const SplineAxis x(p.x, lattice.origin.x, inv_spacing, n.x),
        y(p.y, lattice.origin.y, inv_spacing, n.y), z(p.z, lattice.origin.z, inv_spacing, n.z);
    is_lowest[static_cast<std::size_t>(x.first) +
              columns * (static_cast<std::size_t>(y.first) +
                         rows * static_cast<std::size_t>(z.first))] = 1;
  }
  for (std::size_t lowest = 0; lowest < is_lowest.size(); ++lowest) {
    if (!is_lowest[lowest]) continue;
    for (std::size_t k = 0; k < 9; ++k)
      std::fill_n(is_needed.data() + lowest + columns * (k % 3 + rows * (k / 3)), 3,
                  std::uint8_t{1});
  }
  std::vector<std::uint32_t> listed;
  for (std::size_t node = 0; node < is_needed.size(); ++node)
    if (is_needed[node]) listed.push_back(static_cast<std::uint32_t>(node));
  return listed;
}

/// Computes the regression's nodes, unless backend memory holds them already, and returns the map.
/// If `listed` is not empty, only these nodes are computed, and not kept for the next call. The
/// regression must then have neither landmarks nor thinness.
template <class B>
SmoothMap compute_map(Workspace<B>& work, const std::shared_ptr<const Regression>& regression,
                      const std::vector<std::uint32_t>& listed = {}) {
  const Int3 n = regression->lattice.points;
  const std::int64_t nodes = std::int64_t{n.x} * n.y * n.z;
  const View<float> coefficients =
      work.lattice_nodes.resize(work.backend, kRegressionValues * nodes);
  const SmoothMap map(*regression, coefficients.data);
  if (regression == work.uploaded_regression) return map;
  work.uploaded_regression.reset();
  const UploadedSamples uploaded = upload_samples(work, *regression);
  using Regress = RegressNodes<typename B::Team>;
  Regress regress{regression->lattice, uploaded.samples, uploaded.values,
                  regression->sloped,  coefficients,     /*listed=*/{}};
  const auto listed_count = static_cast<std::int64_t>(listed.size());
  if (listed_count > 0) {
    const View<std::uint32_t> indices = work.regressed_nodes.resize(work.backend, listed_count);
    work.backend.upload(indices, listed.data());
    regress.listed = indices;
  }
  const std::int64_t computed = listed_count > 0 ? listed_count : nodes;
  work.backend.for_teams((computed + Regress::kNodes - 1) / Regress::kNodes, regress, "regress");
  if (listed_count > 0) return map;
  if (!regression->landmarks.empty()) meet_landmarks(work, *regression, map, coefficients);
  if (regression
          ->thinness[0]) {  // both objects have one: the level's weight is small in thin parts
    WeighLevel weigh;
    weigh.map = map;
    for (int m = 0; m < 2; ++m) weigh.thinness[m] = upload_distances(work, regression->thinness[m]);
    weigh.nodes = coefficients;
    work.backend.for_each(nodes, weigh, "regress");
  }
  work.uploaded_regression = regression;
  return map;
}

template <class B>
void sample_map(Workspace<B>& work, const std::shared_ptr<const Regression>& regression,
                const std::vector<Vec3>& points, std::vector<AttributeValues>& values) {
  // A few points depend on a part of the nodes. Landmarks change all of them, and depend on others.
  const Int3 size = regression->lattice.points;
  const std::size_t nodes = static_cast<std::size_t>(size.x) * static_cast<std::size_t>(size.y) *
                            static_cast<std::size_t>(size.z);
  std::vector<std::uint32_t> listed;
  if (regression != work.uploaded_regression && regression->landmarks.empty() &&
      !regression->thinness[0] && points.size() < nodes)
    listed = list_nodes(regression->lattice, points);
  if (2 * listed.size() > nodes) listed.clear();  // computes all, and keeps them for the next call
  const SmoothMap map = compute_map(work, regression, listed);
  const auto n = static_cast<std::int64_t>(points.size());
  values.resize(points.size() * static_cast<std::size_t>(regression->maps));
  const View<Vec3> at = work.points.resize(work.backend, n);
  const View<AttributeValues> out =
      work.attribute_values.resize(work.backend, static_cast<std::int64_t>(values.size()));
  work.backend.upload(at, points.data());
  work.backend.for_each(n, SampleMap{map, at, out, regression->maps}, "map");
  work.backend.download(values.data(), out);
}

/// Returns the largest Strain in the window at each node of the map (MaximizeStrain), in backend
/// memory. It bounds the derivatives of the objects' distances in scene units.
template <class B>
View<const Strain> bound_strain(Workspace<B>& work, const MorphSurface& surface,
                                const SmoothMap& map) {
  using V = typename B::Team::V;
  using Maximize = MaximizeStrain<V>;
  const Int3 n = map.lattice.points;
  const std::int64_t row = n.x, layer = row * n.y, nodes = layer * n.z;
  const std::int64_t padded =
      nodes + (B::kHostMemory ? Maximize::kPadding / Maximize::kFloats + 1 : 0);
  View<Strain> strain = work.strain[0].resize(work.backend, padded);
  BoundStrain bound;
  bound.lattice = map.lattice;
  bound.nodes = {map.nodes, kRegressionValues * nodes};
  bound.scale[0] = surface.from_scale, bound.scale[1] = surface.to_scale;
  bound.strain = {strain.data, nodes};
  if constexpr (B::kHostMemory) {
    View<Strain> windows = work.strain[1].resize(work.backend, padded);
    work.backend.for_each(nodes, bound, "regress");
    const std::int64_t floats = Maximize::kFloats * nodes;
    for (const std::int64_t step : {std::int64_t{1}, row, layer}) {
      work.backend.for_each(
          (floats + Lanes<V>::kCount - 1) / Lanes<V>::kCount,
          Maximize{&strain.data->maps.x, &windows.data->maps.x, floats, Maximize::kFloats * step},
          "regress");
      std::swap(strain, windows);
    }
  } else {
    const Int3 tiles = ceil_divide(n, BoundStrainWindows::kTile);
    work.backend.for_teams(std::int64_t{tiles.x} * tiles.y * tiles.z,
                           BoundStrainWindows{bound, tiles}, "regress");
  }
  return strain;
}

/// Returns the largest factor by which an affine map stretches. The linear part is a rotation times
/// a factor, so this factor is the length of any row; the longest allows for rounding.
inline float affine_norm(const AffineMap& map) {
  float largest = 0;
  for (const Vec3 row : map.rows) largest = std::max(largest, length(row));
  return largest;
}

/// Returns the field of a surface on a grid, with its bounds.
template <class B>
MorphBounds bound_morph(Workspace<B>& work, const MorphSurface& surface, const Grid& grid) {
  const MorphField field = {
      compute_map(work, surface.map),
      {upload_object(work, surface.from, surface.smooth_from, surface.fade_from),
       upload_object(work, surface.to, surface.smooth_to, surface.fade_to)},
      {surface.from_scale, surface.to_scale},
      surface.level,
      surface.linear_range > 0 ? 1 / surface.linear_range : 0};
  MorphBounds bounds;
  bounds.field = field;
  bounds.strain = bound_strain(work, surface, field.map);
  bounds.affine_norm = std::max(surface.from_scale * affine_norm(surface.map->affine[0]),
                                surface.to_scale * affine_norm(surface.map->affine[1]));
  for (const auto& object : {surface.from, surface.to, surface.smooth_from, surface.smooth_to}) {
    if (object) bounds.lipschitz = std::max(bounds.lipschitz, object->lipschitz);
  }
  bounds.rounding = distance_rounding(grid);
  return bounds;
}

template <class B>
void extract_morph(Workspace<B>& work, const MorphSurface& surface, const Grid& grid,
                   const ExtractSettings& settings, Mesh& mesh) {
  extract_level_set(work, bound_morph(work, surface, grid), grid, settings, mesh);
}

}  // namespace polymorph
