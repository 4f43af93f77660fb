// Animated model: a glTF file whose nodes, skin or morph targets move, as a sequence of meshes. The
// pose at each moment of its animation has the path of a file: walk@0012.glb is the 12th of
// walk.glb. Of several animations one may be named: hero@run.glb, and hero@run@0012.glb.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace polymorph {

/// A pose of an animated model.
struct AnimatedPose {
  std::filesystem::path file;  ///< the model's
  std::string animation;       ///< the name that its path has for it; empty: none
  int number = 1;              ///< number of the pose, from 1
};

/// Motion of an animated model.
struct Animation {
  std::vector<std::size_t> playing;  ///< indices of the file's animations that play
  std::vector<std::string> names;    ///< names of all of the file's animations, as paths have them
  double start = 0, end = 0;         ///< times of the first and the last key, in seconds
  /// Rate at which its keys were sampled, if it is one of films; else 24.
  int poses_per_second = 24;
  /// Number of poses, from the first to the last key; 0 where nothing moves.
  int pose_count() const;
  /// Time of a pose.
  double seconds(int number) const {
    return start + static_cast<double>(number - 1) / poses_per_second;
  }
};

/// The pose that a path names; nothing where a file of that name is there, or none of the model's.
std::optional<AnimatedPose> find_pose(const std::filesystem::path& path);

/// Reads what moves an animated model. The animation of that name plays, or the first, and with it
/// the others that move nothing that plays already: those of an armature and of morph targets are
/// often two. A named one alone says how long. Nothing plays where the file is not glTF, cannot be
/// read, is not animated or has none of that name.
Animation read_animation(const std::filesystem::path& file, const std::string& name = {});

/// Number of poses of walk.glb or hero@run.glb; 0 where nothing moves.
int pose_count(const std::filesystem::path& model);

/// Says why an animated model has no poses.
std::string describe_missing_poses(const AnimatedPose& pose);

/// Says which animations of a model do not play, and how they would; empty where all do, or where
/// the path names one.
std::string describe_other_animations(const AnimatedPose& pose);

/// The path of an animated model's poses, walk@####.glb, with a place for their number.
std::filesystem::path pose_pattern(const std::filesystem::path& model);

/// The model and the animation that hero@run.glb names; nothing where a file of that name is there,
/// or none of the model's.
std::optional<AnimatedPose> find_named_animation(const std::filesystem::path& path);

}  // namespace polymorph
