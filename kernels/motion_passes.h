// The pass that moves balls along their paths (ball_paths.h).
#pragma once

#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "ball_paths.h"
#include "ball_set.h"
#include "types.h"
#include "view.h"
#include "workspace.h"

namespace polymorph {

template <class B>
BallSet move_balls(Workspace<B>& work, const std::shared_ptr<const BallPaths>& paths,
                   const MotionState& state, const std::vector<float>& eased_times) {
  const auto resize = [&](auto& buffer, const auto& from) {
    return buffer.resize(work.backend, static_cast<std::int64_t>(from.size()));
  };
  const View<BallPath> ball_paths = resize(work.paths, paths->balls);
  const View<PathPart> parts = resize(work.parts, paths->parts);
  if (paths != work.uploaded_paths) {
    work.uploaded_paths.reset();
    work.backend.upload(ball_paths, paths->balls.data());
    work.backend.upload(parts, paths->parts.data());
    work.uploaded_paths = paths;
  }
  const std::vector<PartPose> host_poses = part_poses_at(paths->parts, state.eased);
  const View<PartPose> poses = resize(work.poses, host_poses);
  work.backend.upload(poses, host_poses.data());
  const View<float> eased = resize(work.eased_times, eased_times);
  if (!eased_times.empty()) work.backend.upload(eased, eased_times.data());
  work.uploaded_balls = {};  // the next pass overwrites raw_balls
  const View<Ball> moved_balls = work.raw_balls.resize(work.backend, ball_paths.size);
  work.backend.for_each(ball_paths.size,
                        MoveBalls{ball_paths, parts, poses, eased, state, moved_balls}, "step");
  std::vector<Ball> balls(paths->balls.size());
  work.backend.download(balls.data(), moved_balls);
  work.uploaded_balls = BallSet(std::move(balls));
  return work.uploaded_balls;
}

}  // namespace polymorph
