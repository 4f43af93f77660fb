#include "assets/check_plan.h"

#include "morph/labels.h"

namespace polymorph {
namespace {

/// Checks plan.labels of one actor. `chain`, `models`: its objects and their models.
void check_actor(std::span<const ChainObject> chain, std::span<const Model> models,
                 std::vector<std::string>& problems) {
  const ActorSettings& actor = *chain.front().actor;
  std::vector<LabelledObject> labels;
  for (std::size_t i = 0; i < chain.size(); ++i)
    labels.push_back({chain[i].settings->name, models[i].label_names});
  if (const Status result = check_label_map(labels, actor.plan.labels); !result)
    problems.push_back(result.error().message);
}

}  // namespace

std::vector<std::string> find_plan_problems(std::span<const ChainObject> chain,
                                            std::span<const Model> models) {
  std::vector<std::string> problems;
  for (const std::span<const ChainObject> objects : actor_chains(chain)) {
    check_actor(objects, models.first(objects.size()), problems);
    models = models.subspan(objects.size());
  }
  return problems;
}

}  // namespace polymorph
