// Morph plan: the correspondence between the balls of two objects (docs/method.md, Plan).
// morph/motion.h has their motion.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/matrix_decompositions.h"
#include "kernels/ball_paths.h"
#include "kernels/types.h"
#include "scene/scene.h"

namespace polymorph {

/// One moving ball: a share of ball `from` that becomes a share of ball `to`. The shares of the
/// pairs that leave one ball, and of those that reach one, each sum to 1, so both ends give the
/// objects' own fields.
struct Pair {
  std::uint32_t from = 0, to = 0;
  float from_share = 1, to_share = 1;  ///< (0, 1]
  double mass = 0;                     ///< share of the whole mass, the mean of both ends' shares
};

/// The similarity that lays one object on the other: q = to_center + scale rotation (p -
/// from_center).
struct Alignment {
  Mat3 rotation;
  /// Its axis times its angle: half a turn goes either way, and the way back is the same.
  Vec3d turn;
  double scale = 1;
  Vec3d from_center, to_center;
  /// RMS distance of the pairs' ends that it leaves, over the RMS size: 0 where one object is a
  /// rotated and scaled copy of the other, about 1 where they have nothing to do with each other.
  double strain = 0;
};

/// One object as a plan takes it.
struct PlanSide {
  std::vector<Ball> balls;
  /// One per ball, equal numbers belong together (morph/labels.h); empty: no labels.
  std::vector<std::int32_t> labels;
  std::vector<Vec3> landmarks;  ///< those of the other side in the same order
  /// Azimuth of the object's front, radians from +z towards +x; nothing where it is not known.
  std::optional<double> front = {};
  std::string name = {};  ///< shown to people who list the cache; the plan does not depend on it
};

/// When a pair starts, and how heavy it is.
struct PairTiming {
  float delay = 0;    ///< stagger: [0, stagger_share]
  float inertia = 1;  ///< spring: of mean 1, about
};

/// A point of the source and the point of the target that it becomes.
struct PlanLandmark {
  Vec3 from, to;
  std::uint32_t pair = 0;  ///< index of the pair with which it moves: the nearest one at both ends
};

/// A limb's centre line, from its root to its tip.
struct LimbCurve {
  static constexpr std::size_t kPoints = 9;
  std::array<Vec3, kPoints> points;
  std::array<float, kPoints> radii;  ///< half the limb's thickness
};

/// One object's limbs as a smooth map follows them (morph/limb_samples.h); all empty: it follows
/// the pairs alone.
struct LimbCurves {
  std::vector<LimbCurve> matched;  ///< limbs by the number of their pair
  std::vector<LimbCurve> lone;     ///< limbs that the other object has no counterpart of
  std::vector<Vec3> counterparts;  ///< place of each lone limb's root on the other object's surface
  std::vector<std::int32_t> lone_limbs;  ///< the lone limb of each ball, or kNoLabel
  std::vector<float> stations;           ///< share of its limb's length at each ball
};

class BallGraph;  // morph/parts.h

struct MorphPlan {
  FieldKind kind = FieldKind::kGaussian;
  std::vector<Ball> from, to;
  std::vector<std::int32_t> from_labels, to_labels;  ///< empty or one per ball
  /// The matched pair of limbs that each ball belongs to, or kNoLabel (morph/limb_plan.h); empty
  /// where the plan was made without limbs.
  std::vector<std::int32_t> from_limbs, to_limbs;
  /// Names of limbs that become each other; an empty name is nothing.
  std::vector<std::pair<std::string, std::string>> limb_names;
  LimbCurves from_curves, to_curves;
  /// The roots of the lone limbs of `from`, then of `to`, with their counterparts.
  std::vector<PlanLandmark> lone_roots;
  std::vector<double> from_masses, to_masses;  ///< ball_masses() of each
  std::vector<Pair> pairs;
  std::vector<PlanLandmark> landmarks;
  Alignment alignment;
  MotionSettings motion;
  /// The rotations and scalings of balls: one for all, or (path `parts`) one each.
  std::vector<Alignment> parts;
  std::shared_ptr<const BallGraph> graph;  ///< path `parts`: what holds them together
  /// The paths of the balls, one per pair; a new object whenever they change.
  std::shared_ptr<const BallPaths> paths;
  std::vector<PairTiming> timing;  ///< one per pair
  /// The leads of a smooth map (morph/smooth_map.h: compute_leads): one per pair, or none.
  std::vector<float> leads;
  /// Offsets of the places to which a smooth map takes each pair's ball on the source, at the end
  /// of the motion, and on the target, at its start (leg/registration.h); empty: none.
  std::vector<Vec3> from_offsets, to_offsets;
  /// Eased times at which even shares of the whole change are done, from 0 to 1 and rising; empty:
  /// as they are (leg/pacing.h). Only where all balls share one eased time.
  std::vector<float> pacing;
  /// Heights by which the whole is raised when even shares of the whole change are done, both ends
  /// at 0; empty: none (leg/pacing.h). Only where all balls share one eased time.
  std::vector<float> lifts;
  double size = 1;   ///< geometric mean of both objects' RMS sizes
  double floor = 0;  ///< height of the lowest ball's centre in either object
};

/// Both ball lists must not be empty. Deterministic; `index` also depends on the seed. The plan
/// from `to` to `from` is this one's mirror image. Pairs and turn are kept in the folder `cache`
/// (morph/plan_cache.h); empty: they are not.
MorphPlan plan_morph(PlanSide from, PlanSide to, FieldKind kind, const PlanSettings& settings,
                     const MotionSettings& motion = {}, const std::filesystem::path& cache = {});

/// Tests whether the plan has curves of its limbs.
bool has_curves(const MorphPlan& plan);
/// Tests whether one of a pair's balls belongs to a lone limb.
bool is_lone(const MorphPlan& plan, const Pair& pair);

/// Swaps the ends of a plan: of its balls, labels, limbs, pairs and turn. Landmarks, paths and what
/// follows from them stay.
void swap_ends(MorphPlan& plan);

}  // namespace polymorph
