// The game of Pairs (report 3.6): its rules and its state. Spheres on a grid hide objects, each of
// them twice; a player picks two at a time. Deterministic: the same game and the same picks give
// the same events.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/result.h"

namespace polymorph {

/// Times in seconds.
struct PairsRules {
  double reveal = 0.75;   ///< of the morph that shows an object the first time
  double slowdown = 1.4;  ///< every further look at it takes so many times as long
  double show = 0.5;      ///< two that are no pair are shown for so long
  double melt = 1.5;      ///< a found pair melts into puddles
  double explode = 1.5;   ///< a piece that was looked at too often bursts
  int looks = 4;          ///< so many looks a piece bears; at the next it explodes
  int pair_points = 100;  ///< for a pair that is found
  int look_cost = 10;     ///< of those, for every look at either piece after its first
  int second_points = 2;  ///< for every whole second that is left when the last level is won
};

struct PairsLevel {
  int columns = 4, rows = 4;  ///< an even number of pieces
  double seconds = 90;        ///< added to what is left of the time
  int pairs = 0;              ///< to be found for the next level; 0 = all
};

struct PairsGame {
  PairsRules rules;
  std::vector<PairsLevel> levels;
  std::vector<std::string>
      objects;             ///< what may be hidden; each level uses as many as it has pairs
  std::uint64_t seed = 0;  ///< of where they are hidden
};

struct PairsPiece {
  int object = 0;  ///< index into the game's objects
  enum class State { kHidden, kShown, kFound, kExploded } state = State::kHidden;
  int looks = 0;
};

struct PairsEvent {
  enum class Kind {
    kReveal,   ///< the piece becomes its object
    kHide,     ///< and a sphere again
    kMelt,     ///< its pair is found
    kExplode,  ///< it was looked at too often
    kLevelUp,  ///< enough pairs are found; no piece
    kWon,      ///< likewise, of the last level
    kTimeOut,  ///< the time is over
    kStuck,    ///< what is left has no enough pairs for the level
  };
  Kind kind = Kind::kReveal;
  int level = 0;       ///< index into the game's levels
  int piece = -1;      ///< index into the level's board, row by row
  double start = 0;    ///< on the level's own clock
  double seconds = 0;  ///< how long it takes; cut off where the time is over
  int score = 0;       ///< after it
};

/// A level's board at its beginning: what is hidden where.
std::vector<PairsPiece> dealt_board(const PairsGame& game, int level);

/// A play of a game, pick by pick.
class PairsPlay {
 public:
  explicit PairsPlay(PairsGame game);

  /// Picks two pieces of the board, "b3" style names or indices already resolved. Does nothing when
  /// the play is over. Errors (kInput): no such piece, the same twice, one that is found or
  /// exploded; nothing has changed then.
  Status pick(int first, int second);
  /// The player thinks, and the clock runs. Errors (kInput): less than nothing.
  Status wait(double seconds);

  bool over() const { return over_; }
  bool won() const { return won_; }
  int level() const { return level_; }
  int score() const { return score_; }
  double clock() const { return clock_; }  ///< since the level began
  double time_left() const { return limit_ - clock_; }
  double time_limit() const { return limit_; }  ///< of this level, with what was left before
  int pairs_found() const { return found_; }    ///< of this level
  int pairs_needed() const;
  const std::vector<PairsPiece>& board() const { return board_; }
  const PairsGame& game() const { return game_; }
  const std::vector<PairsEvent>& events() const { return events_; }
  /// The time limit of every level that was begun.
  const std::vector<double>& limits() const { return limits_; }

 private:
  void begin_level(double seconds_left);
  bool look(int piece);
  void run(PairsEvent::Kind kind, std::vector<int> pieces, double seconds);
  void note(PairsEvent::Kind kind);
  void finish_turn();
  int pairs_possible() const;

  PairsGame game_;
  std::vector<PairsPiece> board_;
  std::vector<PairsEvent> events_;
  std::vector<double> limits_;
  int level_ = 0, score_ = 0, found_ = 0;
  double clock_ = 0, limit_ = 0;
  bool over_ = false, won_ = false;
};

/// How long a piece's next look takes.
double reveal_seconds(const PairsRules& rules, int looks_before);

/// "b3" -> column 2, row 3: letters count columns from the left, numbers rows from the front.
/// Errors (kInput): not a place of this level's board.
Result<int> parse_place(const PairsLevel& level, const std::string& text);
std::string place_name(const PairsLevel& level, int piece);

}  // namespace polymorph
