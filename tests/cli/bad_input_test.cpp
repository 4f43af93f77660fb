// Bad models, scenes and outputs: the message names the file and what to do, the exit code says
// whose fault it is.
#include "testing/program.h"

namespace polymorph {
namespace {

constexpr const char* kPoints = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n";
constexpr const char* kFaces = "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n";

class BadModel : public ProgramTest {
 protected:
  /// Renders (exit code 3, nothing made) and checks (1) a scene whose source is `model`; both must
  /// say `parts` on standard error.
  void expect_refused(const std::string& model, const std::vector<std::string>& parts) {
    write("scene.json", tiny_scene(2, '"' + model + '"'));
    const Ran rendered = run(3, {"render", "scene.json", "-o", "f.####.exr", "--device", "cpu"});
    EXPECT_EQ(rendered.out, "");
    EXPECT_EQ(count_files(".exr"), 0u);
    const Ran checked = run(1, {"check", "scene.json"});
    EXPECT_TRUE(checked.out.ends_with("scene.json: 1 error, 0 warnings\n")) << checked.out;
    for (const Ran& ran : {rendered, checked}) {
      // After what takes seconds on a busy machine, which is said.
      EXPECT_TRUE(contains('\n' + ran.err, "\nerror: ")) << ran.err;
      for (const std::string& part : parts) EXPECT_TRUE(contains(ran.err, part)) << ran.err;
    }
  }
};

TEST_F(BadModel, Missing) {
  expect_refused("gone.obj", {"scene.json:2:13: /source: no such file: ", "gone.obj",
                              "paths are relative to the scene file"});
}

TEST_F(BadModel, Directory) {
  std::filesystem::create_directories(folder / "folder.obj");
  expect_refused("folder.obj", {"scene.json:2:13: /source: ", "folder.obj is a directory"});
}

TEST_F(BadModel, Empty) {
  write("m.obj", "");
  expect_refused("m.obj", {"m.obj: no faces (0 vertices)", "export the model with its faces"});
}

TEST_F(BadModel, Binary) {
  write("m.obj", std::string("\x7f\x45LF\0\1\2\3", 8) + kPoints);
  expect_refused("m.obj", {"m.obj: is not text (byte 0x00 at offset 4)"});
}

TEST_F(BadModel, IndexOutOfRange) {
  write("m.obj", std::string(kPoints) + "f 1 2 9\n");
  expect_refused("m.obj", {"m.obj:5: vertex index 9 is beyond the 4 of the file"});
}

TEST_F(BadModel, RelativeIndexBeforeTheStart) {
  write("m.obj", std::string(kPoints) + "f 1 2 -7\n");
  expect_refused("m.obj", {"m.obj:5: relative vertex index -7 reaches before the start"});
}

TEST_F(BadModel, NanCoordinate) {
  write("m.obj", std::string("v 0 0 nan\n") + kPoints + kFaces);
  expect_refused("m.obj", {"m.obj:1: vertex number 3 \"nan\" is not a finite number"});
}

TEST_F(BadModel, NoFaces) {
  write("m.obj", kPoints);
  expect_refused("m.obj", {"m.obj: no faces (4 vertices)"});
}

TEST_F(BadModel, MissingTextureIsAWarningUnlessStrict) {
  write("m.mtl", "newmtl red\nKd 1 0 0\nmap_Kd gone.png\n");
  write("m.obj", std::string("mtllib m.mtl\nusemtl red\nvt 0 0\nvt 1 0\nvt 0 1\n") + kPoints +
                     "f 1/1 3/2 2/3\nf 1/1 2/2 4/3\nf 2/1 3/2 4/3\nf 1/1 4/2 3/3\n");
  write("scene.json", tiny_scene(2, "\"m.obj\""));
  const std::string part = "m.mtl:3: map_Kd \"gone.png\" is not there - put it beside the model";
  const std::vector<std::string> render{"render", "scene.json", "-o", "f.####.exr", "-q"};
  std::vector<std::string> strictly = render;
  strictly.emplace_back("--strict");
  const Ran strict = run(3, strictly);
  EXPECT_TRUE(contains(strict.err, part)) << strict.err;
  EXPECT_TRUE(contains(strict.err, "error: scene.json: 1 warning about its files")) << strict.err;
  EXPECT_EQ(count_files(".exr"), 0u);
  const Ran rendered = run(0, render);
  EXPECT_TRUE(rendered.err.starts_with("warning: ")) << rendered.err;
  EXPECT_TRUE(contains(rendered.err, part + " or remove the line; a default grey is used"));
  EXPECT_EQ(count_files(".exr"), 2u);
  EXPECT_TRUE(contains(run(0, {"check", "scene.json"}).err, part));
  run(1, {"check", "scene.json", "--strict"});
}

TEST_F(BadModel, MissingMtlIsAWarningOnly) {
  write("m.obj", std::string("mtllib gone.mtl\nusemtl red\n") + kPoints + kFaces);
  write("scene.json", tiny_scene(2, "\"m.obj\""));
  const Ran rendered = run(0, {"render", "scene.json", "-o", "f.####.exr", "-q"});
  EXPECT_TRUE(rendered.err.starts_with("warning: ")) << rendered.err;
  EXPECT_TRUE(contains(rendered.err, "m.obj:1: mtllib \"gone.mtl\" is not there"));
  EXPECT_EQ(count_files(".exr"), 2u);
  run(0, {"check", "scene.json"});
  const Ran strict = run(1, {"check", "scene.json", "--strict"});
  EXPECT_TRUE(contains(strict.out, "scene.json: 0 errors, 1 warning\n")) << strict.out;
}

class BadScene : public ProgramTest {
 protected:
  void expect_refused(const std::string& text, const std::vector<std::string>& parts) {
    write("scene.json", text);
    const Ran rendered = run(3, {"render", "scene.json", "-o", "f.####.exr"});
    EXPECT_EQ(rendered.out, "");
    const Ran checked = run(1, {"check", "scene.json"});
    for (const Ran& ran : {rendered, checked})
      for (const std::string& part : parts) EXPECT_TRUE(contains(ran.err, part)) << ran.err;
  }
};

TEST_F(BadScene, SyntaxErrorShowsThePlace) {
  expect_refused("{\"source\": \"cube\",\n \"target\" \"sphere\"}\n",
                 {"error: scene.json:2:", "expected ':'", "  |  \"target\" \"sphere\"}\n", "^"});
}

TEST_F(BadScene, DuplicateKey) {
  expect_refused("{\"source\": \"cube\",\n \"source\": \"cube\", \"target\": \"sphere\"}",
                 {"scene.json:2:2: duplicate key \"source\" (first on line 1)"});
}

TEST_F(BadScene, UnknownKeyNamesTheNearest) {
  expect_refused(R"({"source": "cube", "target": "sphere", "surfce": 1})",
                 {"scene.json:1:40: /surfce: unknown key - did you mean \"surface\"?"});
}

TEST_F(BadScene, OutOfRange) {
  expect_refused(tiny_scene(2, "\"cube\"", "  \"camera\": {\"fov\": 200},\n"),
                 {"scene.json:6:21: /camera/fov: must be 1 to 150 (is 200)"});
}

/// What only the models tell: check says it as render does.
TEST_F(BadScene, LabelsAndLandmarksThatNoObjectHas) {
  const auto scene = [](const std::string& plan) {
    return tiny_scene(2, "\"cube\"", "  \"plan\": {" + plan + "},\n");
  };
  expect_refused(scene(R"("labels": {"tail": "wing"})"), {"tail"});
  expect_refused(
      scene(R"("landmarks": {"cube": {"top": [0, 2, 0]}, "sphere": {"top": [0, 100, 0]}})"),
      {"scene.json:6:", "/plan/landmarks/sphere/top: (0, 100, 0) is ",
       " times the size of sphere away from its surface, which reaches from (-1, 0, -1) to (1, 2, "
       "1)"});
  expect_refused(scene(R"("landmarks": {"cube": {"top": "v99999"}, "sphere": {"top": [0, 2, 0]}})"),
                 {"/plan/landmarks/cube/top: is vertex 99999, but cube has "});
  expect_refused(scene(R"("landmarks": {"cube": {"a": [0, 2, 0], "b": [0, 2, 0.002]},
                       "sphere": {"a": [1, 1, 0], "b": [0, 2, 0]}})"),
                 {"scene.json:6:", "/plan/landmarks/cube/b: is in the same place as \"a\""});
  write("scene.json",
        scene(R"("landmarks": {"cube": {"top": [0, 2, 0]}, "sphere": {"top": "v1"}})"));
  run(0, {"check", "scene.json"});
}

TEST_F(BadScene, Empty) { expect_refused("", {"scene.json: is empty"}); }

TEST_F(BadScene, NotAnObject) {
  expect_refused("[1]", {"scene.json:1:1: a scene must be an object"});
}

TEST_F(BadScene, TooDeep) {
  expect_refused(std::string(100000, '['), {"scene.json:1:", "nested deeper than 64 levels"});
}

TEST_F(BadScene, Missing) {
  for (const char* command : {"render", "info"}) {
    const Ran ran = run(3, {command, "gone.json"});
    EXPECT_EQ(ran.out, "");
    EXPECT_TRUE(contains(ran.err, "gone.json: cannot read: No such file or directory")) << ran.err;
    EXPECT_TRUE(contains(ran.err, folder.string())) << ran.err;
  }
  run(1, {"check", "gone.json"});
}

TEST_F(BadScene, ThreeMistakesAreAllReported) {
  write("scene.json",
        "{\n  \"source\": \"cube\",\n  \"target\": \"gone.obj\",\n  \"framez\": {\"count\": 4},\n"
        "  \"image\": {\"width\": 0}\n}\n");
  const Ran checked = run(1, {"check", "scene.json"});
  EXPECT_EQ(checked.out, "scene.json: 3 errors, 0 warnings\n");
  const auto lines = lines_of(checked.err);
  ASSERT_EQ(lines.size(), 3u) << checked.err;
  EXPECT_TRUE(lines[0].starts_with("error: scene.json:3:13: /target: no such file: ")) << lines[0];
  EXPECT_EQ(lines[1], "error: scene.json:4:3: /framez: unknown key - did you mean \"frames\"?");
  EXPECT_EQ(lines[2], "error: scene.json:5:22: /image/width: must be 1 to 32768 (is 0)");

  const Ran json = run(1, {"check", "scene.json", "--json"});
  const auto report = parse(json.out);
  EXPECT_EQ(report["ok"], false);
  ASSERT_EQ(report["findings"].size(), 3u);
  EXPECT_EQ(report["findings"][2]["pointer"], "/image/width");
  EXPECT_EQ(report["findings"][2]["line"], 5);

  const Ran rendered = run(3, {"render", "scene.json"});
  EXPECT_EQ(rendered.err, checked.err);
  EXPECT_EQ(rendered.out, "");
}

TEST_F(BadScene, GoodSceneIsDescribed) {
  write("scene.json", tiny_scene());
  const Ran ran = run(0, {"check", "scene.json", "--progress", "none"});
  EXPECT_EQ(ran.err, "");
  EXPECT_TRUE(contains(ran.out, "closed, genus 0"));
  EXPECT_TRUE(contains(ran.out, "scene.json: ok, 2 objects, 4 frames, about ")) << ran.out;
}

class BadOutput : public ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    write("scene.json", tiny_scene(2));
  }
  void expect_refused(const std::vector<std::string>& arguments, const std::string& part) {
    const Ran ran = run(4, arguments);
    EXPECT_EQ(ran.out, "");
    EXPECT_TRUE(contains(ran.err, part)) << ran.err;
    EXPECT_EQ(count_files(".part"), 0u);
  }
};

TEST_F(BadOutput, FolderInTheWay) {
  std::filesystem::create_directories(folder / "f.0001.exr");
  expect_refused({"render", "scene.json", "-o", "f.####.exr"},
                 "f.0001.exr: cannot write: Is a directory");
  expect_refused({"render", "scene.json", "-o", "f.####.exr", "--overwrite"},
                 "f.0001.exr: cannot write: Is a directory - a folder of that name is in the way");
}

TEST_F(BadOutput, ParentIsAFile) {
  for (const std::vector<std::string>& arguments :
       {std::vector<std::string>{"render", "scene.json", "-o", "scene.json/f.####.exr"},
        {"mesh", "scene.json", "-f", "1", "-o", "scene.json/m.obj"},
        {"strip", "scene.json", "-o", "scene.json/strip.png"}})
    expect_refused(arguments, "Not a directory - a part of the path is a file, not a folder");
}

TEST_F(BadOutput, PlaceThatTakesNoFiles) {
  for (const std::vector<std::string>& arguments :
       {std::vector<std::string>{"render", "scene.json", "-o", "/proc/f.####.exr"},
        {"mesh", "scene.json", "-f", "2", "-o", "/proc/m.obj"},
        {"strip", "scene.json", "-o", "/proc/strip.png"},
        {"check", "scene.json", "--json", "/proc/report.json"}})
    expect_refused(arguments, "cannot write: ");
}

TEST_F(BadOutput, NameTooLong) {
  expect_refused({"render", "scene.json", "-o", std::string(300, 'n') + ".####.exr"},
                 "cannot write: File name too long");
}

TEST_F(BadOutput, FullStandardOutputIsNoSuccess) {
  out_file = "/dev/full";
  for (const std::vector<std::string>& arguments :
       {std::vector<std::string>{"schema"}, {"info", "scene.json"}, {"--help"}, {"--version"}}) {
    const Ran ran = run(4, arguments);
    EXPECT_TRUE(contains(ran.err, "standard output: cannot write")) << ran.err;
  }
}

}  // namespace
}  // namespace polymorph
