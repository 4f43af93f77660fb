#include "morph/match_limbs.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <optional>

#include "base/exact_math.h"
#include "base/parallel.h"

namespace polymorph {
namespace {

// Weights of the terms in the cost of a pair of limbs (pair_cost()), which compare Features.
constexpr double kTip = 0.15, kRoot = 0.5, kDirection = 0.6, kLength = 0.25, kThickness = 0.15,
                 kVolume = 0.05, kDepth = 0.5, kTipHeight = 0.6, kRootHeight = 1.2, kToe = 0.4;
constexpr double kFloorCost = 1.2;  // cost of a limb on the floor with one that is not
/// Weights of the terms in the cost of two pairs together: the difference of the tips' geodesic
/// distances, and the angle between the directions from root to root.
constexpr double kTipDistances = 0.6, kRootDirections = 0.4;
/// Max cost of two limbs whose roots change sides. Running legs cross, but their roots do not.
constexpr double kCrossingCost = 1;
/// Cost of a limb that stays alone, per unit of Features::stretch; factor of this cost for a limb
/// that sits on a matched one; max Features::stretch.
constexpr double kAloneCost = 1.6, kNestedFactor = 0.6, kMaxStretch = 1.2;
constexpr double kChoiceCost = 1000;  // cost of each pair fewer than the user has chosen
constexpr double kTurnCost = 1;       // an angle d from the given one costs kTurnCost (1 - cos d)
constexpr double kMaxFloorHeight = 0.15;      // max relative height of a tip that is on the floor
constexpr std::size_t kBeamWidth = 150;       // width of the beam: partial matchings kept per step
constexpr int kStartAngles = 8, kRounds = 4;  // start angles; refinements of each
/// Max number of repeated searches, each without the matches of the one before that split twins
/// (splits_twins()).
constexpr int kSplitTwinRounds = 4;
/// Min number of matched limbs, and min fraction of their length, of a certain match.
constexpr std::size_t kMinLimbs = 3;
constexpr double kMinMatchedShare = 0.75;

double square(double a) { return a * a; }
double square(Vec3d a) { return dot(a, a); }

Vec3d rotate_about_y(Vec3d p, double sine, double cosine) {
  return {cosine * p.x + sine * p.z, p.y, cosine * p.z - sine * p.x};
}

/// The properties of a limb that are compared. Points are in unit-RMS coordinates, heights relative
/// to the object's height, other lengths relative to the mean geodesic distance from the centre.
struct Features {
  Vec3d tip, root, direction, toe;  // toe: direction of the last segment
  // depth: distance of the tip from the centre.
  double log_length = 0, depth = 0, log_volume = 0, tip_height = 0, root_height = 0;
  double stretch = 0;                      // Limb::stretch, at most kMaxStretch
  std::optional<std::size_t> choice = {};  // the user's choice that the limb belongs to
  std::array<double, kLimbStations> log_radii{};
  std::uint32_t nested = 0, enclosing = 0;  // masks: limbs that sit on it, limbs that it sits on
  bool on_floor = false;
};

std::vector<Features> compute_features(const Limbs& limbs) {
  std::vector<Features> features;
  const auto height = [&](Vec3d p) {
    return (p.y - limbs.low) / std::max(limbs.high - limbs.low, 1e-9);
  };
  const auto normalize = [&](Vec3d p) { return (p - limbs.middle) * (1 / limbs.rms); };
  for (const Limb& limb : limbs.limbs) {
    Features f;
    f.tip = normalize(limb.tip());
    f.root = normalize(limb.root);
    f.direction = normalized(limb.tip() - limb.line.front());
    f.toe = normalized(limb.tip() - limb.line[kLimbStations - 2]);
    f.log_length = exact::log(std::max(limb.length() / limbs.mean_distance, 1e-6));
    f.depth = limb.tip_distance / limbs.mean_distance;
    f.log_volume = exact::log(std::max(limb.volume, 1e-9));
    f.tip_height = height(limb.tip());
    f.root_height = height(limb.root);
    f.stretch = std::min(limb.stretch / limbs.mean_distance, kMaxStretch);
    for (std::size_t k = 0; k < kLimbStations; ++k)
      f.log_radii[k] = exact::log(std::max(limb.radius[k] / limbs.mean_distance, 1e-6));
    for (const std::uint32_t i : limb.nested) f.nested |= 1u << i;
    f.on_floor = f.tip_height < kMaxFloorHeight;
    features.push_back(f);
  }
  for (std::size_t i = 0; i < features.size(); ++i)
    for (std::size_t k = 0; k < features.size(); ++k)
      if (features[i].nested >> k & 1) features[k].enclosing |= 1u << i;
  return features;
}

/// Two objects' limbs, to be matched.
struct Problem {
  const Limbs &from, &to;
  const LimbChoices& choices;
  AllowedLimbs allowed;
  std::vector<Features> a, b;
  /// Indices of `a` in the order of the search: the user's chosen limbs first, then by the number
  /// of limbs on them, then by length, both descending.
  std::vector<std::uint32_t> order;
};

bool is_allowed(const Problem& problem, std::size_t i, std::size_t k) {
  // Limbs of a choice are matched only with each other.
  if (problem.a[i].choice != problem.b[k].choice) return false;
  return problem.allowed.empty() || problem.allowed[i][k] != 0;
}

/// The cost of matching two limbs, with `a` rotated.
double pair_cost(const Features& a, const Features& b, double sine, double cosine) {
  const auto rotate = [&](Vec3d p) { return rotate_about_y(p, sine, cosine); };
  double cost = kTip * square(rotate(a.tip) - b.tip) + kRoot * square(rotate(a.root) - b.root) +
                kDirection * (1 - dot(rotate(a.direction), b.direction)) +
                kLength * square(a.log_length - b.log_length) +
                kVolume * square(a.log_volume - b.log_volume) + kDepth * square(a.depth - b.depth) +
                kTipHeight * square(a.tip_height - b.tip_height) +
                kRootHeight * square(a.root_height - b.root_height);
  double thickness = 0;
  for (std::size_t k = 0; k < kLimbStations; ++k)
    thickness += square(a.log_radii[k] - b.log_radii[k]);
  cost += kThickness / static_cast<double>(kLimbStations) * thickness;
  if (a.on_floor != b.on_floor) cost += kFloorCost;
  if (a.on_floor && b.on_floor) cost += kToe * (1 - dot(rotate(a.toe), b.toe));
  return cost;
}

/// A matching of some of the limbs.
struct Partial {
  double cost = 0;
  std::uint32_t from = 0, to = 0;  // masks of the matched limbs
  std::vector<MatchedLimbs> limbs;
};

/// The cost of leaving a limb alone. `matched`: mask of its object's matched limbs.
double alone_cost(const Features& limb, std::uint32_t matched) {
  return kAloneCost * limb.stretch * (limb.enclosing & matched ? kNestedFactor : 1);
}
/// The cost of a limb that is not matched: 0 if a limb that sits on it is matched in its place.
double unmatched_cost(const Features& limb, std::uint32_t matched) {
  return !(limb.enclosing & matched) && (limb.nested & matched) ? 0 : alone_cost(limb, matched);
}

/// Tests whether a choice of the user gets one pair fewer if the limb at `position` of the order
/// stays alone. It does if the choice has no more limbs of `a` from there on than unmatched limbs
/// of `b`.
bool breaks_choice(const Problem& problem, const Partial& partial, std::size_t position) {
  const std::optional<std::size_t> choice = problem.a[problem.order[position]].choice;
  if (!choice) return false;
  const std::vector<std::uint32_t>& others = problem.choices.chosen[*choice].to;
  const auto limbs_left = std::count_if(
      problem.order.begin() + static_cast<std::ptrdiff_t>(position), problem.order.end(),
      [&](std::uint32_t i) { return problem.a[i].choice == choice; });
  const auto unmatched = std::count_if(others.begin(), others.end(),
                                       [&](std::uint32_t k) { return (partial.to >> k & 1) == 0; });
  return limbs_left <= unmatched;
}

/// Degree to which two horizontal offsets between roots are opposite, [0, 1]. Offsets shorter than
/// 0.3 RMS sizes count less.
double crossing(Vec3d a, Vec3d b) {
  constexpr double kMinOffset = 0.3;
  a.y = b.y = 0;
  return std::max(0.0, -dot(a, b)) /
         (std::max(length(a), kMinOffset) * std::max(length(b), kMinOffset));
}

/// The cost that two limbs, if matched, cause together with the pairs that `partial` matches
/// already.
double interaction_cost(const Problem& problem, const Partial& partial, MatchedLimbs limbs,
                        double sine, double cosine) {
  if (partial.limbs.empty()) return 0;
  double tip_distances = 0, roots = 0, crossings = 0;
  for (const MatchedLimbs& other : partial.limbs) {
    tip_distances +=
        square(problem.from.tip_distances[limbs.from][other.from] / problem.from.mean_distance -
               problem.to.tip_distances[limbs.to][other.to] / problem.to.mean_distance);
    const Vec3d a = rotate_about_y(problem.a[limbs.from].root - problem.a[other.from].root, sine,
                                   cosine),
                b = problem.b[limbs.to].root - problem.b[other.to].root;
    roots += (1 - dot(normalized(a), normalized(b))) / 2;
    crossings += crossing(a, b);
  }
  return kTipDistances * tip_distances / static_cast<double>(partial.limbs.size()) +
         kRootDirections * roots + kCrossingCost * crossings;
}

/// The cheapest matching found by beam search at a rotation about the vertical.
Partial search_matching(const Problem& problem, double angle) {
  const double sine = exact::sin(angle), cosine = exact::cos(angle);
  // Each step decides about one limb of `a`. Every matching of the beam has one continuation that
  // leaves this limb alone, and one for each limb of `b` that it may be matched with.
  std::vector<Partial> beam(1), next;
  for (std::size_t position = 0; position < problem.order.size(); ++position) {
    const std::uint32_t i = problem.order[position];
    const Features& a = problem.a[i];
    std::vector<double> pair_costs;
    for (const Features& b : problem.b) pair_costs.push_back(pair_cost(a, b, sine, cosine));
    next.clear();
    for (const Partial& partial : beam) {
      next.push_back(partial);
      // The cost of a limb that others sit on is known only at the end (unmatched_cost()).
      if (a.nested == 0) next.back().cost += alone_cost(a, partial.from);
      if (breaks_choice(problem, partial, position)) next.back().cost += kChoiceCost;
      if (a.enclosing & partial.from) continue;  // sits on a matched limb
      for (std::uint32_t k = 0; k < problem.b.size(); ++k) {
        const Features& b = problem.b[k];
        // Skip a limb k that is matched, sits on a matched limb or has one on it, and a pair that
        // is not allowed.
        if (((b.enclosing | b.nested | 1u << k) & partial.to) != 0 || !is_allowed(problem, i, k))
          continue;
        Partial extended = partial;
        extended.cost += pair_costs[k] + interaction_cost(problem, partial, {i, k}, sine, cosine);
        extended.from |= 1u << i;
        extended.to |= 1u << k;
        extended.limbs.push_back({i, k});
        next.push_back(std::move(extended));
      }
    }
    const std::size_t count = std::min(kBeamWidth, next.size());
    std::stable_sort(next.begin(), next.end(),
                     [](const Partial& p, const Partial& q) { return p.cost < q.cost; });
    next.resize(count);
    std::swap(beam, next);
  }
  // Add the costs that only complete matchings have, and choose the cheapest.
  const Partial* best = nullptr;
  for (Partial& partial : beam) {
    for (const Features& b : problem.b)
      if (!(partial.to >> (&b - problem.b.data()) & 1))
        partial.cost += unmatched_cost(b, partial.to);
    for (const Features& a : problem.a)
      if (a.nested != 0 && !(partial.from >> (&a - problem.a.data()) & 1))
        partial.cost += unmatched_cost(a, partial.from);
    if (!best || partial.cost < best->cost) best = &partial;
  }
  return *best;
}

/// The rotation that best aligns the matched limbs: weighted Procrustes about the vertical,
/// radians.
double fit_angle(const Problem& problem, const std::vector<MatchedLimbs>& limbs) {
  constexpr double kTipWeight = 0.16;  // roots have the weight 1
  double sine = 0, cosine = 0;
  const auto add = [&](Vec3d p, Vec3d q, double weight) {
    sine += weight * (q.x * p.z - q.z * p.x);
    cosine += weight * (q.x * p.x + q.z * p.z);
  };
  for (const auto& [i, k] : limbs) {
    add(problem.a[i].tip, problem.b[k].tip, kTipWeight);
    add(problem.a[i].root, problem.b[k].root, 1);
  }
  return exact::atan2(sine, cosine);
}

/// A matching, and the angle at which it was found.
struct MatchingFit {
  Partial matching;
  double angle = 0;
};

/// Alternates between matching and Procrustes from the angle `start`, until the cost stops falling.
/// `plan_angle`: the angle to which kTurnCost relates.
MatchingFit fit_from(const Problem& problem, double start, double plan_angle) {
  constexpr double kMinGain = 1e-6;
  std::optional<MatchingFit> best;
  double angle = start;
  for (int round = 0; round < kRounds; ++round) {
    Partial matching = search_matching(problem, angle);
    matching.cost += kTurnCost * (1 - exact::cos(angle - plan_angle));
    if (best && !(matching.cost < best->matching.cost - kMinGain)) break;
    best = MatchingFit{std::move(matching), angle};
    if (best->matching.limbs.empty()) break;
    angle = fit_angle(problem, best->matching.limbs);
  }
  return *best;
}

/// Tests whether two limbs of one object have nearly the same size and height, as two arms or legs
/// do.
bool are_twins(const Features& a, const Features& b) {
  // Max differences between twins' features.
  constexpr double kMaxLogLength = 0.2, kMaxDepth = 0.15, kMaxLogVolume = 0.4, kMaxTipHeight = 0.15,
                   kMaxRootHeight = 0.1;
  return std::fabs(a.log_length - b.log_length) < kMaxLogLength &&
         std::fabs(a.depth - b.depth) < kMaxDepth &&
         std::fabs(a.log_volume - b.log_volume) < kMaxLogVolume &&
         std::fabs(a.tip_height - b.tip_height) < kMaxTipHeight &&
         std::fabs(a.root_height - b.root_height) < kMaxRootHeight;
}

/// Lists the twins of a limb that are neither matched nor sit on a matched limb. `matched`: mask of
/// the object's matched limbs.
std::vector<std::uint32_t> list_unmatched_twins(const std::vector<Features>& all, std::size_t limb,
                                                std::uint32_t matched) {
  std::vector<std::uint32_t> twins;
  for (std::uint32_t k = 0; k < all.size(); ++k)
    if (k != limb && all[k].nested == 0 &&
        ((all[k].enclosing | all[k].nested | 1u << k) & matched) == 0 &&
        are_twins(all[limb], all[k]))
      twins.push_back(k);
  return twins;
}

/// Tests whether a limb on the floor is matched with one that is not, or the other way round.
bool crosses_floor(const Problem& problem, const MatchedLimbs& limbs) {
  return problem.a[limbs.from].on_floor != problem.b[limbs.to].on_floor;
}

/// Tests whether a match separates a limb from its twin: the limb is matched with one that other
/// limbs sit on, while the twin stays alone or is matched across the floor (crosses_floor()). For
/// example, one of two legs becomes both legs under a cape.
bool splits_twins(const Problem& problem, const Partial& matching, const MatchedLimbs& limbs) {
  const Features &a = problem.a[limbs.from], &b = problem.b[limbs.to];
  if ((a.nested == 0) == (b.nested == 0)) return false;
  const bool is_from = a.nested == 0;
  const std::vector<Features>& side = is_from ? problem.a : problem.b;
  const std::size_t limb = is_from ? limbs.from : limbs.to;
  if (!list_unmatched_twins(side, limb, is_from ? matching.from : matching.to).empty()) return true;
  return std::any_of(matching.limbs.begin(), matching.limbs.end(), [&](const MatchedLimbs& other) {
    const std::size_t twin = is_from ? other.from : other.to;
    return twin != limb && crosses_floor(problem, other) && are_twins(side[limb], side[twin]);
  });
}

/// Forbids the matches of `matching` that split twins, except those that the user has chosen. Also
/// forbids all matches of a limb on the floor with one that is not: such a match, an arm with a
/// leg, would otherwise replace the forbidden one. Returns false, and forbids nothing, if no match
/// splits twins.
bool forbid_split_twins(Problem& problem, const Partial& matching) {
  AllowedLimbs allowed = problem.allowed;
  if (allowed.empty())
    allowed.assign(problem.a.size(), std::vector<std::uint8_t>(problem.b.size(), 1));
  bool splits_any = false;
  for (const MatchedLimbs& pair : matching.limbs) {
    if (problem.a[pair.from].choice || !splits_twins(problem, matching, pair)) continue;
    allowed[pair.from][pair.to] = 0;
    splits_any = true;
  }
  if (!splits_any) return false;
  for (std::size_t i = 0; i < problem.a.size(); ++i)
    for (std::size_t k = 0; k < problem.b.size(); ++k)
      if (!problem.a[i].choice && problem.a[i].on_floor != problem.b[k].on_floor) allowed[i][k] = 0;
  problem.allowed = std::move(allowed);
  return true;
}

/// Extends a matching by twins. If each of two matched limbs has exactly one twin that stays alone,
/// and these lie on corresponding sides, they are matched: the second legs of two figures.
void match_twins(const Problem& problem, MatchingFit& fit) {
  constexpr double kMaxCrossing = 0.5;
  const double sine = exact::sin(fit.angle), cosine = exact::cos(fit.angle);
  Partial& matching = fit.matching;
  for (const auto& [i, k] : std::vector(matching.limbs)) {
    const std::vector<std::uint32_t> from = list_unmatched_twins(problem.a, i, matching.from),
                                     to = list_unmatched_twins(problem.b, k, matching.to);
    if (problem.a[i].nested != 0 || problem.b[k].nested != 0 || from.size() != 1 ||
        to.size() != 1 || !is_allowed(problem, from[0], to[0]))
      continue;
    const Features &a = problem.a[from[0]], &b = problem.b[to[0]];
    if (crossing(rotate_about_y(a.root - problem.a[i].root, sine, cosine),
                 b.root - problem.b[k].root) > kMaxCrossing)
      continue;
    matching.cost += pair_cost(a, b, sine, cosine) +
                     interaction_cost(problem, matching, {from[0], to[0]}, sine, cosine) -
                     alone_cost(a, matching.from) - alone_cost(b, matching.to);
    matching.from |= 1u << from[0];
    matching.to |= 1u << to[0];
    matching.limbs.push_back({from[0], to[0]});
  }
}

/// Finds the cheapest matching from kStartAngles angles.
MatchingFit find_matching(const Problem& problem, double angle) {
  std::array<MatchingFit, kStartAngles> fits;
  parallel_for(kStartAngles, [&](std::int64_t k) {
    const double start = angle + 2 * exact::kPi * static_cast<double>(k) / kStartAngles;
    fits[static_cast<std::size_t>(k)] = fit_from(problem, start, angle);
  });
  const MatchingFit* best = &fits[0];
  for (const MatchingFit& fit : fits)
    if (fit.matching.cost < best->matching.cost) best = &fit;
  return *best;
}

/// Total length of the limbs that no other limb sits on, and the length of the ones among them that
/// are matched or sit on a matched limb.
struct Lengths {
  double total = 0, matched = 0;
};
Lengths sum_lengths(const Limbs& limbs, const std::vector<Features>& features,
                    std::uint32_t matched) {
  Lengths lengths;
  for (std::size_t i = 0; i < features.size(); ++i) {
    if (features[i].nested != 0) continue;
    const double length = limbs.limbs[i].stretch / limbs.mean_distance;
    lengths.total += length;
    if ((features[i].enclosing | 1u << i) & matched) lengths.matched += length;
  }
  return lengths;
}

}  // namespace

LimbMatch match_limbs(const Limbs& from, const Limbs& to, double angle,
                      const LimbChoices& choices) {
  // State the problem, and sort the limbs of `from` into the order of the search.
  Problem problem = {
      from,        to, choices, choices.allowed, compute_features(from), compute_features(to),
      /*order=*/{}};
  for (std::size_t n = 0; n < choices.chosen.size(); ++n) {
    for (const std::uint32_t i : choices.chosen[n].from) problem.a[i].choice = n;
    for (const std::uint32_t k : choices.chosen[n].to) problem.b[k].choice = n;
  }
  for (std::uint32_t i = 0; i < problem.a.size(); ++i) problem.order.push_back(i);
  std::stable_sort(
      problem.order.begin(), problem.order.end(), [&](std::uint32_t i, std::uint32_t k) {
        const Features &a = problem.a[i], &b = problem.a[k];
        if (a.choice.has_value() != b.choice.has_value()) return a.choice.has_value();
        const int limbs_on_a = std::popcount(a.nested), limbs_on_b = std::popcount(b.nested);
        return limbs_on_a != limbs_on_b ? limbs_on_a > limbs_on_b : a.stretch > b.stretch;
      });
  // Search, and repeat the search without matches that split twins, so that each twin may find a
  // counterpart of its own.
  MatchingFit best = find_matching(problem, angle);
  for (int round = 0; round < kSplitTwinRounds && forbid_split_twins(problem, best.matching);
       ++round)
    best = find_matching(problem, angle);
  match_twins(problem, best);
  // Drop the matches that still split twins.
  LimbMatch match;
  match.limbs = best.matching.limbs;
  std::erase_if(match.limbs, [&](const MatchedLimbs& pair) {
    return !problem.a[pair.from].choice && splits_twins(problem, best.matching, pair);
  });
  std::sort(match.limbs.begin(), match.limbs.end(),
            [](const MatchedLimbs& p, const MatchedLimbs& q) { return p.from < q.from; });
  match.angle = exact::atan2(exact::sin(best.angle), exact::cos(best.angle));
  match.cost = best.matching.cost;
  const auto measure_share = [&] {
    std::uint32_t from_matched = 0, to_matched = 0;
    for (const auto& [i, k] : match.limbs) from_matched |= 1u << i, to_matched |= 1u << k;
    const Lengths a = sum_lengths(from, problem.a, from_matched),
                  b = sum_lengths(to, problem.b, to_matched);
    if (a.total + b.total > 0) match.share = (a.matched + b.matched) / (a.total + b.total);
  };
  measure_share();
  if (choices.chosen.empty()) return match;
  // Pairs that the user has not chosen are kept only if the match is certain without regard to the
  // choice.
  const auto is_users = [](const ChosenLimbs& choice) { return !choice.is_by_name; };
  if (!is_certain(match)) {
    std::erase_if(match.limbs, [&](const MatchedLimbs& pair) {
      const std::optional<std::size_t> choice = problem.a[pair.from].choice;
      return !choice || !is_users(choices.chosen[*choice]);
    });
    measure_share();
  }
  match.is_chosen = std::any_of(choices.chosen.begin(), choices.chosen.end(), is_users);
  return match;
}

bool is_certain(const LimbMatch& match) {
  if (match.is_chosen) return true;
  return match.limbs.size() >= kMinLimbs && match.share >= kMinMatchedShare;
}

bool is_complete(const LimbMatch& match) {
  constexpr double kRounding = 1e-9;
  return match.share >= 1 - kRounding;
}

}  // namespace polymorph
