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

/// Raise it when measure_pacing() gives other numbers: paces in the cache are then not used. A test
/// pins the digests.
inline constexpr std::uint32_t kPacingVersion = 15;

struct Pacing {
  Registration registration;  ///< offsets of the leg's map, with which all else is measured
  /// Eased times at which 0, 1/n, 2/n, ... 1 of the surface's whole change is done
  /// (MorphPlan::pacing); empty where nothing changes.
  std::vector<float> times;
  /// Levels that keep the volume at eased times 0, 1/n, 2/n, ... 1, nearly (DistanceLeg::levels).
  std::vector<float> levels;
  /// Heights by which the surface is raised at each of `times`, so that it stays as low as its ends
  /// (MorphPlan::lifts); empty where these are not equally low, or nothing asks for it.
  std::vector<float> lifts;
  /// The points furthest out along each axis at any measured moment (DistanceLeg::extremes).
  std::vector<Vec3> extremes;
};

/// Measures the pacing of a leg made of distances whose plan has none yet and no offsets, from the
/// mean distances between its surfaces at even eased times (at more times where much changes); then
/// the levels with that pacing, on cells twice as large. The leg's balls must share one eased time.
/// Errors: the engine's.
Result<Pacing> measure_pacing(const Leg& leg, Engine& engine, const std::filesystem::path& cache);

}  // namespace polymorph
