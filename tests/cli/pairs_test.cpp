// The game of Pairs, played by its file and by hand.
#include "testing/program.h"

namespace polymorph {
namespace {

class Pairs : public ProgramTest {
 protected:
  /// Two by two, whose moves try every two places, so that the game ends whatever is where.
  void write_game(const std::string& more = "") {
    write("game.json",
          R"({ // a small one
            "objects": ["cube", {"shape": "torus", "spheres": {"balls": 6}}], "seed": 3,
            "levels": [{"columns": 2, "rows": 2, "seconds": 60}],
            "rules": {"reveal": 0.2, "show": 0.1, "melt": 0.2}, )" +
              more + R"( "scene": {"frames": {"fps": 10}, "spheres": {"balls": 6, "fit": "none"},
            "motion": {"interpolate": "balls"}, "surface": {"resolution": 12}, "image": {"width": 96, "height": 48, "samples": 1}}})");
  }
  /// What pairs with a1, told by a play.
  std::string partner() {
    for (const char* place : {"b1", "a2", "b2"}) {
      write("moves.txt", std::string("a1 ") + place + "\n");
      if (contains(run(0, {"pairs", "game.json", "--moves", "moves.txt"}).out, "melts"))
        return place;
    }
    ADD_FAILURE() << "a1 has no partner";
    return "b1";
  }
  /// The two that are left when a1 and this one are gone.
  static std::string others(const std::string& place) {
    std::string both;
    for (const char* other : {"b1", "a2", "b2"})
      if (place != other) both += std::string(both.empty() ? "" : " ") + other;
    return both;
  }
};

TEST_F(Pairs, PlaysAndRendersTheSameEveryTime) {
  write_game();
  const std::string place = partner();
  write_game("\"moves\": [\"a1 " + place + "\", \"" + others(place) + "\"],");
  const Ran text = run(0, {"pairs", "game.json"});
  EXPECT_EQ(lines_of(text.out).back().find("score 3"), 0u) << text.out;
  EXPECT_TRUE(contains(text.out, "2 of 2 pairs, won")) << text.out;
  EXPECT_EQ(run(0, {"pairs", "game.json", "-o", "play"}).out, text.out);
  for (const char* file :
       {"play/strip.png", "play/play.gif", "play/level-1.json", "play/frame.0001.png"})
    EXPECT_TRUE(exists(file)) << file;
  run(0, {"check", "play/level-1.json"});
  run(0, {"pairs", "game.json", "-o", "again"});
  EXPECT_EQ(read_text(folder / "play/play.gif"), read_text(folder / "again/play.gif"));
  // Two moves of 0.2 + 0.2 + 0.2 s at 10 frames a second, and the frame at their end.
  EXPECT_TRUE(exists("play/frame.0013.png"));
  EXPECT_FALSE(exists("play/frame.0014.png"));
  EXPECT_TRUE(contains(run(4, {"pairs", "game.json", "-o", "play"}).err, "exists"));
}

TEST_F(Pairs, EveryMoveMadeByHandIsRendered) {
  write_game();
  const std::string place = partner(), first = "a1 " + place + "\n", second = others(place) + "\n";
  write("moves.txt", first + second);
  const Ran file = run(0, {"pairs", "game.json", "--moves", "moves.txt", "-o", "file"});
  in_file = write("hand.txt", first + "help\n" + second);
  const Ran hand = run(0, {"pairs", "game.json", "--moves", "-", "-o", "hand"});
  EXPECT_TRUE(contains(hand.out, "2 of 2 pairs, won")) << hand.out;
  EXPECT_TRUE(contains(hand.err, "\"help\" is no move")) << hand.err;
  EXPECT_EQ(hand.out, file.out);
  EXPECT_EQ(read_text(folder / "hand/level-1.json"), read_text(folder / "file/level-1.json"));
  EXPECT_TRUE(exists("hand/frame.0013.png") && exists("hand/play.gif"));
  // What a later move reveals is framed from the first frame on.
  for (const char* frame : {"frame.0001.png", "frame.0003.png", "frame.0009.png"})
    EXPECT_EQ(read_text(folder / "hand" / frame), read_text(folder / "file" / frame)) << frame;
}

TEST_F(Pairs, SaysWhatIsWrongWithAGame) {
  const auto refused = [&](const std::string& game, const std::string& part) {
    write("bad.json", game);
    EXPECT_TRUE(contains(run(3, {"pairs", "bad.json"}).err, part)) << game;
  };
  refused("{", "is not JSON");
  refused(R"({"objects": ["cube"], "levels": []})", "/levels: must be a list of 1 to 20 levels");
  refused(R"({"objects": ["cube"], "levels": [{"columns": 3, "rows": 1}]})", "an odd number");
  refused(R"({"objects": ["cube"], "levels": [{"columns": 2, "rows": 2}]})",
          "/levels/0: hides 2 objects, and there are only 1");
  refused(R"({"objects": ["cbe"], "levels": [{"columns": 2, "rows": 1}]})",
          "/objects/0: neither a file nor a shape");
  refused(R"({"objects": ["cube"], "levels": [{"columns": 2, "rows": 1}], "rule": {}})",
          "unknown key - did you mean \"rules\"?");
  refused(R"({"objects": ["cube"], "levels": [{"columns": 2, "rows": 1, "seconds": 0}]})",
          "/levels/0/seconds: must be a number");
  refused(R"({"objects": ["cube"], "levels": [{"columns": 2, "rows": 1}], "moves": ["a1 c1"]})",
          "\"c1\" is no place - the board has a1 to b1");
}

}  // namespace
}  // namespace polymorph
