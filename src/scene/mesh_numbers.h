// Mesh sequence in a scene: an object whose model is a numbered file, seq.####.obj. It plays alone,
// as an actor's only object, or moves through a morph.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/frame_pattern.h"
#include "base/result.h"
#include "scene/scene.h"

namespace polymorph {

/// Tests whether a model's name has a place for a number, and is not itself that of a file.
bool is_numbered(const std::filesystem::path& model);

/// Numbers of a sequence's meshes that are there, as files or in memory, rising. Errors: those of
/// existing_frames().
Result<std::vector<int>> existing_meshes(const FramePattern& pattern);

/// Range of the files that are there: first and last number, and a step where all are further
/// apart than 1. Errors: kInput (there is none, or the folder cannot be read), kUsage (a bad name).
Result<std::vector<int>> find_range(const std::filesystem::path& model);

/// Meshes per second that the files themselves state: an animated model's poses; else nothing.
std::optional<float> stored_rate(const std::filesystem::path& model);

/// Tests whether the object is a mesh sequence: then its scene's reader has found its range.
inline bool is_mesh_sequence(const ObjectSettings& object) { return !object.range.empty(); }

/// Tests whether the actor plays a mesh sequence instead of a morph.
bool plays_meshes(const ActorSettings& actor);

/// Tests whether an object of the actor's morph is a mesh sequence.
bool morphs_meshes(const ActorSettings& actor);

/// Number of a sequence's meshes; 0 where its range is none.
int mesh_count(const ObjectSettings& object);

/// Numbers of a sequence's meshes in the order in which they are shown.
std::vector<int> mesh_numbers(const ObjectSettings& object);

/// File of one mesh.
std::filesystem::path mesh_file(const ObjectSettings& object, int number);

/// "240 meshes, frames 1 to 240, 1 missing": the files of a sequence, none of which is read.
std::string describe_files(const ObjectSettings& object);

/// Name of a sequence: that of its files without number and suffix.
std::string sequence_name(const std::filesystem::path& model);

}  // namespace polymorph
