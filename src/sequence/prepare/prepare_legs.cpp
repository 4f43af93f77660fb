#include "sequence/prepare/prepare_legs.h"

#include "base/activity.h"
#include "base/log.h"
#include "leg/make_leg.h"
#include "leg/map_fold.h"
#include "morph/labels.h"
#include "morph/plan_words.h"

namespace polymorph {
namespace {

LabelledObject label_list(const PreparedObject& object) {
  return {object.name, object.model.label_names};
}

/// Makes the input of a plan for one of its objects. `numbers`: LabelMatch::from or to, the number
/// of each of the object's labels.
PlanSide plan_side(const PreparedObject& object, const std::vector<std::int32_t>& numbers) {
  PlanSide side;
  side.name = object.name;
  side.balls = object.balls;
  side.front = object.front;
  for (const std::uint32_t label : object.ball_labels) side.labels.push_back(numbers[label]);
  return side;
}

/// Logs the overall rotation of the morph and which limb becomes which.
void log_plan(const MorphPlan& plan, const std::string& from, const std::string& to) {
  if (const std::string rotation = describe_rotation(plan); !rotation.empty())
    log_info("{} -> {}: {}", from, to, rotation);
  if (const std::string limbs = describe_limbs(plan); !limbs.empty())
    log_info("{} -> {}: limbs: {}", from, to, limbs);
}

/// Lists the names of the landmarks that both objects have.
std::vector<std::string> common_landmarks(const PreparedObject& from, const PreparedObject& to) {
  std::vector<std::string> names;
  for (const auto& [name, place] : from.landmarks)
    if (to.landmarks.contains(name)) names.push_back(name);
  return names;
}

/// Both ends of a leg, and the names of the landmarks that both have.
struct LegEnds {
  const PreparedObject &from, &to;
  std::vector<std::string> landmarks;
};

MorphPlan plan_leg(const PlanSettings& settings, const LegEnds& ends, const MotionSettings& motion,
                   FieldKind kind, const std::filesystem::path& cache) {
  const auto& [from, to, landmarks] = ends;
  const LabelMatch match = match_labels(label_list(from), label_list(to), settings.labels);
  PlanSide source = plan_side(from, match.from), target = plan_side(to, match.to);
  for (const std::string& name : landmarks) {
    source.landmarks.push_back(from.landmarks.at(name));
    target.landmarks.push_back(to.landmarks.at(name));
  }
  return plan_morph(std::move(source), std::move(target), kind, settings, motion, cache);
}

/// Makes the actor's legs in order: a leg may start from the previous one's balls in flight.
Status add_legs(const Preparation& preparation, const PlanSettings& settings, PreparedActor& actor,
                std::vector<std::string>& warnings) {
  const auto& [scene, engine, cache, fits] = preparation;
  std::vector<LabelledObject> labels;
  for (const auto& object : actor.objects) labels.push_back(label_list(*object));
  PM_TRY_STATUS(check_label_map(labels, settings.labels));
  const std::vector<LegTiming>& timings = actor.timeline.legs;
  std::shared_ptr<const PreparedObject> source = actor.objects.front();
  // The leg before, if it is left before its end; else null.
  std::shared_ptr<const Leg> previous;
  for (std::size_t i = 0; i < timings.size(); ++i) {
    const std::shared_ptr<const PreparedObject> target = actor.objects[i + 1];
    const Activity activity("planning " + source->name + " -> " + target->name);
    LegParts parts{source, target, /*plan=*/{}, previous, common_landmarks(*source, *target)};
    parts.plan = plan_leg(settings, {*source, *target, parts.landmark_names}, timings[i].motion,
                          scene.field.kind, cache);
    log_plan(parts.plan, source->name, target->name);
    if (previous) parts.pace = leg_pace(timings[i - 1]) / leg_pace(timings[i]);
    PM_TRY(const std::shared_ptr<const Leg> leg,
           make_leg(std::move(parts), timings[i], actor.settings, engine, cache));
    actor.legs.push_back(leg);
    PM_TRY(const std::string fold_warning, describe_fold(*leg, engine));
    if (!fold_warning.empty()) warnings.push_back(fold_warning);
    if (mixes_many(actor.timeline)) continue;  // all legs start from the first object
    source = target;
    previous = nullptr;
    if (leg->until == 1) continue;
    // The leg is left before its end: its balls in flight are the next leg's source.
    const bool with_distances =
        i + 1 < timings.size() && timings[i + 1].interpolation == Interpolation::kDistance;
    PM_TRY(PreparedObject object, make_flight_object(*leg, with_distances, engine, cache));
    source = std::make_shared<const PreparedObject>(std::move(object));
    actor.objects.push_back(source);
    previous = leg;
  }
  if (!mixes_many(actor.timeline)) return Ok{};
  PM_TRY(ShapeSpace space, make_shape_space(actor.legs, engine));
  actor.space = std::make_shared<const ShapeSpace>(std::move(space));
  return Ok{};
}

}  // namespace

Result<std::vector<PreparedActor>> make_actors(const Preparation& preparation,
                                               std::span<const ActorOutline> outlines,
                                               std::span<const ObjectList> objects,
                                               std::vector<std::string>& warnings) {
  std::vector<PreparedActor> actors;
  actors.reserve(outlines.size());
  for (std::size_t a = 0; a < outlines.size(); ++a) {
    PreparedActor& actor = actors.emplace_back(
        PreparedActor{outlines[a], objects[a], /*legs=*/{}, /*space=*/{}, /*poses=*/{}});
    if (actor.shared_actor != a) {
      const PreparedActor& first = actors[actor.shared_actor];
      actor.objects = first.objects;
      actor.legs = first.legs;
      actor.settings = first.settings;
      continue;
    }
    PM_TRY_STATUS(add_legs(preparation, preparation.scene.actors[a].plan, actor, warnings));
  }
  return actors;
}

MorphPlan plan_between(const Preparation& preparation, std::size_t actor,
                       const PreparedObject& from, const PreparedObject& to) {
  const Scene& scene = preparation.scene;
  return plan_leg(scene.actors[actor].plan, {from, to, common_landmarks(from, to)}, /*motion=*/{},
                  scene.field.kind, preparation.cache);
}

}  // namespace polymorph
