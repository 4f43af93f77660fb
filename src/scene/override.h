// Settings from the command line, put into a scene file's JSON before it is read.
#pragma once

#include <string_view>

#include "base/json.h"
#include "base/result.h"

namespace polymorph {

/// Sets the value at a dotted path ("image.width", "intermediate.0.meta") to `value`, which is JSON
/// or, failing that, a plain string. Missing objects on the way are made; a string there
/// becomes an object whose key "" has it ("target": "b.obj" and target.scale). Errors: kUsage.
Status set_json_value(JsonDocument& document, std::string_view path, std::string_view value);

}  // namespace polymorph
