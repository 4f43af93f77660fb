// demo, init and the program alone: what newcomers do first.
#include <cstdio>

#include "testing/program.h"

namespace polymorph {
namespace {

class Demo : public ProgramTest {
 protected:
  /// A data folder with one model.
  void use_small_models() {
    write("data/models/lump.obj",
          "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
    write("data/effects/flat.json",
          R"({"description": "By way of a puddle.", "source": {"model": "../models/lump.obj"},
              "intermediate": [{"shape": "puddle", "meta": true}], "target": "torus",
              "look": {"kind": "metal"}, "frames": {"count": 99}})");
    write("data/effects/tied.json",
          R"({"source": "cube", "target": "torus", "plan": {"labels": {"cube": "torus"}}})");
    variables = {{"POLYMORPH_DATA_DIR", (folder / "data").string()}};
  }

  /// Runs a demo of few, small frames.
  Ran small_demo(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "demo");
    for (const char* set : {"frames.count=12", "spheres.balls=12", "surface.resolution=16",
                            "image.width=48", "image.height=36", "image.samples=1"})
      arguments.insert(arguments.end(), {"--set", set});
    return run(0, arguments);
  }
};

TEST_F(Demo, TheProgramAloneSaysWhatToDoFirst) {
  const Ran ran = run(2, {});
  EXPECT_EQ(ran.out, "");
  EXPECT_TRUE(contains(ran.err, "Start here:\n  " + program_path().string() + " demo\n"))
      << ran.err;
  EXPECT_TRUE(contains(ran.err, " init first.obj second.obj")) << ran.err;
  EXPECT_TRUE(contains(ran.err, " --help lists all commands.")) << ran.err;
  const auto help = lines_of(run(0, {"--help"}).out);
  const auto examples = std::find(help.begin(), help.end(), "Examples:");
  ASSERT_NE(examples, help.end());
  EXPECT_TRUE(contains(*(examples + 1), "polymorph demo"));
}

TEST_F(Demo, MakesAStripAGifAndTheSceneItPrints) {
  use_small_models();
  const Ran ran = small_demo({"lump", "sphere", "-o", "it's here"});
  const std::string scene = read_text(folder / "it's here/scene.json");
  EXPECT_EQ(ran.out, scene);
  EXPECT_TRUE(contains(scene, "// start of the morph")) << scene;
  EXPECT_TRUE(read_text(folder / "it's here/morph.gif").starts_with("GIF89a"));
  EXPECT_TRUE(read_text(folder / "it's here/strip.png").starts_with("\x89PNG"));
  // What it suggests is one word to a shell, whatever the folder is called.
  EXPECT_TRUE(contains(ran.err, " check 'it'\\''s here/scene.json'\n")) << ran.err;
  EXPECT_TRUE(contains(ran.err, " -o 'it'\\''s here/frame.####.exr' --png")) << ran.err;
  // The folder can be taken elsewhere with the models: no path is of this machine.
  EXPECT_TRUE(contains(scene, "\"source\": \"../data/models/lump.obj\"")) << scene;
  EXPECT_FALSE(contains(scene, folder.string())) << scene;
  run(0, {"check", "it's here/scene.json"});
  EXPECT_TRUE(contains(run(4, {"demo", "lump", "sphere", "-o", "it's here"}).err, "exists"));
}

TEST_F(Demo, ItsLastLinesSayWhatToDo) {
  use_small_models();
  const std::string command = "cd '" + folder.string() + "' && POLYMORPH_DATA_DIR=data '" +
                              program_path().string() +
                              "' demo lump sphere --set image.samples=1 --set frames.count=12 "
                              "--set surface.resolution=16 2>&1";
  FILE* const pipe = ::popen(command.c_str(), "r");  // both streams into one
  ASSERT_NE(pipe, nullptr);
  std::string both;
  for (int c = std::fgetc(pipe); c != EOF; c = std::fgetc(pipe)) both += static_cast<char>(c);
  EXPECT_EQ(::pclose(pipe), 0) << both;
  const std::vector<std::string> lines = lines_of(both);
  ASSERT_GT(lines.size(), 3u) << both;
  EXPECT_TRUE(contains(lines.back(), " render lump-sphere/scene.json -o ")) << both;
  EXPECT_TRUE(
      contains(both.substr(both.find("made lump-sphere/morph.gif")), "edit the scene, then"))
      << both;
  EXPECT_LT(both.find("\"surface\""), both.find("made lump-sphere/morph.gif")) << both;
}

TEST_F(Demo, TakesAFolderOrTheNameOfOneOfItsFiles) {
  use_small_models();
  small_demo({"lump", "sphere", "-o", "to/d1.png"});
  EXPECT_TRUE(read_text(folder / "to/d1.png").starts_with("\x89PNG"));
  EXPECT_TRUE(read_text(folder / "to/d1.gif").starts_with("GIF89a"));
  EXPECT_TRUE(contains(read_text(folder / "to/d1.json"), "lump.obj"));
  EXPECT_TRUE(contains(run(4, {"demo", "lump", "cube", "-o", "to/d1.gif"}).err, "exists"));
  EXPECT_TRUE(contains(run(2, {"demo", "lump", "cube", "-o", "d2.mp4"}).err, "name a folder"));
  EXPECT_FALSE(exists("d2.mp4"));
  small_demo({"lump", "cube", "-o", "v1.2"});
  EXPECT_TRUE(exists("v1.2/scene.json"));
}

TEST_F(Demo, GoesThroughEffectsAndObjects) {
  use_small_models();
  small_demo({"lump", "cube", "--through", "flat"});
  const auto json = parse(run(0, {"info", "lump-flat-cube/scene.json", "--json"}).out);
  const auto actor = json["actors"][0];
  EXPECT_EQ(actor["intermediate"][0]["shape"], "puddle");
  EXPECT_TRUE(actor["intermediate"][0]["meta"]);
  // Its end that is a shape belongs to the effect; the one that is a model does not.
  EXPECT_EQ(actor["intermediate"].size(), 2u);
  EXPECT_EQ(actor["intermediate"][1]["shape"], "torus");
  EXPECT_EQ(actor["target"]["shape"], "cube");
  EXPECT_EQ(json["look"]["kind"], "metal");
  EXPECT_NE(json["frames"]["count"], 99);
}

TEST_F(Demo, SettingsAreThoseOfTheSceneItWrites) {
  use_small_models();
  const std::string scene = small_demo({"lump", "sphere", "-o", "d"}).out;
  EXPECT_TRUE(contains(scene, "\"samples\": 1,\n")) << scene;
  EXPECT_EQ(parse(run(0, {"info", "d/scene.json", "--json"}).out)["image"]["width"], 48);
  // What no scene takes leaves no file.
  EXPECT_TRUE(contains(run(2, {"demo", "lump", "sphere", "-o", "e", "--set", "image"}).err,
                       "write KEY=VALUE"));
  EXPECT_TRUE(contains(run(3, {"demo", "lump", "sphere", "-o", "e", "--set", "image.widht=9"}).err,
                       "did you mean \"width\"?"));
  EXPECT_FALSE(exists("e/scene.json"));
}

TEST_F(Demo, NamesWhatItKnows) {
  use_small_models();
  const Ran list = run(0, {"demo", "--list"});
  EXPECT_EQ(list.out,
            "models:\n  lump\neffects, for --through:\n"
            "  flat                 By way of a puddle.\n");
  EXPECT_TRUE(contains(run(2, {"demo", "lamp"}).err,
                       "model \"lamp\" is not known - did you mean \"lump\"?"));
  EXPECT_TRUE(contains(run(2, {"demo", "lump", "cube", "--through", "flit"}).err,
                       "effect \"flit\" is not known - did you mean \"flat\"?"));
  variables = {{"POLYMORPH_DATA_DIR", (folder / "nowhere").string()}};
  EXPECT_TRUE(contains(run(5, {"demo"}).err, "nowhere: No such file"));
}

TEST_F(Demo, FindsItsModelsFromTheBuildFolder) {
  const Ran list = run(0, {"demo", "--list"});
  for (const char* name : {"teapot", "penguin", "monkey", "torus", "spider", "humanoid"})
    EXPECT_TRUE(contains(list.out, std::string("  ") + name + "\n")) << list.out;
  for (const char* name : {"puddle", "explosion", "spring", "melt"})
    EXPECT_TRUE(contains(list.out, std::string("  ") + name + " ")) << list.out;
  EXPECT_FALSE(contains(list.out, "  limbs ")) << list.out;
}

class Init : public ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    for (const char* name : {"models/a b.obj", "models/b.obj", "models/c.obj"})
      write(name, "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
  }
};

TEST_F(Init, WritesACommentedSceneThatIsGood) {
  const Ran ran = run(0, {"init", "models/a b.obj", "models/b.obj", "-o", "scenes/one.json"});
  EXPECT_EQ(ran.out, "scenes/one.json\n");
  EXPECT_TRUE(contains(ran.err, " check scenes/one.json\n")) << ran.err;
  const std::string scene = read_text(folder / "scenes/one.json");
  EXPECT_TRUE(contains(scene, "\"source\": \"../models/a b.obj\",\n")) << scene;
  EXPECT_TRUE(contains(scene, "// width in pixels; 1 to 32768\n    \"width\": 640,\n")) << scene;
  run(0, {"check", "scenes/one.json"});
  // The schema is found from there.
  const auto document = nlohmann::json::parse(scene, nullptr, false, true);  // with comments
  const auto schema = document["$schema"].get<std::string>();
  EXPECT_TRUE(schema.starts_with("../")) << schema;
  EXPECT_TRUE(exists("scenes/" + schema)) << schema;
  // All of its values are the defaults, but the output's.
  write("scenes/bare.json",
        R"({"source": "../models/a b.obj", "target": "../models/b.obj", "frames": {"count": 24},
            "output": {"file": "out/frame.####.exr", "png": true}})");
  EXPECT_EQ(run(0, {"info", "scenes/one.json", "--json"}).out,
            run(0, {"info", "scenes/bare.json", "--json"}).out);
  // What is commented out works as it stands.
  std::string more = scene;
  const auto at = more.find("//   \"intermediate\": ");
  ASSERT_NE(at, std::string::npos) << scene;
  write("scenes/more.json", more.erase(at, 2));
  const auto json = parse(run(0, {"info", "scenes/more.json", "--json"}).out);
  EXPECT_EQ(json["actors"][0]["intermediate"][0]["shape"], "puddle");
}

TEST_F(Init, TakesModelsOfOtherFormats) {
  const std::string glb = (source_dir() / "tests/data/models/box.glb").string();
  run(0, {"init", "models/b.obj", glb});
  run(0, {"check", "scene.json"});
}

TEST_F(Init, TakesObjectsOnTheWayAndReplacesNothing) {
  run(0, {"init", "models/a b.obj", "models/b.obj", "models/c.obj"});
  const auto json = parse(run(0, {"info", "scene.json", "--json"}).out);
  EXPECT_EQ(json["actors"][0]["intermediate"][0]["model"], "models/b.obj");
  EXPECT_EQ(json["frames"]["count"], 48);
  EXPECT_TRUE(contains(run(4, {"init", "models/b.obj", "models/c.obj"}).err, "exists"));
  EXPECT_TRUE(contains(run(3, {"init", "models/b.obj", "models/d.obj", "-o", "x.json"}).err,
                       "models/d.obj: no such file"));
  write("models/notes.txt", "not a model");
  EXPECT_TRUE(contains(run(3, {"init", "models/b.obj", "models/notes.txt", "-o", "x.json"}).err,
                       "models/notes.txt: is no model file - use OBJ, glTF"));
  EXPECT_TRUE(contains(run(2, {"init", "models/b.obj"}).err, "models"));
  EXPECT_FALSE(exists("x.json"));
}

}  // namespace
}  // namespace polymorph
