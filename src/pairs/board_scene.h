// A level of Pairs as a scene like any other: every piece an actor, every event a leg of its chain.
#pragma once

#include <string>

#include "base/json.h"
#include "pairs/game.h"
#include "pairs/load_game.h"

namespace polymorph {

/// Frames of a level from its beginning to the play's last event in it (and the clock, if it is the
/// level that is played now).
int level_frames(const PairsPlay& play, int level, double fps);

/// The scene of a level as far as it is played. A piece is a sphere that becomes its object, a
/// sphere again, a puddle, or drops on the path `explode`. Its frames beyond level_frames() are
/// only there for actors that stand still to move in.
JsonValue board_scene(const PairsFile& file, const PairsPlay& play, int level);

/// Of the stage, or 12.
double frames_per_second(const PairsFile& file);

/// "LEVEL 1   SCORE 300   PAIRS 3/8   TIME 41" at a frame of the level, and what ended the play.
std::string score_line(const PairsPlay& play, int level, int frame, double fps);

}  // namespace polymorph
