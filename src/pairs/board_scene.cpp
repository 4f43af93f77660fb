#include "pairs/board_scene.h"

#include <algorithm>
#include <cmath>

#include "base/json.h"

namespace polymorph {
namespace {

using Kind = PairsEvent::Kind;

constexpr double kSpacing = 2.6;  // distance between the centres of pieces, which are 2 units wide

/// Returns the number of whole frames from the start to this time, rounded.
int frame_at(double seconds, double fps) { return static_cast<int>(std::lround(seconds * fps)); }

JsonValue make_sphere(const PairsFile& file) {
  return {{"shape", "sphere"}, {"color", file.piece_color}, {"roughness", 0.25}};
}

/// Makes the object that a piece becomes by an event.
JsonValue make_outcome(const PairsFile& file, const PairsPiece& piece, Kind kind) {
  switch (kind) {
    case Kind::kReveal:
      return file.objects[static_cast<std::size_t>(piece.object)];
    case Kind::kMelt:
      return {{"shape", "puddle"}, {"color", "#3f6f52"}};
    case Kind::kExplode:
      return {{"shape", "drops"}, {"color", "#8c3b2e"}, {"motion", {{"path", "explode"}}}};
    default:  // kHide; the other events concern no piece
      return make_sphere(file);
  }
}

/// Number of frames of the leg that an actor without events gets after the level's last frame,
/// because every actor needs a leg. The scene has at least as many frames more than the level.
constexpr int kExtraFrames = 2;

/// One level of a play, as a film of `frames` frames.
struct LevelFilm {
  const PairsFile& file;
  const PairsPlay& play;
  int level;
  int frames;
  std::vector<PairsPiece> board;  ///< the pieces as dealt
};

/// Makes the actor of a piece: a chain of objects with a leg per event, and still frames between
/// the legs.
JsonValue make_actor(const LevelFilm& film, int piece) {
  const auto& [file, play, level, frames, board] = film;
  const PairsLevel& grid = file.game.levels[static_cast<std::size_t>(level)];
  const double fps = frames_per_second(file);
  const int column = piece % grid.columns, row = piece / grid.columns;
  JsonValue actor{{"name", format_square(grid, piece)}};
  // Row 0 is in front, at the largest z.
  actor["translate"] = JsonValue::array({(column - (grid.columns - 1) / 2.0) * kSpacing, 0,
                                         ((grid.rows - 1) / 2.0 - row) * kSpacing});
  // Add an object and a leg per event. Between two legs, the object stands still ("hold").
  std::vector<JsonValue> chain{make_sphere(file)};
  std::vector<int> per_leg;  // frames of each leg
  int start_frame = frames + 1, last_end = 0;
  for (const PairsEvent& event : play.events()) {
    if (event.level != level || event.piece != piece) continue;
    // Steps are frames counted from 0; a leg has at least one.
    const int first_step = std::max(last_end, frame_at(event.start, fps));
    const int last_step = std::max(first_step + 1, frame_at(event.start + event.seconds, fps));
    if (per_leg.empty())
      start_frame = first_step + 1;
    else
      chain.back()["hold"] = first_step - last_end;
    per_leg.push_back(last_step - first_step);
    last_end = last_step;
    chain.push_back(make_outcome(file, board[static_cast<std::size_t>(piece)], event.kind));
  }
  if (per_leg.empty()) {
    // Reveal the object after the last frame: the camera frames everything that a level contains,
    // so the view does not change when a later move reveals it.
    chain.push_back(make_outcome(file, board[static_cast<std::size_t>(piece)], Kind::kReveal));
    per_leg.push_back(kExtraFrames);
  }
  actor["start"] = start_frame;
  actor["per_leg"] = per_leg;
  actor["source"] = chain.front();
  if (chain.size() > 2) {
    actor["intermediate"] = JsonValue::array();
    for (std::size_t i = 1; i + 1 < chain.size(); ++i) actor["intermediate"].push_back(chain[i]);
  }
  actor["target"] = chain.back();
  return actor;
}

}  // namespace

double frames_per_second(const PairsFile& file) {
  const JsonValue& fps = file.scene_settings.get("frames").get("fps");
  return fps.is_number() ? std::clamp(fps.number, 0.1, 1000.0) : 12;
}

int count_level_frames(const PairsPlay& play, int level, double fps) {
  double end = level == play.level() ? play.clock() : 0;
  for (const PairsEvent& event : play.events())
    if (event.level == level) end = std::max(end, event.start + event.seconds);
  return frame_at(end, fps) + 1;
}

JsonValue make_board_scene(const PairsFile& file, const PairsPlay& play, int level) {
  const double fps = frames_per_second(file);
  const int frames = count_level_frames(play, level, fps);
  const PairsLevel& grid = file.game.levels[static_cast<std::size_t>(level)];
  JsonValue scene;
  scene["description"] = fmt::format("Pairs, level {}", level + 1);
  if (file.scene_settings.is_object()) scene.update(file.scene_settings);
  const LevelFilm film{file, play, level, frames, deal_board(file.game, level)};
  scene["actors"] = JsonValue::array();
  for (int piece = 0; piece < grid.columns * grid.rows; ++piece)
    scene["actors"].push_back(make_actor(film, piece));
  if (!file.board.empty()) {
    const JsonValue model{{"model", file.board.string()}, {"arrange", false}};
    scene["actors"].push_back({{"name", "board"},
                               {"start", frames + 1},
                               {"per_leg", JsonValue::array({kExtraFrames})},
                               {"source", model},
                               {"target", model}});
  }
  JsonValue& frame_settings = scene["frames"];
  frame_settings["fps"] = fps;
  // The scene lasts until all legs have ended. A leg that begins in the level's last frame ends
  // after that frame, because a leg has at least one step.
  std::int64_t frame_count = frames + kExtraFrames;
  for (const JsonValue& actor : scene.get("actors").items) {
    std::int64_t actor_end = actor.get("start").integer;
    for (const JsonValue& leg : actor.get("per_leg").items) actor_end += leg.integer;
    for (const JsonValue& object : actor.get("intermediate").items)
      actor_end += object.get("hold").integer;
    frame_count = std::max(frame_count, actor_end);
  }
  frame_settings["count"] = frame_count;
  return scene;
}

std::string format_score(const PairsPlay& play, int level, int frame, double fps) {
  const double now = (frame - 1) / fps;
  int score = 0, melted_pieces = 0;
  std::string ending;
  for (const PairsEvent& event : play.events()) {
    // Events are in order of level and time. The frame nearest to an event's start is the first one
    // that shows the event's score.
    if (event.level > level || (event.level == level && event.start > now + 0.5 / fps)) break;
    score = event.score;
    if (event.level == level && event.kind == Kind::kMelt) ++melted_pieces;
    if (event.kind == Kind::kTimeOut) ending = "   TIME IS UP";
    if (event.kind == Kind::kStuck) ending = "   LOST";
    if (event.kind == Kind::kWon) ending = "   WON";
  }
  const PairsLevel& grid = play.game().levels[static_cast<std::size_t>(level)];
  const int max_pairs = grid.columns * grid.rows / 2;
  const double seconds_left = std::max(0.0, play.limits()[static_cast<std::size_t>(level)] - now);
  return fmt::format("LEVEL {}   SCORE {}   PAIRS {}/{}   TIME {:.0f}{}", level + 1, score,
                     melted_pieces / 2,
                     grid.pairs > 0 ? std::min(grid.pairs, max_pairs) : max_pairs,
                     std::ceil(seconds_left), ending);
}

}  // namespace polymorph
