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

enum class MeshFormat { kObj, kPly, kBalls, kUsd, kGlb };

/// Tests whether one file of the format holds all frames.
bool is_one_file(MeshFormat format);

/// Finds the format by the ending of a name. Errors: kUsage.
Result<MeshFormat> parse_mesh_format(const std::filesystem::path& output);

struct MeshFileSettings {
  std::filesystem::path output;  ///< a file, or a pattern with a place for the frame's number
  MeshFormat format = MeshFormat::kObj;
  FramePattern pattern;     ///< `output` of a format with a file per frame
  std::vector<int> frames;  ///< rising where one file or one mesh holds all
  double error = 0;  ///< simplification: maximum Hausdorff distance as a fraction of the box's
                     ///< diagonal; 0: none
  /// One mesh per actor, whose vertices move; neither simplified nor quantized, no balls.
  bool constant_topology = false;
  bool quantize = false;  ///< glTF: 16 bits for positions, 8 for normals, no velocities
  bool overwrite = false;
  std::function<void(const std::string&)> print;  ///< receives a line on each file
};

/// Sets the pattern by the output, and sorts the frames where one file or one mesh holds all.
/// Errors: those of parse_pattern().
Status complete_mesh_settings(MeshFileSettings& settings);

/// Checks that the files may be written, and those of the textures of `actors`. Errors: kOutput.
Status check_mesh_files(const MeshFileSettings& settings, std::span<const PreparedActor> actors);

/// Makes the scene ask for what the files hold, before it is prepared.
void ask_for_mesh_attributes(Scene& scene, const MeshFileSettings& settings);

/// Makes the surfaces and writes them. Errors: those of geometry_at(), carry_actor() and
/// write_files(); stop_code() after a signal.
Status write_mesh_files(const MeshFileSettings& settings, const PreparedScene& prepared,
                        Engine& engine);

}  // namespace polymorph
