#include <iostream>

#include "base/file.h"
#include "base/json.h"
#include "base/log.h"
#include "cli/command_line.h"
#include "cli/progress.h"
#include "export/film_pictures.h"
#include "image/image_io.h"
#include "image/rgb_channels.h"
#include "image/strip.h"
#include "pairs/board_scene.h"
#include "pairs/load_game.h"

namespace polymorph {
namespace {

namespace fs = std::filesystem;

struct PairsOptions {
  std::string game, moves, output;  ///< `moves` empty: the game's own; `output` empty: no pictures
  std::vector<std::string> sets;
};

const char* event_word(PairsEvent::Kind kind) {
  switch (kind) {
    case PairsEvent::Kind::kReveal:
      return "shows";
    case PairsEvent::Kind::kHide:
      return "hides";
    case PairsEvent::Kind::kMelt:
      return "melts";
    case PairsEvent::Kind::kExplode:
      return "explodes";
    case PairsEvent::Kind::kLevelUp:
      return "next level";
    case PairsEvent::Kind::kWon:
      return "won";
    case PairsEvent::Kind::kTimeOut:
      return "time is up";
    case PairsEvent::Kind::kStuck:
      return "lost: too few pairs are left";
  }
  return "";
}

/// A game that is played move by move. Its frames can be rendered into one folder while it goes on.
class Session {
 public:
  Session(const CommandLine& line, const PairsOptions& options, const PairsFile& file)
      : line_(line), options_(options), file_(file), play_(file.game) {}

  const PairsPlay& play() const { return play_; }

  /// Applies a move and prints the events that it causes.
  Status move(const std::string& text) {
    PM_TRY_STATUS(apply_move(play_, text));
    for (; printed_events_ < play_.events().size(); ++printed_events_) {
      const PairsEvent& event = play_.events()[printed_events_];
      const PairsLevel& level = file_.game.levels[static_cast<std::size_t>(event.level)];
      std::string description = event_word(event.kind);
      if (event.piece >= 0) {
        const auto board = deal_board(file_.game, event.level);
        const int object = board[static_cast<std::size_t>(event.piece)].object;
        description = fmt::format("{} {} {}", format_square(level, event.piece), description,
                                  file_.game.objects[static_cast<std::size_t>(object)]);
      }
      print_data("{:>7.2f} s  level {}  score {:>5}  {}\n", event.start, event.level + 1,
                 event.score, description);
    }
    return Ok{};
  }

  /// Renders the frames since the last call as PNGs that show the score and the clock.
  Status render_new_frames() {
    while (rendered_level_ < play_.level()) {
      PM_TRY_STATUS(render_level(rendered_level_));
      ++rendered_level_;
      rendered_frames_ = 0;
    }
    return render_level(rendered_level_);
  }

  /// Writes the contact sheet and the GIF of the whole play.
  Status finish() {
    const fs::path folder = options_.output;
    SheetSettings sheet;
    sheet.count = 16;
    sheet.label = "none";
    PM_TRY_STATUS(write_sheet(folder / "strip.png", film_, sheet));
    PM_TRY_STATUS(write_gif(folder / "play.gif", film_));
    log_info("{} frames, strip.png and play.gif: {}", film_.numbers.size(), folder.string());
    return Ok{};
  }

 private:
  /// Renders the frames of a level that are new since the last call.
  Status render_level(int level) {
    const double fps = frames_per_second(file_);
    const int frames = count_level_frames(play_, level, fps);
    if (frames <= rendered_frames_) return Ok{};
    const fs::path scene_file = fs::path(options_.output) / fmt::format("level-{}.json", level + 1);
    const std::string text = dump_json(make_board_scene(file_, play_, level));
    PM_TRY_STATUS(write_file(scene_file, text));
    PM_TRY(const std::vector<Override> overrides, parse_overrides(options_.sets));
    // Not load_scene(): it would register the file as an input, which the next move may not
    // replace.
    PM_TRY(Scene scene, load_scene_text(scene_file, text, overrides));
    std::vector<int> numbers;
    for (int frame = rendered_frames_ + 1; frame <= frames; ++frame) numbers.push_back(frame);
    PM_TRY(const EngineScene film_scene, prepare_film(std::move(scene), resources(line_.common)));
    PM_TRY(Film film, render_film(film_scene, numbers,
                                  {.progress = make_progress(progress_mode(line_.common))}));
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      Image& image = film.images[i];
      overlay(image, format_score(play_, level, numbers[i], fps));
      film_.numbers.push_back(static_cast<int>(film_.numbers.size()) + 1);
      const fs::path file =
          fs::path(options_.output) / fmt::format("frame.{:04}.png", film_.numbers.back());
      PM_TRY_STATUS(write_image(file, image));
      film_.images.push_back(std::move(image));
    }
    film_.fps = static_cast<float>(fps);
    film_.last = static_cast<int>(film_.numbers.size());
    rendered_frames_ = frames;
    return Ok{};
  }

  /// Draws a line of text on a dark band along the top of the image.
  static void overlay(Image& image, const std::string& text) {
    const int scale =
        std::max(1, image.width / 480);  // magnification of the font, by the width in pixels
    const int height = text_height(scale), border = height / 2;
    constexpr float kShade = 0.25f, kWhite = 0.9f;  // factor of the band; brightness of the text
    const std::size_t channels = image.channel_count();
    const auto rows = static_cast<std::size_t>(std::min(height + 2 * border, image.height));
    for (const int channel : find_rgb(image))  // negative if the image lacks it
      for (std::size_t i = 0; channel >= 0 && i < rows * static_cast<std::size_t>(image.width); ++i)
        image.pixels[i * channels + static_cast<std::size_t>(channel)] *= kShade;
    draw_text(image, border, border, text, {kWhite, scale});
  }

  const CommandLine& line_;
  const PairsOptions& options_;
  const PairsFile& file_;
  PairsPlay play_;
  Film film_;
  std::size_t printed_events_ = 0;
  int rendered_level_ = 0;   ///< level whose frames are rendered now, from 0
  int rendered_frames_ = 0;  ///< number of its frames that are finished
};

/// Reads moves from standard input until the game is over. A line that is no move gives a warning.
Status play_by_hand(Session& session, bool renders) {
  log_info("two places per line, as in \"a1 b2\"; an empty line ends the game");
  for (std::string text; !session.play().over() && std::getline(std::cin, text) && !text.empty();) {
    if (const Status status = session.move(text); !status) {
      log_warning("{}", status.error().message);
      continue;
    }
    std::fflush(stdout);  // the player reads the answer before the next move
    if (renders) PM_TRY_STATUS(session.render_new_frames());
  }
  return Ok{};
}

Result<int> run_pairs(const CommandLine& line, const PairsOptions& options) {
  PM_TRY(const PairsFile file, load_pairs_game(options.game));
  const bool renders = !options.output.empty();
  if (renders)
    for (const char* name : {"level-1.json", "frame.0001.png", "strip.png", "play.gif"})
      PM_TRY_STATUS(check_output(fs::path(options.output) / name, line.common.overwrite));
  Session session(line, options, file);
  if (options.moves == "-") {
    PM_TRY_STATUS(play_by_hand(session, renders));
  } else {
    std::vector<std::string> moves = file.moves;
    if (!options.moves.empty()) {
      PM_TRY(const std::string text, read_file(options.moves, /*limit=*/1u << 20));
      moves = split(text, '\n');
      std::erase_if(moves, [](const std::string& move) { return move.empty(); });
    }
    for (const std::string& move : moves) {
      if (session.play().over()) break;
      PM_TRY_STATUS(session.move(move));
    }
  }
  if (renders) {
    PM_TRY_STATUS(session.render_new_frames());
    PM_TRY_STATUS(session.finish());
  }
  const PairsPlay& play = session.play();
  print_data("score {}, level {}, {} of {} pairs, {}\n", play.score(), play.level() + 1,
             play.pairs_found(), play.pairs_needed(),
             play.won()    ? "won"
             : play.over() ? "lost"
                           : "not over");
  return 0;
}

}  // namespace

void add_pairs(CommandLine& line) {
  auto options = std::make_shared<PairsOptions>();
  Command command = add_command(
      line, "pairs", "Play the game of Pairs with morphing pieces, and render the play.",
      "  polymorph pairs scenes/pairs/small.json\n"
      "  polymorph pairs scenes/pairs/board-4x4.json -o play\n"
      "  polymorph pairs scenes/pairs/small.json --moves - -o play",
      "  0 played   2 usage   3 bad game or move   4 cannot write, exists\n"
      "  5 device or memory   130, 143 stopped by a signal");
  command.add_option("game", options->game, "GAME", "the game file").required();
  command.add_option(
      "--moves", options->moves, "FILE",
      "moves instead of the game's, one per line: a1 b2; - reads them as they are made");
  command.add_option("-o,--output", options->output, "DIR",
                     "folder for frames, strip.png, play.gif and the scenes; default: only play");
  add_overwrite(command, line.common);
  add_overrides(command, options->sets);
  set_action(line, command, [&line, options] { return run_pairs(line, *options); });
}

}  // namespace polymorph
