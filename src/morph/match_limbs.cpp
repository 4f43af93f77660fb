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

// Weights of the cost; lengths over the root mean square size or the mean way along the body.
constexpr double kTip = 0.15, kRoot = 0.5, kDirection = 0.6, kLength = 0.25, kThickness = 0.15,
                 kVolume = 0.05, kDepth = 0.5, kTipHeight = 0.6, kRootHeight = 1.2, kToe = 0.4;
constexpr double kFloor = 1.2;  // of a limb that stands on the floor with one that does not
constexpr double kBetween = 0.6, kRootsBetween = 0.4;  // to the other limbs that are matched
/// Cost of two limbs that change sides: legs cross when they run, their roots do not.
constexpr double kCrossed = 1;
/// Costs of a limb left alone, by its stretch, and of one that sits on a matched limb.
constexpr double kAlone = 1.6, kInner = 0.6, kLongest = 1.2;
constexpr double kChosen = 1000;    // of a pair fewer than the user has chosen
constexpr double kTurn = 1;         // of another turn than the one given
constexpr double kOnFloor = 0.15;   // height of a toe
constexpr std::size_t kBeam = 150;  // partial matchings that are followed
constexpr int kTurns = 8, kRounds = 4;
/// is_certain()
constexpr std::size_t kMinLimbs = 3;
constexpr double kMinMatchedShare = 0.75;

double square(double a) { return a * a; }
double square(Vec3d a) { return dot(a, a); }

Vec3d rotate_place(Vec3d p, double sine, double cosine) {
  return {cosine * p.x + sine * p.z, p.y, cosine * p.z - sine * p.x};
}

/// The properties of a limb that are compared.
struct Features {
  Vec3d tip, root, direction, toe;
  double length = 0, depth = 0, volume = 0, tip_height = 0, root_height = 0;
  double stretch = 0;
  std::optional<std::size_t> choice = {};         // the user's choice that the limb belongs to
  std::array<double, kLimbStations> thickness{};  // logarithms
  std::uint32_t inner = 0, outer = 0;             // masks: limbs on it, limbs that it is on
  bool on_floor = false;
};

std::vector<Features> compute_features(const Limbs& limbs) {
  std::vector<Features> all;
  const auto height = [&](Vec3d p) {
    return (p.y - limbs.low) / std::max(limbs.high - limbs.low, 1e-9);
  };
  const auto place = [&](Vec3d p) { return (p - limbs.middle) * (1 / limbs.rms); };
  for (const Limb& limb : limbs.limbs) {
    Features f;
    f.tip = place(limb.tip());
    f.root = place(limb.root);
    f.direction = normalized(limb.tip() - limb.line.front());
    f.toe = normalized(limb.tip() - limb.line[kLimbStations - 2]);
    f.length = exact::log(std::max(limb.length() / limbs.size, 1e-6));
    f.depth = limb.tip_distance / limbs.size;
    f.volume = exact::log(std::max(limb.volume, 1e-9));
    f.tip_height = height(limb.tip());
    f.root_height = height(limb.root);
    f.stretch = std::min(limb.stretch / limbs.size, kLongest);
    for (std::size_t k = 0; k < kLimbStations; ++k)
      f.thickness[k] = exact::log(std::max(limb.radius[k] / limbs.size, 1e-6));
    for (const std::uint32_t i : limb.inner) f.inner |= 1u << i;
    f.on_floor = f.tip_height < kOnFloor;
    all.push_back(f);
  }
  for (std::size_t i = 0; i < all.size(); ++i)
    for (std::size_t k = 0; k < all.size(); ++k)
      if (all[i].inner >> k & 1) all[k].outer |= 1u << i;
  return all;
}

/// Two objects' limbs, to be matched.
struct Problem {
  const Limbs &from, &to;
  const LimbChoices& choices;
  std::vector<Features> a, b;
  std::vector<std::uint32_t>
      order;  ///< order of a: limbs that others sit on first, then the longest
};

bool is_allowed(const Problem& problem, std::size_t i, std::size_t k) {
  if (problem.a[i].choice != problem.b[k].choice) return false;
  const AllowedLimbs& allowed = problem.choices.allowed;
  return allowed.empty() || allowed[i][k] != 0;
}

/// The cost of one limb with another, `a` turned.
double compute_cost(const Features& a, const Features& b, double sine, double cosine) {
  const auto turn = [&](Vec3d p) { return rotate_place(p, sine, cosine); };
  double cost = kTip * square(turn(a.tip) - b.tip) + kRoot * square(turn(a.root) - b.root) +
                kDirection * (1 - dot(turn(a.direction), b.direction)) +
                kLength * square(a.length - b.length) + kVolume * square(a.volume - b.volume) +
                kDepth * square(a.depth - b.depth) +
                kTipHeight * square(a.tip_height - b.tip_height) +
                kRootHeight * square(a.root_height - b.root_height);
  double thickness = 0;
  for (std::size_t k = 0; k < kLimbStations; ++k)
    thickness += square(a.thickness[k] - b.thickness[k]);
  cost += kThickness / static_cast<double>(kLimbStations) * thickness;
  if (a.on_floor != b.on_floor) cost += kFloor;
  if (a.on_floor && b.on_floor) cost += kToe * (1 - dot(turn(a.toe), b.toe));
  return cost;
}

/// A matching of some of the limbs.
struct Partial {
  double cost = 0;
  std::uint32_t from = 0, to = 0;  // masks of what is matched
  std::vector<MatchedLimbs> limbs;
};

/// The cost of a limb that is left alone.
double alone(const Features& limb, std::uint32_t matched) {
  return kAlone * limb.stretch * (limb.outer & matched ? kInner : 1);
}
/// The cost for a limb that others sit on: none where one of these is matched in its place.
double alone_or_inner(const Features& limb, std::uint32_t matched) {
  return !(limb.outer & matched) && (limb.inner & matched) ? 0 : alone(limb, matched);
}

/// Tests whether a choice of the user has a pair fewer if the limb at `place` of the order stays
/// alone: its limbs from there on are no more than those of the other object that are still free.
bool breaks_choice(const Problem& problem, const Partial& partial, std::size_t place) {
  const std::optional<std::size_t> choice = problem.a[problem.order[place]].choice;
  if (!choice) return false;
  const std::vector<std::uint32_t>& others = problem.choices.chosen[*choice].to;
  const auto left =
      std::count_if(problem.order.begin() + static_cast<std::ptrdiff_t>(place), problem.order.end(),
                    [&](std::uint32_t i) { return problem.a[i].choice == choice; });
  const auto free = std::count_if(others.begin(), others.end(),
                                  [&](std::uint32_t k) { return (partial.to >> k & 1) == 0; });
  return left <= free;
}

/// The degree to which two roots lie the other way round in the plane of the floor: 0 to 1. Roots
/// that are close together say little.
double opposition(Vec3d a, Vec3d b) {
  constexpr double kApart = 0.3;
  a.y = b.y = 0;
  return std::max(0.0, -dot(a, b)) / (std::max(length(a), kApart) * std::max(length(b), kApart));
}

double with_others(const Problem& problem, const Partial& partial, std::size_t i, std::size_t k,
                   double sine, double cosine) {
  if (partial.limbs.empty()) return 0;
  double between = 0, roots = 0, crossed = 0;
  for (const MatchedLimbs& other : partial.limbs) {
    between += square(problem.from.tip_distances[i][other.from] / problem.from.size -
                      problem.to.tip_distances[k][other.to] / problem.to.size);
    const Vec3d a = rotate_place(problem.a[i].root - problem.a[other.from].root, sine, cosine),
                b = problem.b[k].root - problem.b[other.to].root;
    roots += (1 - dot(normalized(a), normalized(b))) / 2;
    crossed += opposition(a, b);
  }
  return kBetween * between / static_cast<double>(partial.limbs.size()) + kRootsBetween * roots +
         kCrossed * crossed;
}

/// The cheapest matching at a turn.
Partial match_at(const Problem& problem, double angle) {
  const double sine = exact::sin(angle), cosine = exact::cos(angle);
  std::vector<Partial> beam(1), next;
  for (std::size_t place = 0; place < problem.order.size(); ++place) {
    const std::uint32_t i = problem.order[place];
    const Features& a = problem.a[i];
    std::vector<double> pairs;
    for (const Features& b : problem.b) pairs.push_back(compute_cost(a, b, sine, cosine));
    next.clear();
    for (const Partial& partial : beam) {
      next.push_back(partial);
      // Limbs that others sit on are settled at the end.
      if (a.inner == 0) next.back().cost += alone(a, partial.from);
      if (breaks_choice(problem, partial, place)) next.back().cost += kChosen;
      if (a.outer & partial.from) continue;
      for (std::uint32_t k = 0; k < problem.b.size(); ++k) {
        const Features& b = problem.b[k];
        if (((b.outer | b.inner | 1u << k) & partial.to) != 0 || !is_allowed(problem, i, k))
          continue;
        Partial more = partial;
        more.cost += pairs[k] + with_others(problem, partial, i, k, sine, cosine);
        more.from |= 1u << i;
        more.to |= 1u << k;
        more.limbs.push_back({i, k});
        next.push_back(std::move(more));
      }
    }
    const std::size_t kept = std::min(kBeam, next.size());
    std::stable_sort(next.begin(), next.end(),
                     [](const Partial& p, const Partial& q) { return p.cost < q.cost; });
    next.resize(kept);
    std::swap(beam, next);
  }
  const Partial* best = nullptr;
  for (Partial& partial : beam) {
    for (const Features& b : problem.b)
      if (!(partial.to >> (&b - problem.b.data()) & 1))
        partial.cost += alone_or_inner(b, partial.to);
    for (const Features& a : problem.a)
      if (a.inner != 0 && !(partial.from >> (&a - problem.a.data()) & 1))
        partial.cost += alone_or_inner(a, partial.from);
    if (!best || partial.cost < best->cost) best = &partial;
  }
  return *best;
}

/// The turn that lays the matched limbs on each other: weighted Procrustes about the vertical.
double fitted_angle(const Problem& problem, const std::vector<MatchedLimbs>& limbs) {
  constexpr double kTipWeight = 0.16;
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

struct MatchingFit {
  Partial matching;
  double angle = 0;
};

MatchingFit fit_from(const Problem& problem, double start, double plan_angle) {
  constexpr double kEnough = 1e-6;
  std::optional<MatchingFit> best;
  double angle = start;
  for (int round = 0; round < kRounds; ++round) {
    Partial matching = match_at(problem, angle);
    matching.cost += kTurn * (1 - exact::cos(angle - plan_angle));
    if (best && !(matching.cost < best->matching.cost - kEnough)) break;
    best = MatchingFit{std::move(matching), angle};
    if (best->matching.limbs.empty()) break;
    angle = fitted_angle(problem, best->matching.limbs);
  }
  return *best;
}

/// Two limbs that are as long, as thick and as high as each other: a pair of arms or legs.
bool are_twins(const Features& a, const Features& b) {
  constexpr double kLengths = 0.2, kDepths = 0.15, kVolumes = 0.4, kTips = 0.15, kRoots = 0.1;
  return std::fabs(a.length - b.length) < kLengths && std::fabs(a.depth - b.depth) < kDepths &&
         std::fabs(a.volume - b.volume) < kVolumes &&
         std::fabs(a.tip_height - b.tip_height) < kTips &&
         std::fabs(a.root_height - b.root_height) < kRoots;
}

/// A limb has a twin that stays alone.
bool has_lonely_twin(const std::vector<Features>& all, std::size_t limb, std::uint32_t matched) {
  for (std::size_t k = 0; k < all.size(); ++k)
    if (k != limb && all[k].inner == 0 &&
        ((all[k].outer | all[k].inner | 1u << k) & matched) == 0 && are_twins(all[limb], all[k]))
      return true;
  return false;
}

/// One limb of a pair, of which the other stays alone, with several that hang together: two legs
/// and both of the other's under a cape.
bool is_half_a_pair(const Problem& problem, const Partial& matching, const MatchedLimbs& limbs) {
  const Features &a = problem.a[limbs.from], &b = problem.b[limbs.to];
  if ((a.inner == 0) == (b.inner == 0)) return false;
  return a.inner == 0 ? has_lonely_twin(problem.a, limbs.from, matching.from)
                      : has_lonely_twin(problem.b, limbs.to, matching.to);
}

/// The length of the limbs that no other sits on, and how much of it is matched or sits on what is.
struct Lengths {
  double all = 0, matched = 0;
};
Lengths sum_lengths(const Limbs& limbs, const std::vector<Features>& features,
                    std::uint32_t matched) {
  Lengths lengths;
  for (std::size_t i = 0; i < features.size(); ++i) {
    if (features[i].inner != 0) continue;
    const double length = limbs.limbs[i].stretch / limbs.size;
    lengths.all += length;
    if ((features[i].outer | 1u << i) & matched) lengths.matched += length;
  }
  return lengths;
}

}  // namespace

LimbMatch match_limbs(const Limbs& from, const Limbs& to, double angle,
                      const LimbChoices& choices) {
  Problem problem = {from, to, choices, compute_features(from), compute_features(to), {}};
  for (std::size_t n = 0; n < choices.chosen.size(); ++n) {
    for (const std::uint32_t i : choices.chosen[n].from) problem.a[i].choice = n;
    for (const std::uint32_t k : choices.chosen[n].to) problem.b[k].choice = n;
  }
  for (std::uint32_t i = 0; i < problem.a.size(); ++i) problem.order.push_back(i);
  std::stable_sort(problem.order.begin(), problem.order.end(),
                   [&](std::uint32_t i, std::uint32_t k) {
                     const Features &a = problem.a[i], &b = problem.a[k];
                     if (a.choice.has_value() != b.choice.has_value()) return a.choice.has_value();
                     const int on_a = std::popcount(a.inner), on_b = std::popcount(b.inner);
                     return on_a != on_b ? on_a > on_b : a.stretch > b.stretch;
                   });
  std::array<MatchingFit, kTurns> fits;
  parallel_for(kTurns, [&](std::int64_t k) {
    const double start = angle + 2 * exact::kPi * static_cast<double>(k) / kTurns;
    fits[static_cast<std::size_t>(k)] = fit_from(problem, start, angle);
  });
  const MatchingFit* best = &fits[0];
  for (const MatchingFit& fit : fits)
    if (fit.matching.cost < best->matching.cost) best = &fit;
  LimbMatch match;
  match.limbs = best->matching.limbs;
  std::erase_if(match.limbs, [&](const MatchedLimbs& pair) {
    return !problem.a[pair.from].choice && is_half_a_pair(problem, best->matching, pair);
  });
  std::sort(match.limbs.begin(), match.limbs.end(),
            [](const MatchedLimbs& p, const MatchedLimbs& q) { return p.from < q.from; });
  match.angle = exact::atan2(exact::sin(best->angle), exact::cos(best->angle));
  match.cost = best->matching.cost;
  const auto measure_share = [&] {
    std::uint32_t from_matched = 0, to_matched = 0;
    for (const auto& [i, k] : match.limbs) from_matched |= 1u << i, to_matched |= 1u << k;
    const Lengths a = sum_lengths(from, problem.a, from_matched),
                  b = sum_lengths(to, problem.b, to_matched);
    if (a.all + b.all > 0) match.share = (a.matched + b.matched) / (a.all + b.all);
  };
  measure_share();
  if (choices.chosen.empty()) return match;
  // Of what nobody has chosen, only what is certain.
  if (!is_certain(match)) {
    std::erase_if(match.limbs,
                  [&](const MatchedLimbs& pair) { return !problem.a[pair.from].choice; });
    measure_share();
  }
  match.is_chosen = true;
  return match;
}

bool is_certain(const LimbMatch& match) {
  if (match.is_chosen) return true;
  return match.limbs.size() >= kMinLimbs && match.share >= kMinMatchedShare;
}

}  // namespace polymorph
