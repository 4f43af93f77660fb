// Surface of a leg at a time of its motion, and its points' origin, motion and labels.
#pragma once

#include <cstdint>
#include <vector>

#include "base/result.h"
#include "kernels/engine.h"
#include "leg/leg.h"
#include "morph/flow.h"
#include "morph/pull_back.h"

namespace polymorph {

/// The state at `time` in [0, 1]. Errors: the engine's.
Result<LegState> leg_state(const Leg& leg, float time, Engine& engine);

/// The level of the balls' field that keeps the volume; 1 where the leg is made of distances.
/// Errors: kResource.
Result<float> volume_iso(const Leg& leg, const LegState& state, Engine& engine);

/// The surface that the volumetric stage shows at `time` in [0, 1], without components that are too
/// small and handles that no object has. Errors: kResource.
Result<LegSurface> leg_surface(const Leg& leg, float time, Engine& engine);

/// Cuts handles of a surface between objects that none of them has, where two parts touch or a thin
/// one tears, as long as they are thin. `genus`: the largest of the objects; `size`: their
/// diagonal.
void cut_superfluous_handles(std::int64_t genus, float size, Mesh& surface);

/// Evaluates the field of the leg's surface at points: positive inside, 0 on the surface before
/// small components and handles were removed. A leg made of distances has their mixture in scene
/// units; a leg made of balls has field / level - 1. Errors: the engine's.
Result<std::vector<float>> surface_field(const Leg& leg, const LegSurface& surface,
                                         const std::vector<Vec3>& points, Engine& engine);

/// Positions on the source and on the target of points near the leg's surface. Errors: the
/// engine's.
Result<PullBack> pull_back(const Leg& leg, const LegState& state, const std::vector<Vec3>& points,
                           Engine& engine);

/// A time of a leg's motion.
struct LegMoment {
  const Leg& leg;
  float time = 0;
};

/// Motion of points of the leg's surface from `state` to `next`, a time of the same leg or of one
/// between other poses (pose_leg()). Reads only the time and the balls of `state`. Errors: the
/// engine's.
Result<Flow> flow_until(const Leg& leg, const LegState& state, LegMoment next,
                        const std::vector<Vec3>& points, Engine& engine);

/// Label of each point of the leg's surface, as an index into the actor's names: that of the balls
/// which contribute most there (morph/labels.h). Errors: the engine's.
Result<std::vector<std::uint32_t>> leg_labels(const Leg& leg, const LegState& state,
                                              const std::vector<Vec3>& points, Engine& engine);

}  // namespace polymorph
