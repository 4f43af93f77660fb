// Game files of Pairs: JSON -> the game, its moves, and how its board is shown.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/json.h"
#include "base/result.h"
#include "pairs/game.h"

namespace polymorph {

struct PairsFile {
  PairsGame game;
  /// What the game's objects are in a scene: "model" (absolute) or "shape", and what else an object
  /// of a scene may have.
  std::vector<JsonValue> objects;
  std::vector<std::string> moves;       ///< "a1 b2" or "wait 2.5"; may be empty
  JsonValue stage;                      ///< keys of a scene: image, look, camera, frames.fps, ...
  std::filesystem::path board;          ///< a model below the pieces; empty: none
  std::string piece_color = "#8fa3b8";  ///< of the spheres
};

/// Comments may stand in it, and paths are relative to it. Errors (kInput), naming the key: not
/// JSON, an unknown key, a value out of its range, a missing file, fewer objects than a level has
/// pairs.
Result<PairsFile> load_pairs_game(const std::filesystem::path& path);

/// One move as a person writes it: two places with a space or a comma between, or "wait SECONDS".
/// Errors (kInput): as pick() and wait(), or not a move.
Status apply_move(PairsPlay& play, const std::string& text);

}  // namespace polymorph
