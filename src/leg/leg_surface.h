// Surface of a leg at a time of its motion, with the origin, motion and labels of its points.
#pragma once

#include <cstdint>
#include <vector>

#include "base/result.h"
#include "kernels/engine.h"
#include "leg/leg.h"
#include "morph/flow.h"
#include "morph/pull_back.h"

namespace polymorph {

/// Computes the leg's state at `time` in [0, 1]. Errors: the engine's.
Result<LegState> leg_state(const Leg& leg, float time, Engine& engine);

/// Finds the level of the balls' field that keeps the volume; 1 if the leg is made of distances.
/// Errors: kResource.
Result<float> volume_iso(const Leg& leg, const LegState& state, Engine& engine);

/// Extracts the surface that the volumetric stage shows at `time` in [0, 1]. Components that are
/// too small and handles that no object has are removed. Errors: kResource.
Result<LegSurface> leg_surface(const Leg& leg, float time, Engine& engine);

/// Cuts thin handles of a surface between objects until it has no more handles than they have.
/// Extra handles arise where two parts touch or a thin one tears. `genus`: the maximum of the
/// objects; `size`: their diagonal.
void cut_superfluous_handles(std::int64_t genus, float size, Mesh& surface);

/// Evaluates the field of the leg's surface at points: positive inside, 0 on the surface before
/// small components and handles were removed. For a leg made of distances this is their mixture in
/// scene units; for a leg made of balls, field / level - 1. Errors: the engine's.
Result<std::vector<float>> surface_field(const Leg& leg, const LegSurface& surface,
                                         const std::vector<Vec3>& points, Engine& engine);

/// Computes the positions on the source and on the target of points near the leg's surface. Errors:
/// the engine's.
Result<PullBack> pull_back(const Leg& leg, const LegState& state, const std::vector<Vec3>& points,
                           Engine& engine);

/// A time of a leg's motion.
struct LegMoment {
  const Leg& leg;
  float time = 0;
};

/// Computes the motion of points of the leg's surface from `state` to `next`, a time of the same
/// leg or of the leg between other poses (pose_leg()). Reads only the time and the balls of
/// `state`. Errors: the engine's.
Result<Flow> flow_until(const Leg& leg, const LegState& state, LegMoment next,
                        const std::vector<Vec3>& points, Engine& engine);

/// Computes the label of each point of the leg's surface, as an index into the actor's names: the
/// label of the balls that contribute most there (morph/labels.h). Errors: the engine's.
Result<std::vector<std::uint32_t>> leg_labels(const Leg& leg, const LegState& state,
                                              const std::vector<Vec3>& points, Engine& engine);

}  // namespace polymorph
