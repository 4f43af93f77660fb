// Scene validation across keys: contradictions that no single key shows.
#pragma once

#include <vector>

#include "base/json.h"
#include "scene/load_scene.h"

namespace polymorph {

/// Adds what is wrong with a scene as a whole to `findings`: missing objects, frames that do not
/// fit the chain, unknown layers. `document` is what the scene was read from.
void find_contradictions(const JsonDocument& document, const Scene& scene,
                         std::vector<SceneFinding>& findings);

}  // namespace polymorph
