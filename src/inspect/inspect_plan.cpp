#include "base/exact_math.h"
#include "inspect/inspection.h"
#include "morph/cost.h"
#include "morph/plan_cycle.h"
#include "morph/plan_words.h"
#include "sequence/prepare/prepare_legs.h"

namespace polymorph {
namespace {

/// Returns the fraction of an object's mass in matched limbs. `masses` has one value per ball,
/// `limbs` the matched limb of each ball, or kNoLabel. If `limbs` is empty, no ball is in a limb.
double mass_share_in_limbs(const std::vector<double>& masses,
                           const std::vector<std::int32_t>& limbs) {
  double matched = 0, all = 0;
  for (std::size_t b = 0; b < masses.size(); ++b) {
    all += masses[b];
    if (b < limbs.size() && limbs[b] != kNoLabel) matched += masses[b];
  }
  return all > 0 ? matched / all : 0;
}

/// Describes a leg's plan as JSON. A list of two has a value of the source, then one of the target.
JsonValue describe_leg(const Leg& leg) {
  const MorphPlan& plan = leg.plan;
  constexpr double kDegreesPerRadian = 180 / exact::kPi;
  JsonValue limbs = JsonValue::array(), landmarks = JsonValue::array();
  for (const auto& [from, to] : plan.limb_names) limbs.push_back(JsonValue::array({from, to}));
  for (const std::string& name : leg.landmark_names) landmarks.push_back(name);
  return {
      {"from", leg.from->name},
      {"to", leg.to->name},
      {"limbs", std::move(limbs)},
      {"mass_in_limbs", JsonValue::array({mass_share_in_limbs(plan.from_masses, plan.from_limbs),
                                          mass_share_in_limbs(plan.to_masses, plan.to_limbs)})},
      {"turn_degrees", length(plan.alignment.rotation_vector) * kDegreesPerRadian},
      {"scale", plan.alignment.scale},
      {"strain", plan.alignment.strain},
      {"balls", JsonValue::array({plan.from.size(), plan.to.size()})},
      {"pairs", plan.pairs.size()},
      {"landmarks", std::move(landmarks)}};
}

/// Describes whether the plan uses limbs, and which fraction of each object is in matched limbs.
std::string describe_certainty(const MorphPlan& plan) {
  if (plan.limb_names.empty())
    return "made without limbs: they are off, not certain, or the objects are nearly alike";
  return fmt::format("matched limbs hold {:.0f} % of the source and {:.0f} % of the target",
                     100 * mass_share_in_limbs(plan.from_masses, plan.from_limbs),
                     100 * mass_share_in_limbs(plan.to_masses, plan.to_limbs));
}

/// Describes a leg's plan as lines of text.
std::string leg_lines(const Leg& leg) {
  const MorphPlan& plan = leg.plan;
  const std::string rotation = describe_rotation(plan), limbs = describe_limbs(plan);
  std::string text = fmt::format("{} -> {}\n", leg.from->name, leg.to->name);
  const auto add = [&](const char* label, const std::string& words) {
    text += fmt::format("  {:<10} {}\n", label, words);
  };
  add("limbs", limbs.empty() ? "-" : limbs);
  add("certainty", describe_certainty(plan));
  add("turn", rotation.empty() ? "does not turn" : rotation);
  add("residual",
      fmt::format("{:.2f} of the size after alignment; 0: a turned copy, 1: nothing alike",
                  plan.alignment.strain));
  add("balls",
      fmt::format("{} -> {} in {} pairs", plan.from.size(), plan.to.size(), plan.pairs.size()));
  add("landmarks",
      leg.landmark_names.empty() ? "none" : fmt::format("{}", fmt::join(leg.landmark_names, ", ")));
  return text;
}

/// Measures the cycle of an actor whose chain ends with its first object. Returns nullopt for other
/// chains.
std::optional<CycleError> measure_actor_cycle(const PreparedActor& actor) {
  if (actor.space) return std::nullopt;  // measure_blend_cycles() measures the cycles of a blend
  std::vector<const MorphPlan*> plans;
  for (const auto& leg : actor.legs) {
    if (leg->before) return std::nullopt;  // the leg begins with the previous leg's moving balls
    plans.push_back(&leg->plan);
  }
  return cycle_error(plans);
}

/// Errors of two cycles from a blend's reference (its first object) to the object `from`, on to the
/// object `to`, and back. The cycles differ in their step from `from` to `to`.
struct BlendCycle {
  std::string from, to;        ///< names of the two objects
  CycleError by_reference;     ///< this step goes by way of the reference, as in the blend
  CycleError by_plan_between;  ///< this step is a plan between the two objects
};

MorphPlan reverse_plan(const MorphPlan& plan) {
  MorphPlan reversed_plan = plan;
  swap_ends(reversed_plan);
  return reversed_plan;
}

/// Measures the cycles through every two objects of a blend other than the reference. `actor_index`
/// is the index of `actor`. The plans between these objects are made for this comparison only.
std::vector<BlendCycle> measure_blend_cycles(const Preparation& preparation,
                                             std::size_t actor_index, const PreparedActor& actor) {
  std::vector<BlendCycle> cycles;
  for (std::size_t i = 0; i < actor.legs.size(); ++i)
    for (std::size_t j = i + 1; j < actor.legs.size(); ++j) {
      const Leg &first = *actor.legs[i], &second = *actor.legs[j];
      const MorphPlan between = plan_between(preparation, actor_index, *first.to, *second.to);
      const MorphPlan first_back = reverse_plan(first.plan),
                      second_back = reverse_plan(second.plan);
      const auto direct = cycle_error({&first.plan, &between, &second_back});
      const auto blended = cycle_error({&first.plan, &first_back, &second.plan, &second_back});
      if (direct && blended) cycles.push_back({first.to->name, second.to->name, *blended, *direct});
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
      out.text += leg_lines(*leg);
    }
    JsonValue actor_json = {{"name", actor.name}, {"legs", std::move(legs)}};
    if (const std::optional<CycleError> cycle = measure_actor_cycle(actor)) {
      actor_json["cycle"] = describe_error(*cycle);
      out.text += fmt::format(
          "Sent once around the cycle, mass returns {:.2f} of the size from its origin, on "
          "average, "
          "and spreads by {:.2f}; 0: the plans are consistent, 1: they are unrelated\n",
          cycle->drift, cycle->spread);
    }
    if (actor.space) {
      actor_json["cycles"] = JsonValue::array();
      const std::string& reference = actor.objects.front()->name;
      for (const BlendCycle& cycle :
           measure_blend_cycles({prepared.scene, engine, cache}, a, actor)) {
        actor_json["cycles"].push_back(
            {{"objects", JsonValue::array({reference, cycle.from, cycle.to})},
             {"by_reference", describe_error(cycle.by_reference)},
             {"by_plan_between", describe_error(cycle.by_plan_between)}});
        out.text += fmt::format(
            "Sent once around {0}, {1} and {2}, mass returns {3:.2f} of the size from its origin, "
            "on "
            "average, and spreads by {4:.2f}, because {1} goes to {2} by way of {0}; with a plan "
            "of "
            "their own it would be {5:.2f} and {6:.2f}\n",
            reference, cycle.from, cycle.to, cycle.by_reference.drift, cycle.by_reference.spread,
            cycle.by_plan_between.drift, cycle.by_plan_between.spread);
      }
    }
    out.json["actors"].push_back(std::move(actor_json));
  }
  return out;
}

}  // namespace polymorph
