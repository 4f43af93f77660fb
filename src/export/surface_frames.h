// Frames for export to other programs: each actor's surface with normals, colours, texture
// coordinates, velocities and labels.
#pragma once

#include <vector>

#include "interchange/surface_frame.h"
#include "sequence/frame/frame_geometry.h"
#include "sequence/prepare/prepared_scene.h"

namespace polymorph {

/// Sets the scene's AOVs so that geometry_at() computes velocities and labels as requested, and no
/// more. Turns motion blur off.
void request_attributes(Scene& scene, bool velocities, bool labels);

/// Makes a frame per actor from its extracted surface or, if it has none, from its model. Colours
/// are those that the renderer would show at each point: the mixed materials and textures of all
/// its objects, and the common look. Velocities and labels are present if geometry_at() computed
/// them. `next` is the geometry of the next frame, or null. If it is given, velocities end on its
/// surface: the motion of balls and map alone leaves out the change of level that keeps the volume.
std::vector<SurfaceFrame> surface_frames(const PreparedScene& prepared,
                                         const FrameGeometry& geometry, const FrameGeometry* next);

/// Makes the frame of an actor's extracted surface; `look` is the common look.
SurfaceFrame extracted_frame(const PreparedActor& actor, const ActorGeometry& geometry,
                             const LookSettings& look);

/// Returns the actors' names and labels, and the times and cameras of the frames `first` to `last`.
SurfaceSequence surface_sequence(const PreparedScene& prepared, int first, int last);

}  // namespace polymorph
