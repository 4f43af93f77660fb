// Validation of plan.labels against the models' labels, used by both `check` and `render`.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "model/model.h"
#include "scene/load_scene.h"

namespace polymorph {

/// Returns one line for each actor whose plan.labels names a label that none of its objects has.
/// `models`: one per object of the chain, as load_models() returns them.
std::vector<std::string> find_plan_problems(std::span<const ChainObject> chain,
                                            std::span<const Model> models);

}  // namespace polymorph
