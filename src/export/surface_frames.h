// A frame for other programs: each actor's surface with normals, colours, texture coordinates,
// velocities and labels.
#pragma once

#include <vector>

#include "interchange/surface_frame.h"
#include "sequence/frame/frame_geometry.h"
#include "sequence/prepare/prepared_scene.h"

namespace polymorph {

/// Makes the scene ask for no layers but those by which geometry_at() gives velocities and labels.
void ask_for_attributes(Scene& scene, bool velocities, bool labels);

/// The surface of each actor or, where it has none, its model. Colours are what the renderer would
/// show at each point: materials and textures of all its objects, mixed, and the common
/// look. Velocities and labels are there where geometry_at() gave them; with `next`,
/// the geometry of that frame, they end on the surface that is shown then: the motion of the balls
/// and the map leaves out what the level does to keep the volume.
std::vector<SurfaceFrame> surface_frames(const PreparedScene& prepared,
                                         const FrameGeometry& geometry, const FrameGeometry* next);

/// The frame of one actor's extracted surface; `look`: the common one.
SurfaceFrame extracted_frame(const PreparedActor& actor, const ActorGeometry& geometry,
                             const LookSettings& look);

/// Names, times and the camera of frames `first` to `last`.
SurfaceSequence surface_sequence(const PreparedScene& prepared, int first, int last);

}  // namespace polymorph
