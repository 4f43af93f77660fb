#include "base/exact_math.h"
#include "inspect/inspection.h"
#include "morph/cost.h"
#include "morph/plan_cycle.h"
#include "morph/plan_words.h"
#include "sequence/prepare/prepare_legs.h"

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
  if (actor.space) return std::nullopt;  // blend_cycles() has those of a blend
  std::vector<const MorphPlan*> plans;
  for (const auto& leg : actor.legs) {
    if (leg->before) return std::nullopt;  // from balls in flight, not from an object
    plans.push_back(&leg->plan);
  }
  return cycle_error(plans);
}

/// Errors of the way from a blend's reference to one object, on to another, and back.
struct BlendCycle {
  std::string from, to;        ///< names of the two objects
  CycleError by_reference;     ///< the way between them leads over the reference, as in the blend
  CycleError by_plan_between;  ///< the way between them is a plan of its own
};

MorphPlan backwards(const MorphPlan& plan) {
  MorphPlan reverse = plan;
  swap_ends(reverse);
  return reverse;
}

/// The cycles through every two objects beside the reference. Plans between these two are made for
/// the comparison alone.
std::vector<BlendCycle> blend_cycles(const Preparation& preparation, std::size_t number,
                                     const PreparedActor& actor) {
  std::vector<BlendCycle> cycles;
  for (std::size_t i = 0; i < actor.legs.size(); ++i)
    for (std::size_t j = i + 1; j < actor.legs.size(); ++j) {
      const Leg &one = *actor.legs[i], &other = *actor.legs[j];
      const MorphPlan between = plan_between(preparation, number, *one.to, *other.to);
      const MorphPlan one_back = backwards(one.plan), other_back = backwards(other.plan);
      const auto direct = cycle_error({&one.plan, &between, &other_back});
      const auto blended = cycle_error({&one.plan, &one_back, &other.plan, &other_back});
      if (direct && blended) cycles.push_back({one.to->name, other.to->name, *blended, *direct});
    }
  return cycles;
}

JsonValue describe_error(const CycleError& error) {
  return {{"drift", error.drift}, {"spread", error.spread}};
}

}  // namespace

Inspection inspect_plan(const PreparedScene& prepared, Engine& engine,
                        const std::filesystem::path& cache) {
  Inspection out;
  out.json = {{"actors", JsonValue::array()}};
  for (std::size_t a = 0; a < prepared.actors.size(); ++a) {
    const PreparedActor& actor = prepared.actors[a];
    JsonValue legs = JsonValue::array();
    if (prepared.actors.size() > 1) out.text += fmt::format("{}:\n", actor.name);
    for (const auto& leg : actor.legs) {
      legs.push_back(describe_leg(*leg));
      out.text += describe_in_lines(*leg);
    }
    JsonValue described = {{"name", actor.name}, {"legs", std::move(legs)}};
    if (const std::optional<CycleError> cycle = actor_cycle(actor)) {
      described["cycle"] = describe_error(*cycle);
      out.text += fmt::format(
          "Once around, mass comes back {:.2f} of the size from where it set out, on the mean, and "
          "spreads by {:.2f}; 0: consistent plans, 1: unrelated ones\n",
          cycle->drift, cycle->spread);
    }
    if (actor.space) {
      described["cycles"] = JsonValue::array();
      const std::string& reference = actor.objects.front()->name;
      for (const BlendCycle& cycle : blend_cycles({prepared.scene, engine, cache}, a, actor)) {
        described["cycles"].push_back(
            {{"objects", JsonValue::array({reference, cycle.from, cycle.to})},
             {"by_reference", describe_error(cycle.by_reference)},
             {"by_plan_between", describe_error(cycle.by_plan_between)}});
        out.text += fmt::format(
            "Once around {0}, {1} and {2}, mass comes back {3:.2f} of the size from where it set "
            "out, on the mean, and spreads by {4:.2f}, as the way from {1} to {2} leads over {0}; "
            "by a plan of their own it would be {5:.2f} and {6:.2f}\n",
            reference, cycle.from, cycle.to, cycle.by_reference.drift, cycle.by_reference.spread,
            cycle.by_plan_between.drift, cycle.by_plan_between.spread);
      }
    }
    out.json["actors"].push_back(std::move(described));
  }
  return out;
}

}  // namespace polymorph
