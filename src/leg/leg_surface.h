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

/// Finds the level of the balls' field (LegSurface::iso) that keeps the volume. It is 1 at both
/// ends of the leg, if the plan does not keep the volume, and for a leg made of distances. Errors:
/// kResource.
Result<float> volume_iso(const Leg& leg, const LegState& state, Engine& engine);

/// Extracts the surface that the volumetric stage shows at `time` in [0, 1]. Components that are
/// too small and handles that no object has are removed. Errors: kResource.
Result<LegSurface> leg_surface(const Leg& leg, float time, Engine& engine);

/// Cuts thin handles of a surface between objects until it has no more than `genus` handles. Extra
/// handles arise where two parts touch or a thin one tears. `genus`: the largest number of handles
/// of an object; `size`: diagonal of the objects' boxes.
void cut_superfluous_handles(std::int64_t genus, float size, Mesh& surface);

/// Evaluates, at points, a field whose zero set is the leg's surface before small components and
/// handles were removed; it is positive inside. For a leg made of distances it is surface.field, in
/// scene units; for a leg made of balls, the balls' field over surface.iso, minus 1. Errors: the
/// engine's.
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
/// leg or of its pose_leg() (leg/make_leg.h). Reads only the time and the balls of `state`. Errors:
/// the engine's.
Result<Flow> flow_until(const Leg& leg, const LegState& state, LegMoment next,
                        const std::vector<Vec3>& points, Engine& engine);

/// Computes the label of each point of the leg's surface: the label of the balls that contribute
/// most there (morph/labels.h). Labels are indices into the actor's label_names
/// (PreparedObject::label_numbers). Errors: the engine's.
Result<std::vector<std::uint32_t>> leg_labels(const Leg& leg, const LegState& state,
                                              const std::vector<Vec3>& points, Engine& engine);

}  // namespace polymorph
