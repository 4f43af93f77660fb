#include "morph/labels.h"

#include <algorithm>
#include <set>

#include "base/text.h"
#include "model/closest.h"
#include "morph/cost.h"

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
      std::int32_t least = match.from[i];
      if (match.to[j] != kNoLabel) least = std::min(least, match.to[j]);
      changed |= match.from[i] != least || match.to[j] != least;
      match.from[i] = match.to[j] = least;
    }
  }
  return match;
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
