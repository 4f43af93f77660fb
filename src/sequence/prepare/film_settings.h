// Film: settings, camera and lights of one frame, where they change over the sequence.
#pragma once

#include <optional>
#include <span>
#include <string>

#include "render/render.h"
#include "sequence/prepare/content_hash.h"
#include "sequence/prepare/prepared_scene.h"

namespace polymorph {

/// The settings, camera and ground of one frame.
struct FrameView {
  Scene scene;  ///< keyed settings at their value of this frame
  Camera camera;
  std::optional<CameraMotion> camera_motion;  ///< empty: the camera stands still around this frame
  std::optional<Camera> rig;                  ///< camera by which the lights stand; empty: `camera`
  GroundSettings ground;                      ///< its height is set
};

/// `frame` in [1, prepared.frame_count].
FrameView make_frame_view(const PreparedScene& prepared, int frame);

/// Tests whether frames with these settings need the surface's motion.
inline bool wants_flow(const Scene& scene) {
  return scene.camera.shutter > 0 || aov_is_chosen(scene.image.aovs, "motion") ||
         aov_is_chosen(scene.image.aovs, "morph");
}

/// Tests whether the scene's camera moves, rotates or zooms.
bool camera_moves(const Scene& scene);

/// The framing of all frames of a scene whose camera moves; `points`: of all its objects.
Framing film_framing(const Scene& scene, std::span<const Vec3> points);

/// Hashes that the frames of a scene are known by, from its files alone: no ball is made for them.
SequenceHashes hash_sequence(const SceneInputs& inputs);

/// Hash of all that decides the frame's files: of the scene's inputs and of its settings as this
/// frame has them. Where nothing is keyed, the same for all frames: hashes.scene. So it is where a
/// moving camera frames balls in flight (`retarget`), which only a preparation makes.
std::string frame_hash(const Scene& scene, const SequenceHashes& hashes, int frame);

}  // namespace polymorph
