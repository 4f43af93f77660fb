// Scene of a level of Pairs: every piece is an actor, and every event of the piece is a leg, that
// is, a morph from one object of the actor's chain to the next (scene/scene.h).
#pragma once

#include <string>

#include "base/json.h"
#include "pairs/game.h"
#include "pairs/load_game.h"

namespace polymorph {

/// Counts the frames of a level from its start to the end of its last event or, in the current
/// level, to the present time of the clock if that is later.
int count_level_frames(const PairsPlay& play, int level, double fps);

/// Makes the scene of a level as far as it has been played. A piece is a sphere that becomes the
/// hidden object, a sphere again, a puddle, or drops that fly apart (motion path "explode"). The
/// scene has a few frames more than count_level_frames(), because even an actor that does not move
/// needs a leg.
JsonValue make_board_scene(const PairsFile& file, const PairsPlay& play, int level);

/// Returns the frames per second of the game's scene settings; default: 12.
double frames_per_second(const PairsFile& file);

/// Formats "LEVEL 1 SCORE 300 PAIRS 3/8 TIME 41" (TIME: seconds left) for a frame of the level. If
/// the game has ended by then, appends the reason: "WON", "LOST" or "TIME IS UP".
std::string format_score(const PairsPlay& play, int level, int frame, double fps);

}  // namespace polymorph
