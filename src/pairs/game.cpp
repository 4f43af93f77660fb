#include "pairs/game.h"

#include <algorithm>
#include <cctype>
#include <cmath>

#include "base/random.h"
#include "base/text.h"

namespace polymorph {

using Kind = PairsEvent::Kind;
using State = PairsPiece::State;

double reveal_seconds(const PairsRules& rules, int looks_before) {
  double seconds = rules.reveal;
  for (int i = 0; i < looks_before; ++i) seconds *= rules.slowdown;
  return seconds;
}

PairsPlay::PairsPlay(PairsGame game) : game_(std::move(game)) { begin_level(0); }

int PairsPlay::pairs_needed() const {
  const PairsLevel& level = game_.levels[static_cast<std::size_t>(level_)];
  const int max_pairs = level.columns * level.rows / 2;
  return level.pairs > 0 ? std::min(level.pairs, max_pairs) : max_pairs;
}

std::vector<PairsPiece> deal_board(const PairsGame& game, int level) {
  const PairsLevel& grid = game.levels[static_cast<std::size_t>(level)];
  const int count = grid.columns * grid.rows;
  std::vector<PairsPiece> board(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) board[static_cast<std::size_t>(i)].object = i / 2;
  // Fisher-Yates shuffle. The random numbers depend on seed, level and i alone (base/random.h).
  for (int i = count - 1; i > 0; --i)
    std::swap(
        board[static_cast<std::size_t>(i)],
        board[random_below(static_cast<std::uint32_t>(i + 1), game.seed,
                           static_cast<std::uint64_t>(level), static_cast<std::uint64_t>(i))]);
  return board;
}

void PairsPlay::begin_level(double seconds_left) {
  board_ = deal_board(game_, level_);
  clock_ = 0;
  limit_ = seconds_left + game_.levels[static_cast<std::size_t>(level_)].seconds;
  limits_.push_back(limit_);
  found_ = 0;
}

void PairsPlay::add_event_without_piece(Kind kind) {
  events_.push_back({kind, level_, /*piece=*/-1, clock_, /*seconds=*/0, score_});
}

/// Adds an event for each of the `pieces`, all at the same time, and advances the clock to its end.
/// The game is over if the level's time ends before. Does nothing if the game is over already.
void PairsPlay::add_event(Kind kind, std::vector<int> pieces, double seconds) {
  if (over_) return;
  const double duration = std::min(seconds, limit_ - clock_);
  for (const int piece : pieces) events_.push_back({kind, level_, piece, clock_, duration, score_});
  clock_ += duration;
  if (duration < seconds) {
    over_ = true;
    add_event_without_piece(Kind::kTimeOut);
  }
}

/// Reveals a piece, or makes it explode. Returns true if it is revealed and the game goes on.
bool PairsPlay::reveal_or_explode(int piece) {
  PairsPiece& p = board_[static_cast<std::size_t>(piece)];
  if (p.looks >= game_.rules.looks) {
    p.state = State::kExploded;
    add_event(Kind::kExplode, {piece}, game_.rules.explode);
    return false;
  }
  const double seconds = reveal_seconds(game_.rules, p.looks);
  ++p.looks;
  p.state = State::kShown;
  add_event(Kind::kReveal, {piece}, seconds);
  return !over_;
}

Status PairsPlay::wait(double seconds) {
  if (!(seconds >= 0))
    return make_error(ErrorCode::kInput, "wait {}: a time is 0 or more seconds", seconds);
  if (over_) return Ok{};
  clock_ += std::min(seconds, limit_ - clock_);
  if (clock_ >= limit_) {
    over_ = true;
    add_event_without_piece(Kind::kTimeOut);
  }
  return Ok{};
}

Status PairsPlay::pick(int first, int second) {
  const PairsLevel& level = game_.levels[static_cast<std::size_t>(level_)];
  for (const int piece : {first, second}) {
    if (piece < 0 || piece >= static_cast<int>(board_.size()))
      return make_error(ErrorCode::kInput, "there is no piece {} on this board", piece);
    const State state = board_[static_cast<std::size_t>(piece)].state;
    if (state == State::kFound || state == State::kExploded)
      return make_error(ErrorCode::kInput, "{}: nothing is left there",
                        format_square(level, piece));
  }
  if (first == second)
    return make_error(ErrorCode::kInput, "{}: pick two different pieces",
                      format_square(level, first));
  if (over_) return Ok{};

  // Reveal both pieces; then they melt if they are a pair, else they hide again.
  PairsPiece& a = board_[static_cast<std::size_t>(first)];
  PairsPiece& b = board_[static_cast<std::size_t>(second)];
  std::vector<int> shown;
  if (reveal_or_explode(first)) shown.push_back(first);
  // If one piece explodes, the turn ends: the other one is not revealed, or is hidden again.
  if (!shown.empty() && reveal_or_explode(second)) shown.push_back(second);
  if (over_) return Ok{};
  if (shown.size() == 2 && a.object == b.object) {
    const int repeated_looks = a.looks + b.looks - 2;  // the first look at each is free
    score_ += std::max(0, game_.rules.pair_points - repeated_looks * game_.rules.look_cost);
    a.state = b.state = State::kFound;
    ++found_;
    add_event(Kind::kMelt, shown, game_.rules.melt);
  } else if (!shown.empty()) {
    PM_TRY_STATUS(wait(game_.rules.show));
    double longest = 0;  // a piece hides as slowly as it was revealed
    for (const int piece : shown) {
      PairsPiece& p = board_[static_cast<std::size_t>(piece)];
      p.state = State::kHidden;
      longest = std::max(longest, reveal_seconds(game_.rules, p.looks - 1));
    }
    add_event(Kind::kHide, shown, longest);
  }
  if (!over_) finish_turn();
  return Ok{};
}

/// Counts the pairs of this level that are found or can still be found.
int PairsPlay::pairs_possible() const {
  std::vector<int> remaining(board_.size(), 0);  // by object: pieces that have not exploded
  for (const PairsPiece& piece : board_)
    remaining[static_cast<std::size_t>(piece.object)] += piece.state != State::kExploded;
  return static_cast<int>(std::count(remaining.begin(), remaining.end(), 2));
}

void PairsPlay::finish_turn() {
  if (found_ >= pairs_needed()) {
    if (level_ + 1 < static_cast<int>(game_.levels.size())) {
      add_event_without_piece(Kind::kLevelUp);
      const double seconds_left = time_left();
      ++level_;
      begin_level(seconds_left);
      return;
    }
    score_ += game_.rules.second_points * static_cast<int>(std::floor(time_left()));
    over_ = won_ = true;
    add_event_without_piece(Kind::kWon);
  } else if (pairs_possible() < pairs_needed()) {
    over_ = true;
    add_event_without_piece(Kind::kStuck);
  }
}

Result<int> parse_square(const PairsLevel& level, const std::string& text) {
  const auto row = text.empty() ? std::nullopt : parse_integer(std::string_view(text).substr(1));
  const int column = text.empty() ? -1 : std::tolower(static_cast<unsigned char>(text[0])) - 'a';
  if (!row || column < 0 || column >= level.columns || *row < 1 || *row > level.rows)
    return make_error(ErrorCode::kInput, "\"{}\" is no place - the board has a1 to {}", text,
                      format_square(level, level.columns * level.rows - 1));
  return static_cast<int>(*row - 1) * level.columns + column;
}

std::string format_square(const PairsLevel& level, int piece) {
  return fmt::format("{}{}", static_cast<char>('a' + piece % level.columns),
                     piece / level.columns + 1);
}

}  // namespace polymorph
