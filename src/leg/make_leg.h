// Construction of a leg from its objects and the plan between them, with its pacing and levels.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "base/result.h"
#include "kernels/engine.h"
#include "leg/leg.h"
#include "morph/timeline.h"

namespace polymorph {

/// Inputs of make_leg() that become members of the leg.
struct LegParts {
  std::shared_ptr<const PreparedObject> from, to;
  MorphPlan plan;
  std::shared_ptr<const Leg> before;             ///< Leg::before
  std::vector<std::string> landmark_names = {};  ///< one per landmark of the plan
  /// leg_pace() (morph/timeline.h) of `before`, divided by this leg's.
  double pace = 1;
};

/// Makes a leg of balls or of distances, by timing.interpolation. A leg made of distances is paced
/// (leg/pacing.h) if its balls share one eased time (morph/motion.h: move_together). `cache`:
/// folder of cache files; may be empty. Errors: the engine's.
Result<std::shared_ptr<const Leg>> make_leg(LegParts parts, const LegTiming& timing,
                                            const LegSettings& settings, Engine& engine,
                                            const std::filesystem::path& cache);

/// Makes the leg between the objects of `reference` in other poses. Their balls must be the
/// reference's, carried to the poses (spheres/carry_balls.h). The reference's plan is adapted
/// (morph/posed_plan.h); its pacing and levels are kept.
std::shared_ptr<const Leg> pose_leg(const Leg& reference,
                                    std::shared_ptr<const PreparedObject> from,
                                    std::shared_ptr<const PreparedObject> to);

/// Makes an object of the balls in flight at `leg.until`: the source of the next leg.
/// `with_distances`: the next leg is made of distances. Errors: kInput if the balls have no
/// surface; the engine's.
Result<PreparedObject> make_flight_object(const Leg& leg, bool with_distances, Engine& engine,
                                          const std::filesystem::path& cache);

}  // namespace polymorph
