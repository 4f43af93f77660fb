// Looks of a surface: materials, colours and normals that it takes over from the objects.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "base/result.h"
#include "kernels/engine.h"
#include "sequence/geometry/actor_geometry.h"

namespace polymorph {

/// When a leg's colours change, by its progress: the source's detail goes, then the colours that
/// are left turn into the target's, then the target's detail comes. Detail of both at once would
/// show a face on a back; half way, where maps stretch most, it would be torn.
struct ColorFade {
  float color;           ///< share of the target
  float source, target;  ///< shares of either's detail
};
ColorFade color_fade(float u);

/// The materials of an object of the actor on the surface whose vertices correspond to the points
/// `at` of the object.
ObjectLayer object_layer(const PreparedActor& actor, std::size_t object, const Mesh& surface,
                         std::span<const Vec3> at, float share = 1);

/// Mixes the models' own normals into those of a leg's surface near its ends. Errors: the
/// engine's.
Status blend_end_normals(const PreparedActor& actor, const PreparedLeg& leg, Engine& engine,
                         ActorGeometry& geometry);

/// Adds the layers and colours of a leg's moving surface to `geometry`: what the points `points`
/// come from, as it was there, and over it what they go to. Errors: the engine's.
Status transfer_looks(const PreparedActor& actor, std::size_t leg, float time, const BallSet& balls,
                      const FrameMap& map, const std::vector<Vec3>& points, Engine& engine,
                      ActorGeometry& geometry);

}  // namespace polymorph
