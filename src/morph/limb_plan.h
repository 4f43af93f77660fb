// Transport cost, masses and curves for two objects whose limbs are matched. Balls are warped along
// matched limbs into the other object's shape, and both limbs of a match get the same mass
// (docs/method.md, Limbs).
#pragma once

#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "morph/cost.h"
#include "morph/limbs.h"
#include "morph/match_limbs.h"
#include "morph/pairing.h"
#include "morph/plan.h"

namespace polymorph {

/// Limbs of two objects, `from` and `to`, with their match.
struct LimbPlan {
  Limbs from, to;
  LimbChoices choices = {};  ///< choices by the user's labels and landmarks
  LimbMatch match = {};      ///< match that the plan uses; set by the caller
  /// Limbs that carry a label which no limb of the other object carries, only its body. They become
  /// that part of the body, so they are not lone limbs (LimbCurves::lone).
  std::vector<std::uint32_t> from_unmatched_label_limbs = {}, to_unmatched_label_limbs = {};
  /// Results of match_at(): the angles at which it was called, radians, and the matches.
  std::vector<std::pair<double, LimbMatch>> matches_by_angle = {};
};

/// Finds the limbs of both sides and the user's choices about them; does not match them. Landmarks
/// and labels (unless the mode is LabelMode::kOff) restrict the match in two ways. A limb that
/// carries one label is not matched with a limb of another label, nor a limb that holds a landmark
/// with one that does not hold it. Limbs that hold the same landmarks are matched with each other,
/// and so are limbs that carry the same label. If PlanSettings::labels is empty, labels match
/// merely because both files use the same names; such choices count only in a certain match
/// (is_certain()).
LimbPlan find_limbs_of_sides(const PlanSide& from, const PlanSide& to,
                             const PlanSettings& settings);

/// Matches the limbs, starting from a rotation of `from` by `angle` radians about the vertical
/// (match_limbs()). Stores the result in `plan.matches_by_angle`, so that each angle is computed
/// once.
LimbMatch match_at(LimbPlan& plan, double angle);

/// Warps the balls of the object `own` into the shape of the object `other`; returns their centres
/// there. A ball on a matched limb keeps its position along the limb's length, and its offset from
/// the centre line is scaled by the ratio of the limbs' radii. Other balls move with the object's
/// centre and the roots of the matched limbs, weighted by nearness. `matched`: pairs of limbs of
/// `own` (`from`) and `other` (`to`). `angle`: rotation about the vertical from `own` to `other`,
/// radians.
std::vector<Vec3d> warp_balls(const std::vector<Ball>& balls, const Limbs& own, const Limbs& other,
                              std::span<const MatchedLimbs> matched, double angle);

/// Computes for each ball the position in the list `matched` of the limb that it belongs to, or
/// kNoLabel. `matched`: indices of limbs in `limbs`. If the lists of both objects have matched
/// limbs at equal positions, the balls of matched limbs get equal indices.
std::vector<std::int32_t> limb_indices_of_balls(const Limbs& limbs,
                                                std::span<const std::uint32_t> matched);

/// Scales the masses of each matched limb so that its share of the total mass is the same in both
/// objects: the geometric mean of its two shares. The balls on no matched limb are scaled in the
/// same way. Transport then moves no mass from one limb to another: a big head takes none from the
/// other object's chest. `from_limbs`, `to_limbs`: limb_indices_of_balls().
std::pair<std::vector<double>, std::vector<double>> balance_masses(
    std::span<const double> from, std::span<const std::int32_t> from_limbs,
    std::span<const double> to, std::span<const std::int32_t> to_limbs);

/// Makes the sides of the transport problem with limbs. The cost of balls p and q is half the
/// squared distance between warp_balls() of p and q, plus half the squared distance between p and
/// the warped q, each relative to the object's RMS size. The squared differences of the geodesic
/// distances from the centres (weight 0.3) and of the distances to the landmarks are added.
/// `from_side`, `to_side`: the sides without limbs (make_cost_side()), of which masses, labels and
/// landmarks are used.
std::pair<CostSide, CostSide> limb_cost_sides(const LimbPlan& limbs, const std::vector<Ball>& from,
                                              const std::vector<Ball>& to,
                                              const CostSide& from_side, const CostSide& to_side);

/// Computes the centre lines of both objects' matched limbs and lone limbs (those without a
/// counterpart), by `limbs.match`.
std::pair<LimbCurves, LimbCurves> find_limb_curves(const LimbPlan& limbs,
                                                   const std::vector<Ball>& from,
                                                   const std::vector<Ball>& to);

/// Pairs the balls that belong to no lone limb, by pair_by_transport(). `from`, `to`: the objects'
/// curves, which list the lone limbs' balls.
std::vector<Pair> pair_bodies(const CostPair& sides, LabelMode mode, const LimbCurves& from,
                              const LimbCurves& to);

/// Adds pairs for the balls of lone limbs to a plan whose other pairs have their masses already.
/// Each such ball is paired with the ball of the other object's body that is nearest to its limb's
/// counterpart (LimbCurves::counterparts). The pair has a share of 1e-4 of the body's ball and a
/// mass of 1e-6, so that it does not change the body.
void add_lone_pairs(MorphPlan& plan);

/// Lists pairs of limb names (limb_names.h), of `from` and of `to`: first of matched limbs, then of
/// leaves of the merge tree (Limb::nested) without a counterpart, whose other name is empty.
/// `angle`: rotation about the vertical from `from` to `to`, radians.
std::vector<std::pair<std::string, std::string>> list_limb_names(const LimbPlan& limbs,
                                                                 double angle = 0);

}  // namespace polymorph
