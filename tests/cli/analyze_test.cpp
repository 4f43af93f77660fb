// analyze: a scene's morph and any program's meshes, as numbers and against limits.
#include <nlohmann/json.hpp>

#include "testing/program.h"

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
  const Ran ran = run(0, {"analyze", "scene.json", "-c", "5", "--html", "a.html", "--csv", "a.csv",
                          "--json", "a.json", "--device", "cpu"});
  EXPECT_EQ(ran.err, "");
  const auto json = nlohmann::json::parse(read_text(folder / "a.json"));
  ASSERT_EQ(json["morphs"].size(), 1u);
  EXPECT_EQ(json["morphs"][0]["frames"].size(), 5u);
  EXPECT_EQ(json["morphs"][0]["metrics"]["bad_surfaces"]["value"], 0.0);
  for (const char* metric : {"curvature", "bumps", "groove", "detail", "first_step", "last_step",
                             "source_step", "target_step", "parts"})
    EXPECT_TRUE(json["morphs"][0]["metrics"][metric]["value"].is_number()) << metric;
  for (const char* measure : {"tac", "bumps", "groove", "rho", "farthest"})
    EXPECT_TRUE(json["morphs"][0]["frames"][2][measure].is_number()) << measure;
  EXPECT_EQ(lines_of(read_text(folder / "a.csv")).size(), 6u);
  EXPECT_TRUE(contains(read_text(folder / "a.csv"), ",tac,bumps,groove,rho,"));
  EXPECT_TRUE(contains(read_text(folder / "a.html"), "<svg"));
  EXPECT_TRUE(contains(read_text(folder / "a.html"), "<b>tac</b>"));
}

TEST_F(Analyze, LimitsDecideTheExitCode) {
  run(0, {"analyze", "scene.json", "-c", "5", "--fail-on", "bad_surfaces<=0"});
  const Ran ran = run(1, {"analyze", "scene.json", "-c", "5", "--fail-on", "dip>=0.1", "--fail-on",
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
  EXPECT_TRUE(json["morphs"][0]["metrics"]["source_step"]["value"].is_null());
  // Against other objects than its own ends.
  const Ran other = run(0, {"analyze", "seq.####.obj", "--source", "seq.0003.obj", "--json"});
  EXPECT_GT(nlohmann::json::parse(other.out)["morphs"][0]["metrics"]["source_error"]["value"],
            1e-3);
  const auto metrics = nlohmann::json::parse(other.out)["morphs"][0]["metrics"];
  EXPECT_GT(metrics["source_step"]["value"], 0.5);
  EXPECT_TRUE(metrics["target_step"]["value"].is_null());
}

TEST_F(Analyze, AFlatSurfaceIsMeasuredLikeAnyOther) {
  const auto metrics = [&](const char* flat) {
    const Ran ran =
        run(0, {"analyze", "scene.json", "-c", "4", "--set", flat, "--json", "--device", "cpu"});
    return nlohmann::json::parse(ran.out)["morphs"][0]["metrics"];
  };
  const auto flat = metrics("report.flat=true"), smooth = metrics("report.flat=false");
  // The same points; only normals tell the two apart.
  EXPECT_EQ(flat["curvature"]["value"], smooth["curvature"]["value"]);
  EXPECT_NEAR(flat["bending"]["value"].get<double>(), smooth["bending"]["value"].get<double>(),
              0.2);
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
