// Rules and state of the game of Pairs (Gilbert 2010, 3.6). The spheres on a grid hide objects,
// each object twice. A player picks two spheres at a time. The same game and the same picks give
// the same events.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/result.h"

namespace polymorph {

/// Rules of a game; times in seconds.
struct PairsRules {
  double reveal = 0.75;   ///< duration of the morph that reveals an object the first time
  double slowdown = 1.4;  ///< factor of `reveal` for every further look at the same piece
  double show = 0.5;      ///< time for which two pieces that are no pair stay revealed
  double melt = 1.5;      ///< duration of the morph of a found pair into puddles
  double explode = 1.5;   ///< duration of an explosion
  int looks = 4;          ///< looks that a piece survives; at the next one it explodes
  int pair_points = 100;  ///< points per found pair
  int look_cost = 10;     ///< deduction for every look at either piece after its first
  int second_points = 2;  ///< points per full second that is left when the last level is won
};

/// One level: its grid of pieces, its time and its goal.
struct PairsLevel {
  int columns = 4, rows = 4;  ///< an even number of pieces
  double seconds = 90;  ///< time limit, to which the time left from the previous level is added
  int pairs = 0;        ///< pairs to find before the next level; 0 = all
};

/// A game: rules, levels and objects.
struct PairsGame {
  PairsRules rules;
  std::vector<PairsLevel> levels;
  std::vector<std::string> objects;  ///< objects to hide; each level uses as many as it has pairs
  std::uint64_t seed = 0;            ///< seed of the positions
};

/// A piece of the board.
struct PairsPiece {
  int object = 0;  ///< index into the game's objects
  enum class State { kHidden, kShown, kFound, kExploded } state = State::kHidden;
  int looks = 0;  ///< number of times that it was revealed
};

/// An event of the game; most concern one piece.
struct PairsEvent {
  enum class Kind {
    kReveal,   ///< the piece becomes its object
    kHide,     ///< the piece becomes a sphere again
    kMelt,     ///< the piece melts, because its pair is found
    kExplode,  ///< the piece explodes, because it was looked at too often
    kLevelUp,  ///< enough pairs are found; no piece
    kWon,      ///< enough pairs of the last level are found
    kTimeOut,  ///< the time is over
    kStuck,    ///< too few pairs are left to complete the level
  };
  Kind kind = Kind::kReveal;
  int level = 0;       ///< index into the game's levels
  int piece = -1;      ///< index into the level's board, row by row; -1: none
  double start = 0;    ///< start on the level's own clock
  double seconds = 0;  ///< duration, cut short if the level's time ends
  int score = 0;       ///< score after the event
};

/// Deals a level's board: the pieces, to which the objects are assigned in random order. The order
/// depends on the game's seed and the level.
std::vector<PairsPiece> deal_board(const PairsGame& game, int level);

/// State of a game that is being played.
class PairsPlay {
 public:
  explicit PairsPlay(PairsGame game);

  /// Picks two pieces of the board by index. Does nothing if the game is over. Errors (kInput),
  /// which change nothing: an index that does not exist, the same piece twice, a piece that is
  /// found or has exploded.
  Status pick(int first, int second);
  /// Lets the clock run for this time. Errors (kInput): a negative time.
  Status wait(double seconds);

  bool over() const { return over_; }
  bool won() const { return won_; }
  int level() const { return level_; }
  int score() const { return score_; }
  double clock() const { return clock_; }  ///< seconds since the level began
  double time_left() const { return limit_ - clock_; }
  /// Time limit of this level, including the time left from the previous one.
  double time_limit() const { return limit_; }
  int pairs_found() const { return found_; }  ///< pairs found in this level
  int pairs_needed() const;                   ///< pairs to find in this level
  const std::vector<PairsPiece>& board() const { return board_; }
  const PairsGame& game() const { return game_; }
  const std::vector<PairsEvent>& events() const { return events_; }
  /// The time limits of all levels begun so far, in seconds.
  const std::vector<double>& limits() const { return limits_; }

 private:
  void begin_level(double seconds_left);  ///< begins level_; adds this time to its limit
  bool reveal_or_explode(int piece);
  void add_event(PairsEvent::Kind kind, std::vector<int> pieces, double seconds);
  void add_event_without_piece(PairsEvent::Kind kind);  ///< the event has no duration
  /// Begins the next level, or ends the game, if this level is complete or cannot be completed.
  void finish_turn();
  int pairs_possible() const;

  PairsGame game_;
  std::vector<PairsPiece> board_;
  std::vector<PairsEvent> events_;
  std::vector<double> limits_;
  int level_ = 0, score_ = 0, found_ = 0;  ///< found_: pairs found in this level
  double clock_ = 0, limit_ = 0;           ///< seconds since the level began, and its time limit
  bool over_ = false, won_ = false;
};

/// Returns the duration, in seconds, of the reveal of a piece that was looked at `looks_before`
/// times.
double reveal_seconds(const PairsRules& rules, int looks_before);

/// Parses a position such as "b3", column 2 of row 3, into the index of a piece. Letters count
/// columns from the left, numbers count rows from the front. Errors (kInput): not a position on
/// this level's board.
Result<int> parse_square(const PairsLevel& level, const std::string& text);
/// Formats the position of a piece, such as "b3".
std::string format_square(const PairsLevel& level, int piece);

}  // namespace polymorph
