// Scene of a level of Pairs: every piece is an actor, every event a leg of its chain.
#pragma once

#include <string>

#include "base/json.h"
#include "pairs/game.h"
#include "pairs/load_game.h"

namespace polymorph {

/// Number of frames of a level from its beginning to the last event in it (or the clock, if it is
/// the current level).
int count_level_frames(const PairsPlay& play, int level, double fps);

/// Makes the scene of a level as far as it has been played. A piece is a sphere that becomes its
/// object, a sphere again, a puddle, or drops on the path `explode`. Frames beyond
/// count_level_frames() exist only because an actor that does not move needs a leg.
JsonValue make_board_scene(const PairsFile& file, const PairsPlay& play, int level);

/// Frames per second of the stage, or 12.
double frames_per_second(const PairsFile& file);

/// Formats "LEVEL 1 SCORE 300 PAIRS 3/8 TIME 41" for a frame of the level, followed by the reason
/// if the play has ended.
std::string format_score(const PairsPlay& play, int level, int frame, double fps);

}  // namespace polymorph
