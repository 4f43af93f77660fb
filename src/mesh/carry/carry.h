// Carried mesh: one connectivity that follows a moving surface from moment to moment.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "base/result.h"
#include "mesh/carry/carry_target.h"

namespace polymorph {

/// What a moving surface can be asked for. A moment is a time of the leg's motion; moments
/// increase.
struct MovingSurface {
  std::function<Result<CarryTarget>(float moment)> at;
  /// Where points near the surface go from one moment to another.
  std::function<Result<std::vector<Vec3>>(std::span<const Vec3> points, float from, float to)> flow;
};

/// How far a mesh is from a surface.
struct CarryFault {
  float distance = 0;        ///< Hausdorff distance: the true one is not larger (deviation.h)
  Vec3 place;                ///< where it is reached
  std::size_t inverted = 0;  ///< triangles that show their back where the surface shows its front
  Vec3 inverted_place;
};

struct CarriedMesh {
  std::vector<Triangle> triangles;
  std::vector<std::vector<Vec3>> points;  ///< of each moment
  std::vector<CarryFault> faults;         ///< of each moment
};

struct CarrySettings {
  float limit = 0;                      ///< Hausdorff distance that is wanted, scene units
  float cell = 0;                       ///< edge of the surface's own cells
  std::size_t max_triangles = 1000000;  ///< about: no division is begun that would exceed it
};

/// The surface of the moment `start` (a number of `moments`) goes to its neighbours by the flow,
/// and so on to both ends. Errors: those of `surface`.
Result<CarriedMesh> carry(const MovingSurface& surface, std::span<const float> moments,
                          std::size_t start, const CarrySettings& settings);

}  // namespace polymorph
