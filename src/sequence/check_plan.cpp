#include "sequence/check_plan.h"

#include <algorithm>

#include "kernels/linear.h"
#include "morph/labels.h"
#include "scene/load_scene.h"

namespace polymorph {
namespace {

float distance_to(const Box& box, Vec3 p) {
  const Vec3 nearest = min(max(p, box.low), box.high);
  return length(p - nearest);
}

/// Empty where the point is near enough.
std::string far_landmark(const ActorSettings& actor, std::size_t number, const char* end, Vec3 p,
                         const ObjectSettings& object, const Model& model) {
  const Box box = model.box();
  const float away = distance_to(box, p);
  if (away <= box.diagonal()) return {};
  return fmt::format(
      "{}: landmark {}: \"{}\" ({:.4g}, {:.4g}, {:.4g}) is {:.3g} away from {}, which reaches from "
      "({:.4g}, {:.4g}, {:.4g}) to ({:.4g}, {:.4g}, {:.4g}) - give the point where the object "
      "stands in the scene",
      actor.name, number, end, p.x, p.y, p.z, away, object.name, box.low.x, box.low.y, box.low.z,
      box.high.x, box.high.y, box.high.z);
}

void check_actor(const ActorSettings& actor, std::span<const Model> models,
                 std::vector<std::string>& problems) {
  const std::vector<const ObjectSettings*> objects = chain_objects(actor);
  std::vector<LabelledObject> labels;
  for (std::size_t i = 0; i < objects.size(); ++i)
    labels.push_back({objects[i]->name, models[i].label_names});
  if (const Status known = check_label_map(labels, actor.plan.labels); !known)
    problems.push_back(known.error().message);
  const auto look_at = [&](std::size_t number, const char* end, Vec3 p, std::size_t object) {
    const std::string far = far_landmark(actor, number, end, p, *objects[object], models[object]);
    if (!far.empty()) problems.push_back(far);
  };
  for (std::size_t i = 0; i < actor.plan.landmarks.size(); ++i) {
    const LandmarkSettings& landmark = actor.plan.landmarks[i];
    const auto to = static_cast<std::size_t>(landmark.leg);
    if (to < 1 || to >= objects.size()) continue;  // an error of the scene file
    // What is left before it is reached is balls in flight, wherever they are.
    if (!(objects[to - 1]->retarget < 1)) look_at(i, "from", landmark.from, to - 1);
    look_at(i, "to", landmark.to, to);
  }
}

}  // namespace

std::vector<std::string> plan_problems(const Scene& scene, std::span<const Model> models) {
  std::vector<std::string> problems;
  for (const ActorSettings& actor : scene.actors) {
    const std::size_t count = chain_objects(actor).size();
    check_actor(actor, models.first(count), problems);
    models = models.subspan(count);
  }
  return problems;
}

}  // namespace polymorph
