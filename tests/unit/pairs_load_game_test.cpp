#include "pairs/load_game.h"

#include <gtest/gtest.h>

#include "base/file.h"
#include "testing/paths.h"
#include "testing/temporary_folder.h"

namespace polymorph {
namespace {

namespace fs = std::filesystem;

class LoadGame : public FolderTest {
 protected:
  Result<PairsFile> load(const std::string& json) const {
    EXPECT_TRUE(write_file(folder / "game.json", json).ok());
    return load_pairs_game(folder / "game.json");
  }
  /// A game of two cubes and two tori, and what else it says.
  static std::string game_with(const std::string& more) {
    return R"({"objects": ["cube", "torus"], "levels": [{"columns": 2, "rows": 2}])" + more + "}";
  }
};

TEST_F(LoadGame, HasAllThatTheFileSays) {
  fs::copy_file(source_dir() / "scenes/models/torus.obj", folder / "ring.obj");
  const Result<PairsFile> file = load(R"({ // a comment
    "description": "two levels", "seed": 7, "piece_color": "#ffffff", "board": "ring.obj",
    "rules": {"reveal": 0.5, "slowdown": 2, "show": 0, "melt": 1, "explode": 3, "looks": 9,
              "pair_points": 50, "look_cost": 5, "second_points": 1},
    "objects": ["cube", "ring.obj", {"shape": "sphere", "name": "ball"}],
    "levels": [{"columns": 2, "rows": 1, "seconds": 12.5}, {"columns": 3, "rows": 2, "pairs": 2}],
    "moves": ["a1 b1", "wait 2"], "scene": {"image": {"width": 64}}})");
  ASSERT_TRUE(file.ok()) << file.error().message;
  const PairsGame& game = file->game;
  EXPECT_EQ(game.seed, 7u);
  EXPECT_EQ(game.objects, (std::vector<std::string>{"cube", "ring", "ball"}));
  EXPECT_EQ(file->objects[0].get("shape").string, "cube");
  EXPECT_EQ(file->objects[1].get("model").string, (folder / "ring.obj").string())
      << "paths are absolute";
  EXPECT_EQ(file->objects[2].get("name").string, "ball");
  EXPECT_EQ(file->board, folder / "ring.obj");
  EXPECT_EQ(file->piece_color, "#ffffff");
  EXPECT_EQ(file->moves, (std::vector<std::string>{"a1 b1", "wait 2"}));
  EXPECT_EQ(file->scene_settings.get("image").get("width").integer, 64);
  ASSERT_EQ(game.levels.size(), 2u);
  EXPECT_EQ(game.levels[0].columns, 2);
  EXPECT_EQ(game.levels[0].rows, 1);
  EXPECT_EQ(game.levels[0].seconds, 12.5);
  EXPECT_EQ(game.levels[1].pairs, 2);
  const PairsRules& rules = game.rules;
  EXPECT_EQ(rules.reveal, 0.5);
  EXPECT_EQ(rules.slowdown, 2);
  EXPECT_EQ(rules.show, 0);
  EXPECT_EQ(rules.melt, 1);
  EXPECT_EQ(rules.explode, 3);
  EXPECT_EQ(rules.looks, 9);
  EXPECT_EQ(rules.pair_points, 50);
  EXPECT_EQ(rules.look_cost, 5);
  EXPECT_EQ(rules.second_points, 1);
}

TEST_F(LoadGame, WhatIsWrongIsNamedWithItsKey) {
  const std::vector<std::pair<std::string, std::string>> wrong{
      {"[]", "game.json: must be an object {...} - a game begins like"},
      {"{\"levels\": [{}]}", "/objects: must be a list"},
      {R"({"objects": [{"name": "x"}], "levels": [{}]})",
       "/objects/0: needs either \"model\" or \"shape\""},
      {R"({"objects": [{"shape": 3}], "levels": [{}]})", "/objects/0/shape: must be a string"},
      {R"({"objects": [3], "levels": [{}]})", "/objects/0: must be a string or an object"},
      {R"({"objects": ["cube"], "levels": [3]})", "/levels/0: must be an object"},
      {R"({"objects": ["cube"], "levels": [{"columns": 2.5}]})",
       "/levels/0/columns: must be a whole number from 1 to 12"},
      {game_with(R"(, "seed": -1)"), "/seed: must be a whole number, 0 or more"},
      {game_with(R"(, "piece_color": 3)"), "/piece_color: must be a string"},
      {game_with(R"(, "moves": ["a1 b1", 3])"), "/moves: must be a list of strings"},
      {game_with(R"(, "scene": [])"), "/scene: must be an object"},
      {game_with(R"(, "scene": {"source": "cube"})"), "/scene/source: belongs to the game"},
      {game_with(R"(, "rules": {"slowdown": 0.5})"),
       "/rules/slowdown: must be a number from 1 to 10"},
      {game_with(R"(, "rules": {"look": 3})"), "/rules/look: unknown key - did you mean"},
      {game_with(R"(, "board": "no.obj")"), "/board: neither a file nor a shape: \"no.obj\""}};
  for (const auto& [json, message] : wrong) {
    const Result<PairsFile> file = load(json);
    ASSERT_FALSE(file.ok()) << json;
    EXPECT_EQ(file.error().code, ErrorCode::kInput) << json;
    EXPECT_NE(file.error().message.find("game.json: "), std::string::npos);
    EXPECT_NE(file.error().message.find(message), std::string::npos) << file.error().message;
  }
}

TEST_F(LoadGame, MovesAreWrittenAsAPersonDoes) {
  const Result<PairsFile> file = load(game_with(""));
  ASSERT_TRUE(file.ok()) << file.error().message;
  PairsPlay play(file->game);
  for (const char* no_move : {"", "a1", "a1 b1 a2", "wait", "wait long", "a1 c1", "a1 a1"}) {
    EXPECT_EQ(apply_move(play, no_move).error().code, ErrorCode::kInput) << no_move;
    EXPECT_EQ(play.clock(), 0) << no_move;
    EXPECT_TRUE(play.events().empty()) << no_move;
  }
  ASSERT_TRUE(apply_move(play, "wait 2.5").ok());
  EXPECT_EQ(play.clock(), 2.5);
  ASSERT_TRUE(apply_move(play, " a1,  b2 ").ok());
  EXPECT_EQ(play.events()[0].piece, 0);
  EXPECT_EQ(play.events()[1].piece, 3);
}

}  // namespace
}  // namespace polymorph
