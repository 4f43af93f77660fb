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

struct LimbMatch {
  std::vector<MatchedLimbs> limbs;  ///< sorted by `from`
  double angle = 0;                 ///< radians about the vertical that lay `from` on `to`
  double cost = 0;
  /// The share of both objects' limbs, by their length, that is matched.
  double share = 0;
  bool is_chosen = false;  ///< some of it is the user's choice
};

/// Pairs of limbs that may be matched: those that the user's labels and landmarks do not forbid.
/// allowed[i][k]: limb i of `from` with limb k of `to`; empty: all.
using AllowedLimbs = std::vector<std::vector<std::uint8_t>>;

/// Limbs that become each other by the user's choice. As many pairs of them are matched as the side
/// with fewer has limbs, those that cost least; with other limbs none is.
struct ChosenLimbs {
  std::vector<std::uint32_t> from, to;
};

/// Choices of the user about the match.
struct LimbChoices {
  AllowedLimbs allowed;
  /// No limb stands twice in them, nor one together with another that it sits on, and within a
  /// choice all pairs are allowed.
  std::vector<ChosenLimbs> chosen;
};

/// The cheapest matching that is found from eight turns about the vertical, `angle` (radians) among
/// them. No limb is matched twice, nor one together with another that it sits on. What decides is
/// where the limbs begin and end, which way they point, how long and thick they are, how high they
/// are above the floor, and how far along the body from each other. Deterministic.
LimbMatch match_limbs(const Limbs& from, const Limbs& to, double angle = 0,
                      const LimbChoices& choices = {});

/// True if a matching says enough to plan by: three limbs at least, and three quarters of their
/// length; or some that the user has chosen.
bool is_certain(const LimbMatch& match);

}  // namespace polymorph
