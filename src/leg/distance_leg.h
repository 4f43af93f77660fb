// Surface of a leg made of distances: the map to both objects, the field, and the level that keeps
// the volume (kernels/morph_field.h).
#pragma once

#include <optional>
#include <vector>

#include "field/level.h"
#include "leg/leg.h"

namespace polymorph {

/// Maximum magnitude of the level (MorphSurface::level), as a fraction of object_size().
inline constexpr float kMaxLevel = 0.08f;
/// MorphSurface::linear_range as a fraction of object_size().
inline constexpr float kLinearRange = 0.06f;

/// Computes the map to both objects at `time`. `balls`: the leg's balls at that time.
FrameMap distance_map(const Leg& leg, float time, const BallSet& balls);

/// Tests whether the level is chosen so that the surface keeps the leg's volume. Returns false if
/// the scene turns that off, or if an object is a shell, because a shell's volume means little.
bool keeps_volume(const Leg& leg);

/// Estimates the level that keeps the volume at the eased progress u, by Catmull-Rom interpolation
/// of `levels` (DistanceLeg::levels). Returns nullopt if there are fewer than three levels.
std::optional<float> interpolate_level(const std::vector<float>& levels, float u);

/// Extracts a leg's surface at surface.state, which must be set: sets surface.mesh and
/// surface.field. Returns an estimate of the level that keeps the volume; 0 at the leg's ends and
/// unless keeps_volume(). Errors: kResource.
Result<LevelEstimate> extract_between(const Leg& leg, const LevelSearch& search, Engine& engine,
                                      LegSurface& surface);

/// Evaluates the field of a surface between two objects at points, with the same bits as the
/// engine. Errors: the engine's.
Result<std::vector<float>> sample_distances(const MorphSurface& field,
                                            const std::vector<Vec3>& points, Engine& engine);

}  // namespace polymorph
