// What check says about models.
#include <sstream>

#include "testing/program.h"

namespace polymorph {
namespace {

class CheckModels : public ProgramTest {
 protected:
  /// A box as OBJ, its sides outward (or inward), points counted from `base`.
  static std::string box(float low, float high, int base, bool inward = false) {
    std::ostringstream text;
    for (int i = 0; i < 8; ++i)
      text << "v " << (i & 1 ? high : low) << ' ' << (i & 2 ? high : low) << ' '
           << (i & 4 ? high : low) << '\n';
    const int sides[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4},
                             {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
    for (const auto& side : sides) {
      text << 'f';
      for (int k = 0; k < 4; ++k) text << ' ' << base + side[inward ? 3 - k : k];
      text << '\n';
    }
    return text.str();
  }
  /// check's answer about a scene whose source is the model.
  nlohmann::json check(int code, const std::string& obj, const std::string& spheres,
                       const std::vector<std::string>& more = {}) {
    write("model.obj", obj);
    write("scene.json", tiny_scene(4, R"({"model": "model.obj", "spheres": )" + spheres + "}"));
    std::vector<std::string> arguments{"check", "scene.json", "--json"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return parse(run(code, arguments).out);
  }
};

TEST_F(CheckModels, AThinShellIsToldHowManyBallsItTakes) {
  const std::string shell = box(0, 2, 1) + box(0.02f, 1.98f, 9, true);
  const auto json = check(0, shell, R"({"resolution": 8})");
  EXPECT_TRUE(contains(json["warnings"].dump(), "it is thin")) << json;
  EXPECT_EQ(json["objects"][0]["thin"], true);
  EXPECT_NEAR(json["objects"][0]["thickness"].get<double>(), 0.02, 1e-4);
  EXPECT_EQ(json["objects"][1]["thin"], false);
  check(1, shell, R"({"resolution": 8})", {"--strict"});
}

TEST_F(CheckModels, CrossingPartsAreAProblemForTheParityRuleOnly) {
  std::string peg = box(0, 1, 1);
  peg +=
      "v 0.4 0.3 0.35\nv 2 0.5 0.4\nv 0.4 0.7 0.5\nv 0.5 0.5 0.8\n"
      "f 9 11 10\nf 9 10 12\nf 10 11 12\nf 11 9 12\n";
  auto json = check(0, peg, R"({"resolution": 5})", {"--strict"});
  EXPECT_GT(json["objects"][0]["crossing_pairs"].get<int>(), 0);
  EXPECT_TRUE(json["warnings"].empty()) << json;
  json = check(0, peg, R"({"resolution": 5})", {"--set", "report.inside=parity"});
  EXPECT_TRUE(contains(json["warnings"].dump(), "triangles cross")) << json;
}

TEST_F(CheckModels, AnOpenModelIsToldWhereAndWhatToDo) {
  std::string open = box(0, 1, 1);
  open.erase(open.rfind('f'));
  const auto json = check(0, open, R"({"resolution": 5})");
  EXPECT_TRUE(contains(json["warnings"].dump(), "it is open: 4 edges have only one face")) << json;
  EXPECT_TRUE(contains(json["warnings"].dump(), "this is usually fine")) << json;
  EXPECT_FALSE(contains(json["warnings"].dump(), "solidify")) << "the pages warn of it";
}

TEST_F(CheckModels, WhatChangesNothingIsNoWarning) {
  // Two boxes that touch in a corner.
  const std::string pair = box(0, 1, 1) + box(1, 2, 9);
  const auto json = check(0, pair, R"({"resolution": 5})", {"--strict"});
  EXPECT_TRUE(json["warnings"].empty()) << json;
  EXPECT_TRUE(contains(json["notes"].dump(), "a point joins parts that no edge joins")) << json;
}

TEST_F(CheckModels, TurnsAndSizesAreExaminedOnce) {
  std::string shell = box(0, 2, 1) + box(0.02f, 1.98f, 9, true);
  shell.erase(shell.rfind('f'));
  write("shell.obj", shell);
  std::string actors;
  for (int i = 0; i < 5; ++i)
    actors += (i > 0 ? ", " : "") +
              (R"({"source": {"model": "shell.obj", "spheres": {"balls": 8}}, "target": {"shape": )"
               R"("cube", "spheres": {"balls": 8}}, "scale": )" +
               std::to_string(1 + i)) +
              ", \"rotate\": [0, " + std::to_string(20 * i) + ", 0]}";
  const auto check_actors = [&](const std::string& list) {
    write("scene.json", "{\"actors\": [" + list + "], \"surface\": {\"resolution\": 16}}");
    return parse(run(0, {"check", "scene.json", "--json", "--cache-dir", "kept"}).out);
  };
  const auto json = check_actors(actors);
  std::size_t examined = 0;
  for (const auto& file : std::filesystem::directory_iterator(folder / "kept"))
    examined += file.path().extension() == ".spheres";
  EXPECT_EQ(examined, 2u) << "a shell and a cube, whatever their sizes";
  ASSERT_EQ(json["objects"].size(), 10u);
  // Each actor has the numbers that it has alone.
  const auto alone = check_actors(actors.substr(actors.rfind("{\"source\"")));
  for (std::size_t k = 0; k < 2; ++k) {
    const auto &last = json["objects"][8 + k], &same = alone["objects"][k];
    for (const char* count : {"name", "triangles", "genus", "boundary_edges", "thin"})
      EXPECT_EQ(last[count], same[count]) << count;
    for (const char* size : {"volume", "area", "thickness", "balls_needed"})
      EXPECT_NEAR(last[size].get<double>() / same[size].get<double>(), 1, 0.01) << size;
  }
  EXPECT_NEAR(json["objects"][8]["thickness"].get<double>(), 5 * 0.02, 1e-3);
  EXPECT_EQ(json["warnings"].size(), 10u) << "each shell is open and thin: " << json["warnings"];
}

TEST_F(CheckModels, AFitIsJudgedEitherWay) {
  auto json = check(0, box(0, 1, 1), R"({"balls": 16, "fit": "ellipsoid"})", {"--fit"});
  EXPECT_TRUE(contains(json["notes"].dump(), "model: the balls fit well: ")) << json;
  EXPECT_TRUE(json["warnings"].empty()) << json;
  json = check(0, box(0, 1, 1) + box(9, 10, 9), R"({"balls": 1, "fit": "round"})", {"--fit"});
  EXPECT_TRUE(contains(json["warnings"].dump(), "model: the balls fit poorly: ")) << json;
}

}  // namespace
}  // namespace polymorph
