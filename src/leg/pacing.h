// Arc-length pacing of a leg made of distance fields: time by the amount that its surface changes,
// the levels that keep its volume, and the heights that keep it on the floor.
#pragma once

#include <filesystem>
#include <vector>

#include "base/result.h"
#include "kernels/engine.h"
#include "leg/leg.h"
#include "leg/registration.h"

namespace polymorph {

/// Increment when measure_pacing() changes its results: older cache files are then ignored. A test
/// pins the digests.
inline constexpr std::uint32_t kPacingVersion = 17;

/// Pacing of a leg, and its measures that depend on it.
struct Pacing {
  Registration registration;  ///< offsets of the leg's map, with which all below is measured
  /// Eased times at which 0, 1/n, 2/n, ... 1 of the surface's total change is done
  /// (MorphPlan::pacing); empty if nothing changes.
  std::vector<float> times;
  /// Levels that nearly keep the volume at eased times 0, 1/n, 2/n, ... 1 (DistanceLeg::levels).
  std::vector<float> levels;
  /// Heights by which the surface is raised at each of `times`, so that it stays as low as at its
  /// ends (MorphPlan::lifts); empty if these are not equally low, or LegSettings::contact is false.
  std::vector<float> lifts;
  /// Extreme points along each axis over all measured times (DistanceLeg::extremes).
  std::vector<Vec3> extremes;
};

/// Measures the pacing of a leg made of distances from the mean distances between its surfaces at
/// evenly spaced eased times, and more times where much changes. The leg's plan must have no pacing
/// and no offsets yet, and its balls must share one eased time. `cache`: folder of cache files; may
/// be empty. Errors: the engine's.
Result<Pacing> measure_pacing(const Leg& leg, Engine& engine, const std::filesystem::path& cache);

}  // namespace polymorph
