#include "sequence/geometry/frame_labels.h"

#include <string_view>
#include <unordered_map>

#include "morph/labels.h"

namespace polymorph {
namespace {

/// The object's labels in the actor's numbering.
std::vector<std::uint32_t> label_numbers(const PreparedActor& actor, const PreparedObject& object) {
  std::unordered_map<std::string_view, std::uint32_t> number_of;
  for (const std::string& name : actor.label_names)
    number_of.emplace(name, static_cast<std::uint32_t>(number_of.size()));
  std::vector<std::uint32_t> numbers;
  for (const std::string& name : object.model.label_names) numbers.push_back(number_of.at(name));
  return numbers;
}

}  // namespace

std::vector<std::uint32_t> model_labels(const PreparedActor& actor, const PreparedObject& object) {
  const std::vector<std::uint32_t> numbers = label_numbers(actor, object);
  std::vector<std::uint32_t> labels(object.model.points.size(), 0);
  for (std::size_t t = 0; t < object.model.triangles.size(); ++t)
    for (const std::uint32_t v : object.model.triangles[t].v)
      labels[v] = numbers[object.model.labels[t]];
  return labels;
}

Result<std::vector<std::uint32_t>> surface_labels(const PreparedActor& actor,
                                                  const ActorGeometry& geometry, Engine& engine) {
  const std::vector<Vec3>& points = geometry.surface.positions;
  const MorphState& moment = geometry.moment;
  if (moment.object < 0) {
    const PreparedLeg& leg = leg_of(actor, moment.leg);
    const auto names = [&](std::size_t object) {
      const std::vector<std::uint32_t> numbers = label_numbers(actor, actor.objects[object]);
      std::vector<std::uint32_t> own;
      for (const std::uint32_t label : actor.objects[object].ball_labels)
        own.push_back(numbers[label]);
      return own;
    };
    return label_points(leg.plan, moment.time, geometry.balls, points, names(leg.from),
                        names(leg.to), engine);
  }
  const PreparedObject& object = object_of(actor, moment.object);
  const std::vector<std::uint32_t> numbers = label_numbers(actor, object);
  std::vector<std::uint32_t> labels;
  for (const ClosestPoint& point : object.outer->closest(points))
    labels.push_back(numbers[object.model.labels[point.triangle]]);
  return labels;
}

}  // namespace polymorph
