// Game files of Pairs: reads a game, its moves and its scene settings from JSON.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/json.h"
#include "base/result.h"
#include "pairs/game.h"

namespace polymorph {

/// Content of a game file.
struct PairsFile {
  PairsGame game;
  /// The objects of `game`, in the same order, as objects of a scene: "model" (an absolute path) or
  /// "shape", and any other key of an object.
  std::vector<JsonValue> objects;
  std::vector<std::string> moves;  ///< moves as apply_move() reads them; may be empty
  JsonValue scene_settings;        ///< keys of a scene (image, look, frames.fps, ...); null: none
  std::filesystem::path board;     ///< model below the pieces; empty: none
  std::string piece_color = "#8fa3b8";  ///< colour of the spheres
};

/// Loads a game. The file may contain comments, and its paths are relative to its folder. Errors
/// (kInput), naming the key: not JSON, an unknown key, a value out of its range, a missing file,
/// fewer objects than a level has pairs.
Result<PairsFile> load_pairs_game(const std::filesystem::path& path);

/// Applies one move: two positions separated by a space or a comma, or "wait SECONDS". Errors
/// (kInput): as pick() and wait(), or not a move.
Status apply_move(PairsPlay& play, const std::string& text);

}  // namespace polymorph
