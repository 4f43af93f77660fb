// A plan's cost and masses where two objects' limbs are matched: places are carried from limb to
// limb, and each limb gets as much mass as it gives (docs/method.md, Limbs).
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

/// Two objects' limbs and which becomes which.
struct LimbPlan {
  Limbs from, to;
  LimbChoices choices = {};
  LimbMatch match = {};  ///< the one that is planned by
  /// Limbs that carry a label which no limb of the other object carries: they become what has it
  /// there, and are not lone.
  std::vector<std::uint32_t> from_labelled = {}, to_labelled = {};
  /// Turns, radians, from which match_at() has searched, with what it found.
  std::vector<std::pair<double, LimbMatch>> searched = {};
};

/// Finds the limbs of both sides. What the sides' labels (unless LabelMode::kOff) and landmarks say
/// is heeded: limbs of other labels, or of which one alone holds a landmark, may not be matched.
/// Two that hold the same landmarks are matched, then limbs that carry the same label; if nothing
/// but equal names in both files says so (PlanSettings::labels is empty), only in a certain match.
LimbPlan find_limbs_of_sides(const PlanSide& from, const PlanSide& to,
                             const PlanSettings& settings);

/// Matches the limbs from a turn about the vertical, in radians; once for each turn.
LimbMatch match_at(LimbPlan& plan, double angle);

/// Carries an object's balls into the shape of another. A ball of a matched limb keeps its share of
/// the length of the centre line and, by the limb's thickness, its offset from it; the others
/// follow the displacements of the centre and of the matched limbs' roots. `matched`: from `own` to
/// `other`, which lies turned by `angle`.
std::vector<Vec3d> warped_places(const std::vector<Ball>& balls, const Limbs& own,
                                 const Limbs& other, std::span<const MatchedLimbs> matched,
                                 double angle);

/// The number of the matched pair of limbs that each ball belongs to, or kNoLabel.
std::vector<std::int32_t> limb_labels(const Limbs& limbs, std::span<const std::uint32_t> matched);

/// Scales the masses of each matched limb, and those of all the rest, to the geometric mean of
/// their shares in both objects: a big head need not be fed from the other's chest.
std::pair<std::vector<double>, std::vector<double>> balance_masses(
    std::span<const double> from, std::span<const std::int32_t> from_limbs,
    std::span<const double> to, std::span<const std::int32_t> to_limbs);

/// Makes the sides whose costs are half the squared distances that the carried places leave either
/// way, each over the object's size, with the distances from the centres and to the landmarks.
/// `from_side`, `to_side`: as without limbs, for masses, labels and landmarks.
std::pair<CostSide, CostSide> limb_cost_sides(const LimbPlan& limbs, const std::vector<Ball>& from,
                                              const std::vector<Ball>& to,
                                              const CostSide& from_side, const CostSide& to_side);

/// The curves of both objects' limbs, by the match that is planned by.
std::pair<LimbCurves, LimbCurves> find_limb_curves(const LimbPlan& limbs,
                                                   const std::vector<Ball>& from,
                                                   const std::vector<Ball>& to);

/// Pairs the balls that belong to no lone limb, by transport.
std::vector<Pair> pair_bodies(const CostPair& sides, LabelMode mode, const LimbCurves& from,
                              const LimbCurves& to);

/// Adds the balls of lone limbs to a plan of the others, whose masses are set: each with the ball
/// of the other object's body that is nearest to its limb's counterpart, next to none of which it
/// becomes. Such pairs weigh next to nothing.
void add_lone_pairs(MorphPlan& plan);

/// Lists the names of limbs that become each other; an empty name is nothing.
std::vector<std::pair<std::string, std::string>> list_limb_names(const LimbPlan& limbs,
                                                                 double angle = 0);

}  // namespace polymorph
