// Mesh tracking: carries a mesh along a moving surface, with the same triangles at all times.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "base/result.h"
#include "mesh/carry/carry_target.h"

namespace polymorph {

/// A surface that depends on time, with its flow. Times increase along the motion.
struct MovingSurface {
  /// Makes the surface at one time.
  std::function<Result<CarryTarget>(float time)> at;
  /// Moves points near the surface from one time to another.
  std::function<Result<std::vector<Vec3>>(std::span<const Vec3> points, float from, float to)> flow;
};

/// Error of a carried mesh against the surface at one time.
struct CarryFault {
  float distance = 0;        ///< upper bound of the Hausdorff distance (deviation.h)
  Vec3 position;             ///< point of either surface that has this distance
  std::size_t inverted = 0;  ///< number of triangles that face against the surface's normal
  Vec3 inverted_position;    ///< a corner of the first inverted triangle, if any
};

struct CarriedMesh {
  std::vector<Triangle> triangles;
  /// Positions of the points, per time. The work ends at a time where the mesh stays more than
  /// three limits from the surface; the times not reached then have neither points nor faults.
  std::vector<std::vector<Vec3>> points;
  std::vector<CarryFault> faults;  ///< errors per time
};

struct CarrySettings {
  float limit = 0;  ///< maximum Hausdorff distance, scene units
  float cell = 0;   ///< edge of the grid cells that the surface was extracted from
  std::size_t max_triangles = 1000000;  ///< no division of triangles begins that would exceed it
  std::string name = "a mesh";          ///< name of the mesh in messages of progress
  /// Called before each move of the mesh; an error ends the work.
  std::function<Status()> check_stop = [] { return Status(Ok{}); };
};

/// Extracts the surface at `times[start]` and carries its mesh along the flow to the neighbouring
/// times, and so on to both ends of `times`. Each time is shown as a stage of the progress
/// (base/activity.h). Triangles that are further than the limit from the surface are divided at all
/// times; errors that remain are in CarriedMesh::faults. Errors: those of `surface` and of
/// `check_stop`.
Result<CarriedMesh> carry(const MovingSurface& surface, std::span<const float> times,
                          std::size_t start, const CarrySettings& settings);

}  // namespace polymorph
