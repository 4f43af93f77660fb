// Mesh sequence: a survey that reads all meshes before the first frame, and loading of single ones.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "assets/load_object.h"
#include "assets/loaded_scene.h"
#include "base/result.h"
#include "scene/load_scene.h"

namespace polymorph {

/// Result of survey_meshes().
struct MeshSurvey {
  LoadedObject stand_in;  ///< outermost points of all meshes, without faces, rotated upright
  MeshSequence sequence;  ///< complete except for `steps`
};

/// Reads all meshes of a sequence, one per thread at a time, and keeps only what decides the
/// sequence's placement, the camera and the frames' hashes. `textures`: whether to read textures,
/// too. Adds to `warnings` those of the first mesh that has any, and the number of other meshes
/// with warnings. A mesh that cannot be read is reported in MeshFile::problem. Errors: kInput if no
/// mesh can be read.
Result<MeshSurvey> survey_meshes(const Scene& scene, const ChainObject& object, bool textures,
                                 std::vector<std::string>& warnings);

/// Reads a mesh and places it in the scene. `mesh`: index in sequence.files. Errors: kInput if it
/// has a problem or its file has changed since the survey.
Result<Model> load_mesh(const MeshSequence& sequence, int mesh);

/// Reads the vertices of a mesh as its file has them, in the file's coordinates. Errors: as
/// load_mesh().
Result<std::vector<Vec3>> read_mesh_vertices(const MeshSequence& sequence, int mesh);

/// A step from the mesh of one frame to the mesh of the next frame.
struct MeshStep {
  int mesh = 0, next = 0;  ///< indices in MeshSequence::files
  float fps = 24;          ///< frames per second
};
/// Computes the displacement, per frame, of each point of `shown`, which is load_mesh() of
/// `step.mesh`. If both meshes have the same faces, a displacement leads to the point of the same
/// index in the next mesh; else it is the velocity that the file stores, divided by fps. Returns an
/// empty list if the mesh stays the same or no motion is known. Errors: as load_mesh().
Result<std::vector<Vec3>> compute_mesh_motion(const MeshSequence& sequence, const Model& shown,
                                              const MeshStep& step);

/// Returns one line for each mesh that cannot be shown.
std::vector<std::string> find_mesh_problems(const MeshSequence& sequence);

/// Describes the files: "dancer: 240 meshes, frames 1 to 240, 1 missing, 2 broken, at most 9000
/// triangles". Files that exist but cannot be shown are broken.
std::string describe_meshes(const MeshSequence& sequence);

}  // namespace polymorph
