#include "morph/plan.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <span>
#include <tuple>
#include <utility>

#include "base/exact_math.h"
#include "base/result.h"
#include "morph/align.h"
#include "morph/cost.h"
#include "morph/facing.h"
#include "morph/limb_plan.h"
#include "morph/mass.h"
#include "morph/motion.h"
#include "morph/pairing.h"
#include "morph/plan_cache.h"

namespace polymorph {
namespace {

/// Fits the similarity of the pairs with the given rotation. The scale is fitted only with
/// AlignMethod::kSimilarity.
Alignment fit_alignment(const MorphPlan& plan, const Mat3& rotation, AlignMethod method) {
  Alignment fit;
  for (const Pair& pair : plan.pairs) {
    fit.from_center = fit.from_center + Vec3d(plan.from[pair.from].center) * pair.mass;
    fit.to_center = fit.to_center + Vec3d(plan.to[pair.to].center) * pair.mass;
  }
  fit.rotation = rotation;
  fit.rotation_vector = log_rotation(rotation);
  double from_square = 0, to_square = 0, product = 0;
  for (const Pair& pair : plan.pairs) {
    const Vec3d p = rotation * (Vec3d(plan.from[pair.from].center) - fit.from_center);
    const Vec3d q = Vec3d(plan.to[pair.to].center) - fit.to_center;
    from_square += pair.mass * dot(p, p);
    to_square += pair.mass * dot(q, q);
    product += pair.mass * dot(p, q);
  }
  if (!(from_square > 0 && to_square > 0)) return fit;
  // The symmetric scale of Horn 1987, which becomes its inverse when the objects are swapped. It is
  // used only if it brings the balls at least 10 % nearer.
  constexpr double kMinScaleGain = 0.1;
  // The weighted sum of |q - s p|^2 / s.
  const auto residual_at = [&](double s) { return to_square / s + from_square * s - 2 * product; };
  const auto is_gain = [&](double s) {
    return residual_at(s) < (1 - kMinScaleGain) * residual_at(1);
  };
  const double scale = std::sqrt(to_square / from_square);
  if (method == AlignMethod::kSimilarity && is_gain(scale)) {
    // The centres of a few balls may lie anywhere in an object and say little about its size. With
    // 96 balls, the scale agrees with the bodies' to a factor of 1.3.
    constexpr double kMaxRatio = 1.5;
    const double body_scale = radius_of_gyration(plan.to, plan.kind, fit.to_center) /
                              radius_of_gyration(plan.from, plan.kind, fit.from_center);
    const bool is_unreliable = std::max(scale / body_scale, body_scale / scale) > kMaxRatio;
    const double chosen_scale = is_unreliable ? body_scale : scale;
    if (is_gain(chosen_scale)) fit.scale = chosen_scale;
  }
  fit.strain =
      std::sqrt(std::max(residual_at(fit.scale), 0.0) / std::sqrt(from_square * to_square));
  return fit;
}

/// Orders the sides of a plan by their number of balls, then by the balls. A correspondence is
/// always made from the lesser side, so that it does not depend on the direction of the morph.
bool is_less(const PlanSide& a, const PlanSide& b) {
  if (a.balls.size() != b.balls.size()) return a.balls.size() < b.balls.size();
  for (std::size_t i = 0; i < a.balls.size(); ++i) {
    const auto key = [](const Ball& ball) {
      return std::array<float, 5>{ball.center.x, ball.center.y, ball.center.z, ball.a, ball.w};
    };
    if (key(a.balls[i]) != key(b.balls[i])) return key(a.balls[i]) < key(b.balls[i]);
  }
  return false;
}

/// RMS distance of the balls' centres from their mean.
double rms_size(const std::vector<Ball>& balls) {
  const std::vector<double> equal_masses(balls.size(), 1 / static_cast<double>(balls.size()));
  return fit_normalization(balls, equal_masses).size;
}

double lowest_center(const std::vector<Ball>& balls) {
  float low = balls[0].center.y;
  for (const Ball& ball : balls) low = std::min(low, ball.center.y);
  return static_cast<double>(low);
}

/// Makes landmarks, each with its nearest pair, which is the one with the least sum of squared
/// distances at both ends, relative to the objects' sizes. Pairs of lone limbs are used only if
/// there are no others.
std::vector<PlanLandmark> landmarks_with_pairs(const MorphPlan& plan, std::span<const Vec3> from,
                                               std::span<const Vec3> to) {
  const double from_size = rms_size(plan.from), to_size = rms_size(plan.to);
  std::vector<PlanLandmark> landmarks;
  for (std::size_t l = 0; l < from.size(); ++l) {
    const auto distance2 = [&](const Pair& pair) {
      const Vec3d p = Vec3d(plan.from[pair.from].center) - Vec3d(from[l]),
                  q = Vec3d(plan.to[pair.to].center) - Vec3d(to[l]);
      return dot(p, p) / (from_size * from_size) + dot(q, q) / (to_size * to_size);
    };
    const auto nearest =
        std::min_element(plan.pairs.begin(), plan.pairs.end(), [&](const Pair& a, const Pair& b) {
          const bool a_is_lone = is_lone(plan, a), b_is_lone = is_lone(plan, b);
          return a_is_lone != b_is_lone ? b_is_lone : distance2(a) < distance2(b);
        });
    landmarks.push_back({from[l], to[l], static_cast<std::uint32_t>(nearest - plan.pairs.begin())});
  }
  return landmarks;
}

/// Lists the roots of the lone limbs.
std::vector<Vec3> lone_roots(const LimbCurves& curves) {
  std::vector<Vec3> roots;
  for (const LimbCurve& curve : curves.lone) roots.push_back(curve.points[0]);
  return roots;
}

/// Tests whether a plan uses the objects' limbs and fronts. The objects must be free to rotate
/// about the vertical, since limbs of objects that face different ways are in different places.
/// With hard labels, limbs are not used.
bool uses_structure(const MorphPlan& plan, const PlanSettings& settings, RotationAxis axis) {
  const bool may_rotate =
      settings.align == AlignMethod::kRigid || settings.align == AlignMethod::kSimilarity;
  return settings.structure == PlanStructure::kAuto && settings.method == PlanMethod::kTransport &&
         settings.label_mode != LabelMode::kHard && plan.kind == FieldKind::kGaussian &&
         may_rotate && axis == RotationAxis::kVertical;
}

/// Tests whether the pairs found without limbs have little strain. Near copies are matched better
/// without limbs.
bool are_alike(const MorphPlan& plan, const Mat3& rotation, AlignMethod align) {
  constexpr double kAlike = 0.2;
  return fit_alignment(plan, rotation, align).strain < kAlike;
}

/// Matches the limbs and stores the match in the plan; returns false if it is not certain.
bool use_limbs(MorphPlan& plan, LimbPlan& limbs, const Mat3& rotation) {
  limbs.match = match_at(limbs, log_rotation(rotation).y);
  if (!is_certain(limbs.match)) return false;
  std::vector<std::uint32_t> from_matched, to_matched;
  for (const auto& [i, k] : limbs.match.limbs) {
    from_matched.push_back(i);
    to_matched.push_back(k);
  }
  plan.from_limbs = limb_indices_of_balls(limbs.from, from_matched);
  plan.to_limbs = limb_indices_of_balls(limbs.to, to_matched);
  return true;
}

/// Pairs the balls by limbs and returns the rotation. The rotation is fitted to the pairs if the
/// limbs match at an angle of more than 35 degrees, or if `rotation`, found without limbs, is not
/// the identity. Otherwise it is the identity: limbs that merely point elsewhere do not rotate an
/// object.
Mat3 find_pairs_by_limbs(MorphPlan& plan, const LimbPlan& limbs, const CostPair& sides,
                         const Mat3& rotation, LabelMode mode) {
  constexpr double kMinAngle = 35 * exact::kPi / 180;
  CostPair by_limbs;
  by_limbs.label_cost = sides.label_cost;
  std::tie(by_limbs.a, by_limbs.b) = limb_cost_sides(limbs, plan.from, plan.to, sides.a, sides.b);
  // In an incomplete match that the user has not chosen, the pairs are more reliable without
  // curves: a limb without a counterpart often lies on a limb of the other object if both are
  // similar.
  if (limbs.match.is_chosen || is_complete(limbs.match))
    std::tie(plan.from_curves, plan.to_curves) = find_limb_curves(limbs, plan.from, plan.to);
  plan.pairs = pair_bodies(by_limbs, mode, plan.from_curves, plan.to_curves);
  set_masses(plan.pairs, plan.from_masses, plan.to_masses);
  const std::vector<TransportFlow> flows = list_flows(plan.pairs);
  if (has_curves(plan)) add_lone_pairs(plan);
  const double angle = limbs.match.angle;
  const bool rotates = std::fabs(angle) > kMinAngle || rotation_angle(rotation) > 0;
  return rotates ? fit_rotation(sides.a, sides.b, flows, RotationAxis::kVertical) : Mat3{};
}

/// Certainty of a rotation, the least certain first. kFound: it comes from a search with
/// representative balls, and is refitted to all balls. kFaced: it comes from the mirror planes of
/// bodies that are not quite symmetric, and matched limbs may correct it. kKnown: it comes from
/// landmarks, fronts or exact mirror planes, and stays as it is.
enum class Certainty : std::uint8_t { kFound, kFaced, kKnown };

/// The rotation of a plan.
struct RotationChoice {
  Mat3 rotation;
  RotationAxis axis = RotationAxis::kVertical;
  Certainty certainty = Certainty::kFound;
  std::optional<LimbPlan> limbs = {};  ///< limbs of both objects, if they were found
};

/// Finds the rotation from `from` to `to` before the balls are paired.
RotationChoice choose_rotation(const MorphPlan& plan, const PlanSide& from, const PlanSide& to,
                               const CostPair& sides, const PlanSettings& settings) {
  RotationChoice choice;
  if (settings.align != AlignMethod::kRigid && settings.align != AlignMethod::kSimilarity)
    return choice;
  if (const auto by_landmarks = fit_landmark_rotation(from.landmarks, to.landmarks)) {
    choice = {*by_landmarks, RotationAxis::kVertical, Certainty::kKnown};
  } else {
    // The search for a rotation treats hard labels as soft ones with a high cost.
    constexpr float kHardCost = 100;
    const float label_cost = settings.label_mode == LabelMode::kHard ? kHardCost : sides.label_cost;
    const RotationResult search = find_rotation(
        sides.a, sides.b, label_cost, static_cast<double>(settings.weights.align_gain),
        static_cast<double>(settings.weights.align_tip_residual));
    choice = {search.rotation, search.axis, Certainty::kFound};
  }
  if (!uses_structure(plan, settings, choice.axis) || choice.certainty == Certainty::kKnown)
    return choice;
  if (from.front && to.front)
    return {about_vertical(azimuth_difference(*from.front, *to.front)), choice.axis,
            Certainty::kKnown};
  LimbPlan& limbs = choice.limbs.emplace(find_limbs_of_sides(from, to, settings));
  const double plan_angle = log_rotation(choice.rotation).y;
  const auto facing = find_facing(limbs, plan_angle, from.front, to.front);
  if (!facing || *facing == plan_angle) return choice;
  choice.rotation = about_vertical(*facing);
  const bool is_known = is_symmetric(limbs.from) && is_symmetric(limbs.to);
  choice.certainty = is_known ? Certainty::kKnown : Certainty::kFaced;
  return choice;
}

/// Sets the plan's pairs, and its limbs if it uses them; returns the rotation.
Mat3 find_pairs(MorphPlan& plan, const PlanSide& from, const PlanSide& to,
                const PlanSettings& settings) {
  const std::vector<double>& from_mass = plan.from_masses;
  const std::vector<double>& to_mass = plan.to_masses;
  if (settings.method == PlanMethod::kIndex) {
    plan.pairs = pair_by_index(plan.from.size(), plan.to.size(), settings.seed);
    set_masses(plan.pairs, from_mass, to_mass);
    return {};
  }
  Normalization from_normalization = fit_normalization(plan.from, from_mass);
  Normalization to_normalization = fit_normalization(plan.to, to_mass);
  if (settings.align == AlignMethod::kNone) {
    Normalization common;
    common.center = (from_normalization.center + to_normalization.center) * 0.5;
    common.size = std::sqrt(from_normalization.size * to_normalization.size);
    from_normalization = to_normalization = common;
  }
  // Make the sides of the transport problem.
  const bool has_soft_labels = settings.label_mode == LabelMode::kSoft;
  CostPair sides;
  sides.a = make_cost_side(from, plan.kind, from_mass, from_normalization, settings);
  sides.b = make_cost_side(to, plan.kind, to_mass, to_normalization, settings);
  sides.label_cost = has_soft_labels ? settings.weights.label : 0;
  const auto pair_up = [&] {
    plan.pairs = settings.method == PlanMethod::kNearest
                     ? pair_nearest(sides)
                     : pair_by_transport(sides, settings.label_mode);
    set_masses(plan.pairs, from_mass, to_mass);
  };
  // Choose a rotation and pair the balls.
  RotationChoice choice = choose_rotation(plan, from, to, sides, settings);
  const bool rotates = rotation_angle(choice.rotation) > 0;
  const CostSide unrotated = sides.a;
  const auto refit = [&] {
    choice.rotation = fit_rotation(unrotated, sides.b, list_flows(plan.pairs), choice.axis);
  };
  if (rotates) sides.a = rotate_side(unrotated, choice.rotation);
  pair_up();
  // A rotation that was found with 80 representatives is refitted to all balls: twice with new
  // pairs, then to the last pairs.
  for (int step = 0; rotates && choice.certainty == Certainty::kFound && step < 2; ++step) {
    refit();
    sides.a = rotate_side(unrotated, choice.rotation);
    pair_up();
  }
  if (rotates && choice.certainty == Certainty::kFound) refit();
  // Pair the balls anew by their limbs, if these match.
  if (!uses_structure(plan, settings, choice.axis) ||
      are_alike(plan, choice.rotation, settings.align))
    return choice.rotation;
  if (!choice.limbs) choice.limbs = find_limbs_of_sides(from, to, settings);
  if (use_limbs(plan, *choice.limbs, choice.rotation)) {
    const Mat3 by_limbs =
        find_pairs_by_limbs(plan, *choice.limbs, {unrotated, sides.b, sides.label_cost},
                            choice.rotation, settings.label_mode);
    if (choice.certainty != Certainty::kKnown) choice.rotation = by_limbs;
    plan.limb_names = list_limb_names(*choice.limbs, log_rotation(choice.rotation).y);
  }
  return choice.rotation;
}

/// Sets masses, pairs and limbs, computed or from the cache; returns the rotation.
Mat3 find_correspondence(MorphPlan& plan, const PlanSide& from, const PlanSide& to,
                         const PlanSettings& settings, const std::filesystem::path& cache) {
  const std::string key =
      cache.empty() ? std::string{} : correspondence_key(from, to, plan.kind, settings);
  if (!cache.empty())
    if (auto cached = load_correspondence(cache, key, from, to)) {
      plan.from_masses = std::move(cached->from_masses);
      plan.to_masses = std::move(cached->to_masses);
      plan.pairs = std::move(cached->pairs);
      plan.from_limbs = std::move(cached->from_limbs);
      plan.to_limbs = std::move(cached->to_limbs);
      plan.from_curves = std::move(cached->from_curves);
      plan.to_curves = std::move(cached->to_curves);
      plan.limb_names = std::move(cached->limb_names);
      return cached->rotation;
    }
  plan.from_masses = ball_masses(plan.from, plan.kind);
  plan.to_masses = ball_masses(plan.to, plan.kind);
  const Mat3 rotation = find_pairs(plan, from, to, settings);
  if (!cache.empty())
    store_correspondence(cache, key,
                         std::min(from.name, to.name) + ", " + std::max(from.name, to.name),
                         {plan.from_masses, plan.to_masses, plan.pairs, rotation, plan.from_limbs,
                          plan.to_limbs, plan.from_curves, plan.to_curves, plan.limb_names});
  return rotation;
}

}  // namespace

bool has_curves(const MorphPlan& plan) { return !plan.from_curves.stations.empty(); }

bool is_lone(const MorphPlan& plan, const Pair& pair) {
  return has_curves(plan) && (plan.from_curves.lone_limbs[pair.from] != kNoLabel ||
                              plan.to_curves.lone_limbs[pair.to] != kNoLabel);
}

void swap_ends(MorphPlan& plan) {
  std::swap(plan.from, plan.to);
  std::swap(plan.from_masses, plan.to_masses);
  std::swap(plan.from_labels, plan.to_labels);
  std::swap(plan.from_limbs, plan.to_limbs);
  std::swap(plan.from_curves, plan.to_curves);
  for (auto& [a, b] : plan.limb_names) std::swap(a, b);
  for (Pair& pair : plan.pairs) {
    std::swap(pair.from, pair.to);
    std::swap(pair.from_share, pair.to_share);
  }
  const Alignment fit = plan.alignment;
  plan.alignment = {transposed(fit.rotation),
                    fit.rotation_vector * -1.0,
                    1 / fit.scale,
                    fit.to_center,
                    fit.from_center,
                    fit.strain};
}

MorphPlan plan_morph(PlanSide from, PlanSide to, FieldKind kind, const PlanSettings& settings,
                     const MotionSettings& motion, const std::filesystem::path& cache) {
  PM_CHECK(!from.balls.empty() && !to.balls.empty());
  PM_CHECK(from.landmarks.size() == to.landmarks.size());
  const bool is_swapped = is_less(to, from);
  if (is_swapped) std::swap(from, to);
  MorphPlan plan;
  plan.kind = kind;
  plan.from = from.balls;
  plan.to = to.balls;
  plan.from_labels = from.labels;
  plan.to_labels = to.labels;
  const Mat3 rotation = find_correspondence(plan, from, to, settings, cache);
  std::sort(plan.pairs.begin(), plan.pairs.end(), [](const Pair& a, const Pair& b) {
    return std::pair(a.from, a.to) < std::pair(b.from, b.to);
  });
  plan.alignment = fit_alignment(plan, rotation, settings.align);
  if (is_swapped) swap_ends(plan);
  plan.landmarks = landmarks_with_pairs(plan, is_swapped ? to.landmarks : from.landmarks,
                                        is_swapped ? from.landmarks : to.landmarks);
  plan.lone_roots =
      landmarks_with_pairs(plan, lone_roots(plan.from_curves), plan.from_curves.counterparts);
  for (const PlanLandmark& root :
       landmarks_with_pairs(plan, plan.to_curves.counterparts, lone_roots(plan.to_curves)))
    plan.lone_roots.push_back(root);
  plan.size = std::sqrt(rms_size(plan.from) * rms_size(plan.to));
  plan.floor = std::min(lowest_center(plan.from), lowest_center(plan.to));
  plan.motion = motion;
  set_paths(plan);
  return plan;
}

}  // namespace polymorph
