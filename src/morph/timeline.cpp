#include "morph/timeline.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numeric>

#include "base/result.h"
#include "morph/easing.h"
#include "scene/blends.h"
#include "scene/load_scene.h"
#include "scene/max_frames.h"
#include "scene/mesh_numbers.h"

namespace polymorph {
namespace {

constexpr int kFramesPerLeg = 24;  ///< frames of a leg, unless the scene sets them
constexpr std::array<StageInfo, 7> kStages{{
    {Stage::kLookOut, "look-out", "the source's own materials fade to the common look"},
    {Stage::kBoundaryOut, "boundary-out", "the source's mesh becomes its balls"},
    {Stage::kVolume, "volume", "balls move from source to target"},
    {Stage::kBoundaryIn, "boundary-in", "the target's balls become its mesh"},
    {Stage::kLookIn, "look-in", "the common look fades to the target's own materials"},
    {Stage::kPlay, "play", "meshes of a sequence, one after the other"},
    {Stage::kBlend, "blend", "three objects or more, mixed by their weights"},
}};

float smoothstep(float t) { return t * t * (3 - 2 * t); }

/// Sets LegTiming::shares, whose indices are the stages. An end has stages only if it shows a model
/// (`starts_at_model`, `ends_at_model`). A surface from distances starts at the model itself, so it
/// has no boundary stages.
void set_shares(LegTiming& leg, const BoundarySettings& settings, bool own_look) {
  const bool is_cut =
      leg.interpolation == Interpolation::kDistance || settings.method == BoundaryMethod::kCut;
  const float boundary = is_cut ? 0 : settings.boundary_share;
  const float look = own_look ? 0 : settings.look_share;
  leg.shares[0] = leg.starts_at_model ? look : 0;
  leg.shares[1] = leg.starts_at_model ? boundary : 0;
  leg.shares[3] = leg.ends_at_model ? boundary : 0;
  leg.shares[4] = leg.ends_at_model ? look : 0;
  // The stages beside the volumetric one take at most four fifths of the time.
  const float end_shares = leg.shares[0] + leg.shares[1] + leg.shares[3] + leg.shares[4];
  if (end_shares > 0.8f)
    for (const int i : {0, 1, 3, 4}) leg.shares[i] *= 0.8f / end_shares;
  leg.shares[2] = 1 - (leg.shares[0] + leg.shares[1] + leg.shares[3] + leg.shares[4]);
}

/// Tests whether a leg's surface is made from distances (MotionSettings::interpolate). Balls are
/// always used for paths and shapes that separate into single balls (explode, drops), in fields
/// that are not Gaussian, and with an influence resolution (surface.influence).
bool has_distances(const Scene& scene, const ObjectSettings& from, const ObjectSettings& to) {
  constexpr const char* kDrops = "drops";
  return to.motion.interpolate == Interpolation::kDistance && to.motion.path != Path::kExplode &&
         scene.field.kind == FieldKind::kGaussian && scene.surface.influence == 1 &&
         from.shape != kDrops && to.shape != kDrops;
}

/// Handles ends of a leg that show a model but have no stages (a cut without a fade).
/// `leg_fraction`: fraction of the leg that has passed, [0, 1]. If it is such an end, sets `state`
/// to show the model and returns true.
bool show_model_without_stages(const LegTiming& leg, float leg_fraction, MorphState& state) {
  const bool at_start =
      leg_fraction <= 0 && leg.starts_at_model && leg.shares[0] + leg.shares[1] <= 0;
  const bool at_end = leg_fraction >= 1 && leg.ends_at_model && leg.shares[3] + leg.shares[4] <= 0;
  if (!at_start && !at_end) return false;
  state.stage = at_start ? Stage::kLookOut : Stage::kLookIn;
  state.object = at_start ? state.leg : state.leg + 1;
  state.progress = state.time = state.u = at_start ? 0.0f : 1.0f;
  state.look = state.growth = 0;
  state.boundary = 1;
  return true;
}

/// Tests whether the scene gives the total number of frames, from which the legs' numbers of frames
/// follow (unless an actor gives its own).
bool has_frame_count(const Scene& scene) {
  return scene.frames.count > 0 && scene.frames.per_leg.empty();
}

/// Number of frames of each leg.
std::vector<int> leg_frames(const Scene& scene, const ActorSettings& actor) {
  if (!actor.per_leg.empty()) return actor.per_leg;
  if (!scene.frames.per_leg.empty()) return scene.frames.per_leg;
  return std::vector<int>(actor.intermediate.size() + 1, kFramesPerLeg);
}

/// Number of frames for which an actor stands still between legs.
int held_frames(const ActorSettings& actor) {
  int held = 0;
  for (const ObjectSettings& object : actor.intermediate) held += object.hold;
  return held;
}

Playback make_playback(const Scene& scene, const ObjectSettings& object) {
  Playback playback;
  playback.meshes = mesh_count(object);
  playback.pace = static_cast<double>(object.fps.value_or(scene.frames.fps)) /
                  static_cast<double>(scene.frames.fps);
  playback.hold = object.hold;
  playback.fps = scene.frames.fps;
  playback.loop = object.loop.value_or(false);
  return playback;
}

/// Tolerance for rounding errors in products with frame rates such as 23.976, in frames.
constexpr double kRounding = 1e-6;

/// Number of frames for which a mesh sequence plays once, with the hold of its last mesh.
int playback_frames(const Playback& playback) {
  const double frames = std::ceil(playback.meshes / playback.pace - kRounding);
  return playback.hold + static_cast<int>(std::clamp(frames, 1.0, double{kMaxFrames}));
}

/// The mesh, counted from 0, that is shown `step` frames after the first.
int mesh_at(const Playback& playback, int step) {
  double elapsed = step;  // frames; in a loop, since the first mesh was last shown
  if (playback.loop)
    elapsed = std::fmod(elapsed + kRounding, playback.meshes / playback.pace + playback.hold);
  return std::min(static_cast<int>(elapsed * playback.pace + kRounding), playback.meshes - 1);
}

/// Adds the legs of a blend: each lasts as long as the film.
void add_blend_legs(const Scene& scene, const ActorSettings& actor, Timeline& timeline) {
  const auto objects = chain_objects(actor);
  for (std::size_t i = 1; i < objects.size(); ++i) {
    LegTiming& leg = timeline.legs.emplace_back();
    leg.steps = timeline.steps;
    leg.motion = objects[i]->motion;
    leg.motion.easing = Easing::kLinear;  // weights have easings of their own
    if (has_distances(scene, *objects[0], *objects[i]))
      leg.interpolation = Interpolation::kDistance;
    set_shares(leg, scene.boundary, timeline.own_look);
  }
}

/// Adds the weights of a blend's objects in each frame.
void add_weights(const Scene& scene, std::size_t actor, Timeline& timeline) {
  for (int frame = 1; frame <= timeline.count; ++frame)
    timeline.weights.push_back(blend_weights(scene, actor, film_time(scene, frame)));
}

/// Weights of a blend's objects at a frame, or between two by linear interpolation; empty without a
/// blend.
std::vector<float> weights_at(const Timeline& timeline, double frame) {
  if (timeline.weights.empty()) return {};
  const auto before = static_cast<std::size_t>(frame) - 1;
  const auto fraction = static_cast<float>(frame - std::floor(frame));
  std::vector<float> weights = timeline.weights[before];
  if (fraction > 0)
    for (std::size_t i = 0; i < weights.size(); ++i)
      weights[i] = std::lerp(weights[i], timeline.weights[before + 1][i], fraction);
  return weights;
}

/// State of an actor that mixes three objects or more. If one object has all the weight, the object
/// itself is shown.
MorphState blend_state(const Timeline& timeline, const std::vector<float>& weights,
                       MorphState state) {
  state.stage = Stage::kBlend;
  state.progress = state.time = state.u = 1 - weights.front();
  state.weights = weights;
  const auto sole = std::find(weights.begin(), weights.end(), 1.0f);
  if (sole == weights.end()) return state;
  state.object = static_cast<int>(sole - weights.begin());
  state.leg = std::max(state.object - 1, 0);
  state.look = timeline.own_look ? 0.0f : 1.0f;
  state.growth = 0;
  return state;
}

/// State of an actor that plays a mesh sequence.
MorphState play_state(const Timeline& timeline, int step, MorphState state) {
  const Playback& playback = timeline.playbacks.front();
  state.stage = Stage::kPlay;
  state.object = 0;
  state.mesh = mesh_at(playback, step);
  state.progress = playback.meshes > 1
                       ? static_cast<float>(state.mesh) / static_cast<float>(playback.meshes - 1)
                       : 0;
  state.look = state.growth = 0;
  state.boundary = 1;
  return state;
}

/// Lays out the times of an actor, without the weights of its blend.
Timeline lay_out(const Scene& scene, const ActorSettings& actor) {
  Timeline timeline;
  timeline.count = film_frame_count(scene);
  timeline.start = actor.start;
  timeline.hold_start = scene.frames.hold_start + actor.start - 1;
  timeline.own_look = scene.look.kind == LookKind::kOwn;
  if (plays_sequence_alone(actor)) {
    timeline.steps = timeline.count - timeline.hold_start - scene.frames.hold_end - 1;
    timeline.playbacks = {make_playback(scene, actor.source)};
    return timeline;
  }
  if (!actor.blend.empty()) {
    const bool fills_film = has_frame_count(scene) && actor.per_leg.empty();
    const int still_frames = timeline.hold_start + scene.frames.hold_end;
    timeline.steps =
        (fills_film ? timeline.count - still_frames : leg_frames(scene, actor).front()) - 1;
    add_blend_legs(scene, actor, timeline);
    return timeline;
  }
  const auto objects = chain_objects(actor);
  if (morphs_sequence(actor)) {
    for (const ObjectSettings* object : objects)
      timeline.playbacks.push_back(make_playback(scene, *object));
    // An object between two legs plays on without a hold.
    for (std::size_t i = 1; i + 1 < objects.size(); ++i) timeline.playbacks[i].hold = 0;
  }
  // Distribute the steps over the legs and the holds.
  const std::size_t leg_count = objects.size() - 1;
  const std::vector<int> frames = leg_frames(scene, actor);
  PM_CHECK(frames.size() == leg_count);

  // The number of steps follows from the scene's number of frames or from the legs' frames, of
  // which there are at least two.
  const int total = std::accumulate(frames.begin(), frames.end(), 0);
  int hold_frames = held_frames(actor);
  const bool fills_film = has_frame_count(scene) && actor.per_leg.empty();
  timeline.steps = fills_film ? timeline.count - timeline.hold_start - scene.frames.hold_end - 1
                              : std::max(2, total) + hold_frames - 1;
  // If the holds leave less than a step per leg, there are no holds.
  if (timeline.steps - hold_frames < static_cast<int>(leg_count)) hold_frames = 0;
  const int moving_steps = timeline.steps - hold_frames;
  // Sums over the legs so far: frames as the scene gives them, and steps of holds.
  int frames_before = 0, holds_before = 0;
  // The step, without holds, at which the first n of the legs' `total` frames have passed: n *
  // moving_steps / total, rounded.
  const auto step_at = [&](int n) {
    return static_cast<int>((2LL * n * moving_steps + total) / (2LL * total));
  };
  for (std::size_t i = 0; i < leg_count; ++i) {
    LegTiming leg;
    const int first = step_at(frames_before);
    frames_before += frames[i];
    leg.steps = step_at(frames_before) - first;
    leg.first_step = first + holds_before;
    if (hold_frames > 0) holds_before += objects[i + 1]->hold;
    leg.motion = objects[i + 1]->motion;
    // After a leg of balls that is left early (`retarget`), the next leg continues with balls.
    const bool stays_balls = i > 0 && objects[i]->retarget < 1 &&
                             timeline.legs[i - 1].interpolation == Interpolation::kBalls;
    if (!stays_balls && has_distances(scene, *objects[i], *objects[i + 1]))
      leg.interpolation = Interpolation::kDistance;
    // An object that is left before it is reached is never shown itself.
    leg.starts_at_model = !objects[i]->meta && objects[i]->retarget == 1;
    leg.ends_at_model = !objects[i + 1]->meta && objects[i + 1]->retarget == 1;
    leg.until = objects[i + 1]->retarget;
    set_shares(leg, scene.boundary, timeline.own_look);
    timeline.legs.push_back(leg);
  }
  return timeline;
}

}  // namespace

std::span<const StageInfo> stage_table() { return std::span(kStages).first(5); }

const char* stage_name(Stage stage) { return kStages[static_cast<std::size_t>(stage)].name; }

bool mixes_many(const Timeline& timeline) {
  return !timeline.weights.empty() && timeline.weights.front().size() > 2;
}

std::optional<int> find_weightless_frame(const Timeline& timeline) {
  for (std::size_t i = 0; i < timeline.weights.size(); ++i) {
    const std::vector<float>& weights = timeline.weights[i];
    if (std::none_of(weights.begin(), weights.end(), [](float weight) { return weight > 0; }))
      return static_cast<int>(i) + 1;
  }
  return std::nullopt;
}

Timeline make_timeline(const Scene& scene, const ActorSettings& actor) {
  Timeline timeline = lay_out(scene, actor);
  if (actor.blend.empty()) return timeline;
  const auto index = static_cast<std::size_t>(&actor - scene.actors.data());
  PM_CHECK(index < scene.actors.size());
  add_weights(scene, index, timeline);
  return timeline;
}

LegKinds leg_kinds(const Timeline& timeline, std::size_t object) {
  LegKinds kinds;
  for (std::size_t i = object == 0 ? 0 : object - 1; i <= object && i < timeline.legs.size(); ++i) {
    const bool distances = timeline.legs[i].interpolation == Interpolation::kDistance;
    (distances ? kinds.distances : kinds.balls) = true;
  }
  return kinds;
}

double leg_pace(const LegTiming& leg) {
  return static_cast<double>(leg.until) /
         (static_cast<double>(leg.shares[2]) * std::max(leg.steps, 1));
}

int film_frame_count(const Scene& scene) {
  if (has_frame_count(scene)) return scene.frames.count;
  int longest = 0;
  for (const ActorSettings& actor : scene.actors) {
    if (plays_sequence_alone(actor)) {
      const int played = playback_frames(make_playback(scene, actor.source));
      longest = std::max(longest, actor.start - 1 + played);
      continue;
    }
    const std::vector<int> frames = leg_frames(scene, actor);
    const int total = std::accumulate(frames.begin(), frames.end(), 0);
    longest = std::max(longest, actor.start - 1 + std::max(2, total) + held_frames(actor));
  }
  return scene.frames.hold_start + longest + scene.frames.hold_end;
}

int frame_count(const Scene& scene) {
  return scene.frames.turntable > 0 ? scene.frames.turntable : film_frame_count(scene);
}

int shown_frame(const Scene& scene, int frame) {
  return scene.frames.turntable > 0 ? scene.frames.still : frame;
}

float sequence_time(const Scene& scene, int frame) {
  const int steps = film_frame_count(scene) - scene.frames.hold_start - scene.frames.hold_end - 1;
  const int step = std::clamp(frame - 1 - scene.frames.hold_start, 0, std::max(steps, 0));
  return steps > 0 ? static_cast<float>(step) / static_cast<float>(steps) : 0;
}

FilmTime film_time(const Scene& scene, double frame) {
  const int count = film_frame_count(scene);
  FilmTime time;
  time.frame = frame;
  time.share = count > 1 ? (frame - 1) / (count - 1) : 0;
  time.loop_fraction = (frame - 1) / count;
  const Timeline timeline = lay_out(scene, scene.actors.front());
  const double step = frame - 1 - timeline.hold_start;
  if (timeline.legs.empty())  // keyframes count playback as the first leg
    time.leg = 1 + std::clamp(step / std::max(timeline.steps, 1), 0.0, 1.0);
  const bool blends = !scene.actors.front().blend.empty();  // its legs are simultaneous
  for (std::size_t i = 0; i < (blends ? 1 : timeline.legs.size()); ++i) {
    const LegTiming& leg = timeline.legs[i];
    const double elapsed = (step - leg.first_step) / std::max(leg.steps, 1);
    if (i == 0 || elapsed >= 0)
      time.leg = static_cast<double>(i + 1) + std::clamp(elapsed, 0.0, 1.0);
  }
  return time;
}

Scene scene_at(const Scene& scene, double frame) {
  if (scene.frames.turntable == 0) return scene_at(scene, film_time(scene, frame));
  Scene still_scene = scene_at(scene, film_time(scene, scene.frames.still));
  still_scene.camera.orbit += static_cast<float>(360 * (frame - 1) / scene.frames.turntable);
  return still_scene;
}

MorphState morph_state_at(const Timeline& timeline, double frame) {
  PM_CHECK(frame >= 1 && frame <= timeline.count);
  const double step =
      std::clamp(frame - 1 - timeline.hold_start, 0.0, static_cast<double>(timeline.steps));
  MorphState state;
  state.frame = static_cast<int>(frame);
  state.t = timeline.steps > 0 ? static_cast<float>(step) / static_cast<float>(timeline.steps) : 0;
  if (timeline.legs.empty()) return play_state(timeline, static_cast<int>(step), state);
  const std::vector<float> weights = weights_at(timeline, frame);
  if (mixes_many(timeline)) return blend_state(timeline, weights, state);

  // Find the last leg that has begun. Legs without steps are skipped, but the first frame always
  // belongs to the first leg and the last frame to the last leg.
  const bool is_last_step = step == timeline.steps;
  std::size_t index = timeline.legs.size() - 1;
  while (!is_last_step && index > 0 &&
         (step == 0 || step < timeline.legs[index].first_step || timeline.legs[index].steps == 0))
    --index;
  const LegTiming& leg = timeline.legs[index];
  state.leg = static_cast<int>(index);
  state.mesh = shown_mesh_number(timeline, index, state.frame);
  state.to_mesh = shown_mesh_number(timeline, index + 1, state.frame);
  // Fraction of the leg that has passed, [0, 1]; in a blend of two objects, the weight of the
  // second.
  float leg_fraction = !weights.empty() ? weights[1]
                       : is_last_step   ? 1.0f
                                        : std::min(static_cast<float>(step - leg.first_step) /
                                                       static_cast<float>(std::max(leg.steps, 1)),
                                                   1.0f);
  if (show_model_without_stages(leg, leg_fraction, state)) return state;

  int stage = 0;
  while (stage < 4 && (leg.shares[stage] <= 0 || leg_fraction > leg.shares[stage]))
    leg_fraction -= leg.shares[stage++];
  // Rounding may leave a remainder, which belongs to the last stage with a share.
  while (leg.shares[stage] <= 0) leg_fraction = leg.shares[--stage];
  state.stage = static_cast<Stage>(stage);
  state.progress = std::clamp(leg_fraction / leg.shares[stage], 0.0f, 1.0f);

  const float eased = smoothstep(state.progress);
  if (state.stage == Stage::kVolume) {
    state.time = leg.until * state.progress;
  } else {
    const bool is_leaving = state.stage < Stage::kVolume,
               is_look = state.stage == Stage::kLookOut || state.stage == Stage::kLookIn;
    // 0: the model as it is; 1: the common look, or only balls.
    const float fade = is_leaving ? eased : 1 - eased;
    state.object = is_leaving ? state.leg : state.leg + 1;
    state.time = is_leaving ? 0.0f : 1.0f;
    state.look = is_look ? fade : 1;
    state.boundary = is_look ? 1 : is_leaving ? 1 - eased : eased;
    state.growth = is_look ? 0 : fade;
  }
  if (timeline.own_look) state.look = 0;
  state.u = ease(leg.motion, state.time);
  return state;
}

int shown_mesh_number(const Timeline& timeline, std::size_t object, int frame) {
  if (object >= timeline.playbacks.size() || timeline.playbacks[object].meshes == 0) return -1;
  return mesh_at(timeline.playbacks[object], std::max(0, frame - timeline.start));
}

bool shows_source(const MorphState& state) { return state.object != state.leg + 1; }
bool shows_target(const MorphState& state) { return state.object != state.leg; }

bool looks_same(const MorphState& a, const MorphState& b) {
  return a.leg == b.leg && a.stage == b.stage && a.progress == b.progress && a.time == b.time &&
         a.object == b.object && a.weights == b.weights && a.look == b.look &&
         a.boundary == b.boundary && a.growth == b.growth &&
         (!shows_source(a) || a.mesh == b.mesh) && (!shows_target(a) || a.to_mesh == b.to_mesh);
}

bool differs_from_neighbours(const Timeline& timeline, int frame) {
  const MorphState now = morph_state_at(timeline, frame);
  return !(frame > 1 && looks_same(now, morph_state_at(timeline, frame - 1))) &&
         !(frame < timeline.count && looks_same(now, morph_state_at(timeline, frame + 1)));
}

}  // namespace polymorph
