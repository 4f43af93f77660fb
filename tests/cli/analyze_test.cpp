// analyze: a scene's morph and any program's meshes, as numbers and against limits.
#include <nlohmann/json.hpp>

#include "cli/program.h"

namespace polymorph {
namespace {

class Analyze : public ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    write("scene.json", tiny_scene());
  }
};

TEST_F(Analyze, ASceneInNumbersAndAllFiles) {
  const Ran ran = run(0, {"analyze", "scene.json", "-n", "5", "--html", "a.html", "--csv", "a.csv",
                          "--json", "a.json", "--device", "cpu"});
  EXPECT_EQ(ran.err, "");
  const auto json = nlohmann::json::parse(read_text(folder / "a.json"));
  ASSERT_EQ(json["morphs"].size(), 1u);
  EXPECT_EQ(json["morphs"][0]["frames"].size(), 5u);
  EXPECT_EQ(json["morphs"][0]["metrics"]["bad_surfaces"]["value"], 0.0);
  EXPECT_EQ(lines_of(read_text(folder / "a.csv")).size(), 6u);
  EXPECT_TRUE(contains(read_text(folder / "a.html"), "<svg"));
}

TEST_F(Analyze, LimitsDecideTheExitCode) {
  run(0, {"analyze", "scene.json", "-n", "5", "--fail-on", "bad_surfaces<=0"});
  const Ran ran = run(1, {"analyze", "scene.json", "-n", "5", "--fail-on", "dip>=0.1", "--fail-on",
                          "source_error<0"});
  EXPECT_TRUE(contains(ran.err, "source_error is ")) << ran.err;
  EXPECT_TRUE(contains(ran.err, "not < 0")) << ran.err;
  EXPECT_FALSE(contains(ran.err, "dip is")) << ran.err;
  EXPECT_TRUE(contains(run(2, {"analyze", "scene.json", "--fail-on", "dib>=1"}).err,
                       "did you mean \"dip\""));
}

TEST_F(Analyze, MeshesOfAnyProgram) {
  run(0, {"mesh", "scene.json", "-f", "1-4", "-o", "seq.####.obj", "--set", "boundary.method=cut",
          "--set", "boundary.look_share=0"});
  const Ran ran = run(0, {"analyze", "seq.####.obj", "--json"});
  const auto json = nlohmann::json::parse(ran.out);
  EXPECT_EQ(json["morphs"][0]["frames"].size(), 4u);
  EXPECT_EQ(json["morphs"][0]["from"], "seq.0001.obj");
  EXPECT_TRUE(json["morphs"][0]["metrics"]["attributes"]["value"].is_null());
  EXPECT_LT(json["morphs"][0]["metrics"]["source_error"]["value"], 1e-5);
  EXPECT_TRUE(json["morphs"][0]["metrics"]["pop"]["value"].is_number());
  // Against other objects than its own ends.
  const Ran other = run(0, {"analyze", "seq.####.obj", "--source", "seq.0003.obj", "--json"});
  EXPECT_GT(nlohmann::json::parse(other.out)["morphs"][0]["metrics"]["source_error"]["value"],
            1e-3);
}

TEST_F(Analyze, WhatIsNoMorphIsSaid) {
  EXPECT_TRUE(contains(run(3, {"analyze", "none.####.obj"}).err, "at least two frames"));
  EXPECT_TRUE(contains(run(2, {"analyze", "one.obj"}).err, "seq.####.obj"));
  EXPECT_TRUE(contains(run(2, {"analyze", "scene.json", "--source", "a.obj"}).err, "for meshes"));
  write("bad.json",
        "{\"source\": \"sphere\", \"target\": \"cube\", \"plan\": {\"labels\": {\"spher\": "
        "\"cube\"}}}");
  EXPECT_TRUE(
      contains(run(3, {"analyze", "bad.json"}).err, "no object has a face group \"spher\""));
}

}  // namespace
}  // namespace polymorph
