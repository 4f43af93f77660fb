// analyze: a scene's morph and any program's meshes, as numbers and against limits.
#include <cmath>
#include <nlohmann/json.hpp>

#include "testing/cubes.h"
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
                             "source_step", "target_step", "parts", "least_curvature", "hull_dip",
                             "floating", "sinking", "registration"})
    EXPECT_TRUE(json["morphs"][0]["metrics"][metric]["value"].is_number()) << metric;
  for (const char* measure : {"tac", "bumps", "groove", "rho", "farthest", "hull", "lowest"})
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
  EXPECT_TRUE(json["morphs"][0]["metrics"]["distortion"]["value"].is_null());
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

/// Two cubes that stand alike, of 1 and 2 file units, with a point on each side.
class AnalyzeTruth : public Analyze {
 protected:
  void SetUp() override {
    Analyze::SetUp();
    write("a.obj", cube_obj(1));
    write("b.obj", cube_obj(2));
    write("cubes.json", R"({"source": "a.obj", "target": "b.obj", "frames": {"count": 3},
                            "spheres": {"balls": 12}, "surface": {"resolution": 16}})");
    write("truth.json", truth_json("left", "right"));
  }
  nlohmann::json metrics(const std::vector<std::string>& arguments) {
    std::vector<std::string> all{"analyze", "--json", "--device", "cpu", "-q"};
    all.insert(all.end(), arguments.begin(), arguments.end());
    return nlohmann::json::parse(run(0, all).out)["morphs"][0]["metrics"];
  }
};

TEST_F(AnalyzeTruth, TellsHowNearKnownPointsComeInTheFilesCoordinates) {
  const auto found = metrics({"cubes.json", "--truth", "truth.json"});
  EXPECT_EQ(found["points"]["value"], 4);
  EXPECT_EQ(found["map_within_5"]["value"], 1.0);
  EXPECT_LT(found["map_error"]["value"], 0.02);
  EXPECT_LT(found["map_geodesic"]["value"], 0.02);
  EXPECT_LT(found["true_facing"]["value"], 1);
  EXPECT_LT(found["facing"]["value"], 5);
  EXPECT_LT(found["registration"]["value"], 0.01);
  EXPECT_TRUE(found["plan_error"]["value"].is_number());
}

TEST_F(AnalyzeTruth, PointsThatChangeSidesAreOffByTheCubesWidth) {
  write("swapped.json", truth_json("right", "left"));
  const auto found = metrics({"cubes.json", "--truth", "swapped.json"});
  // Two of four points are a side away, which is 1 / sqrt 3 of the diagonal.
  EXPECT_NEAR(found["map_error"]["value"].get<double>(), 0.5 / std::sqrt(3), 0.02);
  EXPECT_EQ(found["map_within_10"]["value"], 0.5);
  const Ran ran = run(1, {"analyze", "cubes.json", "--truth", "swapped.json", "--device", "cpu",
                          "--fail-on", "map_within_10>=0.7"});
  EXPECT_TRUE(contains(ran.err, "map_within_10 is 0.5, not >= 0.7")) << ran.err;
}

TEST_F(AnalyzeTruth, MeshesWithTheSameTrianglesAreJudgedToo) {
  // The second mesh is the first, turned by 90 degrees about the vertical, three times as large and
  // elsewhere: its own points say where each goes.
  write("seq.0001.obj", cube_obj(1));
  write("seq.0002.obj", cube_obj(3, true));
  const auto found =
      metrics({"seq.####.obj", "--source", "a.obj", "--target", "b.obj", "--truth", "truth.json"});
  EXPECT_EQ(found["points"]["value"], 4);
  EXPECT_NEAR(found["true_facing"]["value"].get<double>(), 90, 1e-3);
  // Two points of the sides are off by sqrt 1/2 of a side; those above and below are met.
  EXPECT_NEAR(found["map_error"]["value"].get<double>(), 0.5 * std::sqrt(0.5 / 3), 1e-4);
  EXPECT_NEAR(found["distortion"]["value"].get<double>(), 1, 1e-3);
  EXPECT_TRUE(found["plan_error"]["value"].is_null());
}

TEST_F(AnalyzeTruth, WhatCannotBeJudgedIsSaid) {
  EXPECT_TRUE(contains(run(3, {"analyze", "scene.json", "--truth", "truth.json"}).err,
                       "has no points that two successive objects have in common"));
  write("bad.json", "{\"models\": []}");
  EXPECT_TRUE(contains(run(3, {"analyze", "scene.json", "--truth", "bad.json"}).err,
                       "bad.json:1:12: \"models\" must be"));
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
