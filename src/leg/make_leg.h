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

/// Parts that a leg is made of.
struct LegParts {
  std::shared_ptr<const PreparedObject> from, to;
  MorphPlan plan;
  std::shared_ptr<const Leg> before;             ///< leg whose balls in flight `from` is; else null
  std::vector<std::string> landmark_names = {};  ///< one per landmark of the plan
  double pace = 1;  ///< motion time of `before` that goes by in a unit of this leg's (leg_pace())
};

/// Makes a leg of the kind that its timing says. One made of distances gets a pacing if its balls
/// share one eased time. Errors: the engine's.
Result<std::shared_ptr<const Leg>> make_leg(LegParts parts, const LegTiming& timing,
                                            const LegSettings& settings, Engine& engine,
                                            const std::filesystem::path& cache);

/// The leg between its objects in other poses, whose balls were carried (spheres/carry_balls.h):
/// what was found for it, the plan and its pace among it, is carried, too.
std::shared_ptr<const Leg> pose_leg(const Leg& reference,
                                    std::shared_ptr<const PreparedObject> from,
                                    std::shared_ptr<const PreparedObject> to);

/// Makes an object of the balls with which a leg is left: the source of the next leg.
/// `with_distances`: the next leg is made of distances. Errors: kInput where the balls have no
/// surface; the engine's.
Result<PreparedObject> object_in_flight(const Leg& leg, bool with_distances, Engine& engine,
                                        const std::filesystem::path& cache);

}  // namespace polymorph
