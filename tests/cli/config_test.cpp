// --config and POLYMORPH_ variables: which setting wins, and what is refused.
#include "testing/program.h"

namespace polymorph {
namespace {

class Config : public ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    write("scene.json", tiny_scene());
    write(
        "c.toml",
        "# defaults\nthreads = 1\nprogress = \"none\"\n[render]\npng = true\nskip-existing = true\n"
        "set = [\"image.width=16\", \"image.height=8\"]\nframes = \"1-2\"\n[strip]\ncount = 3\n");
  }
  std::vector<int> frames(const Ran& ran) const {
    std::vector<int> all;
    const auto report = parse(ran.out);
    for (const auto& frame : report["frames"]) all.push_back(frame["frame"]);
    return all;
  }
};

TEST_F(Config, FillsInWhatTheCommandLineLeavesOpen) {
  const auto report = parse(run(0, {"render", "scene.json", "--config", "c.toml", "--json"}).out);
  EXPECT_EQ(report["threads"], 1);
  EXPECT_EQ(report["frames"].size(), 2u);
  EXPECT_TRUE(exists("frame.0001.png"));
  const auto image = parse(run(0, {"info", "frame.0001.png", "--json"}).out);
  EXPECT_EQ(image["width"], 16);
  EXPECT_EQ(image["height"], 8);
  variables = {{"POLYMORPH_CONFIG", "c.toml"}};
  EXPECT_EQ(frames(run(0, {"render", "scene.json", "-n", "--json"})), (std::vector<int>{1, 2}));
}

TEST_F(Config, TheCommandLineAndTheEnvironmentWin) {
  variables = {{"POLYMORPH_CONFIG", "c.toml"}, {"POLYMORPH_THREADS", "2"}};
  const Ran ran = run(0, {"render", "scene.json", "-f", "4", "--overwrite", "--json"});
  EXPECT_EQ(frames(ran), std::vector<int>{4});
  EXPECT_EQ(parse(ran.out)["threads"], 2);
  // --overwrite excludes the file's skip-existing, and is what was asked for.
  EXPECT_EQ(parse(run(0, {"render", "scene.json", "-f", "4", "--overwrite", "--json"})
                      .out)["frames"][0]["state"],
            "done");
}

TEST_F(Config, SetGoesBeforeWhatAPreviewSays) {
  const auto preview = [&](const std::string& name, const std::vector<std::string>& sets) {
    std::vector<std::string> render{"render", "scene.json", "--preview", "-f", "2", "-o", name};
    for (const std::string& set : sets) render.insert(render.end(), {"--set", set});
    run(0, render);
  };
  const auto compare = [&](int code, const std::string& name) {
    run(code,
        {"compare", "plain.exr", name, "--fail", "0", "--relative", "0", "--failpercent", "0"});
  };
  preview("plain.exr", {});
  preview("smooth.exr", {"image.smooth=true"});
  preview("noisy.exr", {"image.smooth=false"});
  preview("more.exr", {"image.samples=5"});
  compare(0, "smooth.exr");
  compare(1, "noisy.exr");
  compare(1, "more.exr");
}

TEST_F(Config, ADraftIsNearAPreview) {
  const auto render = [&](const std::string& kind, const std::string& name,
                          const std::vector<std::string>& more = {}) {
    std::vector<std::string> command{
        "render", "scene.json",      kind, "-f", "2-4", "-o", name, "--set", "image.width=160",
        "--set",  "image.height=120"};
    command.insert(command.end(), more.begin(), more.end());
    run(0, command);
  };
  render("--preview", "preview.####.png");
  render("--draft", "draft.####.png");
  run(0, {"compare", "preview.####.png", "draft.####.png", "--fail", "1", "--flip", "0.08"});
  run(1, {"compare", "preview.####.png", "draft.####.png"});
  // What --set says goes before it, as before --preview.
  render("--draft", "deep.####.png", {"--set", "image.max_depth=1"});
  run(1, {"compare", "draft.####.png", "deep.####.png"});
}

TEST_F(Config, TheCommandLineWinsOverTheEnvironment) {
  variables = {{"POLYMORPH_THREADS", "2"},        {"POLYMORPH_DEVICE", "abacus"},
               {"POLYMORPH_CACHE_DIR", "theirs"}, {"POLYMORPH_MAX_MEMORY", "1M"},
               {"POLYMORPH_PROGRESS", "json"},    {"POLYMORPH_COLOR", "always"}};
  const std::vector<std::string> given{"-t",           "1",    "--device",   "cpu",
                                       "--cache-dir",  "mine", "--progress", "lines",
                                       "--max-memory", "4G",   "--color",    "never"};
  for (std::vector<std::string> command :
       {std::vector<std::string>{"render", "scene.json", "-f", "2", "-o", "f.exr", "--json"},
        {"mesh", "scene.json", "-f", "2", "-o", "m.obj"},
        {"check", "scene.json"}}) {
    command.insert(command.end(), given.begin(), given.end());
    const Ran ran = run(0, command);
    EXPECT_FALSE(contains(ran.err, "\x1b[") || contains(ran.err, "{\"")) << ran.err;
    if (command[0] == "render") {
      EXPECT_EQ(parse(ran.out)["threads"], 1);
    }
  }
  EXPECT_TRUE(exists("mine"));
  EXPECT_FALSE(exists("theirs"));
}

/// POLYMORPH_CONFIG, POLYMORPH_DATA_DIR (demo_test) and POLYMORPH_OIDN (films_test) besides.
TEST_F(Config, EveryVariableOfTheEnvironmentCounts) {
  const std::vector<std::string> render{"render", "scene.json", "-f",     "1",
                                        "-o",     "f.exr",      "--json", "--overwrite"};
  const auto with = [&](const char* name, const std::string& value, int code,
                        const std::vector<std::string>& command) {
    variables = {{name, value}};
    const Ran ran = run(code, command);
    variables.clear();
    return ran;
  };
  EXPECT_EQ(parse(with("POLYMORPH_THREADS", "1", 0, render).out)["threads"], 1);
  EXPECT_EQ(parse(with("POLYMORPH_ISA", "sse2", 0, render).out)["isa"], "sse2");
  EXPECT_TRUE(contains(with("POLYMORPH_DEVICE", "abacus", 2, render).err, "abacus"));
  EXPECT_TRUE(contains(with("POLYMORPH_MAX_MEMORY", "1K", 5, render).err, "--max-memory"));
  EXPECT_TRUE(contains(with("POLYMORPH_HEARTBEAT", "often", 2, render).err, "often"));
  EXPECT_TRUE(contains(with("POLYMORPH_PROGRESS", "json", 0, render).err, "{\"frame\""));
  EXPECT_TRUE(contains(with("POLYMORPH_COLOR", "always", 1, {"check", "no.json"}).err, "\x1b["));
  EXPECT_TRUE(contains(with("POLYMORPH_LOG_FORMAT", "json", 1, {"check", "no.json"}).err, "{\""));
  with("POLYMORPH_LOG_FILE", "log.txt", 1, {"check", "no.json"});
  EXPECT_TRUE(contains(read_text(folder / "log.txt"), "no.json"));
  with("POLYMORPH_CACHE_DIR", "kept", 0, render);
  EXPECT_TRUE(exists("kept"));
  // Readers that are not there are missed only by what needs them.
  std::string bmp(58, '\0');  // a pixel of 24 bits
  bmp.replace(0, 3, "BM:");
  bmp[10] = 54, bmp[14] = 40, bmp[18] = bmp[22] = bmp[26] = 1, bmp[28] = 24, bmp[34] = 4;
  write("one.bmp", bmp);
  EXPECT_TRUE(
      contains(with("POLYMORPH_OIIO_MODULE", "/nowhere/oiio.so", 5, {"info", "one.bmp"}).err,
               "/nowhere/oiio.so"));
  write("one.stl", "solid\n");
  EXPECT_TRUE(contains(with("POLYMORPH_ASSIMP", "/nowhere/reader", 5, {"info", "one.stl"}).err,
                       "/nowhere/reader"));
}

TEST_F(Config, IsCheckedAsAWhole) {
  const auto refused = [&](const std::string& text, const std::string& part) {
    write("bad.toml", text);
    const Ran ran = run(2, {"render", "scene.json", "--config", "bad.toml"});
    EXPECT_TRUE(contains(ran.err, part)) << ran.err;
    EXPECT_EQ(count_files(".exr"), 0u);
  };
  refused("treads = 2\n", "bad.toml: treads: unknown option - did you mean \"threads\"?");
  refused("[rendr]\npng = true\n", "the section names no command - did you mean \"render\"?");
  refused("[strip]\ncolums = 2\n", "[strip] colums: unknown option - did you mean \"columns\"?");
  refused("[render]\nspp = 0\n", "[render] spp: ");
  refused("[render]\nframes = \"\"\n", "[render] frames: is empty");
  refused("threads = 1\nconfig = \"c.toml\"\n", "config: unknown option");
  EXPECT_TRUE(contains(run(2, {"render", "scene.json", "--config", "none.toml"}).err, "none.toml"));
}

}  // namespace
}  // namespace polymorph
