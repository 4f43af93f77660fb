// Signed distances of an object, and measures of their surface, from the disk cache or computed.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "base/result.h"
#include "field/distance_grid.h"
#include "kernels/engine.h"
#include "model/repair/shell.h"

namespace polymorph {

/// Increment when compute_signed_distances(), classify_faces(), compute_thinness() or the measures
/// change their results: older cache files are then ignored. A test pins the digests.
inline constexpr std::uint32_t kDistancesVersion = 12;

/// Signed distances of one object, and measures of their surface.
struct ObjectDistances {
  std::vector<FaceSide> sides;  ///< one per triangle of the model
  double undecided =
      0;  ///< measure_undecided_fraction(); from kMinShellFraction on the object is a shell
  std::shared_ptr<const DistanceGrid> grid;
  std::shared_ptr<const DistanceGrid> thinness;  ///< limit_thinness(); null for a shell
  std::shared_ptr<const DistanceGrid> smooth;    ///< null for a shell (field/remove_detail.h)
  /// True for a vessel (model/repair/vessel.h): `grid` has the distances of its walls, and all
  /// other members are those of the filled vessel.
  bool is_vessel = false;
  double volume = 0;  ///< volume of the surface extracted on cells of the requested size
  double smallest_component_share = 1;  ///< fraction of that volume in the smallest component
  std::int64_t genus = 0;               ///< number of handles of that surface
  std::string key;                      ///< hash of all inputs of the distances
};

inline bool is_shell(const ObjectDistances& object) {
  return object.undecided >= kMinShellFraction;
}

/// Settings of an object's distances.
struct DistanceMeasure {
  float cell = 0;                  ///< edge of the cells of the measured surface, scene units
  float thinnest = 0;              ///< half thickness below which parts are thickened, scene units
  double min_component_share = 0;  ///< share of the volume below which components are left out
  bool solidified = false;         ///< whether to measure solidify(model) instead of the model
};

/// Computes signed distances on cells of half of `cell`; then, on the surface extracted with cells
/// of size `cell`, the volume, the smallest component and the genus. Reads and writes a cache file
/// in `folder`, unless that is empty. Only distances near the surface are stored, about 10 MB for a
/// grid of 256^3. Errors: the engine's.
Result<ObjectDistances> load_or_measure_distances(const Model& model,
                                                  const ClosestPointQuery& closest,
                                                  const DistanceMeasure& measure, Engine& engine,
                                                  const std::filesystem::path& folder);

}  // namespace polymorph
