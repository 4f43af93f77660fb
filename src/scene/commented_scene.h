// Commented scene files: JSON for people to edit, with the meaning of each key above it.
#pragma once

#include <string>

#include "base/json.h"

namespace polymorph {

/// Writes a scene file in the order of `scene`'s keys. A `//` comment above each key of the first
/// two levels gives its description from describe.h. The lines of `title` become the first
/// comments. `suggestions` maps keys of `scene` to members that are written above them, commented
/// out so that removing the slashes enables them.
std::string commented_scene(const JsonValue& scene, const std::string& title,
                            const JsonValue& suggestions);

}  // namespace polymorph
