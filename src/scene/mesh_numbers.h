// Mesh sequence in a scene: an object whose model is a series of numbered files, seq.####.obj. It
// plays alone, as an actor's only object, or goes on playing during a morph.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/frame_pattern.h"
#include "base/result.h"
#include "scene/scene.h"

namespace polymorph {

/// Tests whether a model's name is a pattern with a number, and not an existing model. A malformed
/// pattern with a '#' counts, too, so that reading it reports the error.
bool is_numbered(const std::filesystem::path& model);

/// Lists the numbers of a sequence's existing meshes, which are meshes in memory, poses or files,
/// in ascending order. Errors: those of existing_frames().
Result<std::vector<int>> existing_meshes(const FramePattern& pattern);

/// Finds the range of a sequence's existing meshes: first and last number and, if it is above 1,
/// the step. Errors: kInput (no mesh, or an unreadable folder), kUsage (a bad name).
Result<std::vector<int>> find_mesh_range(const std::filesystem::path& model);

/// Poses per second of an animated model; nullopt for other models.
std::optional<float> find_pose_rate(const std::filesystem::path& model);

/// Tests whether the object is a mesh sequence. The scene's reader gives all of these a range.
inline bool is_mesh_sequence(const ObjectSettings& object) { return !object.range.empty(); }

/// Tests whether the actor plays a mesh sequence instead of a morph.
bool plays_sequence_alone(const ActorSettings& actor);

/// Tests whether an object of the actor's morph is a mesh sequence.
bool morphs_sequence(const ActorSettings& actor);

/// Number of a sequence's meshes; 0 if its range is invalid.
int mesh_count(const ObjectSettings& object);

/// Numbers of a sequence's meshes in the order in which they are shown; empty if its range is
/// invalid.
std::vector<int> mesh_numbers(const ObjectSettings& object);

/// Path of one mesh of a sequence.
std::filesystem::path mesh_file(const ObjectSettings& object, int number);

/// Describes a sequence without reading its files: "240 meshes, frames 1 to 240, 1 missing". The
/// range must be valid.
std::string describe_sequence(const ObjectSettings& object);

/// Name of a sequence: its file name without number, suffix and the separators before the number.
std::string sequence_name(const std::filesystem::path& model);

}  // namespace polymorph
