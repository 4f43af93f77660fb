// Correspondence of two objects' limbs (partial matching by beam search, with a Gromov-Wasserstein
// term; docs/method.md, Limbs).
#pragma once

#include <cstdint>
#include <vector>

#include "morph/limbs.h"

namespace polymorph {

/// Limb `from` of the one object becomes limb `to` of the other.
struct MatchedLimbs {
  std::uint32_t from = 0, to = 0;
};

/// A partial matching of two objects' limbs.
struct LimbMatch {
  std::vector<MatchedLimbs> limbs;  ///< sorted by `from`
  double angle = 0;  ///< rotation about the vertical that takes `from` to `to`, radians
  double cost = 0;   ///< cost of the matching before pairs were dropped from it
  /// Matched length of both objects' limbs, over their total length; 0 if there are no limbs.
  double share = 0;
  bool is_chosen = false;  ///< the user has chosen some of the matches
};

/// Pairs of limbs that may be matched. allowed[i][k] is 0 where the user's labels or landmarks keep
/// limb i of `from` and limb k of `to` apart; if empty, all pairs are allowed.
using AllowedLimbs = std::vector<std::vector<std::uint8_t>>;

/// Limbs that become each other by the user's choice. A limb of `from` is matched only with limbs
/// of `to`, and vice versa. The side with fewer limbs determines the number of pairs; those that
/// cost least are chosen.
struct ChosenLimbs {
  std::vector<std::uint32_t> from, to;
  /// True if the choice follows merely from equal names in both files. It then counts only in a
  /// certain match (is_certain()).
  bool is_by_name = false;
};

/// Choices of the user about the match.
struct LimbChoices {
  AllowedLimbs allowed;
  /// No limb of an object is chosen twice, or together with a limb that it sits on. All pairs of
  /// limbs within a choice are allowed.
  std::vector<ChosenLimbs> chosen;
};

/// Finds the cheapest matching that a beam search yields from eight rotations about the vertical,
/// `angle` (radians) and every 45 degrees from there. No limb is matched twice, nor together with a
/// limb that it sits on. The cost compares the limbs' roots and tips, directions, lengths,
/// thicknesses, heights above the floor, and the geodesic distances between their tips. Parallel,
/// deterministic.
LimbMatch match_limbs(const Limbs& from, const Limbs& to, double angle = 0,
                      const LimbChoices& choices = {});

/// Tests whether a matching is reliable enough to plan by: it has at least three limbs and three
/// quarters of the limbs' length, or the user has chosen some of it.
bool is_certain(const LimbMatch& match);

/// Tests whether every limb of both objects has a counterpart, or sits on one that has.
bool is_complete(const LimbMatch& match);

}  // namespace polymorph
