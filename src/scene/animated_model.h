// Animated model as a mesh sequence: a glTF file whose nodes, skin or morph targets move. Each pose
// has a virtual path: walk@0012.glb is the 12th pose of walk.glb. A path may also name one of
// several animations: hero@run.glb and hero@run@0012.glb.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace polymorph {

/// A pose of an animated model, as its path names it.
struct AnimatedPose {
  std::filesystem::path file;  ///< the model
  std::string animation;       ///< name of the animation in the path; empty: the path has none
  int number = 1;              ///< number of the pose, from 1
};

/// Motion of an animated model.
struct Animation {
  std::vector<std::size_t> playing;  ///< indices of the file's animations that play
  std::vector<std::string> names;    ///< names of all animations in the file, as paths write them
  double start = 0, end = 0;         ///< times of the first and the last key, in seconds
  /// Sampling rate of the keys if it is a film rate, 24 to 120 per second; else 24.
  int poses_per_second = 24;
  /// Number of poses from the first to the last key, at most an hour's; 0 if nothing moves.
  int pose_count() const;
  /// Time of a pose, in seconds.
  double seconds(int number) const {
    return start + static_cast<double>(number - 1) / poses_per_second;
  }
};

/// Parses the path of a pose. Returns nullopt if `path` does not have this form, if a file of this
/// name exists, or if the model does not exist.
std::optional<AnimatedPose> parse_pose_path(const std::filesystem::path& path);

/// Reads the motion of a model. The animation `name` plays, or the first one if `name` is empty.
/// Each other animation plays along if it moves nothing that an earlier one moves: an armature and
/// its morph targets often have an animation each. The times span the keys of the named animation
/// or, without a name, of all that play. Nothing plays if the file is not glTF, cannot be read, or
/// has no such animation.
Animation read_animation(const std::filesystem::path& file, const std::string& name = {});

/// Number of poses of a model (walk.glb) or of one of its animations (hero@run.glb); 0 if nothing
/// moves.
int pose_count(const std::filesystem::path& model);

/// Explains why a model has no poses.
std::string describe_missing_poses(const AnimatedPose& pose);

/// Explains which animations of a model do not play and how to play them. Returns "" if all play,
/// or if the path names one.
std::string describe_other_animations(const AnimatedPose& pose);

/// Returns the path pattern of a model's poses: walk@####.glb.
std::filesystem::path pose_pattern(const std::filesystem::path& model);

/// Parses hero@run.glb into model and animation, with pose number 1. Returns nullopt if `path` does
/// not have this form, if a file of this name exists, or if the model does not exist.
std::optional<AnimatedPose> parse_animation_path(const std::filesystem::path& path);

}  // namespace polymorph
