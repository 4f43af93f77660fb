#include "model/repair/solidify.h"

#include <algorithm>
#include <cmath>

#include "base/parallel.h"
#include "mesh/closest.h"
#include "mesh/normals.h"
#include "model/repair/voxels.h"
#include "model/transfer.h"

namespace polymorph {
namespace {

constexpr int kMinResolution = 16, kMaxResolution = 512;
/// Cells along the longest side in find_gap(), whose candidates differ by a factor of 1.4.
constexpr int kSearchResolution = 48;
/// Largest gap, as a fraction of the longest side. The opening of a bowl may be as wide as that
/// side.
constexpr float kMaxGap = 1.05f;
constexpr float kMaxProjection = 2;  // cells; vertices nearer to the model are projected onto it
constexpr int kSmoothingRounds = 12;

float longest_side(const Box& box) {
  const Vec3 size = box.size();
  return std::max({size.x, size.y, size.z});
}

/// Finds the smallest gap such that no larger one more than doubles the enclosed volume.
float find_gap(const Box& box, const ClosestPointQuery& surface) {
  const float longest = longest_side(box), cell = longest / kSearchResolution;
  std::vector<float> gaps;
  for (float gap = 3 * cell; gap < kMaxGap * longest; gap *= 1.4f) gaps.push_back(gap);
  gaps.push_back(kMaxGap * longest);
  const Grid grid = make_grid_around(box, cell, gaps.back() / 2);
  const std::vector<float> wall_distances =
      compute_distances(grid, mark_wall_points(grid, surface));
  std::vector<double> volumes;
  for (const float gap : gaps) {
    const Voxels voxels = find_unreachable(grid, wall_distances, gap / 2);
    // find_unreachable() erodes by a cell, so thin walls that enclose nothing have hardly any
    // volume.
    const double volume =
        static_cast<double>(std::count(voxels.solid.begin(), voxels.solid.end(), 1));
    volumes.push_back(volume);
  }
  std::size_t best = 0;
  for (std::size_t k = 0; k < gaps.size(); ++k)
    if (volumes[k] > 2 * volumes[best]) best = k;
  // A smaller gap that encloses about the same volume is better.
  while (best > 0 && volumes[best] <= 1.05 * volumes[best - 1]) --best;
  // Walls are thicker on the coarse grid, so a fine grid needs a slightly larger gap.
  return gaps[best] + 2 * cell;
}

using Neighbors = std::vector<std::vector<std::uint32_t>>;

Vec3 mean_neighbor(const VoxelSurface& surface, const std::vector<std::uint32_t>& neighbors) {
  Vec3 sum;
  for (const std::uint32_t i : neighbors) sum = sum + surface.points[i];
  return sum / static_cast<float>(neighbors.size());
}

/// Relaxes `free_vertices`, which are not on the model, to a minimal surface by successive
/// over-relaxation in order of index. Otherwise caps over openings would bulge inward like the ball
/// that is rolled over them.
void relax_to_minimal_surface(VoxelSurface& surface, const Neighbors& neighbors,
                              const std::vector<std::uint32_t>& free_vertices) {
  constexpr int kRounds = 400;
  constexpr float kOverRelaxation = 1.9f;
  for (int round = 0; round < kRounds; ++round)
    for (const std::uint32_t i : free_vertices)
      surface.points[i] = lerp(surface.points[i], mean_neighbor(surface, neighbors[i]),
                               // Over-relaxation in the last rounds would leave ripples.
                               round + 20 < kRounds ? kOverRelaxation : 1.0f);
}

/// Moves vertices near the model onto it, and relaxes the others to a minimal surface.
void fit_to_model(VoxelSurface& surface, float cell, const ClosestPointQuery& model) {
  Neighbors neighbors(surface.points.size());
  for (const Triangle& t : surface.triangles)
    for (int k = 0; k < 3; ++k) neighbors[t.v[k]].push_back(t.v[(k + 1) % 3]);
  std::vector<std::uint32_t> free_vertices;
  const std::vector<ClosestPoint> nearest = model.closest(surface.points, kMaxProjection * cell);
  for (std::uint32_t i = 0; i < nearest.size(); ++i)
    if (nearest[i].triangle == ClosestPoint::kNoTriangle) free_vertices.push_back(i);
  relax_to_minimal_surface(surface, neighbors, free_vertices);
  std::vector<Vec3> next(surface.points.size());
  for (int round = 0; round <= kSmoothingRounds; ++round) {
    const bool is_last = round == kSmoothingRounds;
    parallel_for(
        static_cast<std::int64_t>(surface.points.size()),
        [&](std::int64_t i) {
          const auto k = static_cast<std::size_t>(i);
          // Moving half way to the neighbours' mean evens out the triangles. Then the vertex is
          // projected onto the model. The last round only projects.
          const Vec3 target =
              is_last ? surface.points[k]
                      : lerp(surface.points[k], mean_neighbor(surface, neighbors[k]), 0.5f);
          const ClosestPoint hit = model.closest(target, kMaxProjection * cell);
          next[k] = hit.triangle == ClosestPoint::kNoTriangle ? target : hit.point;
        },
        /*grain=*/256);
    surface.points.swap(next);
  }
}

/// Makes a model of the surface, with the labels, materials and texture coordinates of the nearest
/// faces.
Model transfer_attributes(VoxelSurface surface, const Model& model,
                          const ClosestPointQuery& query) {
  Model solid;
  solid.name = model.name;
  solid.points = std::move(surface.points);
  solid.triangles = std::move(surface.triangles);
  solid.label_names = model.label_names;
  solid.materials = model.materials;
  solid.textures = model.textures;
  std::vector<Vec3> middles;
  for (const Triangle& t : solid.triangles)
    middles.push_back((solid.points[t.v[0]] + solid.points[t.v[1]] + solid.points[t.v[2]]) / 3);
  const std::vector<ClosestPoint> nearest = query.closest(middles);
  for (std::size_t t = 0; t < solid.triangles.size(); ++t) {
    const std::uint32_t source = nearest[t].triangle;
    solid.labels.push_back(model.labels.empty() ? 0 : model.labels[source]);
    solid.triangle_materials.push_back(
        model.triangle_materials.empty() ? 0 : model.triangle_materials[source]);
    if (model.corner_uvs.empty()) continue;
    const auto& corners = model.triangles[source].v;
    for (const std::uint32_t v : solid.triangles[t].v)
      solid.corner_uvs.push_back(
          interpolate_uv(model.corner_uvs, source,
                         closest_on_triangle(solid.points[v], model.points[corners[0]],
                                             model.points[corners[1]], model.points[corners[2]])));
  }
  solid.corner_normals = creased_normals(solid);
  return solid;
}

}  // namespace

Result<Model> solidify(const Model& model, const SolidifySettings& settings) {
  if (settings.resolution < kMinResolution || settings.resolution > kMaxResolution)
    return make_error(ErrorCode::kInput, "solidify: resolution {} is out of range - use {} to {}",
                      settings.resolution, kMinResolution, kMaxResolution);
  const Box box = model.box();
  const float longest = longest_side(box);
  if (model.triangles.empty() || !(longest > 0))
    return make_error(ErrorCode::kInput, "model \"{}\" has no faces to solidify", model.name);
  if (!(settings.gap >= 0) || settings.gap > kMaxGap * longest)
    return make_error(
        ErrorCode::kInput,
        "solidify: gap {:.4g} is out of range for model \"{}\" - use 0 (automatic) to "
        "its longest side, {:.4g}",
        settings.gap, model.name, longest);
  const ClosestPointQuery query(model);
  const float cell = longest / static_cast<float>(settings.resolution);
  const float gap = settings.gap > 0 ? settings.gap : find_gap(box, query);
  const Grid grid = make_grid_around(box, cell, gap / 2);
  Voxels voxels =
      find_unreachable(grid, compute_distances(grid, mark_wall_points(grid, query)), gap / 2);
  make_manifold(voxels);
  VoxelSurface surface = make_surface_nets(voxels);
  if (surface.triangles.empty())
    return make_error(
        ErrorCode::kInput,
        "model \"{}\": nothing solid is left at resolution {} with openings up to {:.3g} closed "
        "(its walls are thinner than {:.3g} and enclose nothing) - raise the gap to the width of "
        "its opening, raise the resolution, or thicken the model",
        model.name, settings.resolution, gap, 2 * cell);
  fit_to_model(surface, cell, query);
  return transfer_attributes(std::move(surface), model, query);
}

}  // namespace polymorph
