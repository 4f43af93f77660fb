// Timeline of a morph (the state machine of Gilbert 2010, Fig. 5.14): the state that a frame shows,
// as a function of its number alone. A leg is the part of the timeline in which one object turns
// into the next.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "scene/scene.h"

namespace polymorph {

/// The stages of a leg from source object A to target object B, in order. A leg that starts (ends)
/// at a meta-object (ObjectSettings::meta) has none of the stages before (after) the volumetric
/// one.
enum class Stage : std::uint8_t {
  kLookOut,      ///< A's own materials fade to the common look
  kBoundaryOut,  ///< A's mesh becomes A's balls
  kVolume,       ///< balls move from A to B
  kBoundaryIn,   ///< B's balls become B's mesh
  kLookIn,       ///< the common look fades to B's own materials
  kPlay,         ///< outside legs: the meshes of a sequence are shown one after another
  kBlend,        ///< outside legs: three objects or more are mixed by their weights
};

/// Name and description of a stage.
struct StageInfo {
  Stage stage;
  const char* name;
  const char* what;
};
/// The stages of a leg, in order.
std::span<const StageInfo> stage_table();
const char* stage_name(Stage stage);

/// Timing of one leg.
struct LegTiming {
  /// The leg's first step, and its number of steps. A step leads from one frame to the next; step 0
  /// begins after Timeline::hold_start.
  int first_step = 0, steps = 1;
  bool starts_at_model = true,
       ends_at_model = true;  ///< whether the leg's start (end) shows a model
  /// Fractions of the leg's time for the stages kLookOut to kLookIn; they sum to 1.
  float shares[5] = {0, 0, 1, 0, 0};
  /// Kind of the surface: from the objects' distances or from balls.
  Interpolation interpolation = Interpolation::kBalls;
  float until = 1;  ///< time of the motion, (0, 1], at which the next leg begins
  MotionSettings motion;
};

/// Playback of a mesh sequence.
struct Playback {
  int meshes = 0;     ///< number of meshes; 0: the object is no mesh sequence
  double pace = 1;    ///< meshes per frame
  int hold = 0;       ///< frames for which the last mesh is held
  bool loop = false;  ///< whether the first mesh follows the last one
  float fps = 24;     ///< frames per second
};

/// The timing of one actor: its holds, legs, mesh sequences and weights.
struct Timeline {
  int count = 24;      ///< number of the scene's frames, 1..count
  int start = 1;       ///< first frame at which the actor moves and its mesh sequences play
  int hold_start = 0;  ///< still frames before the first step
  /// Moving frames - 1. Legs meet at frames, so an object between two legs has a frame of its own.
  int steps = 23;
  /// The actor's objects form a chain: the source, the intermediate objects, the target. Leg k goes
  /// from object k to k + 1. Steps between two legs show the object between them.
  std::vector<LegTiming> legs;
  /// One playback per object of the chain, with `meshes` = 0 for objects that are no mesh sequence;
  /// empty if no object is one. Without legs, the single object plays.
  std::vector<Playback> playbacks;
  /// For a blend, the weights of the objects, [frame - 1][object], which sum to 1; else empty. With
  /// two objects, the second weight is the elapsed fraction of the only leg's time. With more, leg
  /// k leads from object 0 to object k + 1, and frames mix all legs.
  std::vector<std::vector<float>> weights;
  bool own_look = true;  ///< objects keep their own materials; there is no common look
};

/// Time of the leg's motion, which runs from 0 to 1, that passes per frame of its volumetric stage.
double leg_pace(const LegTiming& leg);

/// Kinds of surface of the legs that begin or end at an object of the chain.
struct LegKinds {
  bool distances = false, balls = false;  ///< whether there is a leg of this kind
};
LegKinds leg_kinds(const Timeline& timeline, std::size_t object);

/// Tests whether the actor mixes three objects or more.
bool mixes_many(const Timeline& timeline);

/// Finds the first frame in which all weights of the blend are 0; nullopt if there is none.
std::optional<int> find_weightless_frame(const Timeline& timeline);

/// Computes an actor's timeline. `actor` must be an element of `scene.actors`.
Timeline make_timeline(const Scene& scene, const ActorSettings& actor);

/// The number of the film's frames: as given by the scene, or as many as its actors need.
int film_frame_count(const Scene& scene);
/// The number of frames to render: the film's, or the turntable's.
int frame_count(const Scene& scene);
/// The film's frame that `frame` in [1, frame_count()] shows: `frame`, or the still frame of a
/// turntable.
int shown_frame(const Scene& scene, int frame);

/// Time of `frame`, from 0 to 1 over the film's frames between its holds. `frame` in [1,
/// film_frame_count()].
float sequence_time(const Scene& scene, int frame);

/// The time of the film at `frame`, possibly between frames, in the units of keyframes.
/// FilmTime::leg counts the legs of the first actor, and is an integer while that actor stands
/// still.
FilmTime film_time(const Scene& scene, double frame);
/// The scene with the values of its keyed settings at `frame`, in [1, frame_count()] and possibly
/// between frames.
Scene scene_at(const Scene& scene, double frame);

/// The state of one actor in one frame.
struct MorphState {
  int frame = 1;  ///< counted from 1
  float t = 0;    ///< fraction of the actor's steps (Timeline::steps), [0, 1]
  int leg = 0;    ///< index into Timeline::legs
  Stage stage = Stage::kVolume;
  float progress = 0;  ///< fraction of the stage, [0, 1]
  float time = 0;      ///< time of the leg's motion, [0, 1]: the argument of balls_at()
  float u = 0;         ///< eased `time` (morph/easing.h)
  int object = -1;     ///< chain object whose mesh is shown, or -1
  float look = 1;      ///< look of `object`: 0 own materials .. 1 common look
  float boundary = 0;  ///< size of `object`: 1 whole .. 0 shrunk into its balls
  float growth = 1;    ///< size of the balls: 0 absent .. 1 whole
  /// Indices of the current meshes of the leg's source and target, or of the single object that
  /// plays, counted from 0 in the order of play; -1 for an object that is no mesh sequence.
  int mesh = -1, to_mesh = -1;
  /// Weights of the objects if three or more are mixed, even while one has all the weight; or
  /// empty.
  std::vector<float> weights;
};

/// The mesh that a chain object plays at `frame`, counted from 0; -1 if it is no mesh sequence.
int shown_mesh_number(const Timeline& timeline, std::size_t object, int frame);

/// Computes the state at `frame` in [1, count]. Between two frames, mesh sequences show the mesh of
/// the earlier one. Depends on its arguments only.
MorphState morph_state_at(const Timeline& timeline, double frame);

/// Tests whether a frame shows the leg's source, or the surface between source and target.
bool shows_source(const MorphState& state);
/// Tests whether a frame shows the leg's target, or the surface between source and target.
bool shows_target(const MorphState& state);

/// Tests whether two states of an actor look the same.
bool looks_same(const MorphState& a, const MorphState& b);
/// Tests whether `frame` differs from both the frame before and the frame after.
bool differs_from_neighbours(const Timeline& timeline, int frame);

}  // namespace polymorph
