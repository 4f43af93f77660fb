#include "morph/labels.h"

#include <algorithm>
#include <numeric>
#include <set>
#include <span>
#include <unordered_map>

#include "base/disjoint_sets.h"
#include "base/text.h"
#include "field/extract_surface.h"
#include "mesh/closest.h"
#include "morph/cost.h"
#include "morph/motion.h"

namespace polymorph {
namespace {

/// Finds an object's labels by name; several labels may have one name.
class LabelIndex {
 public:
  explicit LabelIndex(const LabelledObject& object) : prefix_(object.name + ".") {
    for (std::size_t i = 0; i < object.labels.size(); ++i)
      by_name_[object.labels[i]].push_back(static_cast<std::uint32_t>(i));
  }
  std::span<const std::uint32_t> find_label(const std::string& label) const {
    const auto found = by_name_.find(label);
    return found == by_name_.end() ? std::span<const std::uint32_t>() : found->second;
  }
  /// The labels that `name`, "label" or "object.label", refers to.
  std::vector<std::uint32_t> resolve(const std::string& name) const {
    const std::span<const std::uint32_t> unqualified = find_label(name);
    std::vector<std::uint32_t> matches(unqualified.begin(), unqualified.end());
    if (name.starts_with(prefix_)) {
      const std::span<const std::uint32_t> qualified = find_label(name.substr(prefix_.size()));
      matches.insert(matches.end(), qualified.begin(), qualified.end());
    }
    return matches;
  }

 private:
  std::string prefix_;
  std::unordered_map<std::string, std::vector<std::uint32_t>> by_name_;
};

}  // namespace

std::vector<std::uint32_t> face_labels(const Model& model, const std::vector<Ball>& balls) {
  std::vector<std::uint32_t> result(balls.size(), 0);
  if (model.label_names.size() < 2) return result;  // every face has label 0
  std::vector<Vec3> centers;
  for (const Ball& ball : balls) centers.push_back(ball.center);
  const std::vector<ClosestPoint> closest = ClosestPointQuery(model).closest(centers);
  for (std::size_t i = 0; i < balls.size(); ++i)
    if (closest[i].triangle != ClosestPoint::kNoTriangle)
      result[i] = model.labels[closest[i].triangle];
  return result;
}

LabelMatch match_labels(const LabelledObject& from, const LabelledObject& to,
                        const std::map<std::string, std::string>& map) {
  const std::size_t n = from.labels.size(), m = to.labels.size();
  const LabelIndex from_index(from), to_index(to);
  // Sets of labels that match. Elements 0 to n - 1 are the labels of `from`, the others the labels
  // of `to`.
  DisjointSets sets(n + m);
  std::vector<std::uint8_t> is_matched(n + m, 0);
  const auto join = [&](std::span<const std::uint32_t> from_labels,
                        std::span<const std::uint32_t> to_labels) {
    if (from_labels.empty() || to_labels.empty()) return;
    const auto add = [&](std::size_t k) {
      sets.join(from_labels.front(), static_cast<std::uint32_t>(k));
      is_matched[k] = 1;
    };
    for (const std::uint32_t i : from_labels) add(i);
    for (const std::uint32_t j : to_labels) add(n + j);
  };
  for (const auto& [key, value] : map) {
    join(from_index.resolve(key), to_index.resolve(value));
    join(from_index.resolve(value), to_index.resolve(key));
  }
  const std::vector<std::uint8_t> matched_by_map = is_matched;
  for (std::size_t i = 0; i < n; ++i)
    for (const std::uint32_t j : to_index.find_label(from.labels[i]))
      if (!matched_by_map[i] && !matched_by_map[n + j]) {
        sets.join(static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(n + j));
        is_matched[i] = is_matched[n + j] = 1;
      }
  // A set's number is its smallest member, which is a label of `from`.
  LabelMatch match{std::vector<std::int32_t>(n, kNoLabel), std::vector<std::int32_t>(m, kNoLabel)};
  for (std::size_t k = 0; k < n + m; ++k)
    if (is_matched[k])
      (k < n ? match.from[k] : match.to[k - n]) =
          static_cast<std::int32_t>(sets.find(static_cast<std::uint32_t>(k)));
  return match;
}

Result<std::vector<std::uint32_t>> label_points(PlanMoment moment, const BallSet& balls,
                                                const std::vector<Vec3>& points,
                                                const BallLabels& names, Engine& engine) {
  const MorphPlan& plan = moment.plan;
  PM_CHECK(balls.size() == plan.pairs.size());
  PM_CHECK(names.from.size() == plan.from.size() && names.to.size() == plan.to.size());
  // The labels that balls have, and 0, so that the list is never empty. They are renumbered by
  // their index in `distinct_labels`, because an object may have many more labels.
  std::vector<std::uint32_t> distinct_labels{0};
  for (const auto* labels : {&names.from, &names.to})
    distinct_labels.insert(distinct_labels.end(), labels->begin(), labels->end());
  std::sort(distinct_labels.begin(), distinct_labels.end());
  distinct_labels.erase(std::unique(distinct_labels.begin(), distinct_labels.end()),
                        distinct_labels.end());
  const auto count = static_cast<std::uint32_t>(distinct_labels.size());
  const auto index_of_label = [&](std::uint32_t name) {
    return static_cast<std::uint32_t>(
        std::lower_bound(distinct_labels.begin(), distinct_labels.end(), name) -
        distinct_labels.begin());
  };
  // Matched labels form a family, whose number is the smallest of its labels.
  std::vector<std::uint32_t> family(count);
  std::iota(family.begin(), family.end(), 0u);
  for (const Pair& pair : plan.pairs) {
    if (plan.from_labels.empty() || plan.from_labels[pair.from] == kNoLabel ||
        plan.from_labels[pair.from] != plan.to_labels[pair.to])
      continue;
    const std::uint32_t a = family[index_of_label(names.from[pair.from])],
                        b = family[index_of_label(names.to[pair.to])];
    std::replace(family.begin(), family.end(), std::max(a, b), std::min(a, b));
  }
  // Each label's weight is a value attached to the balls. A pass interpolates eight labels, in two
  // attributes of four values per ball.
  const std::vector<float> progress = pair_progress(plan, moment.time);
  std::vector<float> label_weights(points.size() * count);
  for (std::uint32_t first = 0; first < count; first += 8) {
    std::vector<BallAttribute> attributes(2 * balls.size());
    const auto add = [&](std::size_t ball, std::uint32_t label, float share) {
      if (label < first || label >= first + 8) return;
      attributes[2 * ball + (label - first) / 4].value[(label - first) % 4] += share;
    };
    for (std::size_t e = 0; e < balls.size(); ++e) {
      add(e, index_of_label(names.from[plan.pairs[e].from]), 1 - progress[e]);
      add(e, index_of_label(names.to[plan.pairs[e].to]), progress[e]);
    }
    PM_TRY(const std::vector<AttributeValues> values,
           interpolate_attributes(engine, balls, plan.kind, attributes, points));
    for (std::size_t i = 0; i < points.size(); ++i)
      for (std::uint32_t k = 0; k < std::min(count - first, 8u); ++k)
        label_weights[i * count + first + k] = values[2 * i + k / 4].v[k % 4];
  }
  // Each point gets the heaviest label of the heaviest family.
  std::vector<std::uint32_t> labels(points.size());
  std::vector<float> family_weight(count);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const float* weight = label_weights.data() + i * count;
    std::fill(family_weight.begin(), family_weight.end(), 0.0f);
    for (std::uint32_t label = 0; label < count; ++label)
      family_weight[family[label]] += weight[label];
    const auto best = static_cast<std::uint32_t>(
        std::max_element(family_weight.begin(), family_weight.end()) - family_weight.begin());
    std::uint32_t winner = best;
    for (std::uint32_t label = 0; label < count; ++label)
      if (family[label] == best && weight[label] > weight[winner]) winner = label;
    labels[i] = distinct_labels[winner];
  }
  return labels;
}

Status check_label_map(const std::vector<LabelledObject>& chain,
                       const std::map<std::string, std::string>& map) {
  std::vector<std::string> qualified_names;
  std::set<std::string> names;
  for (const LabelledObject& object : chain)
    for (const std::string& label : object.labels) {
      qualified_names.push_back(object.name + "." + label);
      names.insert(qualified_names.back());
      names.insert(label);
    }
  for (const auto& [key, value] : map)
    for (const std::string& name : {key, value}) {
      if (names.contains(name)) continue;
      return make_error(ErrorCode::kInput,
                        "/plan/labels: no object has a face group \"{}\"{} - groups here: {}", name,
                        did_you_mean(name, qualified_names), join_quoted(qualified_names));
    }
  return Ok{};
}

}  // namespace polymorph
