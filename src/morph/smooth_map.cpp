#include "morph/smooth_map.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "field/extract_surface.h"
#include "kernels/distance_field.h"
#include "kernels/morph_field.h"
#include "morph/cost.h"
#include "morph/features.h"
#include "morph/limb_samples.h"
#include "morph/motion.h"
#include "morph/passing_limbs.h"

namespace polymorph {
namespace {

/// Deviation where limbs are matched: neighbours agree on their ways and kernels may be as narrow
/// as limbs.
constexpr double kLimbDeviation = 0.04;
/// Both where limbs pass each other. Their maps would else be mixed, and both vanish.
constexpr double kPassingDeviation = 0.015;
constexpr float kPassingSpacing = 0.02f;
/// Upper bound of the lattice's nodes along an axis, for objects of very different size: while one
/// shrinks to nothing, the box around all balls is many times the objects' size.
constexpr float kMaxNodes = 128;
/// The width of a ball's kernel over the ball's own size.
constexpr double kOwnSize = 0.7;
/// Free space around the balls, as a share of the objects' size.
constexpr float kMargin = 0.05f;

Mat3 scale(const Mat3& a, double factor) {
  Mat3 out = a;
  for (double& v : out.m) v *= factor;
  return out;
}
Mat3 minus(const Mat3& a, const Mat3& b) {
  Mat3 out = a;
  for (int i = 0; i < 9; ++i) out.m[i] -= b.m[i];
  return out;
}
Vec3 row_of(const Mat3& a, int i) { return to_float({a.at(i, 0), a.at(i, 1), a.at(i, 2)}); }

AffineMap affine(const Mat3& turn, Vec3d offset) {
  return {{row_of(turn, 0), row_of(turn, 1), row_of(turn, 2)}, to_float(offset)};
}

/// A part's rotation and scaling up to u, undone: back to the source, and on to the target.
struct Undone {
  Mat3 to_source, to_target;
  Vec3d center;
};
Undone undone(const PathPart& part, double u) {
  const PartPlace place = place_at(part, u);
  const Mat3 unturn = transposed(place.rotation);
  const Mat3 on = exp_rotation(part.turn) * unturn;
  return {scale(unturn, 1 / place.scale), scale(on, exp_scalar(part.log_scale) / place.scale),
          place.center};
}

/// `passing`: kernel_narrowing() of the pair.
float kernel_deviation(const MorphPlan& plan, const Pair& pair, double u, float passing,
                       float size) {
  const auto own = [](const Ball& ball) { return 1 / std::sqrt(2 * static_cast<double>(ball.a)); };
  const double v = std::clamp(u, 0.0, 1.0);
  const double radius =
      kOwnSize * ((1 - v) * own(plan.from[pair.from]) + v * own(plan.to[pair.to]));
  const double deviation =
      plan.from_limbs.empty()
          ? kMapDeviation
          : kLimbDeviation + (kPassingDeviation - kLimbDeviation) * static_cast<double>(passing);
  const double share = deviation * static_cast<double>(size);
  return static_cast<float>(std::sqrt(share * share + radius * radius));
}

/// Deviation of the Gaussians that bend the map around landmarks, as a share of the objects' size;
/// half of the way to the next landmark where that is nearer. Below some share of the lattice's
/// spacing the spline cannot show them.
std::vector<float> landmark_deviations(std::span<const Vec3> places, float size, float spacing) {
  constexpr float kLandmarkDeviation = 0.09f, kApart = 0.5f, kMinDeviation = 0.75f;
  std::vector<float> deviations;
  for (std::size_t l = 0; l < places.size(); ++l) {
    float deviation = kLandmarkDeviation * size;
    for (std::size_t k = 0; k < places.size(); ++k)
      if (k != l) deviation = std::min(deviation, kApart * length(places[k] - places[l]));
    deviations.push_back(std::max(deviation, kMinDeviation * spacing));
  }
  return deviations;
}

/// The box, grown so that it has what landmarks draw out.
Box with_landmarks(Box box, std::span<const Vec3> places, float size) {
  constexpr float kAround = 0.1f;
  const float reach = kAround * size;
  for (const Vec3 p : places)
    box = unite(box, {p - Vec3{reach, reach, reach}, p + Vec3{reach, reach, reach}});
  return box;
}

/// `passing`: the largest of passing_shares().
Grid lattice_over(const Box& box, float size, float passing) {
  Grid lattice;
  const Vec3 extent = box.size();
  lattice.cell = std::max(lerp(kMapSpacing, kPassingSpacing, passing) * size,
                          std::max({extent.x, extent.y, extent.z}) / kMaxNodes);
  // Two nodes beyond: a point's spline needs one, rounding may take the other.
  const auto nodes = [&](float length) {
    return static_cast<int>(std::ceil(length / lattice.cell)) + 5;
  };
  lattice.points = {nodes(extent.x), nodes(extent.y), nodes(extent.z)};
  lattice.origin = box.low - Vec3{2, 2, 2} * lattice.cell;
  return lattice;
}

/// The box, grown so that it has limbs, whose balls may fade.
Box with_limbs(Box box, std::span<const LimbSample> on_limbs, const BallSet& balls, float size) {
  for (const LimbSample& sample : on_limbs) {
    const float reach = kMargin * size + 2 / std::sqrt(balls[sample.pair].a);
    const Vec3 around = {reach, reach, reach};
    box = unite(box, {sample.center - around, sample.center + around});
  }
  return box;
}

Box box_around(const BallSet& balls, float size) {
  // Of many balls in one place each is faint; the strongest counts in any case.
  float strongest = -std::numeric_limits<float>::infinity();
  for (const Ball& ball : balls.balls()) strongest = std::max(strongest, ball.w);
  ExtractSettings settings;
  settings.cutoff = 0.1f;
  if (strongest < 0) settings.cutoff *= static_cast<float>(exp_scalar(strongest));
  const Box box = surface_bounds(balls.balls(), settings);
  const float margin = kMargin * size;
  return {box.low - Vec3{margin, margin, margin}, box.high + Vec3{margin, margin, margin}};
}

/// When a pair's part changes from the one object to the other: what sticks out from the source
/// goes before the rest, from its tip, and what sticks out from the target comes after it.
float mixing_progress(float u, float lead) {
  // Up to a quarter progress rises all the way.
  constexpr float kLead = 0.12f;
  const float middle = std::max(4 * u * (1 - u), 0.0f);
  return u + kLead * lead * middle;
}

/// Tests whether a pair belongs to a limb: a lone one, or a matched one at either end.
bool is_on_limb(const MorphPlan& plan, const Pair& pair) {
  return is_lone(plan, pair) || plan.from_limbs[pair.from] != kNoLabel ||
         plan.to_limbs[pair.to] != kNoLabel;
}

/// The degree to which each pair's kernel is narrow: where limbs pass each other, and along curves
/// of limbs, which say more of their neighbourhood than balls do, 1.
std::vector<float> kernel_narrowing(const MorphPlan& plan, const std::vector<float>& eased,
                                    const BallSet& balls, float size) {
  std::vector<float> narrowing = passing_shares(plan, eased, balls, size);
  for (std::size_t e = 0; e < narrowing.size() && has_curves(plan); ++e)
    if (is_on_limb(plan, plan.pairs[e])) narrowing[e] = 1;
  return narrowing;
}

/// `passing`: kernel_narrowing().
std::vector<RegressionSample> make_samples(const MorphPlan& plan, const std::vector<float>& eased,
                                           const std::vector<float>& passing, const BallSet& balls,
                                           std::span<const LimbSample> on_limbs, float size) {
  // Beside a trunk a thin limb's few balls would have no say by their mass.
  const auto even = 1 / static_cast<float>(plan.pairs.size());
  std::vector<RegressionSample> samples;
  for (std::size_t e = 0; e < balls.size(); ++e)
    samples.push_back(
        {balls[e].center,
         plan.from_limbs.empty() ? std::max(static_cast<float>(plan.pairs[e].mass), 1e-6f) : even,
         kernel_deviation(plan, plan.pairs[e], static_cast<double>(eased[e]), passing[e], size)});
  if (!has_curves(plan)) return samples;
  // Pairs that leave their limb count little. On a limb the body's wide kernels do.
  constexpr float kLeavingMass = 0.05f, kLimbMass = 10, kMinMass = 1e-6f;
  for (std::size_t e = 0; e < balls.size(); ++e)
    if (is_on_limb(plan, plan.pairs[e])) samples[e].mass = even * kLeavingMass;
  for (const LimbSample& sample : on_limbs) {
    samples[sample.pair].center = sample.center;
    samples[sample.pair].mass =
        kLimbMass * even * std::max(static_cast<float>(sample.mass), kMinMass);
  }
  return samples;
}

void set_slope(BallAttribute& carried, const Mat3& turn, Regression& regression) {
  for (int i = 0; i < 3; ++i) {
    carried.slope[i] = row_of(turn, i);
    regression.sloped |= !(carried.slope[i] == Vec3{});
  }
}

void set_value(BallAttribute& carried, Vec3d value) {
  const Vec3 v = to_float(value);
  carried.value[0] = v.x, carried.value[1] = v.y, carried.value[2] = v.z;
}

}  // namespace

double regression_bytes(const Box& box, float size) {
  const float margin = kMargin * size;
  const Grid lattice = lattice_over(
      {box.low - Vec3{margin, margin, margin}, box.high + Vec3{margin, margin, margin}}, size, 1);
  return static_cast<double>(kRegressionValues * sizeof(float) + sizeof(Strain)) *
         lattice.points.x * lattice.points.y * lattice.points.z;
}

FrameMap frame_map(const MorphPlan& plan, float time, const BallSet& balls, float size,
                   const std::shared_ptr<const DistanceGrid>& from_thinness,
                   const std::shared_ptr<const DistanceGrid>& to_thinness) {
  PM_CHECK(balls.size() == plan.pairs.size() && size > 0);
  const std::vector<float> eased = eased_times(plan, time);
  const std::vector<Vec3> places = landmark_places(plan, time, balls);
  FrameMap map;
  const std::vector<LimbSample> on_limbs = limb_samples(plan, time, eased, balls);
  map.box =
      with_landmarks(with_limbs(box_around(balls, size), on_limbs, balls, size), places, size);
  auto regression = std::make_shared<Regression>();
  const std::vector<float> passing = kernel_narrowing(plan, eased, balls, size);
  regression->maps = 2;
  regression->lattice =
      lattice_over(map.box, size, *std::max_element(passing.begin(), passing.end()));
  const std::vector<float> deviations = landmark_deviations(places, size, regression->lattice.cell);
  for (std::size_t l = 0; l < places.size(); ++l)
    regression->landmarks.push_back(
        {places[l], deviations[l], {plan.landmarks[l].from, plan.landmarks[l].to}});
  regression->samples = make_samples(plan, eased, passing, balls, on_limbs, size);
  // What all have in common is exact: the rotation and scaling of the whole.
  const auto mean = static_cast<double>(mean_progress(plan, eased));
  const PathPart mean_part = mean_path_part(plan);
  const Undone common = undone(mean_part, mean);
  const Vec3d from_offset = mean_part.from_center - common.to_source * common.center,
              to_offset = mean_part.to_center - common.to_target * common.center;
  regression->affine[0] = affine(common.to_source, from_offset);
  regression->affine[1] = affine(common.to_target, to_offset);
  if (from_thinness && to_thinness) {
    regression->thinness[0] = from_thinness;
    regression->thinness[1] = to_thinness;
  }
  for (std::size_t e = 0; e < balls.size(); ++e) {
    const BallPath& path = plan.paths->balls[e];
    const Vec3d x(balls[e].center), p(path.start.center), q(path.end.center);
    const auto u = static_cast<double>(eased[e]);
    const PathPart& part = plan.paths->parts[path.part];
    const Undone own = undone(part, u);
    BallAttribute to_source, to_target;
    const Vec3d source_offset =
                    plan.from_offsets.empty() ? Vec3d{} : Vec3d(plan.from_offsets[e]) * u,
                target_offset =
                    plan.to_offsets.empty() ? Vec3d{} : Vec3d(plan.to_offsets[e]) * (1 - u);
    set_value(to_source, p + source_offset - common.to_source * x - from_offset);
    set_value(to_target, q + target_offset - common.to_target * x - to_offset);
    to_source.value[3] = mixing_progress(eased[e], plan.leads.empty() ? 0 : plan.leads[e]);
    set_slope(to_source, minus(own.to_source, common.to_source), *regression);
    set_slope(to_target, minus(own.to_target, common.to_target), *regression);
    regression->values.push_back(to_source);
    regression->values.push_back(to_target);
  }
  for (const LimbSample& sample : on_limbs) {
    const std::size_t e = sample.pair;
    BallAttribute &to_source = regression->values[2 * e],
                  &to_target = regression->values[2 * e + 1];
    const Vec3d x(sample.center);
    const auto u = static_cast<double>(eased[e]);
    const bool has_offsets = !sample.is_lone && !plan.from_offsets.empty();
    const Vec3d source_offset = has_offsets ? Vec3d(plan.from_offsets[e]) * u : Vec3d{},
                target_offset = has_offsets ? Vec3d(plan.to_offsets[e]) * (1 - u) : Vec3d{};
    set_value(to_source, Vec3d(sample.from) + source_offset - common.to_source * x - from_offset);
    set_value(to_target, Vec3d(sample.to) + target_offset - common.to_target * x - to_offset);
    set_slope(to_source, minus(sample.to_source, common.to_source), *regression);
    set_slope(to_target, minus(sample.to_target, common.to_target), *regression);
    if (sample.is_lone) to_source.value[3] = sample.progress;
  }
  map.from_scale = static_cast<float>(exp_scalar(mean_part.log_scale * mean));
  map.to_scale = static_cast<float>(exp_scalar(mean_part.log_scale * (mean - 1)));
  map.regression = std::move(regression);
  return map;
}

Result<std::shared_ptr<const Regression>> with_shortfalls(const FrameMap& map,
                                                          const MorphPlan& plan,
                                                          const BallSet& balls,
                                                          const DistanceGrid& from,
                                                          const DistanceGrid& to, Engine& engine) {
  // The regression takes peaks off.
  constexpr float kGain = 1.2f;
  std::vector<Vec3> centers;
  for (const Ball& ball : balls) centers.push_back(ball.center);
  std::vector<AttributeValues> values;
  PM_TRY_STATUS(to_status(engine.regress(map.regression, centers, values)));
  const DistanceField from_field(from.grid, from.values.data()),
      to_field(to.grid, to.values.data());
  const auto distance = [](const DistanceField& field, Vec3 p) {
    return field.value(Points<float>{p.x, p.y, p.z});
  };
  auto raised = std::make_shared<Regression>(*map.regression);
  for (std::size_t e = 0; e < balls.size(); ++e) {
    const float *source = values[2 * e].v, *target = values[2 * e + 1].v;
    const float share = smoothstep(source[3]);
    const Pair& pair = plan.pairs[e];
    const auto mixed = [&](Vec3 a, Vec3 b) {
      return lerp(map.from_scale * distance(from_field, a), map.to_scale * distance(to_field, b),
                  share);
    };
    const float target_distance = mixed(plan.from[pair.from].center, plan.to[pair.to].center);
    const float here = mixed({source[0], source[1], source[2]}, {target[0], target[1], target[2]});
    raised->values[2 * e + 1].value[3] = kGain * std::max(target_distance - here, 0.0f);
  }
  return std::shared_ptr<const Regression>(std::move(raised));
}

std::vector<float> compute_leads(const MorphPlan& plan) {
  const std::vector<float> from = ball_features(plan.from, plan.from_masses).distance,
                           to = ball_features(plan.to, plan.to_masses).distance;
  std::vector<float> leads;
  for (const Pair& pair : plan.pairs)
    leads.push_back(std::clamp(from[pair.from] - to[pair.to], -1.0f, 1.0f));
  return leads;
}

Result<PullBack> pull_back(const FrameMap& map, const std::vector<Vec3>& points, Engine& engine) {
  std::vector<AttributeValues> values;
  PM_TRY_STATUS(to_status(engine.regress(map.regression, points, values)));
  return read_pull_back(values);
}

Result<Flow> flow_at(PlanMoment now, PlanMoment next, const BallSet& balls, float size,
                     const std::vector<Vec3>& points, Engine& engine) {
  const MorphPlan& plan = now.plan;
  const float time = now.time;
  const std::vector<float> eased = eased_times(plan, time),
                           then = eased_times(next.plan, next.time);
  const BallSet later = differ(now, next) ? BallSet(balls_at(next.plan, next.time)) : balls;
  auto regression = std::make_shared<Regression>();
  const std::vector<float> passing = kernel_narrowing(plan, eased, balls, size);
  const std::vector<LimbSample> on_limbs = limb_samples(plan, time, eased, balls),
                                next_on_limbs = limb_samples(next.plan, next.time, then, later);
  regression->samples = make_samples(plan, eased, passing, balls, on_limbs, size);
  const std::vector<Vec3> places = landmark_places(plan, time, balls),
                          next_places = landmark_places(next.plan, next.time, later);
  regression->lattice = lattice_over(
      with_landmarks(with_limbs(box_around(balls, size), on_limbs, balls, size), places, size),
      size, *std::max_element(passing.begin(), passing.end()));
  const std::vector<float> deviations = landmark_deviations(places, size, regression->lattice.cell);
  for (std::size_t l = 0; l < places.size(); ++l)
    regression->landmarks.push_back({places[l], deviations[l], {next_places[l] - places[l], {}}});
  const Mat3 zero = scale(Mat3{}, 0);
  regression->affine[0] = affine(zero, {});
  for (std::size_t e = 0; e < balls.size(); ++e) {
    BallAttribute carried;
    set_value(carried, Vec3d(later[e].center) - Vec3d(balls[e].center));
    carried.value[3] = std::clamp(eased[e], 0.0f, 1.0f);
    const PathPart& part = plan.paths->parts[plan.paths->balls[e].part];
    const PartPlace a = place_at(part, static_cast<double>(eased[e])),
                    b = place_at(next.plan.paths->parts[plan.paths->balls[e].part],
                                 static_cast<double>(then[e]));
    const Mat3 turn = scale(b.rotation * transposed(a.rotation), b.scale / a.scale);
    set_slope(carried, minus(turn, Mat3{}), *regression);
    regression->values.push_back(carried);
  }
  // Both lists are in the order of the pairs.
  auto later_sample = next_on_limbs.begin();
  for (const LimbSample& sample : on_limbs) {
    while (later_sample != next_on_limbs.end() && later_sample->pair < sample.pair) ++later_sample;
    if (later_sample == next_on_limbs.end()) break;
    if (later_sample->pair == sample.pair)
      set_value(regression->values[sample.pair],
                Vec3d(later_sample->center) - Vec3d(sample.center));
  }
  std::vector<AttributeValues> values;
  PM_TRY_STATUS(to_status(engine.regress(regression, points, values)));
  return read_flow(values);
}

}  // namespace polymorph
