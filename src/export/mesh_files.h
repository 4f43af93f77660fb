// Mesh files of a scene's surfaces: USD, glTF, PLY and OBJ, or the balls as JSON (`polymorph
// mesh`).
#pragma once

#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "base/frames.h"
#include "base/result.h"
#include "kernels/engine.h"
#include "scene/scene.h"
#include "sequence/prepare/prepared_scene.h"

namespace polymorph {

/// Formats of mesh files; kBalls is JSON.
enum class MeshFormat { kObj, kPly, kBalls, kUsd, kGlb };

/// Tests whether one file of the format holds all frames.
bool is_one_file(MeshFormat format);

/// Finds the format by the ending of a name. Errors: kUsage.
Result<MeshFormat> parse_mesh_format(const std::filesystem::path& output);

struct MeshFileSettings {
  std::filesystem::path output;  ///< a file, or a pattern with a place for the frame's number
  MeshFormat format = MeshFormat::kObj;
  FramePattern pattern;     ///< `output` as a pattern; formats with a file per frame only
  std::vector<int> frames;  ///< ascending if one file or one mesh holds all frames
  double error = 0;  ///< simplification: maximum Hausdorff distance as a fraction of the box's
                     ///< diagonal; 0: none
  /// One mesh per actor, whose vertices move; neither simplified nor quantized, no balls.
  bool constant_topology = false;
  bool quantize = false;  ///< glTF: 16 bits for positions, 8 for normals, no velocities
  bool overwrite = false;
  std::function<void(const std::string&)> print;  ///< receives a line about each file
};

/// Sets the pattern from the output, and sorts the frames if one file or one mesh holds all of
/// them. Errors: those of parse_pattern().
Status complete_mesh_settings(MeshFileSettings& settings);

/// Checks that the mesh files and the texture files of `actors` may be written. Before the scene is
/// prepared, `actors` is empty and textures are not checked. Errors: kOutput.
Status check_mesh_files(const MeshFileSettings& settings, std::span<const PreparedActor> actors);

/// Sets the scene's AOVs to the attributes that the files hold. Must be called before the scene is
/// prepared.
void request_mesh_attributes(Scene& scene, const MeshFileSettings& settings);

/// Makes the surfaces and writes them. Errors: those of geometry_at(), carry_actor() and
/// write_files(); stop_code() after a signal.
Status write_mesh_files(const MeshFileSettings& settings, const PreparedScene& prepared,
                        Engine& engine);

}  // namespace polymorph
