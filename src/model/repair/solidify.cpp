#include "model/repair/solidify.h"

#include <algorithm>
#include <cmath>

#include "base/parallel.h"
#include "mesh/closest.h"
#include "mesh/normals.h"
#include "model/repair/voxels.h"

namespace polymorph {
namespace {

constexpr int kMinResolution = 16, kMaxResolution = 512;
constexpr int kSearchResolution = 48;  // for the gap; its widths are a factor 1.4 apart anyway
constexpr float kMaxGap = 1.05f;       // of the longest side, which a bowl is open along
constexpr float kProject = 2;          // cells: how near a vertex belongs on the model
constexpr int kSmoothingRounds = 12;

float longest_side(const Box& box) {
  const Vec3 size = box.size();
  return std::max({size.x, size.y, size.z});
}

/// The smallest gap from which on no wider one would double the volume.
float find_gap(const Box& box, const ClosestPointQuery& surface) {
  const float side = longest_side(box), cell = side / kSearchResolution;
  std::vector<float> gaps;
  for (float gap = 3 * cell; gap < kMaxGap * side; gap *= 1.4f) gaps.push_back(gap);
  gaps.push_back(kMaxGap * side);
  const Grid grid = grid_around(box, cell, gaps.back() / 2);
  const std::vector<float> from_wall = distances_to(grid, wall_points(grid, surface));
  std::vector<double> volumes;
  for (const float gap : gaps) {
    const Voxels voxels = unreachable(grid, from_wall, gap / 2);
    // Less a cell all around, so that thin walls by themselves count as nearly nothing.
    const double volume =
        static_cast<double>(std::count(voxels.solid.begin(), voxels.solid.end(), 1));
    volumes.push_back(volume);
  }
  std::size_t best = 0;
  for (std::size_t k = 0; k < gaps.size(); ++k)
    if (volumes[k] > 2 * volumes[best]) best = k;
  // The first of those that enclose about as much.
  while (best > 0 && volumes[best] <= 1.05 * volumes[best - 1]) --best;
  // Coarse walls are thick: what they close, fine ones may not.
  return gaps[best] + 2 * cell;
}

using Neighbors = std::vector<std::vector<std::uint32_t>>;

Vec3 mean_of(const VoxelSurface& surface, const std::vector<std::uint32_t>& around) {
  Vec3 sum;
  for (const std::uint32_t i : around) sum = sum + surface.points[i];
  return sum / static_cast<float>(around.size());
}

/// A ball that rests on an opening's rim dips into it. Vertices that are not on the model are
/// therefore relaxed to a minimal surface, like a soap film over the rim. In order of index, by
/// successive over-relaxation.
void relax_to_minimal_surface(VoxelSurface& surface, const Neighbors& around,
                              const std::vector<std::uint32_t>& loose) {
  constexpr int kRounds = 400;
  constexpr float kOverRelaxation = 1.9f;
  for (int round = 0; round < kRounds; ++round)
    for (const std::uint32_t i : loose)
      surface.points[i] = lerp(surface.points[i], mean_of(surface, around[i]),
                               // The last rounds without, which would leave ripples.
                               round + 20 < kRounds ? kOverRelaxation : 1.0f);
}

/// Moves vertices near the model onto it, and relaxes the others to a minimal surface.
void settle(VoxelSurface& surface, float cell, const ClosestPointQuery& model) {
  Neighbors around(surface.points.size());
  for (const Triangle& t : surface.triangles)
    for (int k = 0; k < 3; ++k) around[t.v[k]].push_back(t.v[(k + 1) % 3]);
  std::vector<std::uint32_t> loose;
  const std::vector<ClosestPoint> nearest = model.closest(surface.points, kProject * cell);
  for (std::uint32_t i = 0; i < nearest.size(); ++i)
    if (nearest[i].triangle == ClosestPoint::kNoTriangle) loose.push_back(i);
  relax_to_minimal_surface(surface, around, loose);
  std::vector<Vec3> next(surface.points.size());
  for (int round = 0; round <= kSmoothingRounds; ++round) {
    const bool last = round == kSmoothingRounds;
    parallel_for(
        static_cast<std::int64_t>(surface.points.size()),
        [&](std::int64_t i) {
          const auto k = static_cast<std::size_t>(i);
          // Half way to the mean evens the triangles out; then back onto the model.
          const Vec3 moved =
              last ? surface.points[k] : lerp(surface.points[k], mean_of(surface, around[k]), 0.5f);
          const ClosestPoint found = model.closest(moved, kProject * cell);
          next[k] = found.triangle == ClosestPoint::kNoTriangle ? moved : found.point;
        },
        256);
    surface.points.swap(next);
  }
}

Vec2 uv_at(const Model& model, std::uint32_t t, Vec3 p) {
  const auto& v = model.triangles[t].v;
  const TriangleWeights w =
      closest_on_triangle(p, model.points[v[0]], model.points[v[1]], model.points[v[2]]);
  const Vec2* uv = &model.corner_uvs[3 * static_cast<std::size_t>(t)];
  return uv[0] * static_cast<float>(w.a) + uv[1] * static_cast<float>(w.b) +
         uv[2] * static_cast<float>(w.c);
}

/// The surface as a model, with the labels, materials and texture coordinates of the nearest faces.
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
    for (const std::uint32_t v : solid.triangles[t].v)
      solid.corner_uvs.push_back(uv_at(model, source, solid.points[v]));
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
  const float side = longest_side(box);
  if (model.triangles.empty() || !(side > 0))
    return make_error(ErrorCode::kInput, "model \"{}\" has no faces to solidify", model.name);
  if (!(settings.gap >= 0) || settings.gap > kMaxGap * side)
    return make_error(
        ErrorCode::kInput,
        "solidify: gap {:.4g} is out of range for model \"{}\" - use 0 (automatic) to "
        "its longest side, {:.4g}",
        settings.gap, model.name, side);
  const ClosestPointQuery query(model);
  const float cell = side / static_cast<float>(settings.resolution);
  const float gap = settings.gap > 0 ? settings.gap : find_gap(box, query);
  const Grid grid = grid_around(box, cell, gap / 2);
  Voxels voxels = unreachable(grid, distances_to(grid, wall_points(grid, query)), gap / 2);
  make_manifold(voxels);
  VoxelSurface surface = surface_nets(voxels);
  if (surface.triangles.empty())
    return make_error(
        ErrorCode::kInput,
        "model \"{}\": nothing solid is left at resolution {} with openings up to {:.3g} closed "
        "(its walls are thinner than {:.3g} and enclose nothing) - raise the gap to the width of "
        "its opening, raise the resolution, or thicken the model",
        model.name, settings.resolution, gap, 2 * cell);
  settle(surface, cell, query);
  return transfer_attributes(std::move(surface), model, query);
}

}  // namespace polymorph
