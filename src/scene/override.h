// Overrides of settings by the command line, made in the JSON of a scene file before it is read.
#pragma once

#include <string_view>

#include "base/json.h"
#include "base/result.h"

namespace polymorph {

/// Sets the value at a dotted path ("image.width", "intermediate.0.meta") to `text`, which is JSON
/// or, failing that, a plain string. Missing objects along the path are created. A string along the
/// path becomes an object that has the string at key "": with "target": "b.obj", target.scale=2
/// gives {"": "b.obj", "scale": 2}. Errors (kUsage): an empty key, or a key of a list that is no
/// index of one of its items.
Status apply_override(JsonDocument& document, std::string_view path, std::string_view text);

}  // namespace polymorph
