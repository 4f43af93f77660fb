// Plan validation against the models (labels, landmarks), used by both `check` and `render`.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "model/model.h"
#include "scene/scene.h"

namespace polymorph {

/// A line for each name in plan.labels that no object has, and for each landmark that is farther
/// from its object than the object is large. `models`: of all actors, as load_models() gives them.
std::vector<std::string> plan_problems(const Scene& scene, std::span<const Model> models);

}  // namespace polymorph
