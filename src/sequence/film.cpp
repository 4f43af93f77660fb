#include "sequence/film.h"

#include <algorithm>

#include "base/hash.h"
#include "morph/timeline.h"
#include "sequence/content_hash.h"

namespace polymorph {
namespace {

constexpr int kMaxFramedPoses = 128;  // directions that a moving camera's distance is found for

/// `frame` may lie between frames.
Camera camera_at(const PreparedScene& prepared, double frame) {
  return make_camera(scene_at(prepared.scene, frame).camera, *prepared.framing);
}

bool same_pose(const Camera& a, const Camera& b) {
  return a.position == b.position && a.right == b.right && a.up == b.up && a.forward == b.forward &&
         a.tan_half_fov_y == b.tan_half_fov_y && a.lens_radius == b.lens_radius &&
         a.focus == b.focus;
}

void add(Hasher& hasher, const Camera& c) {
  for (const Vec3 v : {c.position, c.right, c.up, c.forward}) hasher.add(v.x).add(v.y).add(v.z);
  hasher.add(c.tan_half_fov_y).add(c.lens_radius).add(c.focus).add(c.shutter);
}

bool changes(const Scene& scene) {
  return !scene.tracks.empty() || scene.camera.orbit != 0 || scene.frames.turntable > 0;
}

}  // namespace

bool camera_moves(const Scene& scene) {
  return scene.camera.orbit != 0 || scene.frames.turntable > 0 ||
         std::any_of(scene.tracks.begin(), scene.tracks.end(), [](const KeyframeTrack& track) {
           return track.pointer.starts_with("/camera/");
         });
}

Framing film_framing(const Scene& scene, std::span<const Vec3> points) {
  const int count = frame_count(scene), poses = std::min(count, kMaxFramedPoses);
  std::vector<CameraSettings> settings;
  for (int i = 0; i < poses; ++i)
    settings.push_back(
        scene_at(scene, 1 + (poses > 1 ? static_cast<double>(i) * (count - 1) / (poses - 1) : 0))
            .camera);
  return make_framing(settings, points, scene.image.width, scene.image.height);
}

FrameView view_of(const PreparedScene& prepared, int frame) {
  FrameView view;
  view.scene = scene_at(prepared.scene, frame);
  view.ground = view.scene.ground;
  // A hair below the feet, so that flat bottoms do not share a plane with it.
  if (!view.ground.height)
    view.ground.height = prepared.box.low.y - 1e-3f * prepared.box.diagonal();
  view.camera = prepared.camera;
  if (!prepared.framing) return view;
  view.camera = make_camera(view.scene.camera, *prepared.framing);
  const double half = 0.5 * static_cast<double>(view.camera.shutter);
  const CameraMotion motion{
      camera_at(prepared, frame - half), camera_at(prepared, frame + half),
      frame == prepared.frame_count ? view.camera : camera_at(prepared, frame + 1)};
  const bool still = same_pose(motion.opening, view.camera) &&
                     same_pose(motion.closing, view.camera) && same_pose(motion.next, view.camera);
  if (!still) view.camera_motion = motion;
  if (!view.scene.lights.follow_camera) view.rig = camera_at(prepared, 1);
  return view;
}

std::string frame_hash(const PreparedScene& prepared, int frame) {
  if (!changes(prepared.scene)) return prepared.hash;
  const FrameView view = view_of(prepared, frame);
  Hasher hasher;
  hasher.add(prepared.inputs_hash).add(settings_text(view.scene));
  add(hasher, view.camera);
  hasher.add(view.camera_motion.has_value());
  if (view.camera_motion)
    for (const Camera& camera :
         {view.camera_motion->opening, view.camera_motion->closing, view.camera_motion->next})
      add(hasher, camera);
  hasher.add(view.rig.has_value());
  if (view.rig) add(hasher, *view.rig);
  return hasher.hex();
}

}  // namespace polymorph
