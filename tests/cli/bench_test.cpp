// bench morph: pairs with true points, this program's morphs and another's meshes, in one table.
#include <cmath>
#include <nlohmann/json.hpp>

#include "testing/cubes.h"
#include "testing/program.h"

namespace polymorph {
namespace {

class BenchMorph : public ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    write("pairs/a.obj", cube_obj(1));
    write("pairs/b.obj", cube_obj(2));
    write("pairs/truth.json", truth_json("left", "right"));
  }
  std::vector<std::string> bench(const std::vector<std::string>& more) const {
    std::vector<std::string> all{"bench",
                                 "morph",
                                 "pairs",
                                 "--device",
                                 "cpu",
                                 "-c",
                                 "3",
                                 "--set",
                                 "spheres.balls=12",
                                 "--set",
                                 "surface.resolution=16"};
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }
};

TEST_F(BenchMorph, PrintsALineForEachPairAndOneForAll) {
  const std::vector<std::string> lines = lines_of(run(0, bench({})).out);
  ASSERT_EQ(lines.size(), 3u);
  EXPECT_TRUE(contains(lines[0], "pair   ")) << lines[0];
  EXPECT_TRUE(lines[1].starts_with("a-b ")) << lines[1];
  EXPECT_TRUE(lines[2].starts_with("all (1) ")) << lines[2];
  EXPECT_EQ(lines[0].size(), lines[1].size());
  EXPECT_EQ(lines[1].substr(24), lines[2].substr(24));
}

TEST_F(BenchMorph, GivesJsonAndHoldsLimits) {
  const Ran ran =
      run(1, bench({"--json", "--fail-on", "map_error<=0.05", "--fail-on", "hull_dip>=2"}));
  EXPECT_TRUE(contains(ran.err, "a -> b: hull_dip is ")) << ran.err;
  EXPECT_FALSE(contains(ran.err, "map_error")) << ran.err;
  const auto json = nlohmann::json::parse(ran.out);
  EXPECT_EQ(json["morphs"][0]["from"], "a");
  EXPECT_EQ(json["morphs"][0]["metrics"]["points"]["value"], 4);
  EXPECT_EQ(json["all"]["points"], 4);
  EXPECT_EQ(json["all"]["map_error"], json["morphs"][0]["metrics"]["map_error"]["value"]);
}

TEST_F(BenchMorph, JudgesAnotherProgramsMeshes) {
  write("theirs/a-b.01.obj", cube_obj(1));
  write("theirs/a-b.02.obj", cube_obj(3, true));
  write("theirs/b-a.01.obj", cube_obj(2));
  write("theirs/b-a.02.obj", cube_obj(2));
  std::string truth = truth_json("left", "right");
  write("pairs/truth.json", truth.replace(truth.find("[[\"a\""), 3, "[[\"b\", \"a\"], [\""));
  const auto json =
      nlohmann::json::parse(run(0, bench({"--meshes", "theirs/{pair}.##.obj", "--json"})).out);
  ASSERT_EQ(json["morphs"].size(), 2u);
  const auto value = [&](int pair, const char* metric) {
    return json["morphs"][pair]["metrics"][metric]["value"].get<double>();
  };
  EXPECT_NEAR(value(0, "map_error"), 0, 1e-5);
  EXPECT_NEAR(value(1, "map_error"), 0.5 * std::sqrt(0.5 / 3), 1e-4);
  EXPECT_NEAR(json["all"]["map_error"].get<double>(), 0.25 * std::sqrt(0.5 / 3), 1e-4);
  EXPECT_NEAR(value(1, "true_facing"), 90, 1e-3);
  EXPECT_EQ(json["all"]["points"], 8);
  EXPECT_TRUE(json["all"]["plan_error"].is_null());
}

TEST_F(BenchMorph, SaysWhatItLacks) {
  EXPECT_TRUE(contains(run(2, {"bench", "morph"}).err, "needs a file of pairs"));
  EXPECT_TRUE(contains(run(2, {"bench", "surface", "pairs"}).err, "one argument too many"));
  EXPECT_TRUE(contains(run(2, bench({"--meshes", "theirs/{pair}.obj"})).err,
                       "has no place for the frame number"));
  EXPECT_TRUE(contains(run(3, bench({"--meshes", "theirs/{pair}.##.obj"})).err, "theirs: "));
  write("pairs/truth.json", R"({"models": {"a": {"model": "a.obj", "points": {}}}})");
  EXPECT_TRUE(contains(run(3, bench({})).err, "names no pairs"));
  write("pairs/truth.json",
        R"({"models": {"a": {"model": "a.obj", "points": {}}}, "pairs": [["a", "a"]]})");
  EXPECT_TRUE(contains(run(3, bench({})).err, "no point of the same name"));
}

}  // namespace
}  // namespace polymorph
