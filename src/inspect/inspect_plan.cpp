#include "base/exact_math.h"
#include "inspect/inspection.h"
#include "morph/cost.h"
#include "morph/plan_cycle.h"
#include "morph/plan_words.h"

namespace polymorph {
namespace {

/// The share of an object's mass that belongs to matched limbs.
double share_in_limbs(const std::vector<double>& masses, const std::vector<std::int32_t>& limbs) {
  double inside = 0, all = 0;
  for (std::size_t b = 0; b < masses.size(); ++b) {
    all += masses[b];
    if (b < limbs.size() && limbs[b] != kNoLabel) inside += masses[b];
  }
  return all > 0 ? inside / all : 0;
}

JsonValue describe_leg(const Leg& leg) {
  const MorphPlan& plan = leg.plan;
  constexpr double kDegrees = 180 / exact::kPi;
  JsonValue limbs = JsonValue::array(), landmarks = JsonValue::array();
  for (const auto& [from, to] : plan.limb_names) limbs.push_back(JsonValue::array({from, to}));
  for (const std::string& name : leg.landmark_names) landmarks.push_back(name);
  return {{"from", leg.from->name},
          {"to", leg.to->name},
          {"limbs", std::move(limbs)},
          {"mass_in_limbs", JsonValue::array({share_in_limbs(plan.from_masses, plan.from_limbs),
                                              share_in_limbs(plan.to_masses, plan.to_limbs)})},
          {"turn_degrees", length(plan.alignment.turn) * kDegrees},
          {"scale", plan.alignment.scale},
          {"strain", plan.alignment.strain},
          {"balls", JsonValue::array({plan.from.size(), plan.to.size()})},
          {"pairs", plan.pairs.size()},
          {"landmarks", std::move(landmarks)}};
}

std::string describe_certainty(const MorphPlan& plan) {
  if (plan.limb_names.empty())
    return "made without limbs: they are off, not certain, or the objects are nearly alike";
  return fmt::format("matched limbs hold {:.0f} % of the source and {:.0f} % of the target",
                     100 * share_in_limbs(plan.from_masses, plan.from_limbs),
                     100 * share_in_limbs(plan.to_masses, plan.to_limbs));
}

std::string describe_in_lines(const Leg& leg) {
  const MorphPlan& plan = leg.plan;
  const std::string turn = describe_turn(plan), limbs = describe_limbs(plan);
  std::string text = fmt::format("{} -> {}\n", leg.from->name, leg.to->name);
  const auto add = [&](const char* what, const std::string& words) {
    text += fmt::format("  {:<10} {}\n", what, words);
  };
  add("limbs", limbs.empty() ? "-" : limbs);
  add("certainty", describe_certainty(plan));
  add("turn", turn.empty() ? "does not turn" : turn);
  add("left over",
      fmt::format("{:.2f} of the size; 0: a turned copy, 1: nothing alike", plan.alignment.strain));
  add("balls",
      fmt::format("{} -> {} in {} pairs", plan.from.size(), plan.to.size(), plan.pairs.size()));
  add("landmarks",
      leg.landmark_names.empty() ? "none" : fmt::format("{}", fmt::join(leg.landmark_names, ", ")));
  return text;
}

/// The error of the actor's plans where its chain ends with the object that it begins with.
std::optional<CycleError> actor_cycle(const PreparedActor& actor) {
  if (actor.space) return std::nullopt;  // all plans start at one object, and none comes back
  std::vector<const MorphPlan*> plans;
  for (const auto& leg : actor.legs) {
    if (leg->before) return std::nullopt;  // from balls in flight, not from an object
    plans.push_back(&leg->plan);
  }
  return cycle_error(plans);
}

}  // namespace

Inspection inspect_plan(const PreparedScene& prepared) {
  Inspection out;
  out.json = {{"actors", JsonValue::array()}};
  for (const PreparedActor& actor : prepared.actors) {
    JsonValue legs = JsonValue::array();
    if (prepared.actors.size() > 1) out.text += fmt::format("{}:\n", actor.name);
    for (const auto& leg : actor.legs) {
      legs.push_back(describe_leg(*leg));
      out.text += describe_in_lines(*leg);
    }
    JsonValue described = {{"name", actor.name}, {"legs", std::move(legs)}};
    if (const std::optional<CycleError> cycle = actor_cycle(actor)) {
      described["cycle"] = {{"drift", cycle->drift}, {"spread", cycle->spread}};
      out.text += fmt::format(
          "Once around, mass comes back {:.2f} of the size from where it set out, on the mean, and "
          "spreads by {:.2f}; 0: consistent plans, 1: unrelated ones\n",
          cycle->drift, cycle->spread);
    }
    out.json["actors"].push_back(std::move(described));
  }
  return out;
}

}  // namespace polymorph
