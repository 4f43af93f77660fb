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

/// Deviation of the kernels where limbs are matched, as a fraction of the objects' size.
/// Neighbouring balls then move alike, so that kernels may be as narrow as limbs.
constexpr double kLimbDeviation = 0.04;
/// Deviation of the kernels and spacing of the lattice where limbs pass each other, as fractions of
/// the objects' size. Wider kernels would mix the maps of both limbs, and both would vanish.
constexpr double kPassingDeviation = 0.015;
constexpr float kPassingSpacing = 0.02f;
/// Max number of lattice nodes along an axis. It matters for objects of very different size: while
/// one of them shrinks to nothing, the box around all balls is many times as large as the objects'
/// size.
constexpr float kMaxNodes = 128;
/// Factor of a ball's own deviation 1 / sqrt(2 a). The squares of this deviation and of the
/// deviations above are summed.
constexpr double kBallDeviation = 0.7;
/// Margin around the balls, as a fraction of the objects' size.
constexpr float kMargin = 0.05f;

Vec3 row_of(const Mat3& a, int i) { return to_float({a.at(i, 0), a.at(i, 1), a.at(i, 2)}); }

AffineMap affine(const Mat3& matrix, Vec3d offset) {
  return {{row_of(matrix, 0), row_of(matrix, 1), row_of(matrix, 2)}, to_float(offset)};
}

/// The deviation of a pair's kernel, scene units. `u`: the pair's eased time; `narrowing`:
/// kernel_narrowing() of the pair.
float kernel_deviation(const MorphPlan& plan, const Pair& pair, double u, float narrowing,
                       float size) {
  const auto ball_deviation = [](const Ball& ball) {
    return 1 / std::sqrt(2 * static_cast<double>(ball.a));
  };
  const double clamped_u = std::clamp(u, 0.0, 1.0);
  const double own_deviation =
      kBallDeviation * ((1 - clamped_u) * ball_deviation(plan.from[pair.from]) +
                        clamped_u * ball_deviation(plan.to[pair.to]));
  const double deviation =
      plan.from_limbs.empty()
          ? kMapDeviation
          : kLimbDeviation + (kPassingDeviation - kLimbDeviation) * static_cast<double>(narrowing);
  const double base = deviation * static_cast<double>(size);
  return static_cast<float>(std::sqrt(base * base + own_deviation * own_deviation));
}

/// Deviations of the Gaussians that correct the map around landmarks: 0.09 of the objects' size, or
/// half the distance to the nearest other landmark if that is less. They are at least 0.75 of the
/// lattice's spacing, because the spline cannot represent narrower ones.
std::vector<float> landmark_deviations(std::span<const Vec3> places, float size, float spacing) {
  constexpr float kLandmarkDeviation = 0.09f, kLandmarkGap = 0.5f, kMinDeviation = 0.75f;
  std::vector<float> deviations;
  for (std::size_t l = 0; l < places.size(); ++l) {
    float deviation = kLandmarkDeviation * size;
    for (std::size_t k = 0; k < places.size(); ++k)
      if (k != l) deviation = std::min(deviation, kLandmarkGap * length(places[k] - places[l]));
    deviations.push_back(std::max(deviation, kMinDeviation * spacing));
  }
  return deviations;
}

/// Extends the box by the surroundings of the landmarks.
Box enclose_landmarks(Box box, std::span<const Vec3> places, float size) {
  constexpr float kRadius = 0.1f;  // fraction of `size`
  const float radius = kRadius * size;
  for (const Vec3 p : places)
    box = unite(box, {p - Vec3{radius, radius, radius}, p + Vec3{radius, radius, radius}});
  return box;
}

/// The lattice of the regression over `box`. `narrowing`: the largest of kernel_narrowing().
Grid lattice_over(const Box& box, float size, float narrowing) {
  Grid lattice;
  const Vec3 extent = box.size();
  lattice.cell = std::max(lerp(kMapSpacing, kPassingSpacing, narrowing) * size,
                          std::max({extent.x, extent.y, extent.z}) / kMaxNodes);
  // Two nodes lie beyond the box on each side: one for the spline's support, one for rounding.
  const auto nodes = [&](float length) {
    return static_cast<int>(std::ceil(length / lattice.cell)) + 5;
  };
  lattice.points = {nodes(extent.x), nodes(extent.y), nodes(extent.z)};
  lattice.origin = box.low - Vec3{2, 2, 2} * lattice.cell;
  return lattice;
}

/// Extends the box by the samples on limbs. The balls there may be too weak to count for the box.
Box enclose_limbs(Box box, std::span<const LimbSample> samples_on_limbs, const BallSet& balls,
                  float size) {
  for (const LimbSample& sample : samples_on_limbs) {
    const float radius = kMargin * size + 2 / std::sqrt(balls[sample.pair].a);
    box = unite(box, widened({sample.center, sample.center}, radius));
  }
  return box;
}

Box box_around(const BallSet& balls, float size) {
  // Where many balls overlap, each of them is weak. The cutoff is lowered so that the strongest
  // ball counts.
  float strongest = -std::numeric_limits<float>::infinity();
  for (const Ball& ball : balls.balls()) strongest = std::max(strongest, ball.w);
  ExtractSettings settings;
  settings.cutoff = 0.1f;
  if (strongest < 0) settings.cutoff *= static_cast<float>(exp_scalar(strongest));
  return widened(surface_bounds(balls.balls(), settings), kMargin * size);
}

/// Progress of a pair in the mix of both objects: u + 0.12 `lead` 4 u (1 - u), with `lead` as in
/// compute_leads(). A part that protrudes from the source therefore vanishes earlier than the rest,
/// from its tip, and a part that protrudes from the target appears later.
float mixing_progress(float u, float lead) {
  // Progress is monotone in u for factors up to 1/4.
  constexpr float kLeadFactor = 0.12f;
  const float bump = std::max(4 * u * (1 - u), 0.0f);
  return u + kLeadFactor * lead * bump;
}

/// Tests whether a pair belongs to a limb: a lone one, or a matched one at either end.
bool is_on_limb(const MorphPlan& plan, const Pair& pair) {
  return is_lone(plan, pair) || plan.from_limbs[pair.from] != kNoLabel ||
         plan.to_limbs[pair.to] != kNoLabel;
}

/// Computes how narrow each pair's kernel is, from 0 (wide) to 1: passing_weights(), and 1 for
/// pairs on limbs with curves, whose samples describe their neighbourhood more accurately than
/// balls.
std::vector<float> kernel_narrowing(const MorphPlan& plan, const std::vector<float>& eased,
                                    const BallSet& balls, float size) {
  std::vector<float> result = passing_weights(plan, eased, balls, size);
  for (std::size_t e = 0; e < result.size() && has_curves(plan); ++e)
    if (is_on_limb(plan, plan.pairs[e])) result[e] = 1;
  return result;
}

/// The samples of a plan at a time, for a map or a flow. `regression` has samples, a lattice and
/// landmarks, but no values yet.
struct SampledPlan {
  std::vector<float> eased;          ///< eased_times()
  std::vector<LimbSample> on_limbs;  ///< limb_samples()
  Box box;                           ///< contains balls, samples and landmarks, with margins
  std::shared_ptr<Regression> regression = std::make_shared<Regression>();
};

/// The samples of the regression: position, mass and deviation. `sampled`: its `eased` and
/// `on_limbs` are used; `narrowing`: kernel_narrowing().
std::vector<RegressionSample> make_samples(const MorphPlan& plan, const SampledPlan& sampled,
                                           const std::vector<float>& narrowing,
                                           const BallSet& balls, float size) {
  // In a plan with limbs all masses are equal. By their own masses, the few balls of a thin limb
  // would have hardly any influence.
  const auto equal_mass = 1 / static_cast<float>(plan.pairs.size());
  std::vector<RegressionSample> samples;
  for (std::size_t e = 0; e < balls.size(); ++e)
    samples.push_back({balls[e].center,
                       plan.from_limbs.empty()
                           ? std::max(static_cast<float>(plan.pairs[e].mass), 1e-6f)
                           : equal_mass,
                       kernel_deviation(plan, plan.pairs[e], static_cast<double>(sampled.eased[e]),
                                        narrowing[e], size)});
  if (!has_curves(plan)) return samples;
  // Samples on limbs have more mass than samples of the body, whose kernels are wide. Pairs whose
  // balls are on different limbs have no such sample, and little mass. The constants are multiples
  // of `equal_mass`.
  constexpr float kLeavingMass = 0.05f, kLimbMass = 10, kMinMass = 1e-6f;
  for (std::size_t e = 0; e < balls.size(); ++e)
    if (is_on_limb(plan, plan.pairs[e])) samples[e].mass = equal_mass * kLeavingMass;
  for (const LimbSample& sample : sampled.on_limbs) {
    samples[sample.pair].center = sample.center;
    samples[sample.pair].mass =
        kLimbMass * equal_mass * std::max(static_cast<float>(sample.mass), kMinMass);
  }
  return samples;
}

/// Sets the first three values of a sample and their slope; marks the regression if the slope is
/// not 0.
void set_values(BallAttribute& attribute, Vec3d value, const Mat3& slope, Regression& regression) {
  set_linear(attribute, to_float(value), slope);
  for (int i = 0; i < 3; ++i) regression.sloped |= !(attribute.slope[i] == Vec3{});
}

SampledPlan sample_plan(const MorphPlan& plan, float time, const BallSet& balls, float size) {
  SampledPlan sampled;
  sampled.eased = eased_times(plan, time);
  sampled.on_limbs = limb_samples(plan, time, sampled.eased, balls);
  const std::vector<float> narrowing = kernel_narrowing(plan, sampled.eased, balls, size);
  const std::vector<Vec3> places = landmark_positions(plan, time, balls);
  sampled.box = enclose_landmarks(
      enclose_limbs(box_around(balls, size), sampled.on_limbs, balls, size), places, size);
  Regression& regression = *sampled.regression;
  regression.samples = make_samples(plan, sampled, narrowing, balls, size);
  regression.lattice =
      lattice_over(sampled.box, size, *std::max_element(narrowing.begin(), narrowing.end()));
  const std::vector<float> deviations = landmark_deviations(places, size, regression.lattice.cell);
  for (std::size_t l = 0; l < places.size(); ++l)
    regression.landmarks.push_back({places[l], deviations[l], /*goal=*/{}});
  return sampled;
}

}  // namespace

double regression_bytes(const Box& box, float size) {
  const Grid lattice = lattice_over(widened(box, kMargin * size), size, /*narrowing=*/1);
  // The strain is kept twice, because its windows are computed from one copy to the other.
  return static_cast<double>(kRegressionValues * sizeof(float) + 2 * sizeof(Strain)) *
         lattice.points.x * lattice.points.y * lattice.points.z;
}

FrameMap frame_map(const MorphPlan& plan, float time, const BallSet& balls, float size,
                   const ThinnessPair& thinness) {
  PM_CHECK(balls.size() == plan.pairs.size() && size > 0);
  const SampledPlan sampled = sample_plan(plan, time, balls, size);
  const std::vector<float>& eased = sampled.eased;
  Regression& regression = *sampled.regression;
  FrameMap map;
  map.box = sampled.box;
  regression.maps = 2;
  for (std::size_t l = 0; l < plan.landmarks.size(); ++l) {
    Vec3* goal = regression.landmarks[l].goal;
    goal[0] = plan.landmarks[l].from, goal[1] = plan.landmarks[l].to;
  }
  // The mean rotation and scaling are an affine term, so that they stay exact. The regressed values
  // are the maps minus this term.
  const auto mean = static_cast<double>(mean_progress(plan, eased));
  const PathPart mean_part = mean_path_part(plan);
  const PartMotion mean_motion = part_motion(mean_part, mean);
  const Mat3 to_source = mean_motion.to_source(), to_target = mean_motion.to_target();
  const Vec3d from_translation = mean_part.from_center - to_source * mean_motion.pose.center,
              to_translation = mean_part.to_center - to_target * mean_motion.pose.center;
  regression.affine[0] = affine(to_source, from_translation);
  regression.affine[1] = affine(to_target, to_translation);
  if (thinness.from && thinness.to) {
    regression.thinness[0] = thinness.from;
    regression.thinness[1] = thinness.to;
  }
  regression.values.resize(2 * balls.size());
  // Sets the values 0 to 2 of a pair's sample: its positions on both objects and their slopes, less
  // the affine term. Registration offsets (MorphPlan::from_offsets) are added, except on lone
  // limbs.
  const auto set_pair = [&](const LimbSample& sample) {
    const std::size_t e = sample.pair;
    const Vec3d x(sample.center);
    const auto u = static_cast<double>(eased[e]);
    const auto offset = [&](const std::vector<Vec3>& offsets, double share) {
      return sample.is_lone || offsets.empty() ? Vec3d{} : Vec3d(offsets[e]) * share;
    };
    set_values(regression.values[2 * e],
               Vec3d(sample.from) + offset(plan.from_offsets, u) - to_source * x - from_translation,
               minus(sample.to_source, to_source), regression);
    set_values(regression.values[2 * e + 1],
               Vec3d(sample.to) + offset(plan.to_offsets, 1 - u) - to_target * x - to_translation,
               minus(sample.to_target, to_target), regression);
  };
  // Values of all pairs; the samples on limbs then replace their pairs' values.
  for (std::uint32_t e = 0; e < balls.size(); ++e) {
    const BallPath& path = plan.paths->balls[e];
    const PartMotion motion =
        part_motion(plan.paths->parts[path.part], static_cast<double>(eased[e]));
    set_pair({e, /*is_lone=*/false, balls[e].center, path.start.center, path.end.center,
              motion.to_source(), motion.to_target()});
    regression.values[2 * e].value[3] =
        mixing_progress(eased[e], plan.leads.empty() ? 0 : plan.leads[e]);
  }
  for (const LimbSample& sample : sampled.on_limbs) {
    set_pair(sample);
    if (sample.is_lone) regression.values[2 * sample.pair].value[3] = sample.progress;
  }
  map.from_scale = static_cast<float>(exp_scalar(mean_part.log_scale * mean));
  map.to_scale = static_cast<float>(exp_scalar(mean_part.log_scale * (mean - 1)));
  map.regression = sampled.regression;
  return map;
}

Result<std::shared_ptr<const Regression>> make_shortfall_regression(const MorphSurface& surface,
                                                                    const MorphPlan& plan,
                                                                    const BallSet& balls,
                                                                    Engine& engine) {
  // Factor that makes up for the regression, which flattens peaks.
  constexpr float kGain = 1.2f;
  std::vector<Vec3> centers;
  for (const Ball& ball : balls) centers.push_back(ball.center);
  std::vector<AttributeValues> values;
  PM_TRY_STATUS(to_status(engine.regress(surface.map, centers, values)));
  const DistanceField from_field(surface.from->grid, surface.from->values.data()),
      to_field(surface.to->grid, surface.to->values.data());
  const auto distance = [](const DistanceField& field, Vec3 p) {
    return field.value(Points<float>{p.x, p.y, p.z});
  };
  auto result = std::make_shared<Regression>(*surface.map);
  for (std::size_t e = 0; e < balls.size(); ++e) {
    const float *source = values[2 * e].v, *target = values[2 * e + 1].v;
    const float weight = smoothstep(source[3]);
    const Pair& pair = plan.pairs[e];
    const auto mixed_distance = [&](Vec3 a, Vec3 b) {
      return lerp(surface.from_scale * distance(from_field, a),
                  surface.to_scale * distance(to_field, b), weight);
    };
    const float target_distance =
        mixed_distance(plan.from[pair.from].center, plan.to[pair.to].center);
    const float mapped_distance =
        mixed_distance({source[0], source[1], source[2]}, {target[0], target[1], target[2]});
    result->values[2 * e + 1].value[3] = kGain * std::max(target_distance - mapped_distance, 0.0f);
  }
  return std::shared_ptr<const Regression>(std::move(result));
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

std::shared_ptr<const Regression> make_flow_regression(PlanMoment now, PlanMoment next,
                                                       const BallSet& balls, float size) {
  const MorphPlan& plan = now.plan;
  const BallSet next_balls = differ(now, next) ? BallSet(balls_at(next.plan, next.time)) : balls;
  const SampledPlan sampled = sample_plan(plan, now.time, balls, size);
  Regression& regression = *sampled.regression;
  // Displacements of landmarks, balls and samples on limbs.
  const std::vector<float> next_eased = eased_times(next.plan, next.time);
  const std::vector<LimbSample> next_on_limbs =
      limb_samples(next.plan, next.time, next_eased, next_balls);
  const std::vector<Vec3> next_places = landmark_positions(next.plan, next.time, next_balls);
  for (std::size_t l = 0; l < next_places.size(); ++l)
    regression.landmarks[l].goal[0] = next_places[l] - regression.landmarks[l].position;
  // A flow has no affine term.
  regression.affine[0] = affine(Mat3{{0, 0, 0, 0, 0, 0, 0, 0, 0}}, /*offset=*/{});
  std::vector<Vec3d> displacements;
  for (std::size_t e = 0; e < balls.size(); ++e)
    displacements.push_back(Vec3d(next_balls[e].center) - Vec3d(balls[e].center));
  // Samples on limbs move with their limb's centre line instead of their ball. Both lists are in
  // the order of the pairs.
  auto next_sample = next_on_limbs.begin();
  for (const LimbSample& sample : sampled.on_limbs) {
    while (next_sample != next_on_limbs.end() && next_sample->pair < sample.pair) ++next_sample;
    if (next_sample == next_on_limbs.end()) break;
    if (next_sample->pair == sample.pair)
      displacements[sample.pair] = Vec3d(next_sample->center) - Vec3d(sample.center);
  }
  for (std::size_t e = 0; e < balls.size(); ++e) {
    const std::uint32_t part = plan.paths->balls[e].part;
    const PartPose a = part_pose_at(plan.paths->parts[part], static_cast<double>(sampled.eased[e])),
                   b = part_pose_at(next.plan.paths->parts[part],
                                    static_cast<double>(next_eased[e]));
    const Mat3 motion = scaled(b.rotation * transposed(a.rotation), b.scale / a.scale);
    BallAttribute& attribute = regression.values.emplace_back();
    set_values(attribute, displacements[e], minus(motion, Mat3{}), regression);
    attribute.value[3] = std::clamp(sampled.eased[e], 0.0f, 1.0f);
  }
  return sampled.regression;
}

Result<Flow> evaluate_flow(const std::shared_ptr<const Regression>& regression,
                           const std::vector<Vec3>& points, Engine& engine) {
  std::vector<AttributeValues> values;
  PM_TRY_STATUS(to_status(engine.regress(regression, points, values)));
  return read_flow(values);
}

}  // namespace polymorph
