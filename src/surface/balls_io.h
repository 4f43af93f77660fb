// Balls as files.
#pragma once

#include <string>
#include <vector>

#include "kernels/types.h"

namespace polymorph {

/// {"field": "gaussian", "balls": [{"center": [x, y, z], "a": .., "w": .., "radius": ..}, ...]}.
std::string encode_balls(const std::vector<Ball>& balls, FieldKind kind);

/// The same as a table: x,y,z,a,w,radius and the six numbers of the shape.
std::string encode_balls_csv(const std::vector<Ball>& balls, FieldKind kind);

}  // namespace polymorph
