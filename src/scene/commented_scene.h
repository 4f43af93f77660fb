// Scene files for people to edit: JSON with the meaning of each key in a comment above it.
#pragma once

#include <string>

#include "base/json.h"

namespace polymorph {

/// A scene file's text, in the order of `scene`'s keys: above each key, down to the second level,
/// stands what describe.h says of it as a `//` comment. The lines of `title` become the first
/// comments. `suggestions` holds, by a key of `scene`, members that are written above it, commented
/// out so that removing the slashes is enough.
std::string commented_scene(const JsonValue& scene, const std::string& title,
                            const JsonValue& suggestions);

}  // namespace polymorph
