// Validation of a complete scene: errors that are not found while its keys are read one by one.
#pragma once

#include <vector>

#include "base/json.h"
#include "scene/load_scene.h"

namespace polymorph {

/// Checks a scene as a whole and adds errors to `findings`: missing or contradictory keys, per-leg
/// frame counts that do not match the number of legs, unknown image layers. `document` is the JSON
/// that the scene was read from.
void find_contradictions(const JsonDocument& document, const Scene& scene,
                         std::vector<SceneFinding>& findings);

}  // namespace polymorph
