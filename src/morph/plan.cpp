#include "morph/plan.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <span>
#include <utility>

#include "base/random.h"
#include "base/result.h"
#include "morph/align.h"
#include "morph/cost.h"
#include "morph/mass.h"
#include "morph/motion.h"
#include "morph/plan_cache.h"
#include "morph/transport.h"

namespace polymorph {
namespace {

using Ends = std::pair<std::uint32_t, std::uint32_t>;

/// A ball that serves several pairs gives each an equal share.
std::vector<Pair> with_equal_shares(const std::vector<Ends>& ends, std::size_t from,
                                    std::size_t to) {
  std::vector<float> from_uses(from), to_uses(to);
  for (const auto& [i, j] : ends) {
    ++from_uses[i];
    ++to_uses[j];
  }
  std::vector<Pair> pairs;
  for (const auto& [i, j] : ends) pairs.push_back({i, j, 1 / from_uses[i], 1 / to_uses[j]});
  return pairs;
}

/// The report's correspondence (5.2.7): array order; the surplus of the longer list is paired with
/// pseudo-randomly chosen balls of the other.
std::vector<Pair> pair_by_index(std::size_t from, std::size_t to, std::uint64_t seed) {
  std::vector<Ends> ends(std::max(from, to));
  for (std::size_t i = 0; i < ends.size(); ++i) {
    const auto random = [&](std::size_t n) {
      return random_below(static_cast<std::uint32_t>(n), seed, 0, i);
    };
    ends[i] = {i < from ? static_cast<std::uint32_t>(i) : random(from),
               i < to ? static_cast<std::uint32_t>(i) : random(to)};
  }
  return with_equal_shares(ends, from, to);
}

/// The sides as a plan's cost sees them, `a` already turned.
struct CostPair {
  CostSide a, b;
  float label_cost = 0;
};

std::vector<Pair> pair_nearest(const CostPair& sides) {
  const auto n = static_cast<std::uint32_t>(sides.a.size());
  const auto m = static_cast<std::uint32_t>(sides.b.size());
  std::vector<Ends> ends;
  std::vector<float> row(m), cheapest(m, std::numeric_limits<float>::infinity());
  std::vector<std::uint32_t> nearest(m, 0);
  for (std::uint32_t i = 0; i < n; ++i) {
    cost_row(sides.a, sides.b, sides.label_cost, i, row);
    ends.emplace_back(
        i, static_cast<std::uint32_t>(std::min_element(row.begin(), row.end()) - row.begin()));
    for (std::uint32_t j = 0; j < m; ++j)
      if (row[j] < cheapest[j]) cheapest[j] = row[j], nearest[j] = i;
  }
  for (std::uint32_t j = 0; j < m; ++j) ends.emplace_back(nearest[j], j);
  std::sort(ends.begin(), ends.end());
  ends.erase(std::unique(ends.begin(), ends.end()), ends.end());
  return with_equal_shares(ends, n, m);
}

/// Which balls of each side may be paired with which: one problem per label, or one of all.
struct Subproblem {
  std::vector<std::uint32_t> from, to;
};

std::vector<Subproblem> subproblems_of(const CostPair& sides, LabelMode mode) {
  std::map<std::int32_t, Subproblem> by_label;
  std::vector<std::uint32_t> unlabelled_from, unlabelled_to;  // balls without a partner label
  for (std::uint32_t i = 0; i < sides.a.size(); ++i)
    by_label[mode == LabelMode::kHard ? sides.a.labels[i] : 0].from.push_back(i);
  for (std::uint32_t j = 0; j < sides.b.size(); ++j)
    by_label[mode == LabelMode::kHard ? sides.b.labels[j] : 0].to.push_back(j);
  std::vector<Subproblem> parts;
  for (auto& [label, part] : by_label) {
    if (!part.from.empty() && !part.to.empty()) {
      parts.push_back(std::move(part));
      continue;
    }
    unlabelled_from.insert(unlabelled_from.end(), part.from.begin(), part.from.end());
    unlabelled_to.insert(unlabelled_to.end(), part.to.begin(), part.to.end());
  }
  if (!unlabelled_from.empty() && !unlabelled_to.empty()) {
    parts.push_back({std::move(unlabelled_from), std::move(unlabelled_to)});
    return parts;
  }
  // Only one side has balls without a partner label: each joins the subproblem where it is
  // cheapest.
  const auto part_of = [&](bool from_side, std::uint32_t ball) {
    for (std::size_t k = 0; k < parts.size(); ++k) {
      const auto& list = from_side ? parts[k].from : parts[k].to;
      if (std::binary_search(list.begin(), list.end(), ball)) return k;
    }
    return std::size_t{0};
  };
  const bool unlabelled_is_from = !unlabelled_from.empty();
  const CostSide& mine = unlabelled_is_from ? sides.a : sides.b;
  const CostSide& other = unlabelled_is_from ? sides.b : sides.a;
  std::vector<std::size_t> joins;
  std::vector<float> row(other.size());
  for (const std::uint32_t ball : unlabelled_is_from ? unlabelled_from : unlabelled_to) {
    cost_row(mine, other, 0, ball, row);
    joins.push_back(part_of(
        !unlabelled_is_from,
        static_cast<std::uint32_t>(std::min_element(row.begin(), row.end()) - row.begin())));
  }
  for (std::size_t k = 0; k < joins.size(); ++k)
    (unlabelled_is_from ? parts[joins[k]].from : parts[joins[k]].to)
        .push_back((unlabelled_is_from ? unlabelled_from : unlabelled_to)[k]);
  return parts;
}

/// Removes pairs that carry less than kMinorShare of both their balls, and rescales the others so
/// that the shares of a ball sum to 1 again. Half of a plan's pairs may be such remainders.
std::vector<Pair> without_minor_pairs(std::vector<Pair> pairs, std::size_t from, std::size_t to) {
  constexpr float kMinorShare = 0.08f;
  std::vector<float> from_max(from, 0), to_max(to, 0);
  for (const Pair& pair : pairs) {
    from_max[pair.from] = std::max(from_max[pair.from], pair.from_share);
    to_max[pair.to] = std::max(to_max[pair.to], pair.to_share);
  }
  std::erase_if(pairs, [&](const Pair& pair) {
    return pair.from_share < kMinorShare && pair.to_share < kMinorShare &&
           pair.from_share < from_max[pair.from] && pair.to_share < to_max[pair.to];
  });
  std::vector<double> from_sum(from, 0), to_sum(to, 0);
  for (const Pair& pair : pairs) {
    from_sum[pair.from] += static_cast<double>(pair.from_share);
    to_sum[pair.to] += static_cast<double>(pair.to_share);
  }
  for (Pair& pair : pairs) {
    pair.from_share =
        static_cast<float>(static_cast<double>(pair.from_share) / from_sum[pair.from]);
    pair.to_share = static_cast<float>(static_cast<double>(pair.to_share) / to_sum[pair.to]);
  }
  return pairs;
}

std::vector<Pair> pair_by_transport(const CostPair& sides, LabelMode mode) {
  // Beyond this the exact plan takes more time than anyone sees: 8192 x 6144 to 1 % take
  // 9 s, exactly 17 s.
  constexpr std::size_t kExact = 2048;
  std::vector<Pair> pairs;
  for (const Subproblem& part : subproblems_of(sides, mode)) {
    const auto masses_of = [](const CostSide& side, const std::vector<std::uint32_t>& balls) {
      std::vector<double> masses;
      for (const std::uint32_t i : balls) masses.push_back(side.mass[i]);
      return masses;
    };
    const std::vector<double> supply = masses_of(sides.a, part.from);
    const std::vector<double> demand = masses_of(sides.b, part.to);
    const CostRow rows = [&](std::uint32_t from, std::span<float> costs) {
      std::vector<float> row(sides.b.size());
      cost_row(sides.a, sides.b, sides.label_cost, part.from[from], row);
      for (std::size_t j = 0; j < costs.size(); ++j) costs[j] = row[part.to[j]];
    };
    const double gap = std::max(supply.size(), demand.size()) > kExact ? 0.01 : 0;
    const TransportPlan plan = solve_transport(supply, demand, rows, gap);
    // Shares by what the flows are, so that whole-number masses leave no rest.
    std::vector<double> from_sum(supply.size(), 0), to_sum(demand.size(), 0);
    for (const TransportFlow& flow : plan.flows) {
      from_sum[flow.from] += flow.amount;
      to_sum[flow.to] += flow.amount;
    }
    for (const TransportFlow& flow : plan.flows)
      pairs.push_back({part.from[flow.from], part.to[flow.to],
                       static_cast<float>(flow.amount / from_sum[flow.from]),
                       static_cast<float>(flow.amount / to_sum[flow.to])});
  }
  return without_minor_pairs(std::move(pairs), sides.a.size(), sides.b.size());
}

void set_masses(std::vector<Pair>& pairs, std::span<const double> from,
                std::span<const double> to) {
  for (Pair& pair : pairs)
    pair.mass = (static_cast<double>(pair.from_share) * from[pair.from] +
                 static_cast<double>(pair.to_share) * to[pair.to]) /
                2;
}

std::vector<TransportFlow> flows_of(const std::vector<Pair>& pairs) {
  std::vector<TransportFlow> flows;
  for (const Pair& pair : pairs) flows.push_back({pair.from, pair.to, pair.mass});
  return flows;
}

/// The least-squares similarity of the pairs; turn and scale only as the settings allow.
Alignment fit_alignment(const MorphPlan& plan, const Mat3& rotation, AlignMethod method) {
  Alignment fit;
  for (const Pair& pair : plan.pairs) {
    fit.from_center = fit.from_center + Vec3d(plan.from[pair.from].center) * pair.mass;
    fit.to_center = fit.to_center + Vec3d(plan.to[pair.to].center) * pair.mass;
  }
  fit.rotation = rotation;
  fit.turn = log_rotation(rotation);
  double from_square = 0, to_square = 0, both = 0;
  for (const Pair& pair : plan.pairs) {
    const Vec3d p = rotation * (Vec3d(plan.from[pair.from].center) - fit.from_center);
    const Vec3d q = Vec3d(plan.to[pair.to].center) - fit.to_center;
    from_square += pair.mass * dot(p, p);
    to_square += pair.mass * dot(q, q);
    both += pair.mass * dot(p, q);
  }
  if (!(from_square > 0 && to_square > 0)) return fit;
  // Horn 1987: the scale that is its own inverse when the objects change places. Kept, like a turn,
  // only if it brings the balls a good deal nearer.
  constexpr double kGain = 0.1;
  const auto left = [&](double s) { return to_square / s + from_square * s - 2 * both; };
  const auto gains = [&](double s) { return left(s) < (1 - kGain) * left(1); };
  const double scale = std::sqrt(to_square / from_square);
  if (method == AlignMethod::kSimilarity && gains(scale)) {
    // The centres of few balls may lie anywhere within an object and say nothing of its size; those
    // of 96 say the same as the bodies to a factor of 1.3.
    constexpr double kMaxDoubt = 1.5;
    const double bodies = radius_of_gyration(plan.to, plan.kind, fit.to_center) /
                          radius_of_gyration(plan.from, plan.kind, fit.from_center);
    const bool doubtful = std::max(scale / bodies, bodies / scale) > kMaxDoubt;
    const double sound = doubtful ? bodies : scale;
    if (gains(sound)) fit.scale = sound;
  }
  fit.strain = std::sqrt(std::max(left(fit.scale), 0.0) / std::sqrt(from_square * to_square));
  return fit;
}

/// The correspondence does not depend on which of two objects a plan starts from: it is always made
/// from the smaller one in this order.
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

double rms_size(const std::vector<Ball>& balls) {
  const std::vector<double> even(balls.size(), 1 / static_cast<double>(balls.size()));
  return normalization_of(balls, even).size;
}

double lowest(const std::vector<Ball>& balls) {
  float low = balls[0].center.y;
  for (const Ball& ball : balls) low = std::min(low, ball.center.y);
  return static_cast<double>(low);
}

/// Pairs and turn of a morph from `plan.from` to `plan.to`.
Mat3 find_pairs(MorphPlan& plan, const PlanSide& from, const PlanSide& to,
                const PlanSettings& settings) {
  const std::vector<double>& from_mass = plan.from_masses;
  const std::vector<double>& to_mass = plan.to_masses;
  if (settings.method == PlanMethod::kIndex) {
    plan.pairs = pair_by_index(plan.from.size(), plan.to.size(), settings.seed);
    set_masses(plan.pairs, from_mass, to_mass);
    return {};
  }
  Normalization from_places = normalization_of(plan.from, from_mass);
  Normalization to_places = normalization_of(plan.to, to_mass);
  if (settings.align == AlignMethod::kNone) {
    Normalization common;
    common.center = (from_places.center + to_places.center) * 0.5;
    common.size = std::sqrt(from_places.size * to_places.size);
    from_places = to_places = common;
  }
  const bool soft = settings.label_mode == LabelMode::kSoft;
  CostPair sides;
  sides.a = cost_side(plan.from, plan.kind, from_mass, from.labels, from.landmarks, from_places,
                      settings);
  sides.b = cost_side(plan.to, plan.kind, to_mass, to.labels, to.landmarks, to_places, settings);
  sides.label_cost = soft ? settings.weights.label : 0;
  const auto pair_up = [&] {
    plan.pairs = settings.method == PlanMethod::kNearest
                     ? pair_nearest(sides)
                     : pair_by_transport(sides, settings.label_mode);
    set_masses(plan.pairs, from_mass, to_mass);
  };
  FoundRotation found;
  if (settings.align == AlignMethod::kRigid || settings.align == AlignMethod::kSimilarity) {
    // While the rotation is searched for, hard labels are soft ones with a high cost.
    constexpr float kHardCost = 100;
    const float label_cost = settings.label_mode == LabelMode::kHard ? kHardCost : sides.label_cost;
    found = find_rotation(sides.a, sides.b, label_cost,
                          static_cast<double>(settings.weights.align_gain),
                          static_cast<double>(settings.weights.align_tip_residual));
  }
  Mat3 rotation = found.rotation;
  const bool turns = angle_of(rotation) > 0;
  const CostSide unturned = sides.a;
  if (turns) sides.a = turned(unturned, rotation);
  pair_up();
  // The turn was found on a few dozen balls: once more with all.
  for (int step = 0; turns && step < 2; ++step) {
    rotation = fit_rotation(unturned, sides.b, flows_of(plan.pairs), found.axis);
    sides.a = turned(unturned, rotation);
    pair_up();
  }
  return turns ? fit_rotation(unturned, sides.b, flows_of(plan.pairs), found.axis) : rotation;
}

/// Masses, pairs and turn, found or from the cache.
Mat3 correspond(MorphPlan& plan, const PlanSide& from, const PlanSide& to,
                const PlanSettings& settings, const std::filesystem::path& cache) {
  const std::string key =
      cache.empty() ? std::string{} : correspondence_key(from, to, plan.kind, settings);
  if (!cache.empty())
    if (auto kept = load_correspondence(cache, key, from, to)) {
      plan.from_masses = std::move(kept->from_masses);
      plan.to_masses = std::move(kept->to_masses);
      plan.pairs = std::move(kept->pairs);
      return kept->rotation;
    }
  plan.from_masses = ball_masses(plan.from, plan.kind);
  plan.to_masses = ball_masses(plan.to, plan.kind);
  const Mat3 rotation = find_pairs(plan, from, to, settings);
  if (!cache.empty())
    store_correspondence(cache, key,
                         std::min(from.name, to.name) + ", " + std::max(from.name, to.name),
                         {plan.from_masses, plan.to_masses, plan.pairs, rotation});
  return rotation;
}

}  // namespace

MorphPlan plan_morph(PlanSide from, PlanSide to, FieldKind kind, const PlanSettings& settings,
                     const MotionSettings& motion, const std::filesystem::path& cache) {
  PM_CHECK(!from.balls.empty() && !to.balls.empty());
  PM_CHECK(from.landmarks.size() == to.landmarks.size());
  const bool swap = is_less(to, from);
  if (swap) std::swap(from, to);
  MorphPlan plan;
  plan.kind = kind;
  plan.from = from.balls;
  plan.to = to.balls;
  plan.from_labels = from.labels;
  plan.to_labels = to.labels;
  const Mat3 rotation = correspond(plan, from, to, settings, cache);
  std::sort(plan.pairs.begin(), plan.pairs.end(), [](const Pair& a, const Pair& b) {
    return std::pair(a.from, a.to) < std::pair(b.from, b.to);
  });
  plan.alignment = fit_alignment(plan, rotation, settings.align);
  if (swap) {
    std::swap(plan.from, plan.to);
    std::swap(plan.from_masses, plan.to_masses);
    std::swap(plan.from_labels, plan.to_labels);
    for (Pair& pair : plan.pairs) {
      std::swap(pair.from, pair.to);
      std::swap(pair.from_share, pair.to_share);
    }
    const Alignment fit = plan.alignment;
    plan.alignment = {transposed(fit.rotation), fit.turn * -1.0, 1 / fit.scale, fit.to_center,
                      fit.from_center,          fit.strain};
  }
  plan.size = std::sqrt(rms_size(plan.from) * rms_size(plan.to));
  plan.floor = std::min(lowest(plan.from), lowest(plan.to));
  plan.motion = motion;
  set_paths(plan);
  return plan;
}

}  // namespace polymorph
