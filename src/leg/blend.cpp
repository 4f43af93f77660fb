#include "leg/blend.h"

#include <algorithm>
#include <cmath>

#include "base/array3.h"
#include "base/parallel.h"
#include "field/distance_grid.h"
#include "field/extract_surface.h"

namespace polymorph {
namespace {

/// Number of cells to which distances are clamped. Where the surfaces are further apart than that,
/// the blend joins them late.
constexpr float kBand = 6;
/// Points per axis of a block. All points of a block are sampled, or none.
constexpr int kBlock = 8;

/// Inputs of distances_at().
struct BlendInputs {
  const BlendEnds& ends;
  const ClosestPointQuery& to_surface;
  const ExtractSettings& settings;
  Engine& engine;
};

/// Signed distances of points to the model and to the balls' surface.
struct Distances {
  std::vector<float> model, balls;
};

/// Computes signed distances to both surfaces, clamped to `band`.
Result<Distances> distances_at(const BlendInputs& in, const std::vector<Vec3>& points, float band) {
  std::vector<float> field_values;
  PM_TRY_STATUS(to_status(in.engine.sample(in.ends.balls, points, in.settings, field_values)));
  const std::vector<std::uint8_t> in_model = in.ends.inside.inside(points);
  const std::vector<ClosestPoint> to_model = in.ends.to_model->closest(points, band),
                                  to_surface = in.to_surface.closest(points, band);
  Distances distances;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const float m = to_model[i].distance, b = to_surface[i].distance;
    distances.model.push_back(in_model[i] ? m : -m);
    distances.balls.push_back(field_values[i] > in.settings.iso ? b : -b);
  }
  return distances;
}

/// Marks the blocks that the blend's surface may cross. These are the blocks within `near` of
/// either surface, and adjacent blocks on different sides of a surface, because the inside of an
/// open model may end far from its faces. `centers`: distances of the blocks' centres.
std::vector<bool> find_crossed_blocks(const Distances& centers, Int3 blocks, float near) {
  std::vector<bool> is_crossed(centers.model.size());
  for (int z = 0; z < blocks.z; ++z)
    for (int y = 0; y < blocks.y; ++y)
      for (int x = 0; x < blocks.x; ++x) {
        const std::size_t i = array3_index(blocks, x, y, z);
        const float m = centers.model[i], b = centers.balls[i];
        if (std::min(std::fabs(m), std::fabs(b)) < near) is_crossed[i] = true;
        const auto compare = [&](std::size_t k) {
          if ((centers.model[k] > 0) == (m > 0) && (centers.balls[k] > 0) == (b > 0)) return;
          is_crossed[i] = is_crossed[k] = true;
        };
        if (x > 0) compare(array3_index(blocks, x - 1, y, z));
        if (y > 0) compare(array3_index(blocks, x, y - 1, z));
        if (z > 0) compare(array3_index(blocks, x, y, z - 1));
      }
  return is_crossed;
}

/// Computes both distances at the points of the grid that `model` and `balls` have in common. First
/// it samples the centres of all blocks, then all points of the blocks that the surface may cross.
/// In the other blocks only the sign counts, which the centre gives.
Status fill_distances(const BlendInputs& in, DistanceGrid& model, DistanceGrid& balls) {
  const Grid& grid = model.grid;
  const Int3 n = grid.points;
  const auto blocks_along = [](int points) { return (points + kBlock - 1) / kBlock; };
  const Int3 blocks = {blocks_along(n.x), blocks_along(n.y), blocks_along(n.z)};
  const float band = kBand * grid.cell;
  constexpr float kHalf = 0.5f * (kBlock - 1);  // half the extent of a block's points, in cells
  const float block_radius =
      std::sqrt(3.0f) * kHalf * grid.cell * 1.001f;  // 1.001 allows for rounding
  std::vector<Int3> corners;
  std::vector<Vec3> centers;
  for (int z = 0; z < n.z; z += kBlock)
    for (int y = 0; y < n.y; y += kBlock)
      for (int x = 0; x < n.x; x += kBlock) {
        corners.push_back({x, y, z});
        centers.push_back(grid_point(grid, {x, y, z}) + Vec3{kHalf, kHalf, kHalf} * grid.cell);
      }
  // Sample the blocks' centres.
  PM_TRY(const Distances at_centers, distances_at(in, centers, band + block_radius));
  const std::vector<bool> is_crossed = find_crossed_blocks(at_centers, blocks, band + block_radius);
  // Sample the points of crossed blocks, in batches, which bounds the memory.
  constexpr std::size_t kBatch = 1 << 18;
  std::vector<std::size_t> indices;
  std::vector<Vec3> points;
  const auto sample_batch = [&]() -> Status {
    PM_TRY(const Distances distances, distances_at(in, points, band));
    for (std::size_t i = 0; i < indices.size(); ++i) {
      model.values[indices[i]] = distances.model[i];
      balls.values[indices[i]] = distances.balls[i];
    }
    indices.clear(), points.clear();
    return Ok{};
  };
  for (std::size_t b = 0; b < corners.size(); ++b) {
    const Int3 low = corners[b];
    for (int z = low.z; z < std::min(low.z + kBlock, n.z); ++z)
      for (int y = low.y; y < std::min(low.y + kBlock, n.y); ++y)
        for (int x = low.x; x < std::min(low.x + kBlock, n.x); ++x) {
          const std::size_t i = array3_index(n, x, y, z);
          if (is_crossed[b]) {
            indices.push_back(i);
            points.push_back(grid_point(grid, {x, y, z}));
          } else {
            model.values[i] = at_centers.model[b] > 0 ? band : -band;
            balls.values[i] = at_centers.balls[b] > 0 ? band : -band;
          }
        }
    if (points.size() >= kBatch) PM_TRY_STATUS(sample_batch());
  }
  return sample_batch();
}

/// Interpolates the vertices' normals at a point of the mesh.
Vec3 surface_normal(const Mesh& mesh, const ClosestPoint& place) {
  const Triangle& t = mesh.triangles[place.triangle];
  const TriangleWeights w = closest_on_triangle(place.point, mesh.positions[t.v[0]],
                                                mesh.positions[t.v[1]], mesh.positions[t.v[2]]);
  return normalized(mesh.normals[t.v[0]] * static_cast<float>(w.a) +
                    mesh.normals[t.v[1]] * static_cast<float>(w.b) +
                    mesh.normals[t.v[2]] * static_cast<float>(w.c));
}

/// Computes t with smoothstep(t) = s by Newton's method, which converges slowly near 0 and 1. Each
/// step goes at most half way to 0 or 1.
float invert_smoothstep(float s) {
  if (s <= 0 || s >= 1) return s;
  double t = static_cast<double>(s);
  for (int i = 0; i < 40; ++i) {
    const double step = (t * t * (3 - 2 * t) - static_cast<double>(s)) / (6 * t * (1 - t));
    t = std::clamp(t - step, 0.5 * t, 0.5 * (1 + t));
  }
  return static_cast<float>(t);
}

/// Makes a regression around `box` with two maps (kernels/morph_surface.h). Both take points to
/// themselves; the progress, which is the fourth value of map 0, is the same everywhere.
std::shared_ptr<const Regression> identity_map(const Box& box, float progress) {
  auto map = std::make_shared<Regression>();
  map->maps = 2;
  map->samples = {{box.center(), /*mass=*/1, /*deviation=*/box.diagonal()}};
  map->values.resize(2);
  map->values[0].value[3] = progress;
  // The values are the same everywhere, so any lattice that extends well beyond the box serves.
  map->lattice = {box.low - box.size(), box.diagonal(), {6, 6, 6}};
  return map;
}

}  // namespace

Result<BlendField> make_blend_field(BlendEnds ends, float cell, const ExtractSettings& settings,
                                    Engine& engine) {
  Mesh& surface = ends.surface;
  PM_CHECK(!surface.triangles.empty());
  const Box box = unite(ends.model.box(), bounding_box(surface.positions));
  const Vec3 size = box.size();
  PM_TRY(const Grid grid,
         fit_grid(box, std::max(cell, std::max({size.x, size.y, size.z}) / kMaxDistanceCells)));
  const std::size_t count = array3_count(grid.points);
  auto model_distances = std::make_shared<DistanceGrid>(),
       ball_distances = std::make_shared<DistanceGrid>();
  model_distances->grid = ball_distances->grid = grid;
  model_distances->values.resize(count), ball_distances->values.resize(count);
  auto to_surface = std::make_shared<const ClosestPointQuery>(surface.positions, surface.triangles);
  PM_TRY_STATUS(
      fill_distances({ends, *to_surface, settings, engine}, *model_distances, *ball_distances));
  for (DistanceGrid* distances : {model_distances.get(), ball_distances.get()}) {
    close_border(*distances);
    set_lipschitz(*distances);
  }
  return BlendField{std::move(model_distances), std::move(ball_distances), std::move(surface),
                    std::move(ends.to_model), std::move(to_surface)};
}

Result<Mesh> blend_surface(const BlendField& field, const Model& model, float progress,
                           const ExtractSettings& settings, Engine& engine) {
  const Grid& grid = field.model->grid;
  // One DistanceGrid of mixed distances has the same surface but rounds differently: half of the
  // vertices would move, by some 1e-4 of a cell.
  const MorphSurface between = {identity_map(bounding_box(grid), invert_smoothstep(progress)),
                                field.model, field.balls};
  Mesh mesh;
  PM_TRY_STATUS(to_status(engine.extract(between, grid, settings, mesh)));
  mesh.normals.resize(mesh.positions.size());
  parallel_for(
      static_cast<std::int64_t>(mesh.positions.size()),
      [&](std::int64_t i) {
        const auto k = static_cast<std::size_t>(i);
        const Vec3 p = mesh.positions[k];
        const Vec3 n = normalized(interpolate_normal(model, model.corner_normals,
                                                     field.to_model->closest(p))) *
                           (1 - progress) +
                       surface_normal(field.surface, field.to_surface->closest(p)) * progress;
        mesh.normals[k] = dot(n, n) > 0 ? normalized(n) : Vec3{0, 1, 0};
      },
      /*grain=*/256);
  return mesh;
}

}  // namespace polymorph
