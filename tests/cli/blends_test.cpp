// Blends of objects by weights, through the program: render, order, two objects and one, the other
// commands, mistakes.
#include "testing/program.h"

namespace polymorph {
namespace {

class Blends : public ProgramTest {
 protected:
  /// A scene of small frames. `chain`: its objects.
  void write_scene(const std::string& name, const std::string& chain, int frames = 3) const {
    write(name, "{" + chain + R"(,
      "frames": {"count": )" +
                    std::to_string(frames) + R"(},
      "spheres": {"balls": 8, "fit": "none"}, "surface": {"resolution": 16},
      "image": {"width": 40, "height": 30, "samples": 1, "aovs": "all"}})");
  }
  Ran render(const std::string& scene, const std::string& output) {
    return run(0, {"render", scene, "-o", output, "--png"});
  }
  /// The pixels of a PNG, as they are packed, without its header.
  std::string pixels(const std::string& file) const {
    const std::string png = read_text(folder / file);
    const std::size_t data = png.find("IDAT");
    EXPECT_NE(data, std::string::npos) << file;
    return data == std::string::npos ? "" : png.substr(data);
  }

  const std::string kCube = R"({"shape": "cube", "color": "#c04030", "weight": )",
                    kSphere = R"({"shape": "sphere", "color": "#3040c0", "weight": )",
                    kTorus = R"({"shape": "torus", "color": "#30c040", "weight": )";
  static std::string keys(double a, double b, double c) {
    return R"({"easing": "linear", "keys": [{"frame": 1, "value": )" + std::to_string(a) +
           R"(}, {"frame": 2, "value": )" + std::to_string(b) + R"(}, {"frame": 3, "value": )" +
           std::to_string(c) + "}]}}";
  }
};

TEST_F(Blends, AnyOrderOfThreeObjectsRendersTheSameFrames) {
  const std::string cube = kCube + keys(1, 1, 0), sphere = kSphere + keys(0, 1, 1),
                    torus = kTorus + keys(0, 2, 0);
  write_scene("one.json", R"("blend": [)" + cube + "," + sphere + "," + torus + "]");
  write_scene("other.json", R"("blend": [)" + torus + "," + cube + "," + sphere + "]");
  const Ran ran = render("one.json", "one.####.exr");
  EXPECT_TRUE(contains(ran.err, "3 frames rendered")) << ran.err;
  EXPECT_TRUE(contains(run(0, {"info", "one.json", "--timeline"}).out, "sphere 0.25, torus 0.5"));
  render("other.json", "other.####.exr");
  for (const char* frame : {"0001", "0002", "0003"})
    EXPECT_EQ(pixels("one." + std::string(frame) + ".png"),
              pixels("other." + std::string(frame) + ".png"));
  run(0, {"compare", "one.####.exr", "other.####.exr", "--fail", "0", "--hardfail", "0"});
  EXPECT_NE(pixels("one.0001.png"), pixels("one.0002.png"));
  // Frames are known by their weights: nothing is to be done again, but where one changes.
  const Ran again =
      run(0, {"render", "other.json", "-o", "one.####.exr", "--png", "--skip-existing"});
  EXPECT_TRUE(contains(again.err, "0 frames rendered")) << again.err;
  EXPECT_TRUE(contains(run(0, {"reproduce", "one.0002.exr"}).out, "same bits"));
}

TEST_F(Blends, AnObjectWithAllTheWeightIsShownItself) {
  const std::string three = R"("blend": [)" + kCube + "1}," + kSphere + "0}," + kTorus + "0}]";
  write_scene("whole.json", three);
  write_scene("morph.json", R"("source": {"shape": "cube", "color": "#c04030"},
    "target": {"shape": "sphere", "color": "#3040c0"}, "camera": {"position": [0, 1, 5]})");
  const Ran info = run(0, {"info", "whole.json", "--timeline"});
  EXPECT_TRUE(contains(info.out, "cube 1")) << info.out;
  run(0, {"mesh", "whole.json", "-f", "1", "-o", "whole.obj"});
  run(0, {"mesh", "morph.json", "-f", "1", "-o", "morph.obj"});
  const auto points = [](const std::string& text) {
    std::string list;
    for (std::size_t at = 0; (at = text.find("\nv ", at)) != std::string::npos; ++at)
      list += text.substr(at, text.find('\n', at + 1) - at);
    return list;
  };
  EXPECT_FALSE(points(read_text(folder / "whole.obj")).empty());
  EXPECT_EQ(points(read_text(folder / "whole.obj")), points(read_text(folder / "morph.obj")));
}

TEST_F(Blends, TwoObjectsAreTheMorphBetweenThem) {
  write_scene("morph.json", R"("source": {"shape": "cube", "color": "#c04030"},
    "target": {"shape": "sphere", "color": "#3040c0"}, "motion": {"easing": "linear"})",
              5);
  render("morph.json", "morph.####.exr");
  // The weights in any unit, the list in any order. Mattes know the actor by its name.
  write_scene("two.json",
              R"("actors": [{"name": "cube", "blend": [)" + kSphere +
                  R"({"easing": "linear", "keys": [
    {"frame": 1, "value": 0}, {"frame": 5, "value": 4}]}}, )" +
                  kCube + R"({"easing": "linear", "keys": [
    {"frame": 1, "value": 4}, {"frame": 5, "value": 0}]}}]}])",
              5);
  render("two.json", "two.####.exr");
  run(0, {"compare", "morph.####.exr", "two.####.exr", "--fail", "0", "--hardfail", "0"});
  for (int frame = 1; frame <= 5; ++frame)
    EXPECT_EQ(pixels("morph.000" + std::to_string(frame) + ".png"),
              pixels("two.000" + std::to_string(frame) + ".png"));
}

TEST_F(Blends, OtherCommandsTakeThem) {
  write_scene("three.json", R"("blend": [)" + kCube + keys(1, 1, 0) + "," + kSphere +
                                keys(0, 1, 1) + "," + kTorus + keys(0, 2, 0) + "]");
  run(0, {"check", "three.json"});
  EXPECT_TRUE(contains(run(0, {"info", "three.json"}).out, "blend"));
  const std::string plan = run(0, {"info", "three.json", "--show", "plan"}).out;
  EXPECT_TRUE(contains(plan, "cube -> torus")) << plan;
  EXPECT_TRUE(contains(plan, "Sent once around cube, sphere and torus, mass returns ")) << plan;
  run(0, {"strip", "three.json", "-c", "3", "-o", "strip.png"});
  run(0, {"strip", "three.json", "--show", "plan", "-c", "3", "-o", "plan.png"});
  run(0, {"mesh", "three.json", "-o", "film.ply", "-f", "2"});
  run(0, {"mesh", "three.json", "-o", "film.usda"});
  EXPECT_TRUE(contains(run(0, {"analyze", "three.json"}).out, "frame 1 -> frame 3"));
  run(0, {"landmarks", "three.json"});
  run(0, {"render", "three.json", "-o", "blur.png", "-f", "2", "--set", "camera.shutter=0.5"});
  run(0, {"mesh", "three.json", "--html", "page.html"});
  EXPECT_TRUE(contains(read_text(folder / "page.html"), "\"space\""));
  EXPECT_TRUE(
      contains(run(3, {"mesh", "three.json", "--topology", "constant", "-o", "one.glb"}).err,
               "one mesh goes through a morph between two"));
}

TEST_F(Blends, TheirPlansAreMoreConsistentOverTheReference) {
  write("plan.json", R"({"blend": [{"shape": "cube", "weight": 1}, {"shape": "sphere", "weight": 1},
    {"shape": "torus", "weight": 1}], "spheres": {"balls": 32}, "surface": {"resolution": 16}})");
  const auto json = parse(run(0, {"info", "plan.json", "--show", "plan", "--json"}).out);
  const auto& cycles = json["actors"][0]["cycles"];
  ASSERT_EQ(cycles.size(), 1u);
  EXPECT_EQ(cycles[0]["objects"], parse(R"(["cube", "sphere", "torus"])"));
  const auto& over = cycles[0]["by_reference"];
  const auto& between = cycles[0]["by_plan_between"];
  EXPECT_GT(over["spread"].get<double>(), 0);
  EXPECT_LT(over["drift"].get<double>(), between["drift"].get<double>()) << cycles.dump();
}

TEST_F(Blends, MistakesStopBeforeTheWork) {
  write_scene("zero.json", R"("blend": [)" + kCube + keys(1, 0, 1) + "," + kSphere + keys(1, 0, 0) +
                               "," + kTorus + "0}]");
  const std::string problem = "all weights are 0 in frame 2";
  EXPECT_TRUE(contains(run(1, {"check", "zero.json"}).err, problem));
  EXPECT_TRUE(contains(run(3, {"render", "zero.json", "-o", "zero.####.png"}).err, problem));
  write("sheet.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n");
  write_scene("shell.json", R"("blend": [)" + kCube + "1}," + kSphere + "1}," +
                                R"({"model": "sheet.obj", "weight": 1}])");
  EXPECT_TRUE(contains(run(3, {"render", "shell.json", "-o", "shell.png", "-f", "1"}).err,
                       "sheet: is a shell or a vessel"));
}

}  // namespace
}  // namespace polymorph
