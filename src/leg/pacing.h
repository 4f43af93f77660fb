// Arc-length pacing of a leg made of distance fields: time by the amount that its surface changes,
// and the levels that keep its volume.
#pragma once

#include <filesystem>
#include <vector>

#include "base/result.h"
#include "kernels/engine.h"
#include "leg/leg.h"

namespace polymorph {

/// Raise it when measure_pacing() gives other numbers: paces in the cache are then not used. A test
/// pins the digests.
inline constexpr std::uint32_t kPacingVersion = 13;

struct Pacing {
  /// Eased times at which 0, 1/n, 2/n, ... 1 of the surface's whole change is done
  /// (MorphPlan::pacing); empty where nothing changes.
  std::vector<float> times;
  /// Levels that keep the volume at eased times 0, 1/n, 2/n, ... 1, nearly (DistanceLeg::levels).
  std::vector<float> levels;
};

/// Measures the pacing of a leg made of distances whose plan has none yet, from the mean distances
/// between its surfaces at even eased times (at more times where much changes); then the levels
/// with that pacing, on cells twice as large. The leg's balls must share one eased time. Errors:
/// the engine's.
Result<Pacing> measure_pacing(const Leg& leg, Engine& engine, const std::filesystem::path& cache);

}  // namespace polymorph
