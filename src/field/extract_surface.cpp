#include "field/extract_surface.h"

#include <algorithm>
#include <cmath>

#include "kernels/field_kinds.h"
#include "kernels/morph_surface.h"

namespace polymorph {

Status to_status(const EngineStatus& status) {
  switch (status.code) {
    case EngineCode::kOk:
      return Ok{};
    case EngineCode::kBadInput:
      return Error{ErrorCode::kInput, status.message};
    case EngineCode::kOutOfMemory:
      return Error{ErrorCode::kResource, status.message + " (surface.resolution, --max-memory)"};
    default:
      return Error{ErrorCode::kResource, status.message};
  }
}

Box surface_bounds(const std::vector<Ball>& balls, const ExtractSettings& settings) {
  Box box;
  const bool compact =
      visit(settings.field, [](auto field) { return decltype(field)::kCompactSupport; });
  if (!compact) {
    // At a distance d from the centres' box the field is at most (sum w) / d^2.
    double sum = 0;
    for (const Ball& ball : balls) {
      box = extend(box, ball.center);
      sum += std::max(ball.w, 0.0f);
    }
    return balls.empty() ? box : widened(box, static_cast<float>(std::sqrt(sum / settings.iso)));
  }
  for (const Ball& ball : balls) {
    // The coordinate q = a d^T shape d at the end of the ball's support; d: offset from its centre.
    const float max_q = visit(settings.field, [&](auto field) {
      return field.end(ball, settings.cutoff * settings.iso);
    });
    if (max_q <= 0) continue;
    // The half extents of an ellipsoid's box are the roots of the diagonal of its inverse matrix.
    const Sym3& s = ball.shape;
    const Vec3 half2 =
        Vec3{s.yy * s.zz - s.yz * s.yz, s.xx * s.zz - s.xz * s.xz, s.xx * s.yy - s.xy * s.xy} *
        (max_q / (ball.a * determinant(s)));
    const Vec3 half{std::sqrt(half2.x), std::sqrt(half2.y), std::sqrt(half2.z)};
    box = unite(box, {ball.center - half, ball.center + half});
  }
  return box;
}

Result<Grid> fit_grid(const Box& box, float cell) {
  PM_CHECK(!box.empty() && cell > 0);
  const auto low = [&](float v) { return std::floor(static_cast<double>(v) / cell) - 1; };
  const auto high = [&](float v) { return std::ceil(static_cast<double>(v) / cell) + 1; };
  const double nx = high(box.high.x) - low(box.low.x) + 1;
  const double ny = high(box.high.y) - low(box.low.y) + 1;
  const double nz = high(box.high.z) - low(box.low.z) + 1;
  constexpr double kMaxPoints = 0x1p40, kMaxAxisPoints = 65536;
  if (!(nx * ny * nz <= kMaxPoints) || std::max({nx, ny, nz}) > kMaxAxisPoints)
    return make_error(
        ErrorCode::kResource,
        "the surface grid would need {:.3g} x {:.3g} x {:.3g} points - lower surface.resolution",
        nx, ny, nz);
  const auto at = [&](double index) { return static_cast<float>(index * cell); };
  return Grid{{at(low(box.low.x)), at(low(box.low.y)), at(low(box.low.z))},
              cell,
              {static_cast<int>(nx), static_cast<int>(ny), static_cast<int>(nz)}};
}

Box bounding_box(const Grid& grid) {
  return {grid.origin, grid_point(grid, {grid.points.x - 1, grid.points.y - 1, grid.points.z - 1})};
}

Result<Mesh> extract_surface(Engine& engine, const BallSet& balls, float cell,
                             const ExtractSettings& settings) {
  Mesh mesh;
  const Box box = surface_bounds(balls.balls(), settings);
  if (box.empty()) return mesh;
  PM_TRY(const Grid grid, fit_grid(box, cell));
  PM_TRY_STATUS(to_status(engine.extract(balls, grid, settings, mesh)));
  return mesh;
}

Result<Mesh> extract_surface(Engine& engine, const MorphSurface& surface, const Box& box,
                             float cell, const ExtractSettings& settings) {
  Mesh mesh;
  PM_TRY(const Grid grid, fit_grid(box, cell));
  PM_TRY_STATUS(to_status(engine.extract(surface, grid, settings, mesh)));
  return mesh;
}

Result<Mesh> extract_distances(Engine& engine, const std::shared_ptr<const DistanceGrid>& object,
                               float cell, const ExtractSettings& settings) {
  Mesh mesh;
  PM_TRY(const Grid grid, fit_grid(bounding_box(object->grid), cell));
  PM_TRY_STATUS(to_status(engine.extract(object, grid, settings, mesh)));
  return mesh;
}

Result<std::vector<AttributeValues>> interpolate_attributes(
    Engine& engine, const BallSet& balls, FieldKind kind,
    const std::vector<BallAttribute>& attributes, const std::vector<Vec3>& points) {
  ExtractSettings settings;
  settings.field = kind;
  std::vector<AttributeValues> values;
  PM_TRY_STATUS(to_status(engine.interpolate(balls, attributes, points, settings, values)));
  return values;
}

}  // namespace polymorph
