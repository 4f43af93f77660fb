// Conversion of vectors to JSON arrays.
#pragma once

#include "base/json.h"
#include "kernels/linear.h"

namespace polymorph {

inline JsonValue to_array(Vec3 v) { return JsonValue::array({v.x, v.y, v.z}); }
inline JsonValue to_array(Int3 v) { return JsonValue::array({v.x, v.y, v.z}); }

}  // namespace polymorph
