#include "leg/weighted_surface.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/array3.h"
#include "base/parallel.h"
#include "field/distance_grid.h"
#include "field/extract_surface.h"
#include "kernels/distance_field.h"
#include "kernels/linear.h"
#include "leg/distance_leg.h"
#include "leg/leg_surface.h"
#include "mesh/fairing.h"
#include "morph/motion.h"

namespace polymorph {
namespace {

/// Margin of Mixture::box, as a fraction of the mixture's size.
constexpr float kMixtureMargin = 0.12f;

/// An object of the space, with its weight in the mixture.
struct MixtureInput {
  std::shared_ptr<const PreparedObject> object;
  double weight = 0;
  PathPart similarity;               ///< object_similarity()
  const std::vector<Vec3d>& places;  ///< positions of the reference's balls on the object
};

/// Maps the source's balls to a leg's target, by the leg's map at its start.
Result<std::vector<Vec3d>> map_balls_to_target(const Leg& leg, Engine& engine) {
  PM_TRY(const LegState start, leg_state(leg, /*time=*/0, engine));
  std::vector<Vec3> points;
  for (const Ball& ball : leg.plan.from) points.push_back(ball.center);
  PM_TRY(const PullBack carried, pull_back(leg, start, points, engine));
  std::vector<Vec3d> places;
  for (const Vec3 place : carried.target) places.emplace_back(place);
  return places;
}

MixtureInput make_input(const ShapeSpace& space, std::size_t object, float weight) {
  const Leg& leg = *space.legs[object > 0 ? object - 1 : 0];
  return {object > 0 ? leg.to : leg.from, static_cast<double>(weight),
          object_similarity(space, object), space.places[object]};
}

/// Lists the objects of the space whose weight is above 0.
std::vector<MixtureInput> list_inputs(const ShapeSpace& space, std::span<const float> weights) {
  std::vector<MixtureInput> inputs;
  for (std::size_t i = 0; i < weights.size(); ++i)
    if (weights[i] > 0) inputs.push_back(make_input(space, i, weights[i]));
  return inputs;
}

Vec3d apply(const PathPart& similarity, Vec3d p) {
  return similarity.to_center +
         (exp_rotation(similarity.rotation_vector) * (p - similarity.from_center)) *
             exp_scalar(similarity.log_scale);
}

/// Averages the objects' similarities by weight. `middle`: centre of the reference's box.
MeanSimilarity mean_similarity(const std::vector<MixtureInput>& inputs, Vec3d middle) {
  MeanSimilarity mean;
  Vec3d turn;
  for (const MixtureInput& input : inputs) {
    mean.log_scale += input.weight * input.similarity.log_scale;
    turn = turn + input.similarity.rotation_vector * input.weight;
    mean.center = mean.center + apply(input.similarity, middle) * input.weight;
  }
  mean.rotation = exp_rotation(turn);
  return mean;
}

/// Sets mixture.samples, at the positions of the reference's balls in the mixture, and mixture.box.
/// A ball's position is c + S Q sum_i w_i ((1/s_i) R_i^T (p_i - t_i) + f_i - m). The sum is over
/// the objects i: w_i is the weight of object i and p_i the ball's position on it; R_i, s_i, f_i
/// and t_i are rotation, scale, from_center and to_center of its similarity. Q, S and c are
/// rotation, scale and centre of mixture.mean, and m is `middle`.
void mix_balls(const MorphPlan& plan, const std::vector<MixtureInput>& inputs, Vec3d middle,
               Mixture& mixture) {
  const MeanSimilarity& mean = mixture.mean;
  const double scale = exp_scalar(mean.log_scale);
  const float margin = kMixtureMargin * mixture.size;
  // The box starts as the weighted mean of the objects' boxes; the balls then extend it.
  Vec3 low, high;
  for (const MixtureInput& input : inputs) {
    const Box box = input.object->model.box();
    const auto weight = static_cast<float>(input.weight);
    low = low + weight * box.low, high = high + weight * box.high;
  }
  mixture.box = widened({low, high}, margin);
  const std::vector<Ball>& balls = plan.from;
  for (std::size_t b = 0; b < balls.size(); ++b) {
    Vec3d offset;
    for (const MixtureInput& input : inputs) {
      const Mat3 inv_rotation = transposed(exp_rotation(input.similarity.rotation_vector));
      const double weighted_inv_scale = exp_scalar(-input.similarity.log_scale) * input.weight;
      offset =
          offset +
          (inv_rotation * (input.places[b] - input.similarity.to_center)) * weighted_inv_scale +
          (input.similarity.from_center - middle) * input.weight;
    }
    const Vec3 position = to_float(mean.center + (mean.rotation * offset) * scale);
    const double ball_deviation = ball_kernel_deviation(balls[b], scale),
                 map_deviation =
                     static_cast<double>(static_cast<float>(kMapDeviation) * mixture.size);
    mixture.samples.push_back({position, std::max(static_cast<float>(plan.from_masses[b]), 1e-6f),
                               static_cast<float>(std::sqrt(map_deviation * map_deviation +
                                                            ball_deviation * ball_deviation))});
    mixture.box = unite(mixture.box, widened({position, position}, 0.5f * margin));
  }
}

/// Makes a regression around the mixture's balls, still without values.
Regression empty_regression(const Mixture& mixture) {
  Regression regression;
  regression.samples = mixture.samples;
  regression.sloped = true;
  // The samples' values and slopes hold the whole map, so the affine part is zero.
  regression.affine[0] = {{Vec3{}, Vec3{}, Vec3{}}, /*offset=*/{}};
  Grid& lattice = regression.lattice;
  lattice.cell = kMapSpacing * mixture.size;
  // Three nodes are added on each side: the spline is defined from node 1 to the last but one.
  lattice.origin = mixture.box.low - Vec3{3, 3, 3} * lattice.cell;
  const auto nodes = [&](float length) {
    return static_cast<int>(std::ceil(length / lattice.cell)) + 7;
  };
  const Vec3 extent = mixture.box.size();
  lattice.points = {nodes(extent.x), nodes(extent.y), nodes(extent.z)};
  return regression;
}

/// Makes an object of the mixture with the map to it.
MixedObject make_mixed_object(const MixtureInput& input, const Mixture& mixture) {
  const MeanSimilarity& mean = mixture.mean;
  MixedObject mixed{input.object, static_cast<float>(input.weight), /*map=*/{}, /*scale=*/1,
                    /*linear=*/{}};
  const double log_scale = input.similarity.log_scale - mean.log_scale;
  mixed.scale = static_cast<float>(exp_scalar(-log_scale));
  mixed.linear = scaled(exp_rotation(input.similarity.rotation_vector) * transposed(mean.rotation),
                        exp_scalar(log_scale));
  Regression regression = empty_regression(mixture);
  for (const Vec3d place : input.places)
    set_linear(regression.values.emplace_back(), to_float(place), mixed.linear);
  mixed.map = std::make_shared<const Regression>(std::move(regression));
  return mixed;
}

/// Computes the weights of the objects' distances: smoothstep of the objects' weights, divided by
/// their sum. These weights let the surface start and arrive slowly, as between two objects.
std::vector<float> distance_shares(const std::vector<MixedObject>& objects) {
  std::vector<float> shares;
  for (const MixedObject& mixed : objects) shares.push_back(polymorph::smoothstep(mixed.weight));
  const float sum = std::accumulate(shares.begin(), shares.end(), 0.0f);
  for (float& share : shares) share /= sum;
  return shares;
}

/// Finds the level in [-limit, limit] at which the field encloses `volume`, by bisection. A cell is
/// counted in part if its value is within half a cell of the level.
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
  for (int i = 0; i < 12; ++i) {  // to 1/4096 of the interval
    const float level = 0.5f * (low + high);
    (enclosed(level) > volume ? low : high) = level;
  }
  return 0.5f * (low + high);
}

/// Evaluates the field of a mixture, without its level, at points: the weighted sum of compressed
/// distances (MorphField::compress). `shares`: distance_shares().
Result<std::vector<float>> sample_field(const Mixture& mixture, const std::vector<float>& shares,
                                        const std::vector<Vec3>& points, Engine& engine) {
  const float inv_range = 1 / (kLinearRange * mixture.size);
  std::vector<float> field(points.size(), 0.0f);
  std::vector<AttributeValues> values;
  for (std::size_t k = 0; k < shares.size(); ++k) {
    const MixedObject& mixed = mixture.objects[k];
    const ObjectDistances& object_distances = mixed.object->distances;
    DistanceField distances(object_distances.grid->grid, object_distances.grid->values.data());
    if (object_distances.smooth)
      distances.set_detail(object_distances.smooth->values.data(), DetailFade{});
    const float detail = distances.detail_share(1 - mixed.weight);
    PM_TRY_STATUS(to_status(engine.regress(mixed.map, points, values)));
    parallel_for(
        static_cast<std::int64_t>(points.size()),
        [&](std::int64_t index) {
          const auto i = static_cast<std::size_t>(index);
          const float* p = values[i].v;
          const float d = mixed.scale * distances.value(Points<float>{p[0], p[1], p[2]}, detail);
          field[i] += shares[k] * d / (0.5f + 0.5f * std::sqrt(1 + 2 * std::abs(d) * inv_range));
        },
        /*grain=*/4096);
  }
  return field;
}

/// Edge of a coarse cell in cells of the fine grid.
constexpr int kStride = 4;

/// Makes the grid of every kStride-th point that covers a grid.
Grid coarsen(const Grid& fine) {
  const auto points = [](int count) { return (count + kStride - 2) / kStride + 1; };
  return {fine.origin,
          fine.cell * kStride,
          {points(fine.points.x), points(fine.points.y), points(fine.points.z)}};
}

/// Calls the function with every point of a grid, in order.
template <class Function>
void for_each_point(const Grid& grid, const Function& function) {
  for (int z = 0; z < grid.points.z; ++z)
    for (int y = 0; y < grid.points.y; ++y)
      for (int x = 0; x < grid.points.x; ++x) function(Int3{x, y, z});
}

/// Evaluates the field on a grid. Where it is far from the level, only its sign counts, and it is
/// interpolated on a coarser grid. `volume`: volume that the level keeps.
Result<std::vector<float>> fill_grid(const Grid& grid, const Mixture& mixture, double volume,
                                     Engine& engine) {
  const std::vector<float> shares = distance_shares(mixture.objects);
  // Evaluate the field on the coarse grid, and estimate the level.
  DistanceGrid coarse{coarsen(grid), /*values=*/{}};
  std::vector<Vec3> points;
  for_each_point(coarse.grid, [&](Int3 at) { points.push_back(grid_point(coarse.grid, at)); });
  PM_TRY(coarse.values, sample_field(mixture, shares, points, engine));
  const float level =
      mixture.keeps_volume ? find_level(coarse, volume, kMaxLevel * mixture.size) : 0;
  // The field's slope is at most 2, and a point is at most half a coarse cell's diagonal (0.87
  // cells) from the nearest corner, so that their values differ by at most 1.73 cells. The
  // remaining 0.77 cells allow for the error of `level`.
  const float range = 2.5f * coarse.grid.cell;
  // Interpolate it on the fine grid, and list the points near the level.
  std::vector<float> values(array3_count(grid.points));
  std::vector<std::size_t> near_indices;
  points.clear();
  for_each_point(grid, [&](Int3 at) {
    const Int3 cell{at.x / kStride, at.y / kStride, at.z / kStride};
    const float t[3] = {static_cast<float>(at.x % kStride) / kStride,
                        static_cast<float>(at.y % kStride) / kStride,
                        static_cast<float>(at.z % kStride) / kStride};
    float value = 0, min_difference = range;
    for (int corner = 0; corner < 8; ++corner) {
      const int step[3] = {corner & 1, corner >> 1 & 1, corner >> 2};
      float weight = 1;
      for (int axis = 0; axis < 3; ++axis) weight *= step[axis] ? t[axis] : 1 - t[axis];
      if (weight == 0) continue;
      const float corner_value = coarse.values[array3_index(
          coarse.grid.points, {cell.x + step[0], cell.y + step[1], cell.z + step[2]})];
      value += weight * corner_value;
      min_difference = std::min(min_difference, std::abs(corner_value - level));
    }
    const std::size_t index = array3_index(grid.points, at);
    values[index] = value;
    if (min_difference >= range) return;
    near_indices.push_back(index);
    points.push_back(grid_point(grid, at));
  });
  // Evaluate the field at these points.
  PM_TRY(const std::vector<float> exact, sample_field(mixture, shares, points, engine));
  for (std::size_t i = 0; i < near_indices.size(); ++i) values[near_indices[i]] = exact[i];
  return values;
}

/// Removes separate fragments and cuts handles that no object has, as leg_surface() does.
void clean_up(const Mixture& mixture, Mesh& mesh) {
  double min_share = 0;
  std::int64_t genus = 0;
  for (const MixedObject& mixed : mixture.objects) {
    min_share = std::max(min_share, min_mixture_component_share(*mixed.object, mixture.settings));
    genus = std::max<std::int64_t>(genus, mixed.object->distances.genus);
  }
  remove_fragments(min_share, mixture.settings, mesh);
  repair_normals(mesh);
  cut_superfluous_handles(genus, mixture.size, mesh);
}

/// Moves a surface vertically so that its lowest point is at `floor`, and returns the offset.
float move_to_floor(float floor, Mesh& mesh) {
  if (mesh.positions.empty()) return 0;
  const float lift = floor - bounding_box(mesh.positions).low.y;
  for (Vec3& p : mesh.positions) p.y += lift;
  return lift;
}

}  // namespace

PathPart object_similarity(const ShapeSpace& space, std::size_t object) {
  if (object > 0) return mean_path_part(space.legs[object - 1]->plan);
  const Vec3d center(space.legs.front()->from->model.box().center());
  return {center, center, /*turn=*/{}, /*log_scale=*/0};
}

double ball_kernel_deviation(const Ball& ball, double scale) {
  return scale * 0.7 / std::sqrt(2 * static_cast<double>(ball.a));
}

double min_mixture_component_share(const PreparedObject& object, const LegSettings& settings) {
  const auto min_share = static_cast<double>(settings.min_component_share);
  if (min_share <= 0) return 0;
  return std::max(min_share, min_fragment_share(object.distances.smallest_component_share));
}

Result<ShapeSpace> make_shape_space(std::vector<std::shared_ptr<const Leg>> legs, Engine& engine) {
  PM_CHECK(!legs.empty());
  ShapeSpace space;
  std::vector<Vec3d>& reference_places = space.places.emplace_back();
  for (const Ball& ball : legs.front()->plan.from) reference_places.emplace_back(ball.center);
  for (const auto& leg : legs) {
    for (const auto& object : {leg->from, leg->to})
      if (is_shell(object->distances) || object->distances.is_vessel)
        return make_error(ErrorCode::kInput,
                          "{}: is a shell or a vessel, and three objects or more can be mixed only "
                          "if all are solids - set spheres.solidify, or blend it with one other",
                          object->name);
    PM_TRY(std::vector<Vec3d> places, map_balls_to_target(*leg, engine));
    space.places.push_back(std::move(places));
  }
  space.legs = std::move(legs);
  return space;
}

Result<Mixture> mix_objects(const ShapeSpace& space, std::span<const float> weights) {
  PM_CHECK(weights.size() == space.places.size());
  const Leg& first = *space.legs.front();
  double sum = 0;
  for (const float weight : weights) {
    if (!(weight >= 0 && weight <= 1))
      return make_error(ErrorCode::kInput, "{}: a weight of a mixture must be in [0, 1] (is {})",
                        first.from->name, weight);
    sum += static_cast<double>(weight);
  }
  if (std::abs(sum - 1) > 1e-5)
    return make_error(ErrorCode::kInput,
                      "{}: the weights of a mixture must sum to 1 (they do to {})",
                      first.from->name, sum);
  const std::vector<MixtureInput> inputs = list_inputs(space, weights);
  Mixture mixture;
  mixture.settings = first.settings;
  mixture.keeps_volume = first.plan.motion.keep_volume;
  Box lowest_points;  // its height is the largest difference between the objects' lowest points
  for (const MixtureInput& input : inputs) {
    const Box box = input.object->model.box();
    mixture.size += static_cast<float>(input.weight) * box.diagonal();
    mixture.floor += static_cast<float>(input.weight) * box.low.y;
    lowest_points = unite(lowest_points, {box.low, box.low});
  }
  mixture.stands =
      first.settings.contact && lowest_points.size().y <= kMaxFloorDifference * mixture.size;
  const Vec3d middle(first.from->model.box().center());
  mixture.mean = mean_similarity(inputs, middle);
  mix_balls(first.plan, inputs, middle, mixture);
  for (const MixtureInput& input : inputs)
    mixture.objects.push_back(make_mixed_object(input, mixture));
  return mixture;
}

Result<WeightedSurface> weighted_surface(const Mixture& mixture, Engine& engine) {
  const LegSettings& settings = mixture.settings;
  const std::vector<MixedObject>& objects = mixture.objects;
  WeightedSurface surface;
  if (objects.size() == 1) {
    PM_TRY(surface.mesh, extract_distances(engine, objects.front().object->distances.grid,
                                           settings.cell, settings.shown));
    return surface;
  }
  auto field = std::make_shared<DistanceGrid>();
  PM_TRY(field->grid, fit_grid(mixture.box, settings.cell));
  double volume = 0;
  for (const MixedObject& mixed : objects)
    volume += static_cast<double>(mixed.weight) * mixed.object->distances.volume;
  PM_TRY(field->values, fill_grid(field->grid, mixture, volume, engine));
  if (mixture.keeps_volume) {
    surface.level = find_level(*field, volume, kMaxLevel * mixture.size);
    for (float& value : field->values) value -= surface.level;
  }
  close_border(*field);
  set_lipschitz(*field);
  PM_TRY(surface.mesh, extract_distances(engine, field, settings.cell, settings.shown));
  clean_up(mixture, surface.mesh);
  if (mixture.stands) surface.lift = move_to_floor(mixture.floor, surface.mesh);
  return surface;
}

Result<std::vector<float>> weighted_field(const Mixture& mixture, const WeightedSurface& surface,
                                          const std::vector<Vec3>& points, Engine& engine) {
  std::vector<float> values;
  if (mixture.objects.size() == 1) {
    const DistanceGrid& object_grid = *mixture.objects.front().object->distances.grid;
    const DistanceField distances(object_grid.grid, object_grid.values.data());
    for (const Vec3 p : points)
      values.push_back(distances.value(Points<float>{p.x, p.y, p.z}, /*detail=*/1.0f));
    return values;
  }
  std::vector<Vec3> lowered = points;
  for (Vec3& p : lowered) p.y -= surface.lift;
  PM_TRY(values, sample_field(mixture, distance_shares(mixture.objects), lowered, engine));
  for (float& value : values) value -= surface.level;
  return values;
}

Result<std::vector<Vec3>> map_to_object(const MixedObject& object, float lift,
                                        const std::vector<Vec3>& points, Engine& engine) {
  std::vector<Vec3> lowered = points;
  for (Vec3& p : lowered) p.y -= lift;
  std::vector<AttributeValues> values;
  PM_TRY_STATUS(to_status(engine.regress(object.map, lowered, values)));
  std::vector<Vec3> places;
  for (const AttributeValues& at : values) places.push_back({at.v[0], at.v[1], at.v[2]});
  return places;
}

Result<std::vector<Vec3>> map_to_reference(const ShapeSpace& space, std::span<const float> weights,
                                           float lift, const std::vector<Vec3>& points,
                                           Engine& engine) {
  PM_TRY(const Mixture mixture, mix_objects(space, weights));
  return map_to_object(make_mixed_object(make_input(space, /*object=*/0, /*weight=*/0), mixture),
                       lift, points, engine);
}

Result<Flow> weighted_flow(const ShapeSpace& space, std::span<const float> now,
                           std::span<const float> next, const std::vector<Vec3>& points,
                           Engine& engine) {
  PM_TRY(const Mixture mixture, mix_objects(space, now));
  PM_TRY(const Mixture next_mixture, mix_objects(space, next));
  auto regression = std::make_shared<Regression>(empty_regression(mixture));
  for (std::size_t b = 0; b < mixture.samples.size(); ++b) {
    const Vec3 step = next_mixture.samples[b].center - mixture.samples[b].center;
    set_linear(regression->values.emplace_back(), step, /*slope=*/scaled({}, 0));
    regression->values.back().value[3] = 1 - now.front();  // progress, as in read_flow()
  }
  std::vector<AttributeValues> values;
  PM_TRY_STATUS(to_status(engine.regress(regression, points, values)));
  return read_flow(values);
}

}  // namespace polymorph
