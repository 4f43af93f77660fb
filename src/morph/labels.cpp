#include "morph/labels.h"

#include <algorithm>
#include <numeric>
#include <set>

#include "base/text.h"
#include "model/query/closest.h"
#include "morph/cost.h"
#include "morph/motion.h"
#include "surface/grid.h"

namespace polymorph {
namespace {

/// Does `name` ("object.label" or "label") mean this label of this object?
bool means(const std::string& name, const std::string& object, const std::string& label) {
  return name == label || name == object + "." + label;
}

}  // namespace

std::vector<std::uint32_t> face_labels(const Model& model, const std::vector<Ball>& balls) {
  std::vector<std::uint32_t> result(balls.size(), 0);
  if (model.label_names.size() < 2) return result;
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
  const auto says = [&](const std::string& one, const std::string& other, std::size_t i,
                        std::size_t j) {
    return means(one, from.name, from.labels[i]) && means(other, to.name, to.labels[j]);
  };
  std::vector<std::pair<std::size_t, std::size_t>> links;
  std::vector<char> named_from(n, 0), named_to(m, 0);
  for (const auto& [key, value] : map)
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t j = 0; j < m; ++j)
        if (says(key, value, i, j) || says(value, key, i, j)) {
          links.emplace_back(i, j);
          named_from[i] = named_to[j] = 1;
        }
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = 0; j < m; ++j)
      if (!named_from[i] && !named_to[j] && from.labels[i] == to.labels[j])
        links.emplace_back(i, j);
  // Labels that share a partner are one; a number is the first linked label of `from` among them.
  LabelMatch match{std::vector<std::int32_t>(n, kNoLabel), std::vector<std::int32_t>(m, kNoLabel)};
  for (const auto& [i, j] : links)
    match.from[i] = match.from[i] == kNoLabel ? static_cast<std::int32_t>(i) : match.from[i];
  for (bool changed = true; changed;) {
    changed = false;
    for (const auto& [i, j] : links) {
      std::int32_t lowest = match.from[i];
      if (match.to[j] != kNoLabel) lowest = std::min(lowest, match.to[j]);
      changed |= match.from[i] != lowest || match.to[j] != lowest;
      match.from[i] = match.to[j] = lowest;
    }
  }
  return match;
}

Result<std::vector<std::uint32_t>> label_points(const MorphPlan& plan, float time,
                                                const BallSet& balls,
                                                const std::vector<Vec3>& points,
                                                std::span<const std::uint32_t> from_names,
                                                std::span<const std::uint32_t> to_names,
                                                Engine& engine) {
  PM_CHECK(balls.size() == plan.pairs.size());
  PM_CHECK(from_names.size() == plan.from.size() && to_names.size() == plan.to.size());
  std::uint32_t count = 1;
  for (const auto& names : {from_names, to_names})
    for (const std::uint32_t name : names) count = std::max(count, name + 1);
  // Names that belong together are a family, called by the least of them.
  std::vector<std::uint32_t> family(count);
  std::iota(family.begin(), family.end(), 0u);
  for (const Pair& pair : plan.pairs) {
    if (plan.from_labels.empty() || plan.from_labels[pair.from] == kNoLabel ||
        plan.from_labels[pair.from] != plan.to_labels[pair.to])
      continue;
    const std::uint32_t a = family[from_names[pair.from]], b = family[to_names[pair.to]];
    std::replace(family.begin(), family.end(), std::max(a, b), std::min(a, b));
  }
  // Each name is a value that the balls carry, eight at a time.
  const std::vector<float> progress = pair_progress(plan, time);
  std::vector<float> of_names(points.size() * count);
  for (std::uint32_t first = 0; first < count; first += 8) {
    std::vector<BallAttribute> carried(2 * balls.size());
    const auto add = [&](std::size_t ball, std::uint32_t name, float share) {
      if (name < first || name >= first + 8) return;
      carried[2 * ball + (name - first) / 4].value[(name - first) % 4] += share;
    };
    for (std::size_t e = 0; e < balls.size(); ++e) {
      add(e, from_names[plan.pairs[e].from], 1 - progress[e]);
      add(e, to_names[plan.pairs[e].to], progress[e]);
    }
    PM_TRY(const std::vector<AttributeValues> values,
           interpolate_attributes(engine, balls, plan.kind, carried, points));
    for (std::size_t i = 0; i < points.size(); ++i)
      for (std::uint32_t k = 0; k < std::min(count - first, 8u); ++k)
        of_names[i * count + first + k] = values[2 * i + k / 4].v[k % 4];
  }
  std::vector<std::uint32_t> labels(points.size());
  std::vector<float> of_family(count);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const float* of_name = of_names.data() + i * count;
    std::fill(of_family.begin(), of_family.end(), 0.0f);
    for (std::uint32_t name = 0; name < count; ++name) of_family[family[name]] += of_name[name];
    const auto best = static_cast<std::uint32_t>(
        std::max_element(of_family.begin(), of_family.end()) - of_family.begin());
    std::uint32_t winner = best;
    for (std::uint32_t name = 0; name < count; ++name)
      if (family[name] == best && of_name[name] > of_name[winner]) winner = name;
    labels[i] = winner;
  }
  return labels;
}

Status check_label_map(const std::vector<LabelledObject>& chain,
                       const std::map<std::string, std::string>& map) {
  std::vector<std::string> known;
  std::set<std::string> names;
  for (const LabelledObject& object : chain)
    for (const std::string& label : object.labels) {
      known.push_back(object.name + "." + label);
      names.insert(known.back());
      names.insert(label);
    }
  for (const auto& [key, value] : map)
    for (const std::string& name : {key, value}) {
      if (names.contains(name)) continue;
      return make_error(ErrorCode::kInput,
                        "/plan/labels: no object has a face group \"{}\"{} - groups here: {}", name,
                        did_you_mean(name, known), join_quoted(known));
    }
  return Ok{};
}

}  // namespace polymorph
