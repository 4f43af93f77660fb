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

constexpr int kFramesPerLeg = 24;
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

/// Shares of a leg's stages, given which of its ends are shown as a model.
/// Distances start from the model itself: nothing lies between the two.
void set_shares(LegTiming& leg, const BoundarySettings& settings, bool own_look) {
  const bool cut =
      leg.interpolation == Interpolation::kDistance || settings.method == BoundaryMethod::kCut;
  const float boundary = cut ? 0 : settings.boundary_share;
  const float look = own_look ? 0 : settings.look_share;
  leg.shares[0] = leg.from_full ? look : 0;
  leg.shares[1] = leg.from_full ? boundary : 0;
  leg.shares[3] = leg.to_full ? boundary : 0;
  leg.shares[4] = leg.to_full ? look : 0;
  // Shares that leave no time for the morph itself are scaled down to four fifths.
  const float ends = leg.shares[0] + leg.shares[1] + leg.shares[3] + leg.shares[4];
  if (ends > 0.8f)
    for (const int i : {0, 1, 3, 4}) leg.shares[i] *= 0.8f / ends;
  leg.shares[2] = 1 - (leg.shares[0] + leg.shares[1] + leg.shares[3] + leg.shares[4]);
}

/// Effects that come apart into single balls are made of balls, and so is the report's method.
bool has_distances(const Scene& scene, const ObjectSettings& from, const ObjectSettings& to) {
  constexpr const char* kDrops = "drops";
  return to.motion.interpolate == Interpolation::kDistance && to.motion.path != Path::kExplode &&
         scene.field.kind == FieldKind::kGaussian && scene.surface.influence == 1 &&
         from.shape != kDrops && to.shape != kDrops;
}

/// A model whose end of the leg has no stages (a cut, and no fade) still shows itself at that very
/// end.
bool show_model_without_stages(const LegTiming& leg, float local, MorphState& moment) {
  const bool at_start = local <= 0 && leg.from_full && leg.shares[0] + leg.shares[1] <= 0;
  const bool at_end = local >= 1 && leg.to_full && leg.shares[3] + leg.shares[4] <= 0;
  if (!at_start && !at_end) return false;
  moment.stage = at_start ? Stage::kLookOut : Stage::kLookIn;
  moment.object = at_start ? moment.leg : moment.leg + 1;
  moment.progress = moment.time = moment.u = at_start ? 0.0f : 1.0f;
  moment.look = moment.growth = 0;
  moment.boundary = 1;
  return true;
}

/// Tests whether the number of frames is given, and the legs' follow from it.
bool is_counted(const Scene& scene) {
  return scene.frames.count > 0 && scene.frames.per_leg.empty();
}

std::vector<int> leg_frames(const Scene& scene, const ActorSettings& actor) {
  if (!actor.per_leg.empty()) return actor.per_leg;
  if (!scene.frames.per_leg.empty()) return scene.frames.per_leg;
  return std::vector<int>(actor.intermediate.size() + 1, kFramesPerLeg);
}

/// Frames that it stands still between legs.
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

constexpr double kRounding = 1e-6;  // of rates such as 23.976

/// Frames of one round.
int round_frames(const Playback& playback) {
  const double frames = std::ceil(playback.meshes / playback.pace - kRounding);
  return playback.hold + static_cast<int>(std::clamp(frames, 1.0, double{kMaxFrames}));
}

/// Mesh that shows so many frames after the first.
int mesh_at(const Playback& playback, int step) {
  double gone = step;
  if (playback.loop)
    gone = std::fmod(gone + kRounding, playback.meshes / playback.pace + playback.hold);
  return std::min(static_cast<int>(gone * playback.pace + kRounding), playback.meshes - 1);
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

/// Weights of a blend's objects at a frame or between two, where they go evenly; empty without one.
std::vector<float> weights_at(const Timeline& timeline, double frame) {
  if (timeline.weights.empty()) return {};
  const auto before = static_cast<std::size_t>(frame) - 1;
  const auto share = static_cast<float>(frame - std::floor(frame));
  std::vector<float> weights = timeline.weights[before];
  if (share > 0)
    for (std::size_t i = 0; i < weights.size(); ++i)
      weights[i] = std::lerp(weights[i], timeline.weights[before + 1][i], share);
  return weights;
}

/// State of an actor that mixes many objects. One that has all the weight shows itself.
MorphState blend_state(const Timeline& timeline, const std::vector<float>& weights,
                       MorphState moment) {
  moment.stage = Stage::kBlend;
  moment.progress = moment.time = moment.u = 1 - weights.front();
  moment.weights = weights;
  const auto alone = std::find(weights.begin(), weights.end(), 1.0f);
  if (alone == weights.end()) return moment;
  moment.object = static_cast<int>(alone - weights.begin());
  moment.leg = std::max(moment.object - 1, 0);
  moment.look = timeline.own_look ? 0.0f : 1.0f;
  moment.growth = 0;
  return moment;
}

/// State of an actor that plays a mesh sequence.
MorphState play_state(const Timeline& timeline, int step, MorphState moment) {
  const Playback& playback = timeline.playbacks.front();
  moment.stage = Stage::kPlay;
  moment.object = 0;
  moment.mesh = mesh_at(playback, step);
  moment.progress = playback.meshes > 1
                        ? static_cast<float>(moment.mesh) / static_cast<float>(playback.meshes - 1)
                        : 0;
  moment.look = moment.growth = 0;
  moment.boundary = 1;
  return moment;
}

/// Lays out the times of an actor, without the weights of its blend.
Timeline lay_out(const Scene& scene, const ActorSettings& actor) {
  Timeline timeline;
  timeline.count = film_frame_count(scene);
  timeline.start = actor.start;
  timeline.hold_start = scene.frames.hold_start + actor.start - 1;
  timeline.own_look = scene.look.kind == LookKind::kOwn;
  if (plays_meshes(actor)) {
    timeline.steps = timeline.count - timeline.hold_start - scene.frames.hold_end - 1;
    timeline.playbacks = {make_playback(scene, actor.source)};
    return timeline;
  }
  if (!actor.blend.empty()) {
    const bool counts_all = is_counted(scene) && actor.per_leg.empty();
    const int held = timeline.hold_start + scene.frames.hold_end;
    timeline.steps = (counts_all ? timeline.count - held : leg_frames(scene, actor).front()) - 1;
    add_blend_legs(scene, actor, timeline);
    return timeline;
  }
  const auto objects = chain_objects(actor);
  if (morphs_meshes(actor)) {
    for (const ObjectSettings* object : objects)
      timeline.playbacks.push_back(make_playback(scene, *object));
    // Between two legs an object on the way plays on.
    for (std::size_t i = 1; i + 1 < objects.size(); ++i) timeline.playbacks[i].hold = 0;
  }
  const std::size_t legs = objects.size() - 1;
  const std::vector<int> frames = leg_frames(scene, actor);
  PM_CHECK(frames.size() == legs);

  const int total = std::accumulate(frames.begin(), frames.end(), 0);
  int held = held_frames(actor);
  const bool until_the_end = is_counted(scene) && actor.per_leg.empty();
  timeline.steps = until_the_end ? timeline.count - timeline.hold_start - scene.frames.hold_end - 1
                                 : std::max(2, total) + held - 1;
  // Frames that leave no step to the legs leave none to stand still, either.
  if (timeline.steps - held < static_cast<int>(legs)) held = 0;
  const int moving = timeline.steps - held;
  int before = 0, stood = 0;
  const auto step_at = [&](int frames_before) {
    return static_cast<int>((2LL * frames_before * moving + total) / (2LL * total));  // rounded
  };
  for (std::size_t i = 0; i < legs; ++i) {
    LegTiming leg;
    const int first = step_at(before);
    before += frames[i];
    leg.steps = step_at(before) - first;
    leg.first_step = first + stood;
    if (held > 0) stood += objects[i + 1]->hold;
    leg.motion = objects[i + 1]->motion;
    // A leg that is left on its way goes on as what it is.
    const bool stays_balls = i > 0 && objects[i]->retarget < 1 &&
                             timeline.legs[i - 1].interpolation == Interpolation::kBalls;
    if (!stays_balls && has_distances(scene, *objects[i], *objects[i + 1]))
      leg.interpolation = Interpolation::kDistance;
    // What is left before it is reached is never seen itself.
    leg.from_full = !objects[i]->meta && objects[i]->retarget == 1;
    leg.to_full = !objects[i + 1]->meta && objects[i + 1]->retarget == 1;
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
  if (is_counted(scene)) return scene.frames.count;
  int longest = 0;
  for (const ActorSettings& actor : scene.actors) {
    if (plays_meshes(actor)) {
      const int played = round_frames(make_playback(scene, actor.source));
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
  time.turn = (frame - 1) / count;
  const Timeline timeline = lay_out(scene, scene.actors.front());
  const double step = frame - 1 - timeline.hold_start;
  if (timeline.legs.empty())  // to keyframes, playing is the first leg
    time.leg = 1 + std::clamp(step / std::max(timeline.steps, 1), 0.0, 1.0);
  const bool blends = !scene.actors.front().blend.empty();  // all legs at once
  for (std::size_t i = 0; i < (blends ? 1 : timeline.legs.size()); ++i) {
    const LegTiming& leg = timeline.legs[i];
    const double gone = (step - leg.first_step) / std::max(leg.steps, 1);
    if (i == 0 || gone >= 0) time.leg = static_cast<double>(i + 1) + std::clamp(gone, 0.0, 1.0);
  }
  return time;
}

Scene scene_at(const Scene& scene, double frame) {
  if (scene.frames.turntable == 0) return scene_at(scene, film_time(scene, frame));
  Scene moment = scene_at(scene, film_time(scene, scene.frames.still));
  moment.camera.orbit += static_cast<float>(360 * (frame - 1) / scene.frames.turntable);
  return moment;
}

MorphState morph_state_at(const Timeline& timeline, double frame) {
  PM_CHECK(frame >= 1 && frame <= timeline.count);
  const double step =
      std::clamp(frame - 1 - timeline.hold_start, 0.0, static_cast<double>(timeline.steps));
  MorphState moment;
  moment.frame = static_cast<int>(frame);
  moment.t = timeline.steps > 0 ? static_cast<float>(step) / static_cast<float>(timeline.steps) : 0;
  if (timeline.legs.empty()) return play_state(timeline, static_cast<int>(step), moment);
  const std::vector<float> weights = weights_at(timeline, frame);
  if (mixes_many(timeline)) return blend_state(timeline, weights, moment);

  // The last leg that has begun. One that few frames leave without a step is passed over, but the
  // first frame is the source's and the last the target's, always.
  const bool last = step == timeline.steps;
  std::size_t index = timeline.legs.size() - 1;
  while (!last && index > 0 &&
         (step == 0 || step < timeline.legs[index].first_step || timeline.legs[index].steps == 0))
    --index;
  const LegTiming& leg = timeline.legs[index];
  moment.leg = static_cast<int>(index);
  moment.mesh = shown_mesh_number(timeline, index, moment.frame);
  moment.to_mesh = shown_mesh_number(timeline, index + 1, moment.frame);
  float local = !weights.empty() ? weights[1]
                : last           ? 1.0f
                                 : std::min(static_cast<float>(step - leg.first_step) /
                                                static_cast<float>(std::max(leg.steps, 1)),
                                            1.0f);
  if (show_model_without_stages(leg, local, moment)) return moment;

  int stage = 0;
  while (stage < 4 && (leg.shares[stage] <= 0 || local > leg.shares[stage]))
    local -= leg.shares[stage++];
  // The last stage that has a share takes what rounding left over.
  while (leg.shares[stage] <= 0) local = leg.shares[--stage];
  moment.stage = static_cast<Stage>(stage);
  moment.progress = std::clamp(local / leg.shares[stage], 0.0f, 1.0f);

  const float faded = smoothstep(moment.progress);
  const int from = moment.leg, to = moment.leg + 1;
  switch (moment.stage) {
    case Stage::kLookOut:
      moment.object = from, moment.look = faded, moment.boundary = 1, moment.growth = 0,
      moment.time = 0;
      break;
    case Stage::kBoundaryOut:
      moment.object = from, moment.look = 1, moment.boundary = 1 - faded, moment.growth = faded,
      moment.time = 0;
      break;
    case Stage::kVolume:
      moment.time = leg.until * moment.progress;
      break;
    case Stage::kBoundaryIn:
      moment.object = to, moment.look = 1, moment.boundary = faded, moment.growth = 1 - faded,
      moment.time = 1;
      break;
    case Stage::kLookIn:
      moment.object = to, moment.look = 1 - faded, moment.boundary = 1, moment.growth = 0,
      moment.time = 1;
      break;
    case Stage::kPlay:
    case Stage::kBlend:
      break;  // of no leg
  }
  if (timeline.own_look) moment.look = 0;
  moment.u = ease(leg.motion, moment.time);
  return moment;
}

int shown_mesh_number(const Timeline& timeline, std::size_t object, int frame) {
  if (object >= timeline.playbacks.size() || timeline.playbacks[object].meshes == 0) return -1;
  return mesh_at(timeline.playbacks[object], std::max(0, frame - timeline.start));
}

bool shows_source(const MorphState& moment) { return moment.object != moment.leg + 1; }
bool shows_target(const MorphState& moment) { return moment.object != moment.leg; }

bool same_moment(const MorphState& a, const MorphState& b) {
  return a.leg == b.leg && a.stage == b.stage && a.progress == b.progress && a.time == b.time &&
         a.object == b.object && a.weights == b.weights && a.look == b.look &&
         a.boundary == b.boundary && a.growth == b.growth &&
         (!shows_source(a) || a.mesh == b.mesh) && (!shows_target(a) || a.to_mesh == b.to_mesh);
}

bool moves_at(const Timeline& timeline, int frame) {
  const MorphState now = morph_state_at(timeline, frame);
  return !(frame > 1 && same_moment(now, morph_state_at(timeline, frame - 1))) &&
         !(frame < timeline.count && same_moment(now, morph_state_at(timeline, frame + 1)));
}

}  // namespace polymorph
