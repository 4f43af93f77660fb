// Scene validation across keys: contradictions that no single key shows.
#pragma once

#include <vector>

#include "base/json.h"
#include "scene/load_scene.h"

namespace polymorph {

/// Checks a scene as a whole and adds errors to `findings`: missing objects, frame counts that do
/// not fit the chain, unknown layers. `document` is the JSON that the scene was read from.
void find_contradictions(const JsonDocument& document, const Scene& scene,
                         std::vector<SceneFinding>& findings);

}  // namespace polymorph
