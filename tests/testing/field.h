// Balls with known surfaces.
#pragma once

#include <vector>

#include "kernels/engine.h"

namespace polymorph {

inline Ball gaussian_ball(Vec3 center, float radius, float blobbiness = 2) {
  return {center, blobbiness / (radius * radius), blobbiness};
}

}  // namespace polymorph
