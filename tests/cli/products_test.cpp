// strip, mesh and info: what is made of scenes and frames.
#include "testing/program.h"

namespace polymorph {
namespace {

class Products : public ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    write("scene.json", tiny_scene());
  }
  void render_frames() { run(0, {"render", "scene.json", "-o", "f.####.exr", "-q"}); }
};

TEST_F(Products, StripOfAScene) {
  const Ran ran = run(0, {"strip", "scene.json", "-c", "3", "--columns", "3", "-o", "strip.png"});
  EXPECT_EQ(ran.out, "strip.png\n");
  EXPECT_TRUE(contains(ran.err, "frame 4 3/3 ")) << ran.err;
  // 3 cells of 32 and 4 gaps of 6 pixels.
  EXPECT_TRUE(contains(run(0, {"info", "strip.png"}).out, "strip.png: 120 x ")) << ran.out;
}

TEST_F(Products, StripAndGifOfFrames) {
  render_frames();
  const Ran ran = run(0, {"strip", "f.####.exr", "-o", "strip.png", "--gif", "morph.gif", "--label",
                          "t", "--fps", "8"});
  EXPECT_EQ(ran.out, "strip.png\nmorph.gif\n");
  EXPECT_TRUE(read_text(folder / "morph.gif").starts_with("GIF89a"));
  EXPECT_TRUE(exists("strip.png"));
  const Ran again = run(4, {"strip", "f.####.exr", "-o", "strip.png"});
  EXPECT_TRUE(contains(again.err, "strip.png: exists - add --overwrite")) << again.err;
  run(0, {"strip", "f.####.exr", "-o", "strip.png", "--overwrite", "-f", "2,3"});
}

TEST_F(Products, StripRefusesAGap) {
  render_frames();
  std::filesystem::remove(folder / "f.0003.exr");
  for (const char* flag : {"-o", "--gif"}) {
    const Ran ran = run(3, {"strip", "f.####.exr", flag, "made.png"});
    EXPECT_TRUE(contains(ran.err, "frame 3 is missing (there are 1 to 4)")) << ran.err;
    EXPECT_FALSE(exists("made.png"));
  }
}

TEST_F(Products, AMovieOrWhatItTakes) {
  render_frames();
  if (std::system("command -v ffmpeg > /dev/null") == 0) {
    EXPECT_EQ(run(0, {"strip", "f.####.exr", "--mp4", "morph.mp4"}).out, "morph.mp4\n");
    EXPECT_EQ(read_text(folder / "morph.mp4").substr(4, 4), "ftyp");
    run(4, {"strip", "f.####.exr", "--mp4", "morph.mp4"});
  }
  // Where it is not installed nothing is rendered first, and the command to run is told.
  const std::string path = std::getenv("PATH");
  setenv("PATH", folder.c_str(), 1);
  const Ran ran = run(5, {"strip", "f.####.exr", "--mp4", "none.mp4"});
  EXPECT_TRUE(contains(ran.err, "ffmpeg -framerate")) << ran.err;
  write("ffmpeg", "#!/bin/sh\necho cannot do that >&2\nexit 1\n");
  std::filesystem::permissions(folder / "ffmpeg", std::filesystem::perms::all);
  const Ran failed = run(4, {"strip", "f.####.exr", "--mp4", "none.mp4"});
  setenv("PATH", path.c_str(), 1);
  EXPECT_TRUE(contains(failed.err, "cannot do that")) << failed.err;
  EXPECT_FALSE(exists("none.mp4"));
}

TEST_F(Products, LayersOnDemand) {
  run(0, {"render", "scene.json", "-f", "2", "-o", "all.exr", "--set", "image.aovs=all"});
  const Ran all = run(0, {"info", "all.exr"});
  for (const char* name :
       {"Z ", "N.X", "P.Z", "albedo.R", "uv.U", "motion.X", "morph.blend", "morph.t", "id "})
    EXPECT_TRUE(contains(all.out, name)) << name << all.out;
  // Others' tools open it and find what is in it, where they are installed.
  const auto said_by = [&](const std::string& tool, const std::string& options) {
    if (std::system(("command -v " + tool + " > /dev/null").c_str()) != 0) return std::string();
    const std::string line = tool + options + " all.exr > said.txt 2>&1";
    EXPECT_EQ(std::system(("cd " + folder.string() + " && " + line).c_str()), 0) << line;
    return read_text(folder / "said.txt");
  };
  if (const std::string said = said_by("exrheader", ""); !said.empty()) {
    EXPECT_TRUE(contains(said, "morph.blend, 32-bit floating-point")) << said;
    EXPECT_TRUE(contains(said, "R, 16-bit floating-point")) << said;
    EXPECT_TRUE(contains(said, "chromaticities")) << said;
  }
  if (const std::string said = said_by("oiiotool", " --info -v"); !said.empty()) {
    EXPECT_TRUE(contains(said, "motion.X")) << said;
  }
  run(0,
      {"render", "scene.json", "-f", "2", "-o", "two.exr", "--set", "image.aovs=P,id", "-j", "2"});
  EXPECT_TRUE(contains(run(0, {"info", "two.exr"}).out, "8 channels"));
  const Ran wrong =
      run(2, {"render", "scene.json", "-f", "2", "-o", "x.exr", "--set", "image.aovs=Z,albdo"});
  EXPECT_TRUE(contains(wrong.err, "did you mean \"albedo\"")) << wrong.err;
}

TEST_F(Products, ThePlanIsShown) {
  run(0, {"strip", "scene.json", "-c", "2", "-o", "scene.png"});
  run(0, {"strip", "scene.json", "-c", "2", "--show", "plan", "-o", "plan.png"});
  EXPECT_NE(read_text(folder / "scene.png"), read_text(folder / "plan.png"));
  const Ran ran = run(0, {"info", "scene.json", "--show", "plan", "-o", "ends.png"});
  for (const char* words : {" -> ", "  limbs ", "  certainty ", "  turn ", " pairs\n"})
    EXPECT_TRUE(contains(ran.out, words)) << ran.out;
  // Two cells of 32 and 3 gaps of 6 pixels.
  EXPECT_TRUE(contains(run(0, {"info", "ends.png"}).out, "ends.png: 82 x "));
  const auto json = parse(run(0, {"info", "scene.json", "--show", "plan", "--json"}).out);
  const auto& leg = json["actors"][0]["legs"][0];
  EXPECT_GE(leg["pairs"].get<int>(), leg["balls"][0].get<int>());
  for (const char* key : {"limbs", "turn_degrees", "strain", "landmarks"})
    EXPECT_TRUE(leg.contains(key)) << key;
  EXPECT_FALSE(json["actors"][0].contains("cycle"));
  render_frames();
  EXPECT_TRUE(contains(run(2, {"strip", "f.####.exr", "--show", "plan", "-o", "s.png"}).err,
                       "--show plan is for the sheet"));
  EXPECT_TRUE(contains(run(2, {"info", "f.0001.exr", "--show", "plan"}).err, "is for scenes"));
  EXPECT_TRUE(contains(run(2, {"info", "scene.json", "-o", "s.png"}).err, "add that"));
  EXPECT_TRUE(
      contains(run(4, {"info", "scene.json", "--show", "plan", "-o", "ends.png"}).err, "exists"));
}

TEST_F(Products, LabelsOfBothFilesDecideWhichLimbsMatch) {
  // Groups of the one model, and others of the second by the scene; without them nothing is
  // certain.
  const std::string models = (source_dir() / "scenes/models").string();
  write("labels.json", R"({"source": {"model": ")" + models + R"(/humanoid.obj"},
      "target": {"model": ")" +
                           models + R"(/penguin.obj"},
      "plan": {"labels": {"left_arm": "left_wing", "left_hand": "left_wing",
                          "right_arm": "right_wing", "right_hand": "right_wing"}},
      "spheres": {"balls": 96, "fit": "none"}})");
  const auto limbs = [&](const char* mode) {
    const std::string setting = std::string("plan.label_mode=") + mode;
    return parse(
        run(0, {"info", "labels.json", "--show", "plan", "--json", "--set", setting.c_str()})
            .out)["actors"][0]["legs"][0]["limbs"];
  };
  EXPECT_TRUE(limbs("off").empty());
  const auto matched = limbs("soft");
  const auto has = [&](const char* from, const char* to) {
    return contains(matched.dump(), std::string("[\"") + from + "\",\"" + to + "\"]");
  };
  EXPECT_TRUE(has("head", "head")) << matched.dump();
  EXPECT_TRUE(has("left arm", "back left limb")) << matched.dump();
  EXPECT_TRUE(has("right arm", "back right limb")) << matched.dump();
}

TEST_F(Products, ACycleOfPlansIsMeasured) {
  const std::string cube = R"({"shape": "cube", "spheres": {"balls": 12}})";
  const std::string sphere = R"({"shape": "sphere", "spheres": {"balls": 6}})";
  write("cycle.json", R"({"source": )" + cube + R"(, "intermediate": [)" + sphere +
                          R"(], "target": )" + cube + R"(, "surface": {"resolution": 16}})");
  const auto json = parse(run(0, {"info", "cycle.json", "--show", "plan", "--json"}).out);
  const auto& cycle = json["actors"][0]["cycle"];
  EXPECT_LT(cycle["drift"].get<double>(), 1);
  EXPECT_GT(cycle["spread"].get<double>(), 0);  // six balls hold the mass of twelve
  EXPECT_TRUE(contains(run(0, {"info", "cycle.json", "--show", "plan"}).out,
                       "Sent once around the cycle, mass returns "));
}

TEST_F(Products, StripNeedsFrames) {
  render_frames();
  EXPECT_TRUE(contains(run(3, {"strip", "g.####.exr", "-o", "s.png"}).err, "no such frames"));
  EXPECT_TRUE(contains(run(2, {"strip", "f.0001.exr", "-o", "s.png"}).err, "is one image"));
  write("f.0005.exr", "not an image");
  EXPECT_TRUE(contains(run(3, {"strip", "f.####.exr", "-o", "s.png"}).err, "f.0005.exr"));
  EXPECT_FALSE(exists("s.png"));
}

TEST_F(Products, MeshSaysThatItIsClosed) {
  for (const char* name : {"half.obj", "half.ply"}) {
    const Ran ran = run(
        0, {"mesh", "scene.json", "-f", "2", "-o", name, "--device", "cpu", "--progress", "none"});
    EXPECT_EQ(ran.err, "");
    const auto lines = lines_of(ran.out);
    ASSERT_EQ(lines.size(), 1u) << ran.out;
    EXPECT_TRUE(lines[0].starts_with(std::string(name) + " volume surface: ")) << lines[0];
    EXPECT_TRUE(contains(lines[0], " triangles, closed, genus 0, 1 part, ")) << lines[0];
    EXPECT_TRUE(contains(lines[0], ", digest ")) << lines[0];
  }
  EXPECT_TRUE(read_text(folder / "half.ply").starts_with("ply\n"));
  const auto info = parse(run(0, {"info", "half.obj", "--json"}).out);
  EXPECT_EQ(info["closed"], true);
  EXPECT_EQ(info["genus"], 0);
}

TEST_F(Products, MeshAsBalls) {
  const Ran ran = run(0, {"mesh", "scene.json", "-f", "2", "-o", "balls.json"});
  const auto json = parse(read_text(folder / "balls.json"));
  EXPECT_EQ(json["field"], "gaussian");
  EXPECT_GT(json["balls"].size(), 10u);
  EXPECT_EQ(ran.out, "balls.json " + std::to_string(json["balls"].size()) + " balls\n");
}

TEST_F(Products, MeshesOfSeveralFrames) {
  const Ran ran = run(0, {"mesh", "scene.json", "-f", "2-3", "-o", "m.obj"});
  EXPECT_TRUE(exists("m.0002.obj"));
  EXPECT_TRUE(exists("m.0003.obj"));
  EXPECT_EQ(lines_of(ran.out).size(), 2u);
  EXPECT_TRUE(contains(run(4, {"mesh", "scene.json", "-f", "3", "-o", "m.0003.obj"}).err,
                       "m.0003.obj: exists - add --overwrite"));
  // The frames where only the model shows give the model.
  EXPECT_TRUE(
      contains(run(0, {"mesh", "scene.json", "-f", "1", "-o", "first.obj"}).out, " model: "));
}

TEST_F(Products, SeveralActors) {
  write("two.json",
        R"({"actors": [{"source": "cube", "target": "sphere"},
                       {"name": "ring", "source": "torus", "target": "cube", "start": 5,
                        "translate": [3, 0, 0]}],
            "frames": {"count": 8}, "spheres": {"balls": 12}, "surface": {"resolution": 16},
            "image": {"width": 32, "height": 24, "samples": 1}})");
  EXPECT_TRUE(contains(run(0, {"check", "two.json"}).out, "two.json: ok, 4 objects, 8 frames"));
  const std::string info = run(0, {"info", "two.json"}).out;
  for (const char* text : {"  cube:\n", "  ring:\n", "torus -> cube: volume"})
    EXPECT_TRUE(contains(info, text)) << info;
  const Ran ran = run(0, {"mesh", "two.json", "-f", "4", "-o", "two.obj"});
  EXPECT_TRUE(contains(ran.out, "two.obj volume, look-out surface, model: ")) << ran.out;
  EXPECT_TRUE(contains(ran.out, "closed, ")) << ran.out;
  EXPECT_TRUE(contains(ran.out, ", 2 parts, ")) << ran.out;
  const auto labels = parse(run(0, {"info", "two.obj", "--json"}).out)["labels"];
  EXPECT_EQ(labels.dump(), R"(["cube","ring"])");
  const auto morphs = parse(run(0, {"analyze", "two.json", "-c", "3", "--json"}).out)["morphs"];
  ASSERT_EQ(morphs.size(), 2u);
  EXPECT_EQ(morphs[1]["actor"], "ring");
  EXPECT_EQ(morphs[1]["from"], "torus");
  run(0, {"render", "two.json", "-f", "6", "-o", "two.exr"});
  const auto image = parse(run(0, {"info", "two.exr", "--json"}).out);
  EXPECT_EQ(image["attributes"]["polymorph/stage"], "volume");
}

TEST_F(Products, PlyMeshesKnowWhatTheirVerticesBelongTo) {
  for (const char* frame : {"1", "2"}) {
    run(0, {"mesh", "scene.json", "-f", frame, "-o", "labels.ply", "--overwrite"});
    const std::string ply = read_text(folder / "labels.ply");
    EXPECT_TRUE(contains(ply, "comment label 0 cube\ncomment label 1 sphere\n")) << frame;
    EXPECT_TRUE(contains(ply, "\nproperty int label\n")) << frame;
  }
}

TEST_F(Products, StoppedBySignalLeavesNoParts) {
  write("long.json", tiny_scene(4000));
  const Started started = start({"mesh", "long.json", "-o", "m.####.obj"});
  for (int i = 0; i < 12000 && !exists("m.0003.obj"); ++i) ::usleep(10000);
  ASSERT_EQ(::kill(started.id, SIGTERM), 0);
  const Ran ran = finish(started);
  EXPECT_EQ(ran.code, 143) << ran.err;
  EXPECT_EQ(lines_of(ran.out).size(), count_files(".obj"));
  EXPECT_EQ(count_files(".part"), 0u);
}

TEST_F(Products, InfoOfAScene) {
  const Ran ran = run(0, {"info", "scene.json"});
  EXPECT_EQ(ran.err, "");
  EXPECT_TRUE(contains(ran.out, "scene.json: 4 frames at 24 fps, 32 x 24\n")) << ran.out;
  EXPECT_TRUE(contains(ran.out, "cube -> sphere: volume"));
  const Ran json = run(0, {"info", "scene.json", "--json", "--set", "image.samples=3"});
  EXPECT_EQ(parse(json.out)["image"]["samples"], 3);
  // What it prints is a scene again.
  write("again.json", json.out);
  run(0, {"check", "again.json"});
}

TEST_F(Products, InfoOfEveryFrame) {
  const Ran table = run(0, {"info", "scene.json", "--timeline"});
  EXPECT_EQ(lines_of(table.out).size(), 5u) << "a heading and four frames: " << table.out;
  const auto json = parse(run(0, {"info", "scene.json", "--timeline", "--json"}).out);
  EXPECT_EQ(json["stages"].size(), 5u);
  EXPECT_EQ(json["stages"][2]["name"], "volume");
  const auto& actor = json["actors"][0];
  ASSERT_EQ(actor["frames"].size(), 4u);
  EXPECT_EQ(actor["frames"][0]["mesh"], "cube");
  EXPECT_EQ(actor["frames"][3]["u"], 1.0);
  double shares = 0;
  for (const auto& share : actor["legs"][0]["shares"]) shares += share.get<double>();
  EXPECT_NEAR(shares, 1, 1e-5);
  write("tetra.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n");
  EXPECT_TRUE(contains(run(2, {"info", "tetra.obj", "--timeline"}).err, "is for scenes"));
}

TEST_F(Products, CubesAreTheTableOfMarchingCubes) {
  const auto json = parse(run(0, {"cubes", "--json"}).out);
  ASSERT_EQ(json["cubes"].size(), 256u);
  EXPECT_EQ(json["bases"].size(), 15u);
  for (std::size_t base = 0; base < 15; ++base)
    EXPECT_EQ(json["cubes"][json["bases"][base].get<std::size_t>()]["base"], base);
  // The report's example: four corners of one face, two triangles.
  EXPECT_EQ(json["cubes"][240]["inside"], nlohmann::json({0, 1, 2, 3}));
  EXPECT_EQ(json["cubes"][240]["triangles"].size(), 2u);
  EXPECT_EQ(lines_of(run(0, {"cubes", "240"}).out).size(), 2u);
  EXPECT_EQ(run(2, {"cubes", "256"}).out, "");
}

TEST_F(Products, InfoOfAModel) {
  write("tetra.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n");
  const Ran ran = run(0, {"info", "tetra.obj"});
  EXPECT_TRUE(contains(ran.out, "tetra.obj: 4 points, 4 triangles, 1 shell\n")) << ran.out;
  EXPECT_TRUE(contains(ran.out, "closed, genus 0"));
  EXPECT_EQ(parse(run(0, {"info", "tetra.obj", "--json"}).out)["triangles"], 4);
  run(3, {"info", "gone.obj"});
}

TEST_F(Products, InfoOfAnImage) {
  render_frames();
  const Ran ran = run(0, {"info", "f.0002.exr"});
  EXPECT_TRUE(contains(ran.out, "f.0002.exr: 32 x 24, ")) << ran.out;
  EXPECT_TRUE(contains(ran.out, "polymorph/frame = 2\n"));
  const auto json = parse(run(0, {"info", "f.0002.exr", "--json"}).out);
  EXPECT_EQ(json["width"], 32);
  EXPECT_EQ(json["channels"][0]["name"], "R");
  EXPECT_EQ(json["attributes"]["polymorph/stage"], "volume");
  write("text.exr", "not an image");
  const Ran bad = run(3, {"info", "text.exr"});
  EXPECT_TRUE(contains(bad.err, "text.exr: ")) << bad.err;
}

}  // namespace
}  // namespace polymorph
