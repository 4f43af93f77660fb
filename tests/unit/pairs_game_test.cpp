#include "pairs/game.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "pairs/board_scene.h"

namespace polymorph {
namespace {

using Kind = PairsEvent::Kind;
using State = PairsPiece::State;

PairsGame game_of(std::vector<PairsLevel> levels, PairsRules rules = {}) {
  return {rules, std::move(levels), {"cube", "torus", "drops", "puddle", "a", "b", "c", "d"}, 5};
}

/// The two places of an object.
std::pair<int, int> places_of(const PairsPlay& play, int object) {
  std::vector<int> places;
  for (std::size_t i = 0; i < play.board().size(); ++i)
    if (play.board()[i].object == object) places.push_back(static_cast<int>(i));
  EXPECT_EQ(places.size(), 2u);
  return {places.at(0), places.at(1)};
}

/// Two pieces that are no pair.
std::pair<int, int> strangers(const PairsPlay& play) {
  return {places_of(play, 0).first, places_of(play, 1).first};
}

std::size_t count(const PairsPlay& play, Kind kind) {
  return static_cast<std::size_t>(
      std::count_if(play.events().begin(), play.events().end(),
                    [&](const PairsEvent& event) { return event.kind == kind; }));
}

TEST(PairsBoard, HidesEveryObjectTwiceAndTheSeedDecidesWhere) {
  PairsGame game = game_of({{4, 4, 90, 0}});
  std::map<int, int> times;
  for (const PairsPiece& piece : deal_board(game, 0)) ++times[piece.object];
  EXPECT_EQ(times.size(), 8u);
  for (const auto& [object, n] : times) EXPECT_EQ(n, 2) << object;
  const auto order = [&](std::uint64_t seed) {
    game.seed = seed;
    std::vector<int> objects;
    for (const PairsPiece& piece : deal_board(game, 0)) objects.push_back(piece.object);
    return objects;
  };
  EXPECT_EQ(order(1), order(1));
  std::set<std::vector<int>> orders;
  for (std::uint64_t seed = 0; seed < 20; ++seed) orders.insert(order(seed));
  EXPECT_GT(orders.size(), 18u);
}

TEST(PairsRulesTest, EveryLookTakesLonger) {
  PairsRules rules;
  rules.reveal = 0.5;
  rules.slowdown = 2;
  rules.show = 0.25;
  PairsPlay play(game_of({{4, 2, 90, 0}}, rules));
  const auto [a, b] = strangers(play);
  ASSERT_TRUE(play.pick(a, b));
  // Two reveals of 0.5 s one after the other, 0.25 s of both, and both hide at once in 0.5 s.
  EXPECT_DOUBLE_EQ(play.clock(), 0.5 + 0.5 + 0.25 + 0.5);
  EXPECT_EQ(play.board()[static_cast<std::size_t>(a)].state, State::kHidden);
  ASSERT_TRUE(play.pick(a, b));
  EXPECT_DOUBLE_EQ(play.clock(), 1.75 + 1 + 1 + 0.25 + 1);
  EXPECT_EQ(count(play, Kind::kReveal), 4u);
  EXPECT_EQ(count(play, Kind::kHide), 4u);
  EXPECT_EQ(play.score(), 0);
}

TEST(PairsRulesTest, APairMeltsAndScoresByItsLooks) {
  PairsRules rules;
  rules.pair_points = 100;
  rules.look_cost = 10;
  PairsPlay play(game_of({{4, 2, 90, 0}}, rules));
  const auto [first, second] = places_of(play, 2);
  ASSERT_TRUE(play.pick(first, second));
  EXPECT_EQ(play.score(), 100);
  EXPECT_EQ(play.pairs_found(), 1);
  EXPECT_EQ(count(play, Kind::kMelt), 2u);
  EXPECT_EQ(play.board()[static_cast<std::size_t>(first)].state, State::kFound);
  // Each look at either after its first costs points.
  const auto [a, b] = strangers(play);
  const auto [a1, a2] = places_of(play, 0);
  ASSERT_TRUE(play.pick(a, b));
  ASSERT_TRUE(play.pick(a, b));
  ASSERT_TRUE(play.pick(a1, a2));
  EXPECT_EQ(play.score(), 100 + 100 - 2 * 10);
}

TEST(PairsRulesTest, TooManyLooksExplodeThePiece) {
  PairsRules rules;
  rules.looks = 2;
  PairsPlay play(game_of({{4, 2, 900, 3}}, rules));
  const auto [a, b] = strangers(play);
  ASSERT_TRUE(play.pick(a, b));
  ASSERT_TRUE(play.pick(a, b));
  ASSERT_TRUE(play.pick(a, b));
  EXPECT_EQ(play.board()[static_cast<std::size_t>(a)].state, State::kExploded);
  // It ends the turn: the other one is not looked at.
  EXPECT_EQ(play.board()[static_cast<std::size_t>(b)].looks, 2);
  EXPECT_EQ(count(play, Kind::kExplode), 1u);
  // Three of four pairs are needed and can still be found.
  EXPECT_FALSE(play.over());
  EXPECT_FALSE(play.pick(a, b));
  // With a second one gone they cannot.
  ASSERT_TRUE(play.pick(b, places_of(play, 2).first));
  EXPECT_EQ(play.board()[static_cast<std::size_t>(b)].state, State::kExploded);
  EXPECT_TRUE(play.over());
  EXPECT_FALSE(play.won());
  EXPECT_EQ(play.events().back().kind, Kind::kStuck);
}

TEST(PairsRulesTest, EnoughPairsLevelUpWithMoreTimeAndObjects) {
  PairsPlay play(game_of({{2, 2, 20, 1}, {4, 2, 30, 0}}));
  const auto [first, second] = places_of(play, 0);
  ASSERT_TRUE(play.pick(first, second));
  const double used = 2 * PairsRules{}.reveal + PairsRules{}.melt;
  EXPECT_EQ(play.level(), 1);
  EXPECT_EQ(play.board().size(), 8u);
  EXPECT_DOUBLE_EQ(play.clock(), 0);
  EXPECT_DOUBLE_EQ(play.time_limit(), 20 - used + 30);
  EXPECT_EQ(count(play, Kind::kLevelUp), 1u);
  for (int object = 0; object < 4; ++object) {
    const auto [one, other] = places_of(play, object);
    ASSERT_TRUE(play.pick(one, other));
  }
  EXPECT_TRUE(play.over());
  EXPECT_TRUE(play.won());
  const double left = 20 - used + 30 - 4 * used;
  EXPECT_EQ(play.score(), 5 * 100 + 2 * static_cast<int>(left));
}

TEST(PairsRulesTest, TimeRunsOutWithinAMove) {
  PairsPlay play(game_of({{4, 2, 1, 0}}));
  const auto [first, second] = places_of(play, 1);
  ASSERT_TRUE(play.pick(first, second));
  EXPECT_TRUE(play.over());
  EXPECT_FALSE(play.won());
  EXPECT_DOUBLE_EQ(play.clock(), 1);
  EXPECT_EQ(play.score(), 0);
  EXPECT_EQ(play.events().back().kind, Kind::kTimeOut);
  // Thinking counts as well.
  PairsPlay slow(game_of({{4, 2, 5, 0}}));
  ASSERT_TRUE(slow.wait(4));
  EXPECT_FALSE(slow.over());
  ASSERT_TRUE(slow.wait(2));
  EXPECT_TRUE(slow.over());
  EXPECT_DOUBLE_EQ(slow.clock(), 5);
}

TEST(PairsRulesTest, WhatIsNoMoveChangesNothing) {
  PairsPlay play(game_of({{4, 2, 90, 0}}));
  for (const char* text :
       {"", "a1", "a1 a1", "a1 e1", "a0 a1", "a1 b3", "a1 b1 c1", "wait x", "wait -1", "1a 2a"})
    EXPECT_FALSE(apply_move(play, text)) << text;
  EXPECT_TRUE(play.events().empty());
  EXPECT_DOUBLE_EQ(play.clock(), 0);
  EXPECT_TRUE(apply_move(play, "A1, d2"));
  EXPECT_TRUE(apply_move(play, "wait 0.5"));
  EXPECT_EQ(play.events()[0].piece, 0);
  EXPECT_EQ(play.events()[1].piece, 7);
}

TEST(PairsScene, EventsAreLegsInTheirTime) {
  PairsFile file;
  file.game = game_of({{2, 2, 60, 0}});
  file.objects = {{{"shape", "cube"}}, {{"shape", "torus"}}};
  file.scene_settings["frames"]["fps"] = 10;
  PairsPlay play(file.game);
  const auto [a, b] = strangers(play);
  const auto [a1, a2] = places_of(play, 0);
  ASSERT_TRUE(play.pick(a, b));
  ASSERT_TRUE(play.pick(a1, a2));
  const auto scene = nlohmann::json::parse(dump_json(make_board_scene(file, play, 0)));
  ASSERT_EQ(scene["actors"].size(), 4u);
  const auto& actor = scene["actors"][static_cast<std::size_t>(a)];
  // Sphere, cube, sphere, cube, puddle.
  EXPECT_EQ(actor["source"]["shape"], "sphere");
  EXPECT_EQ(actor["intermediate"][0]["shape"], "cube");
  EXPECT_EQ(actor["intermediate"][1]["shape"], "sphere");
  EXPECT_EQ(actor["intermediate"][2]["shape"], "cube");
  EXPECT_EQ(actor["target"]["shape"], "puddle");
  // Its chain takes exactly the frames until the level's last event ends.
  int frames = actor["start"].get<int>() - 1;
  for (const auto& leg : actor["per_leg"]) frames += leg.get<int>();
  for (const auto& object : actor["intermediate"]) frames += object.value("hold", 0);
  EXPECT_EQ(frames, count_level_frames(play, 0, 10) - 1);
  // One that is never looked at moves in no frame of the play.
  for (const auto& other : scene["actors"]) {
    if (other["per_leg"].size() != 1) continue;
    EXPECT_GT(other["start"].get<int>(), count_level_frames(play, 0, 10));
  }
  EXPECT_EQ(format_score(play, 0, 1, 10), "LEVEL 1   SCORE 0   PAIRS 0/2   TIME 60");
  EXPECT_EQ(format_score(play, 0, count_level_frames(play, 0, 10), 10).substr(0, 31),
            "LEVEL 1   SCORE 90   PAIRS 1/2 ");
}

}  // namespace
}  // namespace polymorph
