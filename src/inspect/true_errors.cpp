#include "inspect/true_errors.h"

#include <cmath>
#include <numbers>

#include "analyze/distortion.h"
#include "analyze/edge_paths.h"
#include "analyze/facing_error.h"
#include "assets/load_models.h"
#include "leg/leg_surface.h"
#include "mesh/closest.h"
#include "mesh/normals.h"
#include "model/load/load_model.h"
#include "model/shapes.h"

namespace polymorph {
namespace {

std::vector<Vec3d> to_double(const std::vector<Vec3>& points) {
  return {points.begin(), points.end()};
}

Result<Model> read_model(const std::filesystem::path& file) {
  LoadObjSettings settings;
  settings.textures = false;
  PM_TRY(LoadedModel loaded, load_model(file, settings));
  return std::move(loaded.model);
}

/// Transforms points from the coordinates of an object's file, which is read again, to the scene.
Result<std::vector<Vec3>> to_scene_points(const NamedObject& object,
                                          const std::vector<Vec3>& points) {
  const bool is_shape = object.settings.model.empty();
  PM_TRY(const Model file,
         is_shape ? make_shape(object.settings.shape) : read_model(object.settings.model));
  if (file.points.size() != object.model.points.size())
    return make_error(ErrorCode::kInput, "{}: was changed while it was used",
                      object.settings.model.string());
  return move_with_mesh(points, file, object.model.points);
}

/// Moves a point with the ball whose surface is nearest to it: returns the mean of the centers to
/// which the ball's pairs move, weighted by the pairs' shares of the ball. `reversed`: from the
/// target to the source.
Vec3 carry_by_plan(Vec3 point, const MorphPlan& plan, bool reversed) {
  const std::vector<Ball>&own_balls = reversed ? plan.to : plan.from,
        &other_balls = reversed ? plan.from : plan.to;
  // A Gaussian ball alone has its surface, the field 1, at the radius sqrt(w / a).
  const auto distance = [&](const Ball& ball) {
    return length(ball.center - point) - std::sqrt(std::max(ball.w, 0.0f) / ball.a);
  };
  std::size_t nearest = 0;
  for (std::size_t b = 1; b < own_balls.size(); ++b)
    if (distance(own_balls[b]) < distance(own_balls[nearest])) nearest = b;
  Vec3 sum;
  for (const Pair& pair : plan.pairs)
    if ((reversed ? pair.to : pair.from) == nearest)
      sum = sum + other_balls[reversed ? pair.from : pair.to].center *
                      (reversed ? pair.to_share : pair.from_share);
  return sum;
}

/// Appends the distances between arrived points and their partners, divided by the diagonal.
void add_errors(const std::vector<Vec3>& arrived, const std::vector<Vec3>& partners, float diagonal,
                std::vector<double>& errors) {
  for (std::size_t k = 0; k < arrived.size(); ++k)
    errors.push_back(static_cast<double>(length(arrived[k] - partners[k]) / diagonal));
}

/// Computes the lengths of the shortest paths along the mesh's edges between arrived points and
/// their partners, each moved to its nearest vertex, divided by the square root of the area.
std::vector<double> geodesic_errors(const std::vector<Vec3>& arrived,
                                    const std::vector<Vec3>& partners, MeshView mesh, double area) {
  const ClosestPointQuery query(mesh);
  const auto nearest_vertices = [&](const std::vector<Vec3>& points) {
    std::vector<std::uint32_t> vertices;
    for (const ClosestPoint& hit : query.closest(points)) {
      const Triangle& t = mesh.triangles[hit.triangle];
      std::uint32_t nearest = t.v[0];
      for (const std::uint32_t v : t.v)
        if (length(mesh.points[v] - hit.point) < length(mesh.points[nearest] - hit.point))
          nearest = v;
      vertices.push_back(nearest);
    }
    return vertices;
  };
  const std::vector<std::uint32_t> from = nearest_vertices(partners),
                                   to = nearest_vertices(arrived);
  std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;
  for (std::size_t k = 0; k < from.size(); ++k) pairs.emplace_back(from[k], to[k]);
  std::vector<double> lengths = edge_path_lengths(mesh, pairs);
  for (double& path_length : lengths) path_length /= std::sqrt(area);
  return lengths;
}

/// Computes the angle in degrees, about the vertical, of the rotation that fits the true points
/// best after the rotation `applied`.
std::optional<double> remaining_rotation(const std::vector<Vec3>& from, const std::vector<Vec3>& to,
                                         const Mat3& applied) {
  const std::vector<Vec3d> p = to_double(from), q = to_double(to);
  const std::optional<double> angle = rotation_about_vertical({p, q, /*weights=*/{}}, applied);
  return angle ? std::optional(std::abs(*angle)) : std::nullopt;
}

/// Moves and scales an entry's model, and with it `points`, so that its box has the diagonal and
/// the centre of the mesh's box. Sets `model` to the result and returns the points.
Result<std::vector<Vec3>> fit_to_mesh(const TrueModel& entry, const std::vector<Vec3>& points,
                                      const Mesh& mesh, Model& model) {
  PM_TRY(const Model file, read_model(entry.model));
  model = rotate_upright(file, entry.up);
  const Box model_box = model.box(), mesh_box = bounding_box(mesh.positions);
  const float scale = model_box.diagonal() > 0 ? mesh_box.diagonal() / model_box.diagonal() : 1;
  for (Vec3& p : model.points) p = mesh_box.center() + (p - model_box.center()) * scale;
  return move_with_mesh(points, file, model.points);
}

/// Finds the rotation about the vertical that fits two meshes with corresponding vertices best.
Mat3 vertical_rotation(const Mesh& first, const Mesh& last) {
  std::vector<double> areas(first.positions.size(), 0);
  for (const Triangle& t : first.triangles) {
    const Vec3 a = first.positions[t.v[0]];
    const Vec3 normal = cross(first.positions[t.v[1]] - a, first.positions[t.v[2]] - a);
    for (const std::uint32_t v : t.v) areas[v] += static_cast<double>(length(normal)) / 6;
  }
  const std::vector<Vec3d> p = to_double(first.positions), q = to_double(last.positions);
  const double degrees = rotation_about_vertical({p, q, areas}).value_or(0);
  return exp_rotation({0, degrees * std::numbers::pi / 180, 0});
}

}  // namespace

Result<std::optional<TrueErrors>> measure_true_errors(const Leg& leg, const NamedObject& from,
                                                      const NamedObject& to, const TruePair& truth,
                                                      Engine& engine) {
  if (!truth.from || !truth.to) return std::optional<TrueErrors>();
  const PointPairs pairs = pair_points(*truth.from, *truth.to);
  if (pairs.from.empty()) return std::optional<TrueErrors>();
  PM_TRY(const std::vector<Vec3> from_points, to_scene_points(from, pairs.from));
  PM_TRY(const std::vector<Vec3> to_points, to_scene_points(to, pairs.to));
  const float from_size = from.model.box().diagonal(), to_size = to.model.box().diagonal();
  TrueErrors errors;
  errors.points = from_points.size();
  std::vector<Vec3> forward, backward;
  for (const Vec3 p : from_points)
    forward.push_back(carry_by_plan(p, leg.plan, /*reversed=*/false));
  for (const Vec3 p : to_points) backward.push_back(carry_by_plan(p, leg.plan, /*reversed=*/true));
  add_errors(forward, to_points, to_size, errors.plan);
  add_errors(backward, from_points, from_size, errors.plan);
  PM_TRY(const LegState start, leg_state(leg, 0, engine));
  PM_TRY(const LegState end, leg_state(leg, 1, engine));
  PM_TRY(const PullBack first, pull_back(leg, start, from_points, engine));
  PM_TRY(const PullBack last, pull_back(leg, end, to_points, engine));
  add_errors(first.target, to_points, to_size, errors.map);
  add_errors(last.source, from_points, from_size, errors.map);
  errors.geodesic = geodesic_errors(first.target, to_points, to.model, area_of(to.model));
  errors.facing = remaining_rotation(from_points, to_points, leg.plan.alignment.rotation);
  return std::optional(std::move(errors));
}

Result<std::optional<TrueErrors>> measure_true_errors(const Mesh& first, const Mesh& last,
                                                      const TruePair& truth) {
  if (!truth.from || !truth.to || first.triangles.empty() || last.triangles.empty())
    return std::optional<TrueErrors>();
  const PointPairs pairs = pair_points(*truth.from, *truth.to);
  if (pairs.from.empty()) return std::optional<TrueErrors>();
  TrueErrors errors;
  errors.points = pairs.from.size();
  if (!corresponds(first, last)) return std::optional(std::move(errors));
  Model source, target;
  PM_TRY(const std::vector<Vec3> from, fit_to_mesh(*truth.from, pairs.from, first, source));
  PM_TRY(const std::vector<Vec3> to, fit_to_mesh(*truth.to, pairs.to, last, target));
  const std::vector<Vec3> arrived = move_with_mesh(from, first, last.positions);
  add_errors(arrived, to, target.box().diagonal(), errors.map);
  add_errors(move_with_mesh(to, last, first.positions), from, source.box().diagonal(), errors.map);
  errors.geodesic = geodesic_errors(arrived, to, target, area_of(target));
  errors.facing = remaining_rotation(from, to, vertical_rotation(first, last));
  return std::optional(std::move(errors));
}

}  // namespace polymorph
