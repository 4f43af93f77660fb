// Labels of a frame's vertices: the part of an object that each belongs to.
#pragma once

#include <cstdint>
#include <vector>

#include "base/result.h"
#include "kernels/engine.h"
#include "sequence/geometry/actor_geometry.h"

namespace polymorph {

/// One per point of the model: that of its last face, as an index into actor.label_names.
std::vector<std::uint32_t> model_labels(const PreparedActor& actor, const PreparedObject& object);

/// What each vertex of an actor's surface belongs to: index into actor.label_names. Of moving balls
/// by their shares (morph/labels.h), else by the nearest face of the model that the surface comes
/// from. Errors: the engine's.
Result<std::vector<std::uint32_t>> surface_labels(const PreparedActor& actor,
                                                  const ActorGeometry& geometry, Engine& engine);

}  // namespace polymorph
