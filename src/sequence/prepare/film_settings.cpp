#include "sequence/prepare/film_settings.h"

#include <algorithm>

#include "base/hash.h"
#include "morph/timeline.h"
#include "scene/mesh_numbers.h"

namespace polymorph {
namespace {

/// Maximum number of camera poses for which a moving camera's framing is computed.
constexpr int kMaxFramedPoses = 128;

/// Cameras of one frame; see FrameView.
struct FilmCameras {
  Camera camera;
  std::optional<CameraMotion> motion;
  std::optional<Camera> rig;
};

/// Tests whether two cameras take the same picture: all members but the shutter are equal.
bool same_pose(const Camera& a, const Camera& b) {
  return a.position == b.position && a.right == b.right && a.up == b.up && a.forward == b.forward &&
         a.tan_half_fov_y == b.tan_half_fov_y && a.lens_radius == b.lens_radius &&
         a.focus == b.focus;
}

/// Makes the cameras of a frame. `framing`: film_framing().
FilmCameras film_cameras(const Scene& scene, const Framing& framing, int frame) {
  const auto camera_at = [&](double frame_number) {
    return make_camera(scene_at(scene, frame_number).camera, framing);
  };
  FilmCameras cameras;
  cameras.camera = camera_at(frame);
  const double half_shutter = 0.5 * static_cast<double>(cameras.camera.shutter);
  const CameraMotion motion{camera_at(frame - half_shutter), camera_at(frame + half_shutter),
                            frame == frame_count(scene) ? cameras.camera : camera_at(frame + 1)};
  const bool is_still = same_pose(motion.opening, cameras.camera) &&
                        same_pose(motion.closing, cameras.camera) &&
                        same_pose(motion.next, cameras.camera);
  if (!is_still) cameras.motion = motion;
  if (!scene_at(scene, frame).lights.follow_camera)
    cameras.rig = camera_at(1);  // lights stand as in frame 1
  return cameras;
}

void add(Hasher& hasher, const Camera& c) {
  for (const Vec3 v : {c.position, c.right, c.up, c.forward}) hasher.add(v.x).add(v.y).add(v.z);
  hasher.add(c.tan_half_fov_y).add(c.lens_radius).add(c.focus).add(c.shutter);
}

/// Tests whether a leg is left before its end (ObjectSettings::retarget).
bool leaves_balls_in_flight(const Scene& scene) {
  return std::any_of(scene.actors.begin(), scene.actors.end(), [](const ActorSettings& actor) {
    return std::any_of(actor.intermediate.begin(), actor.intermediate.end(),
                       [](const ObjectSettings& object) { return object.retarget < 1; });
  });
}

/// Returns the camera settings at up to kMaxFramedPoses evenly spaced frames, for which the framing
/// is computed.
std::vector<CameraSettings> film_poses(const Scene& scene) {
  const int count = frame_count(scene), poses = std::min(count, kMaxFramedPoses);
  std::vector<CameraSettings> settings;
  for (int i = 0; i < poses; ++i)
    settings.push_back(
        scene_at(scene, 1 + (poses > 1 ? static_cast<double>(i) * (count - 1) / (poses - 1) : 0))
            .camera);
  return settings;
}

/// Hashes those settings of camera poses that make_framing() uses. The framing itself is only known
/// after the legs are made, because a surface between two objects may be larger than both.
std::string hash_poses(std::span<const CameraSettings> poses) {
  Hasher hasher;
  float margin = poses.front().margin, fov = poses.front().fov;
  for (const CameraSettings& pose : poses) {
    margin = std::min(margin, pose.margin), fov = std::max(fov, pose.fov);
    const Vec3 target = pose.target.value_or(Vec3{});
    hasher.add(pose.azimuth + pose.orbit).add(pose.elevation).add(pose.target.has_value());
    for (const Vec3 v : {pose.up, target}) hasher.add(v.x).add(v.y).add(v.z);
  }
  return hasher.add(margin).add(fov).hex();
}

/// Tests whether settings or the camera change over the frames.
bool changes(const Scene& scene) {
  return !scene.tracks.empty() || scene.camera.orbit != 0 || scene.frames.turntable > 0;
}

/// Hashes the meshes of a sequence. In a morph (`morphs`), the balls of a mesh are derived from the
/// reference's, and MeshHashes::fit is set; if the mesh's vertices do not correspond to the
/// reference's, it covers all meshes up to this one.
std::vector<MeshHashes> hash_meshes(const MeshSequence& sequence, bool morphs) {
  std::vector<MeshHashes> hashes;
  const MeshFile& reference = sequence.files[static_cast<std::size_t>(sequence.reference)];
  std::string meshes_so_far;
  for (const MeshFile& file : sequence.files) {
    MeshHashes& mesh_hashes =
        hashes.emplace_back(MeshHashes{file.digest + file.velocities, /*fit=*/{}});
    if (!morphs) continue;
    meshes_so_far =
        Hasher().add(std::string_view(meshes_so_far)).add(std::string_view(file.digest)).hex();
    mesh_hashes.fit = file.topology == reference.topology ? reference.digest : meshes_so_far;
  }
  return hashes;
}

/// Sets hashes.meshes if there is a mesh sequence.
void add_meshes(const SceneInputs& inputs, SequenceHashes& hashes) {
  if (std::none_of(inputs.sequences.begin(), inputs.sequences.end(),
                   [](const auto& sequence) { return sequence != nullptr; }))
    return;
  for (const std::span<const ChainObject> objects : actor_chains(inputs.chain)) {
    auto& lists = hashes.meshes.emplace_back();
    const auto first = static_cast<std::size_t>(objects.data() - inputs.chain.data());
    for (std::size_t i = 0; i < objects.size(); ++i) {
      std::vector<MeshHashes>& list = lists.emplace_back();
      if (const auto& sequence = inputs.sequences[first + i])
        list = hash_meshes(*sequence, !plays_sequence_alone(*objects[i].actor));
    }
  }
}

/// Adds the meshes that a moment shows of an actor, and those from which its balls are derived.
void add_moment_meshes(const std::vector<std::vector<MeshHashes>>& meshes, const MorphState& moment,
                       Hasher& hasher) {
  const bool is_whole = moment.object >= 0 && moment.boundary == 1;  // shown without its balls
  const auto add = [&](int object, int mesh) {
    if (mesh < 0) return;
    const MeshHashes& shown =
        meshes[static_cast<std::size_t>(object)][static_cast<std::size_t>(mesh)];
    hasher.add(std::string_view(shown.content));
    if (!is_whole) hasher.add(std::string_view(shown.fit));
  };
  if (shows_source(moment)) add(moment.leg, moment.mesh);
  if (shows_target(moment)) add(moment.leg + 1, moment.to_mesh);
}

/// Adds the meshes of sequences that a frame shows, their transforms and the camera.
void add_shown_meshes(const Scene& scene, const SequenceHashes& hashes, int frame, Hasher& hasher) {
  hasher.add(std::string_view(hashes.placement));
  for (std::size_t a = 0; a < hashes.meshes.size(); ++a) {
    const std::vector<std::vector<MeshHashes>>& meshes = hashes.meshes[a];
    const auto is_empty = [](const auto& list) { return list.empty(); };
    if (std::all_of(meshes.begin(), meshes.end(), is_empty)) continue;
    const Timeline timeline = make_timeline(scene, scene.actors[a]);
    const int film_frame = shown_frame(scene, frame);
    add_moment_meshes(meshes, morph_state_at(timeline, film_frame), hasher);
    if (scene.frames.turntable == 0 && needs_motion(scene))
      add_moment_meshes(meshes, morph_state_at(timeline, std::min(film_frame + 1, timeline.count)),
                        hasher);
  }
}

}  // namespace

bool camera_moves(const Scene& scene) {
  return scene.camera.orbit != 0 || scene.frames.turntable > 0 ||
         std::any_of(scene.tracks.begin(), scene.tracks.end(), [](const KeyframeTrack& track) {
           return track.pointer.starts_with("/camera/");
         });
}

Framing film_framing(const Scene& scene, std::span<const Vec3> points) {
  return make_framing(film_poses(scene), points, scene.image.width, scene.image.height);
}

FrameView make_frame_view(const PreparedScene& prepared, int frame) {
  FrameView view;
  view.scene = scene_at(prepared.scene, frame);
  view.ground = view.scene.ground;
  // The ground lies slightly below the lowest point, so that flat bottoms are not coplanar with it.
  if (!view.ground.height)
    view.ground.height = prepared.box.low.y - 1e-3f * prepared.box.diagonal();
  view.camera = prepared.camera;
  if (!prepared.framing) return view;
  FilmCameras cameras = film_cameras(prepared.scene, *prepared.framing, frame);
  view.camera = cameras.camera;
  view.camera_motion = std::move(cameras.motion);
  view.rig = std::move(cameras.rig);
  return view;
}

SequenceHashes hash_sequence(const SceneInputs& inputs) {
  const Scene& scene = inputs.scene;
  SequenceHashes hashes;
  hashes.scene = content_hash(inputs);
  hashes.inputs = inputs_hash(inputs);
  hashes.aovs = scene.image.aovs;
  add_meshes(inputs, hashes);
  const bool has_moving_camera = camera_moves(scene), has_sequences = !hashes.meshes.empty();
  // The other members serve only films with mesh sequences or a moving camera.
  if (!has_sequences && (!has_moving_camera || leaves_balls_in_flight(scene))) return hashes;
  std::vector<Vec3> points;
  for (const Model& model : inputs.models)
    points.insert(points.end(), model.points.begin(), model.points.end());
  if (has_moving_camera && !leaves_balls_in_flight(scene)) {
    const std::vector<CameraSettings> poses = film_poses(scene);
    hashes.framing = make_framing(poses, points, scene.image.width, scene.image.height);
    hashes.camera_poses = hash_poses(poses);
  }
  if (!has_sequences) return hashes;
  Hasher hasher;
  const Box box = bounding_box(points);
  for (const Vec3 v : {box.low, box.high}) hasher.add(v.x).add(v.y).add(v.z);
  if (!has_moving_camera)
    add(hasher, make_camera(scene.camera, points, scene.image.width, scene.image.height));
  // Different transforms of the meshes may give the same box.
  for (const auto& sequence : inputs.sequences)
    if (sequence)
      for (const Transform& step : sequence->steps)
        for (const auto& row : step.m)
          for (const float v : row) hasher.add(v);
  hashes.placement = hasher.hex();
  return hashes;
}

std::string frame_hash(const Scene& scene, const SequenceHashes& hashes, int frame) {
  const bool has_sequences = !hashes.meshes.empty();
  if ((!changes(scene) && !has_sequences) || (camera_moves(scene) && !hashes.framing))
    return hashes.scene;
  Hasher hasher;
  Scene frame_scene = scene_at(scene, frame);
  frame_scene.image.aovs = hashes.aovs;
  hasher.add(hashes.inputs).add(settings_text(frame_scene));
  if (has_sequences) add_shown_meshes(frame_scene, hashes, frame, hasher);
  if (!hashes.framing) return hasher.hex();
  hasher.add(std::string_view(hashes.camera_poses));
  const FilmCameras cameras = film_cameras(scene, *hashes.framing, frame);
  add(hasher, cameras.camera);
  hasher.add(cameras.motion.has_value());
  if (cameras.motion)
    for (const Camera& camera :
         {cameras.motion->opening, cameras.motion->closing, cameras.motion->next})
      add(hasher, camera);
  hasher.add(cameras.rig.has_value());
  if (cameras.rig) add(hasher, *cameras.rig);
  return hasher.hex();
}

}  // namespace polymorph
