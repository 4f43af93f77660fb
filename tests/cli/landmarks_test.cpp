// The command that finds landmarks, and the page on which they are clicked.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "testing/program.h"

namespace polymorph {
namespace {

using Json = nlohmann::json;

class LandmarksTest : public ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    write("scene.json", scene("{}"));
  }
  static std::string scene(const std::string& plan) {
    const std::string models = (source_dir() / "scenes/models").string() + "/";
    return R"({"source": ")" + models + R"(spider.obj", "target": {"model": ")" + models +
           R"(monkey.obj", "rotate": [0, 90, 0], "scale": 2}, "spheres": {"balls": 48, "fit": "none"},
      "surface": {"resolution": 24}, "plan": )" +
           plan + "}";
  }
};

TEST_F(LandmarksTest, CandidatesArePlacesOfTheFilesAndMakeAScene) {
  const Ran table = run(0, {"landmarks", "scene.json"});
  EXPECT_TRUE(contains(table.out, "spider.obj -> monkey.obj\n")) << table.out;
  const Ran ran = run(0, {"landmarks", "scene.json", "--json"});
  const Json landmarks = Json::parse(ran.out).at("landmarks");
  for (const auto& [key, points] : landmarks.items())
    for (const auto& [name, point] : points.items()) {
      EXPECT_TRUE(contains(table.out, name)) << table.out;
      EXPECT_EQ(point.size(), 3u) << key;
    }
  // What is printed is what a scene takes: no point is far from its file's surface.
  write("scene.json", scene(Json{{"landmarks", landmarks}}.dump()));
  run(0, {"check", "scene.json"});
}

TEST_F(LandmarksTest, ThePageIsOneFile) {
  const Ran ran = run(0, {"landmarks", "scene.json", "--html", "page.html"});
  EXPECT_TRUE(contains(ran.out, "page.html 1 leg, ")) << ran.out;
  const std::string page = read_text(folder / "page.html");
  EXPECT_TRUE(contains(page, "\"key\":\"spider.obj\""));
  EXPECT_FALSE(contains(page, "{{"));
  EXPECT_TRUE(contains(run(4, {"landmarks", "scene.json", "--html", "page.html"}).err, "exists"));
  EXPECT_TRUE(contains(run(2, {"landmarks", "scene.json", "--html", "page.txt"}).err, "use .html"));
}

}  // namespace
}  // namespace polymorph
