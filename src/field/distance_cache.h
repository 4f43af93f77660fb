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
inline constexpr std::uint32_t kDistancesVersion = 13;

/// Signed distances of one object, and measures of their surface.
struct ObjectDistances {
  std::vector<FaceClass> face_classes;  ///< classify_faces(): one per triangle of the model
  double undecided_fraction = 0;        ///< measure_undecided_fraction() (model/repair/shell.h)
  std::shared_ptr<const DistanceGrid> grid;      ///< signed distances, positive inside
  std::shared_ptr<const DistanceGrid> thinness;  ///< limit_thinness() (field/thinness.h)
  std::shared_ptr<const DistanceGrid> smooth;    ///< remove_detail() (field/remove_detail.h)
  /// True for a vessel (model/repair/vessel.h): `grid` has the distances of its walls
  /// (field/hollow_distances.h); `thinness`, `smooth` and the measures are those of the filled
  /// vessel.
  bool is_vessel = false;
  double volume = 0;  ///< volume of the surface extracted on cells of DistanceMeasure::cell
  double smallest_component_share = 1;  ///< fraction of `volume` in the smallest component
  std::int64_t genus = 0;               ///< number of handles of the extracted surface
  std::string key;                      ///< hash of all inputs of the distances
};

/// Tests whether the object is a shell: it has no inside, and `thinness` and `smooth` are null.
inline bool is_shell(const ObjectDistances& object) {
  return object.undecided_fraction >= kMinShellFraction;
}

/// Settings of an object's distances.
struct DistanceMeasure {
  float cell = 0;                  ///< edge of the cells of the measured surface, scene units
  float thinnest = 0;              ///< half thickness below which parts are thickened, scene units
  double min_component_share = 0;  ///< components of a smaller fraction of the volume are left out
  /// True to measure the result of solidify() (model/repair/solidify.h) instead of the model.
  bool solidified = false;
};

/// Computes signed distances to the model on cells of edge measure.cell / 2. Then extracts their
/// surface on cells of edge measure.cell, and measures its volume, smallest component and genus.
/// `closest`: query of the model. Reads and writes a cache file in `folder`, unless that is empty.
/// Only distances near the surface are stored, about 10 MB for a grid of 256^3. Errors: the
/// engine's.
Result<ObjectDistances> load_or_measure_distances(const Model& model,
                                                  const ClosestPointQuery& closest,
                                                  const DistanceMeasure& measure, Engine& engine,
                                                  const std::filesystem::path& folder);

}  // namespace polymorph
