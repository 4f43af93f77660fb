#include "surface/blend.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "base/parallel.h"
#include "kernels/mc_tables.h"
#include "surface/grid.h"

namespace polymorph {
namespace {

constexpr int kCells = BlendBrick::kCells, kPoints = BlendBrick::kPoints;
constexpr std::size_t kBrickPoints = std::size_t{kPoints} * kPoints * kPoints;

std::size_t point_at(int x, int y, int z) {
  return static_cast<std::size_t>((z * kPoints + y) * kPoints + x);
}

std::int64_t brick_number(const BlendField& field, Int3 at) {
  return (static_cast<std::int64_t>(at.z) * field.size.y + at.y) * field.size.x + at.x;
}

/// Index into field.bricks, -1 where there is none.
std::int32_t brick_at(const BlendField& field, Int3 at) {
  if (at.x < 0 || at.y < 0 || at.z < 0 || at.x >= field.size.x || at.y >= field.size.y ||
      at.z >= field.size.z)
    return -1;
  return field.index[static_cast<std::size_t>(brick_number(field, at))];
}

Vec3 place(const BlendField& field, Int3 brick, float x, float y, float z) {
  const auto cells = [&](int b, float v) { return static_cast<float>(b * kCells) + v; };
  return field.origin + field.cell * Vec3{cells(brick.x, x), cells(brick.y, y), cells(brick.z, z)};
}

bool at_border(const BlendField& field, Int3 brick, std::size_t point) {
  const auto i = static_cast<int>(point);
  const int x = brick.x * kCells + i % kPoints, y = brick.y * kCells + i / kPoints % kPoints,
            z = brick.z * kCells + i / (kPoints * kPoints);
  return x == 0 || y == 0 || z == 0 || x == field.size.x * kCells || y == field.size.y * kCells ||
         z == field.size.z * kCells;
}

/// The distances of many bricks' points.
Status fill(BlendField& field, std::size_t first, const InsideTest& inside,
            const ClosestPointQuery& to_model, const std::vector<Ball>& balls,
            const ExtractSettings& settings, Engine& engine) {
  constexpr std::size_t kBatch = 512;
  for (std::size_t begin = first; begin < field.bricks.size(); begin += kBatch) {
    const std::size_t end = std::min(begin + kBatch, field.bricks.size());
    std::vector<Vec3> points((end - begin) * kBrickPoints);
    for (std::size_t b = begin; b < end; ++b)
      for (int z = 0; z < kPoints; ++z)
        for (int y = 0; y < kPoints; ++y)
          for (int x = 0; x < kPoints; ++x)
            points[(b - begin) * kBrickPoints + point_at(x, y, z)] =
                place(field, field.bricks[b].at, static_cast<float>(x), static_cast<float>(y),
                      static_cast<float>(z));
    // The sign of a point must not depend on the brick that asks.
    std::vector<float> values;
    PM_TRY_STATUS(to_status(engine.sample(balls, points, settings, values)));
    const std::vector<std::uint8_t> in = inside.inside(points);
    parallel_for(static_cast<std::int64_t>(end - begin), [&](std::int64_t k) {
      const auto offset = static_cast<std::size_t>(k) * kBrickPoints;
      BlendBrick& brick = field.bricks[begin + static_cast<std::size_t>(k)];
      brick.model.resize(kBrickPoints);
      brick.balls.resize(kBrickPoints);
      for (std::size_t i = 0; i < kBrickPoints; ++i) {
        const Vec3 p = points[offset + i];
        if (at_border(field, brick.at, i)) {  // an open model's inside may reach beyond: cut it off
          brick.model[i] = brick.balls[i] = -field.cell;
          continue;
        }
        const float m = to_model.closest(p).distance, f = field.to_surface->closest(p).distance;
        brick.model[i] = in[offset + i] ? m : -m;
        brick.balls[i] = values[offset + i] > settings.iso ? f : -f;
      }
    });
  }
  return Ok{};
}

/// Can some blend's surface pass a face of the brick? Its points' values lie between both fields'.
bool crosses_face(const BlendBrick& brick, int axis, bool high) {
  bool below = false, above = false;
  for (int a = 0; a < kPoints; ++a)
    for (int b = 0; b < kPoints; ++b) {
      const int c = high ? kCells : 0;
      const std::size_t i = axis == 0   ? point_at(c, a, b)
                            : axis == 1 ? point_at(a, c, b)
                                        : point_at(a, b, c);
      below |= std::min(brick.model[i], brick.balls[i]) <= 0;
      above |= std::max(brick.model[i], brick.balls[i]) > 0;
    }
  return below && above;
}

void add_brick(BlendField& field, Int3 at) {
  if (at.x < 0 || at.y < 0 || at.z < 0 || at.x >= field.size.x || at.y >= field.size.y ||
      at.z >= field.size.z)
    return;
  std::int32_t& index = field.index[static_cast<std::size_t>(brick_number(field, at))];
  if (index >= 0) return;
  index = static_cast<std::int32_t>(field.bricks.size());
  field.bricks.push_back({at, {}, {}});
}

/// Bricks that the surface could pass through, by the distances at their middles.
Status choose_bricks(BlendField& field, const InsideTest& inside, const ClosestPointQuery& to_model,
                     const std::vector<Ball>& balls, const ExtractSettings& settings,
                     Engine& engine) {
  std::vector<Vec3> middles;
  constexpr float kHalf = 0.5f * kCells;
  for (int z = 0; z < field.size.z; ++z)
    for (int y = 0; y < field.size.y; ++y)
      for (int x = 0; x < field.size.x; ++x)
        middles.push_back(place(field, {x, y, z}, kHalf, kHalf, kHalf));
  std::vector<float> values;
  PM_TRY_STATUS(to_status(engine.sample(balls, middles, settings, values)));
  const std::vector<std::uint8_t> in = inside.inside(middles);
  const std::vector<ClosestPoint> m = to_model.closest(middles),
                                  f = field.to_surface->closest(middles);
  const float reach = std::sqrt(3.0f) * kHalf * field.cell * 1.001f;
  field.index.assign(middles.size(), -1);
  for (std::size_t i = 0; i < middles.size(); ++i) {
    const float a = in[i] ? m[i].distance : -m[i].distance;
    const float b = values[i] > settings.iso ? f[i].distance : -f[i].distance;
    if (std::min(a, b) > reach || std::max(a, b) < -reach) continue;
    const auto n = static_cast<int>(i);
    add_brick(field, {n % field.size.x, n / field.size.x % field.size.y,
                      n / (field.size.x * field.size.y)});
  }
  return Ok{};
}

/// One brick's part of a blended surface.
struct BrickSurface {
  std::vector<float> values;
  std::vector<std::int32_t> vertex;  ///< of the edge (lower corner, axis), -1 = none; own numbering
  std::vector<Vec3> positions;
  std::int32_t first = 0;  ///< number of its first vertex
};

void place_vertices(const BlendField& field, const BlendBrick& brick, float progress,
                    BrickSurface& part) {
  part.values.resize(kBrickPoints);
  for (std::size_t i = 0; i < kBrickPoints; ++i)
    part.values[i] = (1 - progress) * brick.model[i] + progress * brick.balls[i];
  part.vertex.assign(std::size_t{kCells} * kCells * kCells * 3, -1);
  for (int z = 0; z < kCells; ++z)
    for (int y = 0; y < kCells; ++y)
      for (int x = 0; x < kCells; ++x)
        for (int axis = 0; axis < 3; ++axis) {
          const float low = part.values[point_at(x, y, z)];
          const float high =
              part.values[point_at(x + (axis == 0), y + (axis == 1), z + (axis == 2))];
          if ((low > 0) == (high > 0)) continue;
          // Away from the corners, so that no triangle loses its area.
          const float t = std::clamp(low / (low - high), 1.0f / 512, 511.0f / 512);
          const auto cell = static_cast<std::size_t>((z * kCells + y) * kCells + x);
          part.vertex[3 * cell + static_cast<std::size_t>(axis)] =
              static_cast<std::int32_t>(part.positions.size());
          part.positions.push_back(place(field, brick.at,
                                         static_cast<float>(x) + (axis == 0 ? t : 0),
                                         static_cast<float>(y) + (axis == 1 ? t : 0),
                                         static_cast<float>(z) + (axis == 2 ? t : 0)));
        }
}

/// The vertex on the edge along `axis` from the point (x, y, z) of the brick, which may lie in the
/// next one.
std::uint32_t vertex_of(const BlendField& field, const std::vector<BrickSurface>& parts, Int3 brick,
                        int x, int y, int z, int axis) {
  const Int3 owner{brick.x + x / kCells, brick.y + y / kCells, brick.z + z / kCells};
  const std::int32_t index = brick_at(field, owner);
  PM_CHECK(index >= 0);
  const BrickSurface& part = parts[static_cast<std::size_t>(index)];
  const auto cell =
      static_cast<std::size_t>((z % kCells * kCells + y % kCells) * kCells + x % kCells);
  const std::int32_t vertex = part.vertex[3 * cell + static_cast<std::size_t>(axis)];
  PM_CHECK(vertex >= 0);
  return static_cast<std::uint32_t>(part.first + vertex);
}

std::vector<Triangle> triangles_of(const BlendField& field, const std::vector<BrickSurface>& parts,
                                   std::size_t b) {
  std::vector<Triangle> triangles;
  const McTable& table = mc_table();
  const Int3 at = field.bricks[b].at;
  for (int z = 0; z < kCells; ++z)
    for (int y = 0; y < kCells; ++y)
      for (int x = 0; x < kCells; ++x) {
        bool inside[8];
        for (int c = 0; c < 8; ++c)
          inside[c] =
              parts[b].values[point_at(x + (c & 1), y + (c >> 1 & 1), z + (c >> 2 & 1))] > 0;
        const int key = voxel_key(inside);
        for (int t = 0; t < table.count[key]; ++t) {
          Triangle triangle;
          for (int k = 0; k < 3; ++k) {
            const int edge = table.edges[key][3 * t + k], low = edge_low_corner(edge);
            triangle.v[k] = vertex_of(field, parts, at, x + (low & 1), y + (low >> 1 & 1),
                                      z + (low >> 2 & 1), edge_axis(edge));
          }
          triangles.push_back(triangle);
        }
      }
  return triangles;
}

Vec3 surface_normal(const Mesh& mesh, const ClosestPoint& at) {
  const Triangle& t = mesh.triangles[at.triangle];
  const TriangleWeights w = closest_on_triangle(at.point, mesh.positions[t.v[0]],
                                                mesh.positions[t.v[1]], mesh.positions[t.v[2]]);
  return normalized(mesh.normals[t.v[0]] * static_cast<float>(w.a) +
                    mesh.normals[t.v[1]] * static_cast<float>(w.b) +
                    mesh.normals[t.v[2]] * static_cast<float>(w.c));
}

}  // namespace

Result<BlendField> make_blend_field(const Model& model, const InsideTest& inside,
                                    const ClosestPointQuery& to_model,
                                    const std::vector<Ball>& balls, Mesh surface, float cell,
                                    const ExtractSettings& settings, Engine& engine) {
  PM_CHECK(!surface.triangles.empty());
  BlendField field;
  field.cell = cell;
  PM_TRY(const Grid grid, fit_grid(unite(model.box(), box_of(surface.positions)), cell));
  field.origin = grid.origin;
  const auto bricks = [](int points) { return (points + kCells - 1) / kCells; };
  field.size = {bricks(grid.points.x), bricks(grid.points.y), bricks(grid.points.z)};
  field.to_surface =
      std::make_shared<const ClosestPointQuery>(surface.positions, surface.triangles);
  field.surface = std::move(surface);
  PM_TRY_STATUS(choose_bricks(field, inside, to_model, balls, settings, engine));
  // Where the model is open its inside may end far from any face, which no distance tells: bricks
  // that the surface leaves its brick for are added until there are none.
  for (std::size_t first = 0; first < field.bricks.size();) {
    const std::size_t end = field.bricks.size();
    PM_TRY_STATUS(fill(field, first, inside, to_model, balls, settings, engine));
    for (std::size_t b = first; b < end; ++b)
      for (int axis = 0; axis < 3; ++axis)
        for (const bool high : {false, true}) {
          if (!crosses_face(field.bricks[b], axis, high)) continue;
          Int3 at = field.bricks[b].at;
          (axis == 0 ? at.x : axis == 1 ? at.y : at.z) += high ? 1 : -1;
          add_brick(field, at);
        }
    first = end;
  }
  return field;
}

Mesh blend_surface(const BlendField& field, const Model& model, const ClosestPointQuery& to_model,
                   float progress) {
  std::vector<BrickSurface> parts(field.bricks.size());
  const auto for_bricks = [&](const auto& f) {
    parallel_for(
        static_cast<std::int64_t>(parts.size()),
        [&](std::int64_t b) { f(static_cast<std::size_t>(b)); }, 4);
  };
  for_bricks([&](std::size_t b) { place_vertices(field, field.bricks[b], progress, parts[b]); });
  std::int32_t count = 0;
  for (BrickSurface& part : parts) {
    part.first = count;
    count += static_cast<std::int32_t>(part.positions.size());
  }
  Mesh mesh;
  mesh.positions.resize(static_cast<std::size_t>(count));
  mesh.normals.resize(mesh.positions.size());
  std::vector<std::vector<Triangle>> triangles(parts.size());
  for_bricks([&](std::size_t b) {
    const auto first = static_cast<std::size_t>(parts[b].first);
    for (std::size_t i = 0; i < parts[b].positions.size(); ++i) {
      const Vec3 p = parts[b].positions[i];
      const Vec3 n = normalized(interpolated_normal(model, to_model.closest(p))) * (1 - progress) +
                     surface_normal(field.surface, field.to_surface->closest(p)) * progress;
      mesh.positions[first + i] = p;
      mesh.normals[first + i] = dot(n, n) > 0 ? normalized(n) : Vec3{0, 1, 0};
    }
    triangles[b] = triangles_of(field, parts, b);
  });
  for (const auto& part : triangles)
    mesh.triangles.insert(mesh.triangles.end(), part.begin(), part.end());
  return mesh;
}

}  // namespace polymorph
