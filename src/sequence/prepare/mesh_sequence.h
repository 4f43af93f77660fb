// Mesh sequence: a look at all its meshes before the first frame, and each of them in its place.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "base/result.h"
#include "scene/load_scene.h"
#include "sequence/prepare/loaded_scene.h"
#include "sequence/prepare/read_object.h"

namespace polymorph {

/// Facts of a sequence that has no place yet.
struct MeshSurvey {
  ReadObject stand_in;  ///< its outermost points, without faces, turned upright
  MeshSequence sequence;
};

/// Reads all meshes of a sequence, a few at a time, and keeps what decides its place, the camera
/// and the frames' hashes. `warnings` gets those of the first mesh that has any. A mesh that cannot
/// be read is a problem of its own (MeshFile). Errors (kInput): none can.
Result<MeshSurvey> survey_meshes(const Scene& scene, const ChainObject& object, bool textures,
                                 std::vector<std::string>& warnings);

/// A mesh in its place. Errors: its problem; kInput if it has changed since it was surveyed.
Result<Model> load_mesh(const MeshSequence& sequence, int mesh);

/// The vertices that the file of a mesh has itself, in its own coordinates. Errors: those of
/// load_mesh().
Result<std::vector<Vec3>> mesh_vertices(const MeshSequence& sequence, int mesh);

/// Motion of each point of a mesh, as load_mesh() gives it, until `next` shows: to the point of the
/// same number where both have the same faces, else by the velocities that its file stores, for
/// 1 / `fps` seconds. Empty: it stands still, or neither is known. Errors: those of load_mesh().
struct MeshStep {
  int mesh = 0, next = 0;
  float fps = 24;
};
Result<std::vector<Vec3>> mesh_motion(const MeshSequence& sequence, const Model& shown,
                                      const MeshStep& step);

/// One line for each mesh that cannot be shown.
std::vector<std::string> mesh_problems(const MeshSequence& sequence);

/// "240 meshes, frames 1 to 240, 1 missing": its files in words.
std::string describe_meshes(const MeshSequence& sequence);

}  // namespace polymorph
