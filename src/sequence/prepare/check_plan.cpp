#include "sequence/prepare/check_plan.h"

#include <algorithm>

#include "kernels/linear.h"
#include "morph/labels.h"

namespace polymorph {
namespace {

float distance_to(const Box& box, Vec3 p) {
  const Vec3 nearest = min(max(p, box.low), box.high);
  return length(p - nearest);
}

/// One end of a landmark: its number in the plan, its key and its point.
struct LandmarkEnd {
  std::size_t number;
  const char* key;
  Vec3 point;
};

/// Says that a landmark's end is far from its object; empty where it is near enough.
std::string far_landmark(const ChainObject& object, const Model& model, const LandmarkEnd& end) {
  const Vec3 p = end.point;
  const Box box = model.box();
  const float distance = distance_to(box, p);
  if (distance <= box.diagonal()) return {};
  return fmt::format(
      "{}: landmark {}: \"{}\" ({:.4g}, {:.4g}, {:.4g}) is {:.3g} away from {}, which reaches from "
      "({:.4g}, {:.4g}, {:.4g}) to ({:.4g}, {:.4g}, {:.4g}) - give the point where the object "
      "stands in the scene",
      object.actor->name, end.number, end.key, p.x, p.y, p.z, distance, object.settings->name,
      box.low.x, box.low.y, box.low.z, box.high.x, box.high.y, box.high.z);
}

void check_actor(std::span<const ChainObject> chain, std::span<const Model> models,
                 std::vector<std::string>& problems) {
  const ActorSettings& actor = *chain.front().actor;
  std::vector<LabelledObject> labels;
  for (std::size_t i = 0; i < chain.size(); ++i)
    labels.push_back({chain[i].settings->name, models[i].label_names});
  if (const Status known = check_label_map(labels, actor.plan.labels); !known)
    problems.push_back(known.error().message);
  const auto look_at = [&](std::size_t object, const LandmarkEnd& end) {
    const std::string problem = far_landmark(chain[object], models[object], end);
    if (!problem.empty()) problems.push_back(problem);
  };
  for (std::size_t i = 0; i < actor.plan.landmarks.size(); ++i) {
    const LandmarkSettings& landmark = actor.plan.landmarks[i];
    const auto to = static_cast<std::size_t>(landmark.leg);
    if (to < 1 || to >= chain.size()) continue;  // an error of the scene file
    // What is left before it is reached is balls in flight, wherever they are.
    if (!(chain[to - 1].settings->retarget < 1)) look_at(to - 1, {i, "from", landmark.from});
    look_at(to, {i, "to", landmark.to});
  }
}

}  // namespace

std::vector<std::string> plan_problems(std::span<const ChainObject> chain,
                                       std::span<const Model> models) {
  std::vector<std::string> problems;
  for (const std::span<const ChainObject> objects : actor_chains(chain)) {
    check_actor(objects, models.first(objects.size()), problems);
    models = models.subspan(objects.size());
  }
  return problems;
}

}  // namespace polymorph
