// Scene of a level of Pairs: every piece is an actor, and every event of the piece is a leg, that
// is, a morph from one object of the actor's chain to the next (scene/scene.h).
#pragma once

#include <string>

#include "base/json.h"
#include "pairs/game.h"
#include "pairs/load_game.h"

namespace polymorph {

/// Counts the frames of a level from its start to the end of its last event. In the current level
/// they reach at least to the present time of the clock.
int count_level_frames(const PairsPlay& play, int level, double fps);

/// Makes the scene of a level as far as it has been played. A piece is a sphere that becomes its
/// object, a sphere again, a puddle, or drops that fly apart (motion path "explode"). The scene has
/// a few frames more than count_level_frames(), because even an actor that does not move needs a
/// leg.
JsonValue make_board_scene(const PairsFile& file, const PairsPlay& play, int level);

/// Returns the frames per second of the game's scene settings; default: 12.
double frames_per_second(const PairsFile& file);

/// Formats "LEVEL 1 SCORE 300 PAIRS 3/8 TIME 41" for a frame of the level, followed by the reason
/// if the play has ended.
std::string format_score(const PairsPlay& play, int level, int frame, double fps);

}  // namespace polymorph
