// Timeline of a morph, its state machine (report Fig. 5.14): the stage that a frame is in, as a
// function of its number alone.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "scene/scene.h"

namespace polymorph {

/// The stages of one leg, source object A to target object B, in order. A leg that starts (ends) at
/// a meta-object has no stages of A (B) but the volumetric one.
enum class Stage : std::uint8_t {
  kLookOut,      ///< A's own materials fade to the common look
  kBoundaryOut,  ///< A's mesh becomes A's balls
  kVolume,       ///< balls move from A to B
  kBoundaryIn,   ///< B's balls become B's mesh
  kLookIn,       ///< the common look fades to B's own materials
  kPlay,         ///< meshes of a sequence show, one after the other; in no leg
  kBlend,        ///< three objects or more are mixed by their weights; in no leg
};

struct StageInfo {
  Stage stage;
  const char* name;
  const char* what;
};
/// Every stage of a leg with its name, in order.
std::span<const StageInfo> stage_table();
const char* stage_name(Stage stage);

/// Timing of one leg: its place among the sequence's steps (frame to frame), which of its ends show
/// a model, and its stages' shares of its time, which sum to 1.
struct LegTiming {
  int first_step = 0, steps = 1;
  bool from_full = true, to_full = true;
  float shares[5] = {0, 0, 1, 0, 0};
  /// Kind of the surface: made of the objects' distances or of balls.
  Interpolation interpolation = Interpolation::kBalls;
  float until = 1;  ///< time of the motion at which the leg is left for the next one
  MotionSettings motion;
};

/// Playing of a mesh sequence.
struct Playback {
  int meshes = 0;   ///< 0: the object is no mesh sequence
  double pace = 1;  ///< meshes per frame
  int hold = 0;     ///< frames that the last mesh stays
  bool loop = false;
  float fps = 24;  ///< frames per second
};

/// The times of one actor's legs and holds.
struct Timeline {
  int count = 24;  ///< frames 1..count, the scene's
  int start = 1;   ///< first frame at which the actor moves; its mesh sequences begin with it
  int hold_start =
      0;  ///< still frames before the first step; those after the last follow from count
  /// Moving frames - 1. Legs meet on frames, so an object between two legs has a frame of its own.
  int steps = 23;
  /// Leg k goes from chain object k to k + 1. Steps between two legs show the object between them.
  std::vector<LegTiming> legs;
  /// Playing of mesh sequences: one per object of the chain, with no meshes for other objects;
  /// empty where none is one. Without legs the only object plays alone.
  std::vector<Playback> playbacks;
  /// Blend: weights of its objects in each frame, from the first; their sum is 1. With two objects
  /// the second one's weight is the share of the only leg's time that has gone by. With more, leg k
  /// goes from object 0 to k + 1, and none of them shows: they are what is mixed.
  std::vector<std::vector<float>> weights;
  bool own_look = true;  ///< objects keep their own colours throughout: there is no look to fade to
};

/// The share of its motion's time that a leg goes through in a frame of its volumetric stage.
double leg_pace(const LegTiming& leg);

/// Kinds of the legs that a chain object is an end of.
struct LegKinds {
  bool distances = false, balls = false;
};
LegKinds leg_kinds(const Timeline& timeline, std::size_t object);

/// Tests whether the actor mixes three objects or more.
bool mixes_many(const Timeline& timeline);

/// The first frame in which all weights of an actor's blend are 0; nothing where there is none.
std::optional<int> find_weightless_frame(const Timeline& timeline);

/// `actor`: one of the scene's.
Timeline make_timeline(const Scene& scene, const ActorSettings& actor);

/// The number of the film's frames: as many as the scene says, or as its actors need.
int film_frame_count(const Scene& scene);
/// The number of frames to render: the film's, or the turntable's.
int frame_count(const Scene& scene);
/// The film's frame that `frame` in [1, frame_count()] shows: itself, but on a turntable.
int shown_frame(const Scene& scene, int frame);

/// [0, 1] over the film's frames, holds not counted. `frame` in [1, film_frame_count()].
float sequence_time(const Scene& scene, int frame);

/// A moment of the film, between frames too, as keyframes count it. Legs are the first actor's;
/// while it stands still between two legs, `leg` stays whole.
FilmTime film_time(const Scene& scene, double frame);
/// The scene with its keyed settings as `frame`, in [1, frame_count()] or between, shows them.
Scene scene_at(const Scene& scene, double frame);

/// The state of one actor that one frame shows.
struct MorphState {
  int frame = 1;
  float t = 0;  ///< the actor's time [0, 1]
  int leg = 0;
  Stage stage = Stage::kVolume;
  float progress = 0;  ///< within the stage, [0, 1]
  float time = 0;      ///< time in the motion of the leg's balls, [0, 1], as balls_at() takes it
  float u = 0;         ///< the same, eased
  int object = -1;     ///< chain object whose mesh shows, or -1
  float look = 1;      ///< look of that mesh: 0 own materials .. 1 common look
  float boundary = 0;  ///< size of that mesh: 1 whole .. 0 shrunk into its balls
  float growth = 1;    ///< size of the balls: 0 not there .. 1 whole
  /// Meshes of the leg's source and target, or of the object that plays alone, counted from 0 in
  /// the order of play; -1: it is no mesh sequence.
  int mesh = -1, to_mesh = -1;
  /// Weights of the objects, where three or more are mixed, also while one of them has all.
  std::vector<float> weights;
};

/// The mesh of an object of the chain that `frame` shows, if it shows any; -1: it is no sequence.
int shown_mesh_number(const Timeline& timeline, std::size_t object, int frame);

/// `frame` in [1, count], or between two frames: then mesh sequences show that of the frame before.
/// Depends on nothing but its arguments.
MorphState morph_state_at(const Timeline& timeline, double frame);

/// Tests whether the leg's source, or what it becomes, shows, and whether its target does.
bool shows_source(const MorphState& moment);
bool shows_target(const MorphState& moment);

/// Tests whether the actor shows the same at two frames.
bool same_moment(const MorphState& a, const MorphState& b);
/// Tests whether it shows something else than in the frame before and than in the one after.
bool moves_at(const Timeline& timeline, int frame);

}  // namespace polymorph
