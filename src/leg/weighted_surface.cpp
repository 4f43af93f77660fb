#include "leg/weighted_surface.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/matrix_decompositions.h"
#include "base/parallel.h"
#include "field/distance_grid.h"
#include "field/extract_surface.h"
#include "kernels/distance_field.h"
#include "kernels/linear.h"
#include "leg/leg_surface.h"
#include "mesh/components.h"
#include "mesh/fairing.h"
#include "morph/motion.h"

namespace polymorph {
namespace {

/// Shares of the objects' size: deviation of the kernels and spacing of their lattice (as those of
/// a leg's map), margin around the mixture, range in which distances count nearly as they are, and
/// the furthest level.
constexpr float kDeviation = 0.055f, kSpacing = 0.04f, kMargin = 0.12f, kLinearRange = 0.06f,
                kFurthest = 0.08f;

Mat3 scale_matrix(Mat3 a, double factor) {
  for (double& value : a.m) value *= factor;
  return a;
}

/// An object of the space, with its weight in the mixture.
struct Part {
  const PreparedObject& object;
  double weight = 0;
  PathPart similarity;        ///< rotation and scaling of the whole from the reference to it
  std::vector<Vec3d> places;  ///< one per ball of the reference: where it is on the object
};

/// Computes the places of the reference's balls on a leg's target, by the leg's map as it starts.
Result<std::vector<Vec3d>> carry_balls(const Leg& leg, Engine& engine) {
  PM_TRY(const LegState start, leg_state(leg, 0, engine));
  std::vector<Vec3> points;
  for (const Ball& ball : leg.plan.from) points.push_back(ball.center);
  PM_TRY(const PullBack carried, pull_back(leg, start, points, engine));
  std::vector<Vec3d> places;
  for (const Vec3 place : carried.target) places.emplace_back(place);
  return places;
}

/// The reference and the objects that its legs lead to, without those of weight 0.
Result<std::vector<Part>> weighted_parts(const ShapeSpace& space, std::span<const float> weights,
                                         Engine& engine) {
  const Leg& first = *space.legs.front();
  std::vector<Part> parts;
  if (weights[0] > 0) {
    const Vec3d center(first.from->model.box().center());
    Part part{*first.from, static_cast<double>(weights[0]), {center, center, {}, 0}, {}};
    for (const Ball& ball : first.plan.from) part.places.emplace_back(ball.center);
    parts.push_back(std::move(part));
  }
  for (std::size_t i = 0; i < space.legs.size(); ++i) {
    if (weights[i + 1] <= 0) continue;
    const Leg& leg = *space.legs[i];
    Part part{*leg.to, static_cast<double>(weights[i + 1]), mean_path_part(leg.plan), {}};
    PM_TRY(part.places, carry_balls(leg, engine));
    parts.push_back(std::move(part));
  }
  return parts;
}

Vec3d apply(const PathPart& part, Vec3d p) {
  return part.to_center +
         (exp_rotation(part.turn) * (p - part.from_center)) * exp_scalar(part.log_scale);
}

/// Places of the balls in the mixture, and its size, scale and rotation.
struct Mixture {
  float size = 0;        ///< weighted mean of the objects' diagonals
  double log_scale = 0;  ///< natural logarithm of the mixture's scale over the reference's
  std::vector<RegressionSample> samples;
  Mat3 rotation;  ///< rotation of the whole from the reference
  Box box;
};

Mixture mix_balls(const Leg& first, const std::vector<Part>& parts) {
  Mixture mixture;
  const Vec3d middle(first.from->model.box().center());
  Vec3d turn, center;
  Vec3 low, high;
  for (const Part& part : parts) {
    const auto weight = static_cast<float>(part.weight);
    const Box box = part.object.model.box();
    mixture.size += weight * box.diagonal();
    mixture.log_scale += part.weight * part.similarity.log_scale;
    turn = turn + part.similarity.turn * part.weight;
    center = center + apply(part.similarity, middle) * part.weight;
    low = low + weight * box.low, high = high + weight * box.high;
  }
  mixture.rotation = exp_rotation(turn);
  const double scale = exp_scalar(mixture.log_scale);
  const float margin = kMargin * mixture.size;
  mixture.box = {low - Vec3{margin, margin, margin}, high + Vec3{margin, margin, margin}};
  const std::vector<Ball>& balls = first.plan.from;
  for (std::size_t b = 0; b < balls.size(); ++b) {
    Vec3d place;
    for (const Part& part : parts) {
      const Mat3 unturn = transposed(exp_rotation(part.similarity.turn));
      const double unscale = exp_scalar(-part.similarity.log_scale) * part.weight;
      place = place + (unturn * (part.places[b] - part.similarity.to_center)) * unscale +
              (part.similarity.from_center - middle) * part.weight;
    }
    const Vec3 at = to_float(center + (mixture.rotation * place) * scale);
    const double own = scale * 0.7 / std::sqrt(2 * static_cast<double>(balls[b].a)),
                 share = static_cast<double>(kDeviation * mixture.size);
    mixture.samples.push_back({at, std::max(static_cast<float>(first.plan.from_masses[b]), 1e-6f),
                               static_cast<float>(std::sqrt(share * share + own * own))});
    mixture.box = unite(mixture.box, {at - Vec3{margin, margin, margin} * 0.5f,
                                      at + Vec3{margin, margin, margin} * 0.5f});
  }
  return mixture;
}

/// The map from the mixture to an object of it.
std::shared_ptr<const Regression> map_to(const Part& part, const Mixture& mixture) {
  auto regression = std::make_shared<Regression>();
  regression->samples = mixture.samples;
  regression->sloped = true;
  // All of the map is in the samples' values and slopes.
  regression->affine[0] = {{Vec3{}, Vec3{}, Vec3{}}, {}};
  const Mat3 slope = scale_matrix(exp_rotation(part.similarity.turn) * transposed(mixture.rotation),
                                  exp_scalar(part.similarity.log_scale - mixture.log_scale));
  for (std::size_t b = 0; b < part.places.size(); ++b) {
    const Vec3 place = to_float(part.places[b]);
    BallAttribute carried;
    carried.value[0] = place.x, carried.value[1] = place.y, carried.value[2] = place.z;
    for (int i = 0; i < 3; ++i)
      carried.slope[i] = to_float({slope.at(i, 0), slope.at(i, 1), slope.at(i, 2)});
    regression->values.push_back(carried);
  }
  Grid& lattice = regression->lattice;
  lattice.cell = kSpacing * mixture.size;
  lattice.origin = mixture.box.low - Vec3{3, 3, 3} * lattice.cell;
  const auto nodes = [&](float length) {
    return static_cast<int>(std::ceil(length / lattice.cell)) + 7;
  };
  const Vec3 extent = mixture.box.size();
  lattice.points = {nodes(extent.x), nodes(extent.y), nodes(extent.z)};
  return regression;
}

/// Weight of an object's distances: as between two objects, so that ends are left gently.
std::vector<float> distance_shares(const std::vector<Part>& parts) {
  std::vector<float> shares;
  for (const Part& part : parts)
    shares.push_back(polymorph::smoothstep(static_cast<float>(part.weight)));
  const float all = std::accumulate(shares.begin(), shares.end(), 0.0f);
  for (float& share : shares) share /= all;
  return shares;
}

/// Adds an object's distances, pulled back and compressed, to the field.
Status add_distances(const Part& part, float share, const Mixture& mixture, Engine& engine,
                     DistanceGrid& field) {
  const ObjectDistances& own = part.object.distances;
  DistanceField distances(own.grid->grid, own.grid->values.data());
  if (own.smooth) distances.set_detail(own.smooth->values.data(), DetailFade{});
  const float detail = distances.detail_share(1 - static_cast<float>(part.weight));
  const auto scale = static_cast<float>(exp_scalar(mixture.log_scale - part.similarity.log_scale));
  const float inv_range = 1 / (kLinearRange * mixture.size);
  const auto map = map_to(part, mixture);
  const Int3 n = field.grid.points;
  const auto layer = static_cast<std::size_t>(n.x) * static_cast<std::size_t>(n.y);
  constexpr int kLayers = 16;  // at once: what is evaluated there is kept in memory
  for (int z = 0; z < n.z; z += kLayers) {
    std::vector<Vec3> points;
    for (int k = z; k < std::min(z + kLayers, n.z); ++k)
      for (int j = 0; j < n.y; ++j)
        for (int i = 0; i < n.x; ++i) points.push_back(grid_point(field.grid, {i, j, k}));
    std::vector<AttributeValues> values;
    PM_TRY_STATUS(to_status(engine.regress(map, points, values)));
    float* out = field.values.data() + static_cast<std::size_t>(z) * layer;
    parallel_for(
        static_cast<std::int64_t>(points.size()),
        [&](std::int64_t i) {
          const float* at = values[static_cast<std::size_t>(i)].v;
          const float d = scale * distances.value(Points<float>{at[0], at[1], at[2]}, detail);
          out[i] += share * d / (0.5f + 0.5f * std::sqrt(1 + 2 * std::abs(d) * inv_range));
        },
        4096);
  }
  return Ok{};
}

/// The level at which the field encloses the volume, within `limit` of 0.
float find_level(const DistanceGrid& field, double volume, float limit) {
  const auto cell = static_cast<double>(field.grid.cell);
  const auto enclosed = [&](float level) {
    double cells = 0;
    for (const float value : field.values)
      cells +=
          static_cast<double>(std::clamp((value - level) / field.grid.cell + 0.5f, 0.0f, 1.0f));
    return cells * cell * cell * cell;
  };
  float low = -limit, high = limit;
  for (int i = 0; i < 12; ++i) {
    const float level = 0.5f * (low + high);
    (enclosed(level) > volume ? low : high) = level;
  }
  return 0.5f * (low + high);
}

}  // namespace

std::size_t choose_reference(std::span<const std::shared_ptr<const PreparedObject>> objects) {
  PM_CHECK(!objects.empty());
  std::size_t index = 0;
  for (std::size_t i = 1; i < objects.size(); ++i)
    if (objects[i]->distances.key < objects[index]->distances.key) index = i;
  return index;
}

Result<Mesh> weighted_surface(const ShapeSpace& space, std::span<const float> weights,
                              Engine& engine) {
  PM_CHECK(!space.legs.empty() && weights.size() == space.legs.size() + 1);
  const Leg& first = *space.legs.front();
  double all = 0;
  for (const float weight : weights) {
    if (!(weight >= 0 && weight <= 1))
      return make_error(ErrorCode::kInput, "{}: a weight of a mixture must be in [0, 1] (is {})",
                        first.from->name, weight);
    all += static_cast<double>(weight);
  }
  if (std::abs(all - 1) > 1e-5)
    return make_error(ErrorCode::kInput,
                      "{}: the weights of a mixture must sum to 1 (they do to {})",
                      first.from->name, all);
  for (const auto& leg : space.legs)
    for (const auto& object : {leg->from, leg->to})
      if (is_shell(object->distances) || object->distances.is_vessel)
        return make_error(ErrorCode::kInput,
                          "{}: only solids can be mixed, and this is a shell or a vessel",
                          object->name);
  const LegSettings& settings = first.settings;
  PM_TRY(const std::vector<Part> parts, weighted_parts(space, weights, engine));
  if (parts.size() == 1)
    return extract_distances(engine, parts.front().object.distances.grid, settings.cell,
                             settings.shown);
  const Mixture mixture = mix_balls(first, parts);
  auto field = std::make_shared<DistanceGrid>();
  PM_TRY(field->grid, fit_grid(mixture.box, settings.cell));
  const Int3 n = field->grid.points;
  field->values.assign(
      static_cast<std::size_t>(n.x) * static_cast<std::size_t>(n.y) * static_cast<std::size_t>(n.z),
      0.0f);
  const std::vector<float> shares = distance_shares(parts);
  double volume = 0;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    PM_TRY_STATUS(add_distances(parts[i], shares[i], mixture, engine, *field));
    volume += parts[i].weight * parts[i].object.distances.volume;
  }
  if (first.plan.motion.keep_volume) {
    const float level = find_level(*field, volume, kFurthest * mixture.size);
    for (float& value : field->values) value -= level;
  }
  close_border(*field);
  bound_slopes(*field);
  PM_TRY(Mesh mesh, extract_distances(engine, field, settings.cell, settings.shown));
  remove_small_components(mesh, static_cast<double>(settings.min_component_share));
  mend_normals(mesh);
  return mesh;
}

}  // namespace polymorph
