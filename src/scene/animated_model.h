// Animated model: a glTF file whose nodes, skin or morph targets move, as a sequence of meshes. The
// pose at each moment of its animation has the path of a file: walk@0012.glb is the 12th of
// walk.glb.
#pragma once

#include <filesystem>
#include <optional>

namespace polymorph {

/// Poses per second of an animation.
inline constexpr int kPosesPerSecond = 24;

/// A pose of an animated model.
struct AnimatedPose {
  std::filesystem::path file;  ///< the model's
  int number = 1;              ///< number of the pose, from 1
  double seconds() const { return static_cast<double>(number - 1) / kPosesPerSecond; }
};

/// The pose that a path names; nothing where a file of that name is there, or none of the model's.
std::optional<AnimatedPose> find_pose(const std::filesystem::path& path);

/// Number of an animated model's poses, from the first to the last key of its animation; 0 where
/// the file is not glTF, cannot be read or is not animated.
int pose_count(const std::filesystem::path& file);

/// The path of an animated model's poses, walk@####.glb, with a place for their number.
std::filesystem::path pose_pattern(const std::filesystem::path& file);

}  // namespace polymorph
