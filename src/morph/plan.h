// Morph plan: the correspondence between the balls of two objects (docs/method.md, Plan). Their
// motion: morph/motion.h.
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

/// One moving ball: a share of ball `from` that becomes a share of ball `to`. The shares of each
/// source ball sum to 1, and so do those of each target ball; the fields at both ends are therefore
/// the objects' own.
struct Pair {
  std::uint32_t from = 0, to = 0;      ///< indices in MorphPlan::from and to
  float from_share = 1, to_share = 1;  ///< (0, 1]
  double mass = 0;                     ///< mean of its fractions of both objects' masses
};

/// The similarity from one object to the other: q = to_center + scale rotation (p - from_center).
struct Alignment {
  Mat3 rotation;
  /// Rotation vector, axis times angle. It is stored because a half turn has two; the reversed plan
  /// needs the negative of this one.
  Vec3d rotation_vector;
  double scale = 1;
  Vec3d from_center, to_center;
  /// RMS distance that remains between paired balls, over the RMS size: 0 if one object is a
  /// rotated and scaled copy of the other, about 1 for unrelated objects.
  double strain = 0;
};

/// One object as the input of a plan.
struct PlanSide {
  std::vector<Ball> balls;
  /// One label per ball; labels with equal numbers match (morph/labels.h). Empty: no labels.
  std::vector<std::int32_t> labels;
  std::vector<Vec3> landmarks;  ///< both sides list them in the same order
  /// Azimuth of the object's front, radians from +z towards +x; nullopt if unknown.
  std::optional<double> front = {};
  std::string name = {};  ///< shown when the cache is listed; the plan does not depend on it
};

/// Delay and inertia of a pair.
struct PairTiming {
  float delay = 0;    ///< due to stagger, in the motion's time, [0, stagger_share]
  float inertia = 1;  ///< factor of the spring's mass; about 1 in the mean
};

/// A point of the source and the point of the target that it becomes.
struct PlanLandmark {
  Vec3 from, to;
  std::uint32_t pair = 0;  ///< index of the pair with which it moves, which is near at both ends
};

/// A limb's centre line, from its root to its tip.
struct LimbCurve {
  static constexpr std::size_t kPoints = 9;
  std::array<Vec3, kPoints> points;
  std::array<float, kPoints> radii;  ///< half the limb's thickness
};

/// One object's limbs for the smooth map's samples (morph/limb_samples.h). If all members are
/// empty, the map has samples of balls only.
struct LimbCurves {
  std::vector<LimbCurve> matched;        ///< one per matched pair of limbs
  std::vector<LimbCurve> lone;           ///< limbs without a counterpart
  std::vector<Vec3> counterparts;        ///< per lone limb, the root's target on the other surface
  std::vector<std::int32_t> lone_limbs;  ///< per ball, the index in `lone`, or kNoLabel
  std::vector<float> stations;  ///< per ball, its position along its limb, [0, 1]; 0 on the body
};

class BallGraph;  // morph/parts.h

/// A correspondence between two objects' balls, with the motion along it.
struct MorphPlan {
  FieldKind kind = FieldKind::kGaussian;
  std::vector<Ball> from, to;
  std::vector<std::int32_t> from_labels, to_labels;  ///< empty or one per ball
  /// Per ball, the index of the matched pair of limbs that it belongs to, or kNoLabel
  /// (morph/limb_plan.h). Empty if the plan does not use limbs.
  std::vector<std::int32_t> from_limbs, to_limbs;
  /// Names of limbs on the source and on the target: first of matched limbs, then of limbs without
  /// a counterpart, whose other name is empty.
  std::vector<std::pair<std::string, std::string>> limb_names;
  LimbCurves from_curves, to_curves;
  /// The roots of the lone limbs of `from`, then of `to`, each with its counterpart.
  std::vector<PlanLandmark> lone_roots;
  std::vector<double> from_masses, to_masses;  ///< ball_masses() of each
  std::vector<Pair> pairs;
  std::vector<PlanLandmark> landmarks;
  Alignment alignment;
  MotionSettings motion;
  /// Rotations and scalings: one for all balls, or, on path `parts`, one per part.
  std::vector<Alignment> parts;
  std::shared_ptr<const BallGraph> graph;  ///< joins the parts; null unless the path is `parts`
  /// The paths of the balls, one per pair. Changed paths are always a new object.
  std::shared_ptr<const BallPaths> paths;
  std::vector<PairTiming> timing;  ///< one per pair
  /// Leads of the smooth map (morph/smooth_map.h: compute_leads), one per pair; empty: none.
  std::vector<float> leads;
  /// Registration offsets a_e and b_e of each pair (leg/registration.h): at eased time u the smooth
  /// map uses p_e + u a_e on the source and q_e + (1-u) b_e on the target. Empty: none.
  std::vector<Vec3> from_offsets, to_offsets;
  /// Element k is the eased time at which the fraction k / (size - 1) of the total change is done;
  /// increasing from 0 to 1 (leg/pacing.h). Empty: no pacing. Used only if all balls share one
  /// eased time.
  std::vector<float> pacing;
  /// Element k is the height by which all balls are raised when the fraction k / (size - 1) of the
  /// total change is done; 0 at both ends (leg/pacing.h). Empty: none. Used only if all balls share
  /// one eased time.
  std::vector<float> lifts;
  double size = 1;   ///< geometric mean of both objects' RMS sizes
  double floor = 0;  ///< height of the lowest ball's centre in either object
};

/// Plans the morph between two objects, each of at least one ball. Deterministic; the plan by
/// PlanMethod::kIndex also depends on the seed. The plan from `to` to `from` is the same with its
/// ends swapped. Correspondences are cached in the folder `cache` (morph/plan_cache.h); if it is
/// empty, there is no cache.
MorphPlan plan_morph(PlanSide from, PlanSide to, FieldKind kind, const PlanSettings& settings,
                     const MotionSettings& motion = {}, const std::filesystem::path& cache = {});

/// Tests whether the plan has curves of its limbs.
bool has_curves(const MorphPlan& plan);
/// Tests whether one of a pair's balls belongs to a lone limb (LimbCurves::lone).
bool is_lone(const MorphPlan& plan, const Pair& pair);

/// Swaps the ends of a plan's balls, labels, limbs, pairs and alignment. Landmarks, paths and
/// everything derived from the paths stay unchanged.
void swap_ends(MorphPlan& plan);

}  // namespace polymorph
