#include "morph/limb_plan.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <tuple>

#include "base/exact_math.h"
#include "base/side_by_side.h"
#include "morph/align.h"
#include "morph/centre_line.h"
#include "morph/limb_names.h"

namespace polymorph {
namespace {

/// Weight in limb_cost_sides() of the squared difference of the balls' distances from the centres.
constexpr double kDistanceWeight = 0.3;

/// The points of a limb's centre line, extended to its root and tip.
using LinePoints = std::array<Vec3d, kLinePoints>;
LinePoints extend_line(const Limb& limb) {
  constexpr std::size_t n = kLimbStations;
  LinePoints points;
  // Root and tip lie beyond the outermost stations by 0.05 of the limb's length, which is a third
  // of the distance between two stations (0.15).
  points[0] = limb.line[0] - (limb.line[1] - limb.line[0]) * (1.0 / 3);
  points[n + 1] = limb.line[n - 1] + (limb.line[n - 1] - limb.line[n - 2]) * (1.0 / 3);
  std::copy(limb.line.begin(), limb.line.end(), points.begin() + 1);
  return points;
}

/// Interpolates the direction of a line's segments.
Vec3d direction_at(const LinePoints& points, double t) {
  std::array<Vec3d, kLinePoints - 1> segments;
  for (std::size_t k = 0; k < segments.size(); ++k) segments[k] = points[k + 1] - points[k];
  return interpolated(segments, t);
}

double radius_at(const Limb& limb, double t) {
  std::array<double, kLimbStations> stations;
  for (std::size_t k = 0; k < kLimbStations; ++k) stations[k] = limb_station(k);
  return interpolated(stations, limb.radius, t);
}

/// Maps a point of a limb, at the fraction `t` of its length, into another limb: along the centre
/// lines, with the offset from them rotated and scaled by the ratio of the radii.
Vec3d map_to_limb(Vec3d p, double t, const Limb& own, const Limb& other, const Mat3& rotation) {
  // Range of the factor by which offsets are scaled.
  constexpr double kMinScale = 0.4, kMaxScale = 2.5;
  const LinePoints from = extend_line(own), to = extend_line(other);
  const Vec3d offset = rotation * (p - interpolated(kLineStations, from, t));
  const Mat3 bend = rotation_between(rotation * direction_at(from, t), direction_at(to, t));
  const double scale = std::clamp(radius_at(other, t) / radius_at(own, t), kMinScale, kMaxScale);
  return interpolated(kLineStations, to, t) + bend * offset * scale;
}

/// Most common label of some balls.
struct LabelVote {
  std::int32_t label = kNoLabel;
  std::size_t votes = 0;  ///< number of balls that have the label
  std::size_t balls = 0;  ///< number of all these balls
};
/// Finds the most common label of the balls for which `holds(ball)` is true.
template <class Holds>
LabelVote vote_on_label(const PlanSide& side, const Holds& holds) {
  std::map<std::int32_t, std::size_t> votes;
  LabelVote best;
  for (std::size_t b = 0; b < side.labels.size(); ++b)
    if (holds(b)) ++votes[side.labels[b]], ++best.balls;
  for (const auto& [label, count] : votes)
    if (count > best.votes) best.votes = count, best.label = label;
  return best;
}

/// Finds the most common label of the balls on a limb.
LabelVote vote_of_limb(const PlanSide& side, const Limbs& limbs, std::uint32_t limb) {
  return vote_on_label(side, [&](std::size_t b) { return limbs.holds(limb, b); });
}

/// Finds the limb on which most balls of a label lie. If there are several, it is the one with the
/// fewest limbs on it.
std::optional<std::uint32_t> find_limb_of_label(const PlanSide& side, const Limbs& limbs,
                                                std::int32_t label) {
  std::optional<std::uint32_t> best;
  for (std::uint32_t i = 0; i < limbs.limbs.size(); ++i) {
    std::size_t balls = 0, on_limb = 0;
    for (std::size_t b = 0; b < side.labels.size(); ++b)
      if (side.labels[b] == label) ++balls, on_limb += limbs.holds(i, b);
    if (2 * on_limb > balls &&
        (!best || limbs.limbs[i].nested.size() < limbs.limbs[*best].nested.size()))
      best = i;
  }
  return best;
}

/// Removes the labels that no ball of the other object has.
void drop_unshared_labels(PlanSide& from, PlanSide& to) {
  const std::set<std::int32_t> a(from.labels.begin(), from.labels.end()),
      b(to.labels.begin(), to.labels.end());
  const auto drop = [](std::vector<std::int32_t>& labels, const std::set<std::int32_t>& other) {
    for (std::int32_t& label : labels)
      if (!other.contains(label)) label = kNoLabel;
  };
  drop(from.labels, b), drop(to.labels, a);
}

/// Gives labels the same number if they lie on the same limb in both objects, such as the labels of
/// an arm and its hand.
void join_labels_on_limbs(PlanSide& from, PlanSide& to, const Limbs& a, const Limbs& b) {
  std::set<std::int32_t> labels(from.labels.begin(), from.labels.end());
  labels.erase(kNoLabel);
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::int32_t> label_of_limbs;
  for (const std::int32_t label : labels) {
    const auto i = find_limb_of_label(from, a, label), k = find_limb_of_label(to, b, label);
    if (!i || !k) continue;
    const std::int32_t common_label = label_of_limbs.try_emplace({*i, *k}, label).first->second;
    std::replace(from.labels.begin(), from.labels.end(), label, common_label);
    std::replace(to.labels.begin(), to.labels.end(), label, common_label);
  }
}

/// Finds the ball nearest to each landmark.
std::vector<std::size_t> landmark_balls(const PlanSide& side) {
  std::vector<std::size_t> nearest;
  for (const Vec3 landmark : side.landmarks) {
    const auto distance = [&](const Ball& ball) { return length(ball.center - landmark); };
    nearest.push_back(static_cast<std::size_t>(std::ranges::min_element(side.balls, {}, distance) -
                                               side.balls.begin()));
  }
  return nearest;
}

/// Computes LimbChoices::allowed by the rules of find_limbs_of_sides().
AllowedLimbs allowed_limbs(const PlanSide& from, const PlanSide& to, const Limbs& from_limbs,
                           const Limbs& to_limbs) {
  const std::size_t n = from_limbs.limbs.size(), m = to_limbs.limbs.size();
  AllowedLimbs allowed(n, std::vector<std::uint8_t>(m, 1));
  const std::vector<std::size_t> from_landmark_balls = landmark_balls(from),
                                 to_landmark_balls = landmark_balls(to);
  std::vector<std::int32_t> from_labels, to_labels;
  for (std::uint32_t i = 0; i < n; ++i)
    from_labels.push_back(vote_of_limb(from, from_limbs, i).label);
  for (std::uint32_t k = 0; k < m; ++k) to_labels.push_back(vote_of_limb(to, to_limbs, k).label);
  for (std::uint32_t i = 0; i < n; ++i)
    for (std::uint32_t k = 0; k < m; ++k) {
      bool share_landmark = false;
      for (std::size_t l = 0; l < from_landmark_balls.size(); ++l) {
        const bool on_from = from_limbs.holds(i, from_landmark_balls[l]),
                   on_to = to_limbs.holds(k, to_landmark_balls[l]);
        if (on_from != on_to) allowed[i][k] = 0;
        share_landmark |= on_from && on_to;
      }
      // Landmarks outweigh labels, which may be names that both files merely happen to use.
      if (!share_landmark && from_labels[i] != to_labels[k]) allowed[i][k] = 0;
    }
  return allowed;
}

/// Tests whether two limbs of one object are the same limb or one sits on the other.
bool overlap(const Limbs& limbs, std::uint32_t a, std::uint32_t b) {
  const auto holds = [&](std::uint32_t outer, std::uint32_t inner) {
    const std::vector<std::uint32_t>& nested = limbs.limbs[outer].nested;
    return std::find(nested.begin(), nested.end(), inner) != nested.end();
  };
  return a == b || holds(a, b) || holds(b, a);
}

/// Lists the pairs of limbs that hold the same landmarks, at least one.
std::vector<ChosenLimbs> list_landmark_choices(const PlanSide& from, const PlanSide& to,
                                               const Limbs& a, const Limbs& b,
                                               const AllowedLimbs& allowed) {
  const std::vector<std::size_t> from_landmark_balls = landmark_balls(from),
                                 to_landmark_balls = landmark_balls(to);
  std::vector<ChosenLimbs> choices;
  for (std::uint32_t i = 0; i < a.limbs.size(); ++i)
    for (std::uint32_t k = 0; k < b.limbs.size(); ++k)
      for (std::size_t l = 0; l < from_landmark_balls.size(); ++l)
        if (allowed[i][k] && a.holds(i, from_landmark_balls[l]) &&
            b.holds(k, to_landmark_balls[l])) {
          choices.push_back({{i}, {k}});
          break;
        }
  return choices;
}

/// The limbs that carry each label. The trunk consists of the balls on no limb. A limb carries a
/// label if it holds no landmark, more than half of its labelled balls have this label, and either
/// (1) more than half of all its balls have the label, which is not the trunk's most common one, or
/// (2) the limb is find_limb_of_label().
using LabelCarriers = std::map<std::int32_t, std::vector<std::uint32_t>>;
LabelCarriers limbs_of_labels(const PlanSide& side, const Limbs& limbs) {
  const std::vector<std::size_t> balls_at_landmarks = landmark_balls(side);
  const std::int32_t trunk_label =
      vote_on_label(side, [&](std::size_t b) { return limbs.ball_limbs[b] == 0; }).label;
  LabelCarriers carriers;
  for (std::uint32_t i = 0; i < limbs.limbs.size(); ++i) {
    const auto is_on_limb = [&](std::size_t b) { return limbs.holds(i, b); };
    if (std::any_of(balls_at_landmarks.begin(), balls_at_landmarks.end(), is_on_limb)) continue;
    const LabelVote vote = vote_on_label(
        side, [&](std::size_t b) { return is_on_limb(b) && side.labels[b] != kNoLabel; });
    if (2 * vote.votes <= vote.balls) continue;
    const bool covers_limb =
        vote.label != trunk_label && 2 * vote.votes > vote_of_limb(side, limbs, i).balls;
    if (covers_limb || find_limb_of_label(side, limbs, vote.label) == i)
      carriers[vote.label].push_back(i);
  }
  return carriers;
}

/// Lists, for each label that limbs of both sides carry, these limbs.
std::vector<ChosenLimbs> list_label_choices(const LabelCarriers& from_carriers,
                                            const LabelCarriers& to_carriers, bool are_by_name) {
  std::vector<ChosenLimbs> choices;
  for (const auto& [label, limbs] : from_carriers)
    if (const auto others = to_carriers.find(label); others != to_carriers.end())
      choices.push_back({limbs, others->second, are_by_name});
  return choices;
}

/// Lists the limbs that carry a label which no limb of the other object carries.
std::vector<std::uint32_t> list_limbs_of_unmatched_labels(const LabelCarriers& own,
                                                          const LabelCarriers& other) {
  std::vector<std::uint32_t> unmatched;
  for (const auto& [label, limbs] : own)
    if (!other.contains(label)) unmatched.insert(unmatched.end(), limbs.begin(), limbs.end());
  return unmatched;
}

/// Chooses the limbs that become each other by the user's landmarks, then those by the labels. Of
/// limbs that sit on each other only the longest is chosen: a whole arm rather than its fingers.
std::vector<ChosenLimbs> choose_limbs(const std::vector<ChosenLimbs>& by_landmarks,
                                      const std::vector<ChosenLimbs>& by_labels, const Limbs& a,
                                      const Limbs& b) {
  // The choices with the longest limbs come first. Lengths are relative to Limbs::max_distance.
  const auto longest_of = [](const Limbs& all, const std::vector<std::uint32_t>& limbs) {
    double longest = 0;
    for (const std::uint32_t i : limbs) longest = std::max(longest, all.limbs[i].length());
    return longest / all.max_distance;
  };
  const auto length_of = [&](const ChosenLimbs& choice) {
    return longest_of(a, choice.from) + longest_of(b, choice.to);
  };
  // The limbs that are chosen already.
  std::vector<std::uint32_t> from_taken, to_taken;
  // Selects those of `limbs` that overlap neither `taken` limbs nor each other, the longest first.
  const auto select_free = [](const Limbs& all, std::vector<std::uint32_t> limbs,
                              const std::vector<std::uint32_t>& taken) {
    std::stable_sort(limbs.begin(), limbs.end(), [&](std::uint32_t i, std::uint32_t k) {
      return all.limbs[i].length() > all.limbs[k].length();
    });
    std::vector<std::uint32_t> free_limbs;
    const auto overlaps = [&](std::uint32_t limb, const std::vector<std::uint32_t>& others) {
      return std::any_of(others.begin(), others.end(),
                         [&](std::uint32_t other) { return overlap(all, limb, other); });
    };
    for (const std::uint32_t limb : limbs)
      if (!overlaps(limb, taken) && !overlaps(limb, free_limbs)) free_limbs.push_back(limb);
    return free_limbs;
  };
  std::vector<ChosenLimbs> chosen;
  const auto add_choices = [&](std::vector<ChosenLimbs> choices) {
    std::stable_sort(
        choices.begin(), choices.end(),
        [&](const ChosenLimbs& p, const ChosenLimbs& q) { return length_of(p) > length_of(q); });
    for (const ChosenLimbs& choice : choices) {
      const ChosenLimbs free_limbs = {select_free(a, choice.from, from_taken),
                                      select_free(b, choice.to, to_taken), choice.is_by_name};
      if (free_limbs.from.empty() || free_limbs.to.empty()) continue;
      from_taken.insert(from_taken.end(), free_limbs.from.begin(), free_limbs.from.end());
      to_taken.insert(to_taken.end(), free_limbs.to.begin(), free_limbs.to.end());
      chosen.push_back(free_limbs);
    }
  };
  add_choices(by_landmarks);
  add_choices(by_labels);
  return chosen;
}

/// The field of Gaussian balls, divided by its threshold: at least 1 inside.
double field_at(const std::vector<Ball>& balls, Vec3d p) {
  double sum = 0;
  for (const Ball& ball : balls) {
    const Vec3d d = p - Vec3d(ball.center);
    const double q = dot(d, to_mat3(ball.shape) * d) * static_cast<double>(ball.a);
    const double exponent = static_cast<double>(ball.w) - q;
    constexpr double kMinExponent = -40;  // smaller terms do not count
    if (exponent > kMinExponent) sum += exp_scalar(exponent);
  }
  return sum;
}

/// Finds the point of the balls' surface between a point inside and one outside, by bisection.
Vec3d surface_between(const std::vector<Ball>& balls, Vec3d inside, Vec3d outside) {
  constexpr int kHalvings = 24;  // down to the resolution of float
  for (int k = 0; k < kHalvings; ++k) {
    const Vec3d middle = (inside + outside) * 0.5;
    (field_at(balls, middle) >= 1 ? inside : outside) = middle;
  }
  return outside;
}

/// Finds the point of the balls' surface at which a lone limb of the other object begins or ends.
/// `place`: the limb's root, mapped to this object; `direction`: the limb's direction there.
Vec3d place_on_surface(const std::vector<Ball>& balls, const Limbs& limbs, Vec3d place,
                       Vec3d direction) {
  constexpr double kStep = 0.02;  // fraction of Limbs::max_distance
  constexpr int kSteps = 100;
  // From inside, go along the limb until the surface.
  if (field_at(balls, place) >= 1) {
    const Vec3d step = direction * (kStep * limbs.max_distance);
    for (int k = 1; k <= kSteps; ++k) {
      const Vec3d next = place + step * static_cast<double>(k);
      if (field_at(balls, next) < 1) return surface_between(balls, next - step, next);
    }
    return place;  // the surface is farther away than twice Limbs::max_distance
  }
  // From outside, go towards the nearest ball.
  const auto nearest = std::ranges::min_element(
      balls, {}, [&](const Ball& ball) { return length(Vec3d(ball.center) - place); });
  const Vec3d center(nearest->center);
  // The centre of a ball too weak to have a surface may be outside.
  return field_at(balls, center) >= 1 ? surface_between(balls, center, place) : center;
}

/// Lists the lone limbs: those that are small and slim and overlap neither a matched limb nor one
/// of `unmatched_label_limbs`. Of lone limbs that sit on each other only the one that holds the
/// others is listed. `unmatched_label_limbs`: LimbPlan::from_unmatched_label_limbs or
/// to_unmatched_label_limbs.
std::vector<std::uint32_t> list_lone_limbs(const Limbs& limbs,
                                           std::span<const std::uint32_t> matched,
                                           std::span<const std::uint32_t> unmatched_label_limbs) {
  // Larger or less slim limbs count as the body. kMaxVolume: fraction of the object's volume;
  // kMinSlimness: length over mean diameter.
  constexpr double kMaxVolume = 0.15, kMinSlimness = 1.5;
  const auto overlaps = [&](std::uint32_t k) {
    return [&limbs, k](std::uint32_t i) { return overlap(limbs, i, k); };
  };
  std::vector<std::uint32_t> candidates;
  for (std::uint32_t k = 0; k < limbs.limbs.size(); ++k) {
    const Limb& limb = limbs.limbs[k];
    double mean_radius = 0;
    for (const double r : limb.radius) mean_radius += r / static_cast<double>(kLimbStations);
    if (limb.volume <= kMaxVolume && limb.length() >= kMinSlimness * 2 * mean_radius &&
        std::none_of(matched.begin(), matched.end(), overlaps(k)) &&
        std::none_of(unmatched_label_limbs.begin(), unmatched_label_limbs.end(), overlaps(k)))
      candidates.push_back(k);
  }
  std::vector<std::uint32_t> lone;
  for (const std::uint32_t k : candidates)
    if (std::none_of(candidates.begin(), candidates.end(), [&](std::uint32_t i) {
          const std::vector<std::uint32_t>& nested = limbs.limbs[i].nested;
          return std::find(nested.begin(), nested.end(), k) != nested.end();
        }))
      lone.push_back(k);
  return lone;
}

LimbCurve make_curve(const Limb& limb) {
  static_assert(LimbCurve::kPoints == kLinePoints);
  const LinePoints points = extend_line(limb);
  LimbCurve curve;
  for (std::size_t k = 0; k < LimbCurve::kPoints; ++k) {
    curve.points[k] = to_float(points[k]);
    curve.radii[k] = static_cast<float>(radius_at(limb, kLineStations[k]));
  }
  return curve;
}

/// The position of a ball along a limb, as a fraction of the limb's length.
double station_of(const Limbs& limbs, const Limb& limb, std::size_t ball) {
  return std::clamp(
      (limbs.ball_distances[ball] - limb.root_distance) / std::max(limb.length(), 1e-9), 0.0, 1.0);
}

/// One object of a limb match.
struct MatchSide {
  const std::vector<Ball>& balls;
  const Limbs& limbs;
  /// LimbPlan::from_unmatched_label_limbs or to_unmatched_label_limbs.
  const std::vector<std::uint32_t>& unmatched_label_limbs;
  std::vector<std::uint32_t> matched = {};  ///< indices of the matched limbs
  std::vector<Vec3d> places = {};  ///< warp_balls() of `balls`: positions in the other object
};

std::pair<MatchSide, MatchSide> make_match_sides(const LimbPlan& limbs,
                                                 const std::vector<Ball>& from,
                                                 const std::vector<Ball>& to) {
  MatchSide a{from, limbs.from, limbs.from_unmatched_label_limbs},
      b{to, limbs.to, limbs.to_unmatched_label_limbs};
  std::vector<MatchedLimbs> reversed;
  for (const auto& [i, k] : limbs.match.limbs) {
    reversed.push_back({k, i});
    a.matched.push_back(i);
    b.matched.push_back(k);
  }
  const double angle = limbs.match.angle;
  a.places = warp_balls(from, limbs.from, limbs.to, limbs.match.limbs, angle);
  b.places = warp_balls(to, limbs.to, limbs.from, reversed, -angle);
  return {std::move(a), std::move(b)};
}

/// Makes the curves of an object's limbs. `angle`: rotation about the vertical from `object` to
/// `other`, radians.
LimbCurves make_curves(const MatchSide& object, const MatchSide& other, double angle) {
  const auto& [balls, own, unmatched_label_limbs, matched, places] = object;
  const std::vector<std::uint32_t> lone = list_lone_limbs(own, matched, unmatched_label_limbs);
  LimbCurves curves;
  // Station of each ball on its lone or matched limb.
  curves.lone_limbs = limb_indices_of_balls(own, lone);
  const std::vector<std::int32_t> matched_limbs = limb_indices_of_balls(own, matched);
  for (std::size_t b = 0; b < balls.size(); ++b) {
    double station = 0;
    if (curves.lone_limbs[b] != kNoLabel)
      station = station_of(own, own.limbs[lone[static_cast<std::size_t>(curves.lone_limbs[b])]], b);
    else if (matched_limbs[b] != kNoLabel)
      station = station_of(own, own.limbs[matched[static_cast<std::size_t>(matched_limbs[b])]], b);
    curves.stations.push_back(static_cast<float>(station));
  }
  // Centre lines, and the counterparts of lone limbs.
  for (const std::uint32_t limb : matched) curves.matched.push_back(make_curve(own.limbs[limb]));
  const Mat3 rotation = about_vertical(angle);
  for (const std::uint32_t limb_index : lone) {
    const Limb& limb = own.limbs[limb_index];
    curves.lone.push_back(make_curve(limb));
    // The warp moves the root as it moves the nearest ball of the trunk, which is on no matched or
    // lone limb.
    const Vec3d root(curves.lone.back().points[0]);
    std::size_t nearest = balls.size();
    const auto distance = [&](std::size_t b) {
      return length(Vec3d(object.balls[b].center) - root);
    };
    for (std::size_t b = 0; b < balls.size(); ++b)
      if (curves.lone_limbs[b] == kNoLabel && matched_limbs[b] == kNoLabel &&
          (nearest == balls.size() || distance(b) < distance(nearest)))
        nearest = b;
    Vec3d target = other.limbs.center;
    if (nearest < balls.size())
      target = places[nearest] + rotation * (root - Vec3d(balls[nearest].center));
    curves.counterparts.push_back(to_float(place_on_surface(
        other.balls, other.limbs, target, rotation * normalized(limb.line[1] - limb.line[0]))));
  }
  return curves;
}

/// Lists the balls that belong to no lone limb.
std::vector<std::uint32_t> list_body(const LimbCurves& curves, std::size_t count) {
  std::vector<std::uint32_t> body;
  for (std::uint32_t b = 0; b < count; ++b)
    if (curves.lone_limbs.empty() || curves.lone_limbs[b] == kNoLabel) body.push_back(b);
  return body;
}

/// Makes the side that consists of some of a side's balls.
CostSide select_balls(const CostSide& side, const std::vector<std::uint32_t>& balls) {
  CostSide selection;
  selection.first_pinned_axis = side.first_pinned_axis;
  for (const std::uint32_t b : balls) {
    selection.mass.push_back(side.mass[b]);
    if (!side.labels.empty()) selection.labels.push_back(side.labels[b]);
  }
  for (const std::vector<float>& axis : side.values) {
    std::vector<float>& values = selection.values.emplace_back();
    for (const std::uint32_t b : balls) values.push_back(axis[b]);
  }
  return selection;
}

/// Finds the ball of the body that is nearest to a place. `body`: list_body().
std::uint32_t nearest_ball(const std::vector<Ball>& balls, const std::vector<std::uint32_t>& body,
                           Vec3 place) {
  return *std::ranges::min_element(
      body, {}, [&](std::uint32_t b) { return length(balls[b].center - place); });
}

}  // namespace

LimbPlan find_limbs_of_sides(const PlanSide& from, const PlanSide& to,
                             const PlanSettings& settings) {
  LimbPlan plan;
  run_side_by_side([&] { plan.from = find_limbs(from.balls); },
                   [&] { plan.to = find_limbs(to.balls); });
  PlanSide a = from, b = to;
  if (settings.label_mode == LabelMode::kOff) a.labels.clear(), b.labels.clear();
  drop_unshared_labels(a, b);
  join_labels_on_limbs(a, b, plan.from, plan.to);
  plan.choices.allowed = allowed_limbs(a, b, plan.from, plan.to);
  const LabelCarriers from_carriers = limbs_of_labels(a, plan.from),
                      to_carriers = limbs_of_labels(b, plan.to);
  plan.from_unmatched_label_limbs = list_limbs_of_unmatched_labels(from_carriers, to_carriers);
  plan.to_unmatched_label_limbs = list_limbs_of_unmatched_labels(to_carriers, from_carriers);
  plan.choices.chosen = choose_limbs(
      list_landmark_choices(a, b, plan.from, plan.to, plan.choices.allowed),
      list_label_choices(from_carriers, to_carriers, settings.labels.empty()), plan.from, plan.to);
  // Within a choice, limbs may be matched even if `allowed` forbade it.
  for (const ChosenLimbs& choice : plan.choices.chosen)
    for (const std::uint32_t i : choice.from)
      for (const std::uint32_t k : choice.to) plan.choices.allowed[i][k] = 1;
  return plan;
}

std::pair<LimbCurves, LimbCurves> find_limb_curves(const LimbPlan& limbs,
                                                   const std::vector<Ball>& from,
                                                   const std::vector<Ball>& to) {
  const auto [source, target] = make_match_sides(limbs, from, to);
  return {make_curves(source, target, limbs.match.angle),
          make_curves(target, source, -limbs.match.angle)};
}

std::vector<Pair> pair_bodies(const CostPair& sides, LabelMode mode, const LimbCurves& from_curves,
                              const LimbCurves& to_curves) {
  const std::vector<std::uint32_t> from = list_body(from_curves, sides.a.size()),
                                   to = list_body(to_curves, sides.b.size());
  std::vector<Pair> pairs = pair_by_transport(
      {select_balls(sides.a, from), select_balls(sides.b, to), sides.label_cost}, mode);
  for (Pair& pair : pairs) pair.from = from[pair.from], pair.to = to[pair.to];
  return pairs;
}

void add_lone_pairs(MorphPlan& plan) {
  // Share that a ball of the body gives to each pair of a lone limb, and the mass of such a pair.
  constexpr float kShare = 1e-4f;
  constexpr double kMass = 1e-6;
  const std::size_t body_pairs = plan.pairs.size();
  const std::vector<std::uint32_t> from = list_body(plan.from_curves, plan.from.size()),
                                   to = list_body(plan.to_curves, plan.to.size());
  // Per ball of a body, the number of its pairs with balls of lone limbs.
  std::vector<std::size_t> from_lone_pairs(plan.from.size(), 0), to_lone_pairs(plan.to.size(), 0);
  for (std::uint32_t b = 0; b < plan.from_curves.lone_limbs.size(); ++b)
    if (const std::int32_t limb = plan.from_curves.lone_limbs[b]; limb != kNoLabel) {
      const Vec3 counterpart = plan.from_curves.counterparts[static_cast<std::size_t>(limb)];
      plan.pairs.push_back({b, nearest_ball(plan.to, to, counterpart), /*from_share=*/1, kShare});
      ++to_lone_pairs[plan.pairs.back().to];
    }
  for (std::uint32_t b = 0; b < plan.to_curves.lone_limbs.size(); ++b)
    if (const std::int32_t limb = plan.to_curves.lone_limbs[b]; limb != kNoLabel) {
      const Vec3 counterpart = plan.to_curves.counterparts[static_cast<std::size_t>(limb)];
      plan.pairs.push_back({nearest_ball(plan.from, from, counterpart), b, kShare, /*to_share=*/1});
      ++from_lone_pairs[plan.pairs.back().from];
    }
  // The body's balls give up the lone pairs' shares and masses, so that the shares of each ball,
  // and the masses of all pairs, still add up to 1.
  double body_mass = 0;
  for (std::size_t e = 0; e < body_pairs; ++e) {
    Pair& pair = plan.pairs[e];
    pair.from_share *= 1 - kShare * static_cast<float>(from_lone_pairs[pair.from]);
    pair.to_share *= 1 - kShare * static_cast<float>(to_lone_pairs[pair.to]);
    body_mass += pair.mass;
  }
  const double lone_mass = kMass * static_cast<double>(plan.pairs.size() - body_pairs);
  for (std::size_t e = 0; e < plan.pairs.size(); ++e)
    plan.pairs[e].mass = e < body_pairs ? plan.pairs[e].mass * (1 - lone_mass) / body_mass : kMass;
}

LimbMatch match_at(LimbPlan& plan, double angle) {
  for (const auto& [known, match] : plan.matches_by_angle)
    if (known == angle) return match;
  plan.matches_by_angle.emplace_back(angle, match_limbs(plan.from, plan.to, angle, plan.choices));
  return plan.matches_by_angle.back().second;
}

std::vector<Vec3d> warp_balls(const std::vector<Ball>& balls, const Limbs& own, const Limbs& other,
                              std::span<const MatchedLimbs> matched, double angle) {
  // Distance from a root within which its displacement dominates, as a fraction of
  // Limbs::max_distance.
  constexpr double kRootRadius = 0.08;
  const Mat3 rotation = about_vertical(angle);
  const auto carry_rigidly = [&](Vec3d p) { return other.center + rotation * (p - own.center); };
  std::vector<Vec3d> positions;
  for (std::size_t b = 0; b < balls.size(); ++b) {
    const Vec3d p(balls[b].center);
    const auto limb_match =
        std::find_if(matched.begin(), matched.end(),
                     [&](const MatchedLimbs& pair) { return own.holds(pair.from, b); });
    if (limb_match != matched.end()) {
      const Limb &from = own.limbs[limb_match->from], &to = other.limbs[limb_match->to];
      positions.push_back(map_to_limb(p, station_of(own, from, b), from, to, rotation));
      continue;
    }
    const auto weight_at = [&](double distance) {
      const double root_radius = kRootRadius * own.max_distance;
      return 1 / (distance * distance + root_radius * root_radius);
    };
    double weights = weight_at(own.ball_distances[b]);  // the centre is not displaced
    Vec3d sum;
    for (const MatchedLimbs& pair : matched) {
      const double weight = weight_at(own.ball_root_distances[pair.from][b]);
      sum = sum +
            (other.limbs[pair.to].line[0] - carry_rigidly(own.limbs[pair.from].line[0])) * weight;
      weights += weight;
    }
    positions.push_back(carry_rigidly(p) + sum * (1 / weights));
  }
  return positions;
}

std::vector<std::int32_t> limb_indices_of_balls(const Limbs& limbs,
                                                std::span<const std::uint32_t> matched) {
  std::vector<std::int32_t> indices(limbs.ball_limbs.size(), kNoLabel);
  for (std::size_t b = 0; b < indices.size(); ++b)
    for (std::size_t n = 0; n < matched.size(); ++n)
      if (limbs.holds(matched[n], b)) indices[b] = static_cast<std::int32_t>(n);
  return indices;
}

std::pair<std::vector<double>, std::vector<double>> balance_masses(
    std::span<const double> from, std::span<const std::int32_t> from_limbs,
    std::span<const double> to, std::span<const std::int32_t> to_limbs) {
  constexpr double kMinShare = 1e-6;  // keeps the ratio of shares finite
  const auto shares = [](std::span<const double> masses, std::span<const std::int32_t> limbs) {
    std::map<std::int32_t, double> sums;
    for (std::size_t b = 0; b < masses.size(); ++b) sums[limbs[b]] += masses[b];
    return sums;
  };
  auto from_shares = shares(from, from_limbs), to_shares = shares(to, to_limbs);
  const auto balance = [](std::span<const double> masses, std::span<const std::int32_t> limbs,
                          std::map<std::int32_t, double>& own,
                          std::map<std::int32_t, double>& other) {
    std::vector<double> balanced;
    double sum = 0;
    for (std::size_t b = 0; b < masses.size(); ++b) {
      const double own_share = std::max(own[limbs[b]], double{kMinShare}),
                   other_share = std::max(other[limbs[b]], double{kMinShare});
      balanced.push_back(std::max(masses[b] * std::sqrt(other_share / own_share), 1e-9));  // > 0
      sum += balanced.back();
    }
    for (double& mass : balanced) mass /= sum;
    return balanced;
  };
  return {balance(from, from_limbs, from_shares, to_shares),
          balance(to, to_limbs, to_shares, from_shares)};
}

std::pair<CostSide, CostSide> limb_cost_sides(const LimbPlan& limbs, const std::vector<Ball>& from,
                                              const std::vector<Ball>& to,
                                              const CostSide& from_side, const CostSide& to_side) {
  const auto [source, target] = make_match_sides(limbs, from, to);
  const auto make_side = [&](std::size_t count, const CostSide& plain, const auto& in_to,
                             const auto& in_from, const Limbs& own) {
    CostSide side;
    // Adds an axis of the feature space; value(b): coordinate of ball b.
    const auto axis = [&](const auto& value) {
      std::vector<float> values(count);
      for (std::size_t b = 0; b < count; ++b) values[b] = static_cast<float>(value(b));
      side.values.push_back(std::move(values));
    };
    // sqrt(0.5), because half of each squared distance counts.
    const double to_scale = std::sqrt(0.5) / limbs.to.rms,
                 from_scale = std::sqrt(0.5) / limbs.from.rms;
    axis([&](std::size_t b) { return (in_to(b).x - limbs.to.middle.x) * to_scale; });
    axis([&](std::size_t b) { return (in_to(b).y - limbs.to.middle.y) * to_scale; });
    axis([&](std::size_t b) { return (in_to(b).z - limbs.to.middle.z) * to_scale; });
    axis([&](std::size_t b) { return (in_from(b).x - limbs.from.middle.x) * from_scale; });
    axis([&](std::size_t b) { return (in_from(b).y - limbs.from.middle.y) * from_scale; });
    axis([&](std::size_t b) { return (in_from(b).z - limbs.from.middle.z) * from_scale; });
    axis([&](std::size_t b) {
      return std::sqrt(kDistanceWeight) * own.ball_distances[b] / std::max(own.max_distance, 1e-9);
    });
    side.first_pinned_axis = side.values.size();
    for (std::size_t k = plain.first_pinned_axis; k < plain.values.size(); ++k)
      side.values.push_back(plain.values[k]);
    side.labels = plain.labels;
    return side;
  };
  const auto center = [](const std::vector<Ball>& balls) {
    return [&balls](std::size_t b) { return Vec3d(balls[b].center); };
  };
  const auto warped_center = [](const std::vector<Vec3d>& places) {
    return [&places](std::size_t b) { return places[b]; };
  };
  // The two functions of a side give a ball's centre in the target and in the source; one of the
  // centres is the ball's own, the other is warped.
  std::pair sides(
      make_side(from.size(), from_side, warped_center(source.places), center(from), limbs.from),
      make_side(to.size(), to_side, center(to), warped_center(target.places), limbs.to));
  std::tie(sides.first.mass, sides.second.mass) =
      balance_masses(from_side.mass, limb_indices_of_balls(limbs.from, source.matched),
                     to_side.mass, limb_indices_of_balls(limbs.to, target.matched));
  return sides;
}

std::vector<std::pair<std::string, std::string>> list_limb_names(const LimbPlan& limbs,
                                                                 double angle) {
  const std::vector<std::string> from = limb_names(limbs.from), to = limb_names(limbs.to, angle);
  std::vector<std::pair<std::string, std::string>> names;
  // Masks of the limbs that are matched, and of those that sit on a matched limb; find_limbs()
  // finds at most 27 limbs (14 leaves and 13 nodes below them).
  std::uint32_t from_listed = 0, to_listed = 0;
  const auto mask = [](const Limbs& all, std::uint32_t limb) {
    std::uint32_t bits = 1u << limb;
    for (const std::uint32_t i : all.limbs[limb].nested) bits |= 1u << i;
    return bits;
  };
  for (const auto& [i, k] : limbs.match.limbs) {
    names.emplace_back(from[i], to[k]);
    from_listed |= mask(limbs.from, i);
    to_listed |= mask(limbs.to, k);
  }
  // A limb that others sit on is left out, because these stand for it.
  for (std::uint32_t i = 0; i < from.size(); ++i)
    if (limbs.from.limbs[i].nested.empty() && !(from_listed >> i & 1))
      names.emplace_back(from[i], "");
  for (std::uint32_t k = 0; k < to.size(); ++k)
    if (limbs.to.limbs[k].nested.empty() && !(to_listed >> k & 1)) names.emplace_back("", to[k]);
  return names;
}

}  // namespace polymorph
