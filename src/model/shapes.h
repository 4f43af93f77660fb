// Built-in shapes (sphere, cube, torus, puddle, drops) as models: closed, outward oriented, about 2
// units across, standing on y = 0.
#pragma once

#include <string>

#include "base/result.h"
#include "model/model.h"

namespace polymorph {

/// Makes a built-in shape: "sphere" (radius 1), "cube" (side 2), "torus" (ring radius 1, tube
/// radius 0.4, lying flat), "puddle" (a flat cylinder with a rounded rim, radius 1.3, height 0.12)
/// or "drops" (48 spheres of radius 0.05 in a ball, for objects that appear from nothing or
/// vanish). Error (kInput) for an unknown name, naming the nearest. The names are kShapeNames
/// (scene/scene.h).
Result<Model> make_shape(const std::string& name);

}  // namespace polymorph
