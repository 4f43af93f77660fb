// Commented scene files: JSON for people to edit, with the meaning of each key above it.
#pragma once

#include <string>

#include "base/json.h"

namespace polymorph {

/// Writes a scene file in the order of `scene`'s keys. A `//` comment above each key of the first
/// two levels gives its description from describe.h. The lines of `title` become the first
/// comments. `suggestions` maps a key of `scene` to an object whose members are written above that
/// key as comments; removing the slashes enables them.
std::string commented_scene(const JsonValue& scene, const std::string& title,
                            const JsonValue& suggestions);

}  // namespace polymorph
