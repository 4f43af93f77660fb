// Command lines that cannot be meant, and help.
#include "base/program_identity.h"
#include "testing/program.h"

namespace polymorph {
namespace {

const std::vector<std::string> kCommands{"render", "strip", "mesh",  "check", "info",    "compare",
                                         "golden", "bench", "cache", "cubes", "devices", "schema"};

class Usage : public ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    write("scene.json", tiny_scene());
  }
  void expect_usage(const std::vector<std::string>& arguments, const std::string& part) {
    const Ran ran = run(2, arguments);
    EXPECT_EQ(ran.out, "");
    EXPECT_TRUE(ran.err.starts_with("error: ")) << ran.err;
    EXPECT_TRUE(contains(ran.err, part)) << ran.err;
    EXPECT_EQ(count_files(".exr"), 0u);
  }
};

TEST_F(Usage, UnknownCommandNamesTheNearest) {
  expect_usage({"rendr", "scene.json"}, "unknown command \"rendr\" - did you mean \"render\"?");
  expect_usage({"xyzzy"}, "try: polymorph --help");
}

TEST_F(Usage, UnknownFlag) {
  expect_usage({"render", "scene.json", "--framez"}, "--framez");
  expect_usage({"render", "scene.json", "--framez"}, "try: polymorph render --help");
  expect_usage({"golden", "new", "logo", "--framez"}, "try: polymorph golden new --help");
  expect_usage({"schema", "extra"}, "\"extra\" is one word too many - write polymorph schema");
  expect_usage({"cache", "ls", "x", "y"}, "\"x\" is one word too many");
  expect_usage({"render", "scene.json", "-z"}, "unknown option \"-z\"");
  expect_usage({"render", "scene.json", "--overwrite", "--skip-existing"}, "do not go together");
  expect_usage({"--threads", "2", "check", "scene.json"},
               "options come after the command: polymorph check --threads");
}

TEST_F(Usage, RetiredOptionsSayTheirNewNames) {
  expect_usage({"render", "scene.json", "--noise=0.01"}, "--noise is now --set image.noise=E");
  expect_usage({"strip", "scene.json", "--denoise"}, "--denoise is now --set image.denoise=true");
  expect_usage({"status", "out", "scene.json", "--aovs", "all"}, "--set image.aovs=LIST");
  expect_usage({"submit", "slurm", "scene.json", "--seed", "7"}, "--set image.seed=N");
  expect_usage({"golden", "test", "--isa", "sse2"}, "--isa is now the variable POLYMORPH_ISA");
  expect_usage({"golden", "accept", "report", "--only", "3"}, "--only is now --frames");
}

TEST_F(Usage, MissingArgument) {
  for (const std::string command : {"render", "check", "mesh"})
    expect_usage({command}, "SCENE is missing - write polymorph " + command + " SCENE\n");
  expect_usage({"info"}, "FILE is missing");
  expect_usage({"compare", "a.exr"},
               "REFERENCE is missing - write polymorph compare ACTUAL REFERENCE");
  expect_usage({"mesh", "scene.json"}, "give -o morph.usda");
  expect_usage({"render", "scene.json", "-o"}, "--output needs a value - write --output FILE");
  expect_usage({"strip", "scene.json"}, "nothing to make - give -o strip.png");
  expect_usage({"golden"},
               "VERB is missing (test, new, update, accept, merge, list, hash) - write "
               "polymorph golden VERB [SUITE]");
  expect_usage({"cache"}, "VERB is missing (ls, verify, gc, clear)");
  expect_usage({"cache", "gc"}, "cache gc needs a limit");
  expect_usage({"cache", "gc", "--max-size", "big"}, "--max-size big: not an amount");
  expect_usage({"cache", "gc", "--max-age", "-3d"}, "--max-age");
  expect_usage({"cache", "ls", "--max-size", "1G"},
               "cache ls takes no --max-size - that is for cache gc");
}

TEST_F(Usage, AnEmptyValueIsNoDefault) {
  for (const char* option : {"-f", "--frames", "-o", "--set", "--json", "--log-file", "--shard"})
    expect_usage({"render", "scene.json", option, ""},
                 std::string(option) + " \"\": is empty - give a value, or leave it out");
  expect_usage({"render", "scene.json", "--frames="}, "--frames=: is empty");
  expect_usage({"render", ""}, "error: \"\": is empty");
}

TEST_F(Usage, BadFrameList) {
  expect_usage({"render", "scene.json", "-f", "1-"}, "--frames 1-: \"1-\" is not a frame");
  expect_usage({"render", "scene.json", "-f", "one"}, "write 1-48, 1-48x2, 5-1 or 1,5,10-20");
  expect_usage({"render", "scene.json", "-f", "1-4x0"}, "has a bad step");
  expect_usage({"mesh", "scene.json", "-o", "m.obj", "-f", "0-3"},
               "frame 0 is outside the scene's 1-4");
  expect_usage({"strip", "scene.json", "-o", "s.png", "-f", "5"},
               "frame 5 is outside the scene's 1-4");
}

TEST_F(Usage, BadPattern) {
  expect_usage({"render", "scene.json", "-o", "f.#.exr"}, "a lone # is ambiguous - write ####");
  expect_usage({"render", "scene.json", "-o", "f.##.####.exr"}, "two places");
  expect_usage({"render", "scene.json", "-o", "out/"}, "names a folder");
  expect_usage({"render", "scene.json", "-o", "f.jpg"}, "unknown image format \".jpg\"");
  expect_usage({"mesh", "scene.json", "-o", "m.stl"}, "use .obj, .ply, .usda or .glb");
  expect_usage({"strip", "scene.json", "-o", "s.jpg"}, "unknown image format \".jpg\"");
}

TEST_F(Usage, TooFewDigits) {
  expect_usage({"render", "scene.json", "-o", "f.##.exr", "--set", "frames.count=100"},
               "2 digits are too few for 100 frames");
  run(0, {"render", "scene.json", "-o", "f.##.exr", "--set", "frames.count=99", "-n"});
}

TEST_F(Usage, BadDevice) {
  expect_usage({"render", "scene.json", "--device", "gpu"},
               "--device gpu: write cpu, cuda, cuda:1, cuda:all or auto");
  expect_usage({"render", "scene.json", "--device", "cuda:0,"}, "a device has no name");
  expect_usage({"render", "scene.json", "--device", "cuda:x"}, "--device cuda:x");
}

TEST_F(Usage, AbsentDeviceIsAResource) {
  variables = {{"CUDA_VISIBLE_DEVICES", ""}};  // the same on a machine with GPUs
  const auto list = parse(run(0, {"devices", "--json"}).out);
  EXPECT_TRUE(list["cuda"].empty());
  // What is missing, in the words of whoever must provide it.
  const std::string missing = !list["built_with_cuda"] ? "built without CUDA"
                              : contains(list["driver"], "no cuda driver")
                                  ? "no NVIDIA driver answers (is it installed and loaded?)"
                                  : "CUDA_VISIBLE_DEVICES=\"\" hides every GPU";
  const std::vector<std::vector<std::string>> commands{
      {"render", "scene.json", "--device", "cuda"},
      {"mesh", "scene.json", "--device", "cuda", "-o", "m.####.obj"},
      {"strip", "scene.json", "--device", "cuda", "-o", "strip.png"},
      {"analyze", "scene.json", "--device", "cuda"}};
  for (const auto& command : commands) {
    const Ran ran = run(5, command);
    EXPECT_EQ(ran.out, "");
    EXPECT_TRUE(contains(ran.err, "error: --device cuda: ")) << ran.err;
    EXPECT_TRUE(contains(ran.err, missing)) << ran.err;
    EXPECT_TRUE(contains(ran.err, " - use --device cpu or auto")) << ran.err;
  }
  EXPECT_EQ(count_files(".exr"), 0u);

  const auto notices = [&](const Ran& ran) {
    const auto lines = lines_of(ran.err);
    return std::count_if(lines.begin(), lines.end(), [&](const std::string& line) {
      return line.starts_with("device: cpu (no GPU is needed");
    });
  };
  const Ran ran = run(0, {"render", "scene.json", "-o", "a.####.exr", "--progress", "none"});
  EXPECT_EQ(notices(ran), 1) << ran.err;
  EXPECT_GT(count_files(".exr"), 0u);
  const Ran verbose =
      run(0, {"render", "scene.json", "-o", "v.####.exr", "--progress", "none", "-v"});
  EXPECT_TRUE(contains(verbose.err, "no GPU: ") && contains(verbose.err, missing)) << verbose.err;
  EXPECT_EQ(notices(run(0, {"render", "scene.json", "-o", "b.####.exr", "-q"})), 0);
  EXPECT_EQ(notices(run(0, {"render", "scene.json", "-o", "c.####.exr", "--device", "cpu"})), 0);
}

TEST_F(Usage, AFrameThatNeedsMoreMemoryThanAllowedSaysSo) {
  const std::vector<std::string> render{"render",   "scene.json", "-o",          "a.####.exr",
                                        "--device", "cpu",        "--max-memory"};
  const auto refused = [&](const char* limit, const std::vector<std::string>& more) {
    std::vector<std::string> arguments = render;
    arguments.push_back(limit);
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run(5, arguments).err;
  };
  const std::string scene = refused("300M", {"--set", "surface.resolution=256"});
  EXPECT_TRUE(contains(scene, "the scene needs about ")) << scene;
  EXPECT_TRUE(
      contains(scene,
               " of it for distances to the models, and the limit is 314.6 MB - use a lower "
               "surface.resolution, or raise --max-memory"))
      << scene;
  // Told before anything is loaded or taken: this one would be 77 GB.
  const std::string picture =
      refused("8G", {"--set", "image.width=32768", "--set", "image.height=32768", "-j", "1"});
  EXPECT_TRUE(contains(picture, "2 pictures at once of 32768 x 32768 need 77.3 GB")) << picture;
  EXPECT_TRUE(contains(picture, "the limit is 8.6 GB - lower image.width")) << picture;
  EXPECT_EQ(count_files(".exr"), 0u);
}

TEST_F(Usage, TheEstimateOfMemoryIsNearWhatIsTaken) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "sanitizers take memory of their own";
#endif
  for (const char* resolution : {"16", "96"}) {
    const std::vector<std::string> scene{"scene.json", "--set",
                                         std::string("surface.resolution=") + resolution};
    std::vector<std::string> check{"check", "--json"},
        render{"render", "-o", "m.####.exr", "-f",          "2-3",    "--device",
               "cpu",    "-j", "1",          "--overwrite", "--json", "--no-cache"};
    check.insert(check.begin() + 1, scene.begin(), scene.end());
    render.insert(render.begin() + 1, scene.begin(), scene.end());
    const auto said = parse(run(0, check).out)["memory_bytes"].get<double>();
    const auto taken = parse(run(0, render).out)["peak_memory_bytes"].get<double>();
    EXPECT_GT(said, 0.8 * taken) << resolution;
    EXPECT_LT(said, 1.6 * taken) << resolution;
    render.insert(render.end(), {"--dry-run"});
    EXPECT_NEAR(parse(run(0, render).out)["estimate"]["memory_bytes"].get<double>(), said,
                0.01 * said);
  }
}

TEST_F(Usage, AModelsFileThatIsLargerThanMemoryIsNotRead) {
  write("scene.json", R"({"source": "large.obj", "target": "cube"})");
  write("large.obj", "");
  std::filesystem::resize_file(folder / "large.obj", 1u << 30);  // of nothing
  const Ran ran = run(5, {"render", "scene.json", "-o", "f.exr", "--max-memory", "500M"});
  EXPECT_TRUE(contains(ran.err,
                       "large.obj: reading it takes at least 1.1 GB of memory, and the "
                       "limit is 524.3 MB"))
      << ran.err;
  const Ran check = run(1, {"check", "scene.json", "--max-memory", "500M"});
  EXPECT_TRUE(contains(check.err, "large.obj: reading it takes at least 1.1 GB")) << check.err;
}

TEST_F(Usage, BadSet) {
  expect_usage({"render", "scene.json", "--set", "image"}, "--set image: write KEY=VALUE");
  expect_usage({"info", "scene.json", "--set", "=3"}, "--set =3: write KEY=VALUE");
  expect_usage({"check", "scene.json", "--set", "image..width=3"}, "--set image..width");
  expect_usage({"render", "scene.json", "--set", "image.width=wide"},
               "--set /image/width: must be a number (is a string)");
  expect_usage({"render", "scene.json", "--set", "image.width=0"}, "must be 1 to 32768 (is 0)");
  expect_usage({"mesh", "scene.json", "-o", "m.obj", "--set", "imge.width=3"},
               "--set /imge: unknown key - did you mean \"image\"?");
}

TEST_F(Usage, BadValues) {
  expect_usage({"render", "scene.json", "--spp", "0"},
               "--spp: 0 is not a whole number from 1 to 65536");
  expect_usage({"render", "scene.json", "-t", "x"}, "--threads");
  expect_usage({"render", "scene.json", "--shard", "3/2"}, "write i/N with 1 <= i <= N");
  expect_usage({"render", "scene.json", "--shard", "auto"}, "neither a Slurm array");
  expect_usage({"render", "scene.json", "--overwrite", "--skip-existing"}, "do not go together");
  expect_usage({"render", "scene.json", "--progress", "loud"}, "--progress");
  expect_usage({"golden", "shine"},
               "golden \"shine\" - use test, new, update, accept, merge, list, hash");
  expect_usage({"bench", "nothing"}, "bench \"nothing\" - use surface, report, render, all");
}

/// Every option that takes a number: not a number, infinite, too large for its type, out of range.
TEST_F(Usage, NumbersAreFiniteAndInRange) {
  const std::vector<std::vector<std::string>> of_reals{
      {"compare", "a.exr", "b.exr", "--fail"},
      {"compare", "a.exr", "b.exr", "--relative"},
      {"compare", "a.exr", "b.exr", "--failpercent"},
      {"compare", "a.exr", "b.exr", "--hardfail"},
      {"compare", "a.exr", "b.exr", "--depth"},
      {"compare", "a.exr", "b.exr", "--normal"},
      {"compare", "a.exr", "b.exr", "--flip"},
      {"compare", "a.exr", "b.exr", "--flip-p99"},
      {"compare", "a.exr", "b.exr", "--warn"},
      {"compare", "a.exr", "b.exr", "--warnpercent"},
      {"strip", "scene.json", "--fps"},
      {"spheres", "cube", "--error"},
      {"render", "scene.json", "--max-memory"},
      {"cache", "gc", "--max-size"},
      {"cache", "gc", "--max-age"}};
  const std::vector<std::vector<std::string>> of_whole{
      {"render", "scene.json", "--spp"},     {"render", "scene.json", "--jobs"},
      {"render", "scene.json", "--threads"}, {"strip", "scene.json", "--count"},
      {"strip", "scene.json", "--columns"},  {"strip", "scene.json", "--width"},
      {"spheres", "cube", "--balls"},        {"spheres", "cube", "--resolution"},
      {"spheres", "cube", "--grid"},         {"spheres", "cube", "--width"},
      {"analyze", "scene.json", "--count"},  {"bench", "surface", "--torus"},
      {"bench", "surface", "--grid"},        {"bench", "surface", "--spp"},
      {"bench", "surface", "--repeats"},     {"cubes"},
      {"render", "scene.json", "--frames"},  {"render", "scene.json", "--shard"},
      {"render", "scene.json", "--device"}};
  const auto refuse = [&](std::vector<std::string> arguments, const std::string& value) {
    const std::string option = arguments.back();
    const bool named = option.starts_with("--");
    named ? arguments.back() += "=" + value : arguments.emplace_back(value);
    const Ran ran = run(2, arguments);
    EXPECT_EQ(ran.out, "");
    EXPECT_TRUE(ran.err.starts_with("error: ")) << ran.err;
    EXPECT_TRUE(!named || contains(ran.err, option)) << ran.err;
  };
  for (const auto& arguments : of_reals)
    for (const char* value : {"nan", "inf", "-1", "1e999", "1,5", "0x10", ""})
      refuse(arguments, value);
  for (const auto& arguments : of_whole)
    for (const char* value : {"nan", "99999999999999999999", "1.5"}) refuse(arguments, value);
  variables = {{"POLYMORPH_THREADS", "nan"}};
  expect_usage({"info", "scene.json"}, "--threads");
}

class Help : public ProgramTest {};

TEST_F(Help, AloneIsUsage) {
  const Ran ran = run(2, {});
  EXPECT_EQ(ran.out, "");
  EXPECT_TRUE(contains(ran.err, "Start here:")) << ran.err;
  EXPECT_TRUE(contains(ran.err, " demo")) << ran.err;
  EXPECT_TRUE(contains(ran.err, "--help lists all commands")) << ran.err;
}

TEST_F(Help, Version) {
  for (const char* flag : {"--version", "-V"}) {
    const Ran ran = run(0, {flag});
    EXPECT_EQ(ran.out, "polymorph " + std::string(program_version()) + "\n");
    EXPECT_EQ(ran.err, "");
  }
}

TEST_F(Help, VersionSaysWhatAReportOfABugNeeds) {
  const std::string text = run(0, {"version"}).out;
  EXPECT_TRUE(text.starts_with("polymorph " + std::string(program_version()) + "\nbuild   "))
      << text;
  for (const char* part : {"GNU", "\nwith    Embree 3.", ", OpenEXR 3.", "\ncpu     ", " thread"})
    EXPECT_TRUE(contains(text, part)) << part << "\n" << text;
  const auto json = parse(run(0, {"version", "--json"}).out);
  EXPECT_EQ(json["version"], std::string(program_version()));
  EXPECT_FALSE(json["build"].get<std::string>().empty());
  EXPECT_EQ(json["devices"]["cpu"], parse(run(0, {"devices", "--json"}).out)["cpu"]);
}

TEST_F(Help, HelpIsACommand) {
  EXPECT_EQ(run(0, {"help"}).out, run(0, {"--help"}).out);
  for (const char* command : {"render", "help", "golden"})
    EXPECT_EQ(run(0, {"help", command}).out, run(0, {command, "--help"}).out) << command;
  const Ran unknown = run(2, {"help", "rendr"});
  EXPECT_TRUE(contains(unknown.err, "unknown command \"rendr\" - did you mean \"render\"?"))
      << unknown.err;
}

TEST_F(Help, WhatOnlyPrintsListsNoOptionsOfWork) {
  for (const char* option :
       {"--device", "--max-memory", "--cache-dir", "--no-cache", "--overwrite"}) {
    for (const char* command : {"cubes", "schema", "devices", "version", "help", "completion"})
      EXPECT_FALSE(contains(run(0, {command, "--help"}).out, option)) << command << option;
    EXPECT_TRUE(contains(run(0, {"render", "--help"}).out, option)) << option;
  }
  run(0, {"cubes", "--device", "cpu", "--overwrite"});  // as scripts for all commands may have it
}

TEST_F(Help, SchemaListsWhatSetTakes) {
  const std::vector<std::string> lines = lines_of(run(0, {"schema", "--keys"}).out);
  for (const char* line :
       {"camera.fov=", "look.kind=metal", "ground.enabled=false",
        "target.rotate=", "motion.easing=spring", "target.shape=torus", "image.aovs=albedo"})
    EXPECT_NE(std::find(lines.begin(), lines.end(), line), lines.end()) << line;
  for (const std::string& line : lines) EXPECT_TRUE(contains(line, "=")) << line;
}

TEST_F(Help, ListsEveryCommand) {
  for (const char* flag : {"--help", "-h"}) {
    const Ran ran = run(0, {flag});
    EXPECT_EQ(ran.err, "");
    for (const std::string& command : kCommands)
      EXPECT_TRUE(contains(ran.out, "\n  " + command + " ")) << command;
  }
}

TEST_F(Help, FitsInEightyColumns) {
  std::vector<std::vector<std::string>> all{{"--help"}, {"-h"}};
  for (const std::string& command : kCommands) {
    all.push_back({command, "--help"});
    all.push_back({command, "-h"});
  }
  for (const auto& arguments : all) {
    const Ran ran = run(0, arguments);
    EXPECT_EQ(ran.err, "");
    for (const std::string& line : lines_of(ran.out)) {
      EXPECT_LE(line.size(), 80u) << line;
      EXPECT_FALSE(line.ends_with(' ')) << line;
    }
  }
}

TEST_F(Help, EachVerbHasAPageWithItsOwnOptions) {
  struct Page {
    const char *command, *verb;
    std::vector<std::string> has, lacks;
  };
  const Page pages[] = {
      {"golden",
       "test",
       {"--report", "--junit", "--bits", "--device"},
       {"--any-program", "--reason"}},
      {"golden", "new", {"NAME SCENE", "--frames", "--device"}, {"--report", "--any-program"}},
      {"golden", "update", {"--reason", "--device"}, {"--report", "--frames"}},
      {"golden", "accept", {"REPORT", "--any-program", "--frames"}, {"--junit", "--device"}},
      {"golden", "merge", {"REPORT...", "--output"}, {"--root", "--reason"}},
      {"golden", "list", {"--root"}, {"--report", "--reason", "--device"}},
      {"golden", "hash", {"--root", "--threads"}, {"--report", "--reason"}},
      {"cache", "ls", {"--json", "--cache-dir"}, {"--max-size", "--device"}},
      {"cache", "verify", {"--json", "--cache-dir"}, {"--max-size", "--device"}},
      {"cache", "gc", {"--max-size", "--max-age"}, {"--device"}},
      {"cache", "clear", {"--cache-dir"}, {"--max-size"}},
  };
  const std::string reference = run(0, {"manual", "commands"}).out;
  for (const Page& page : pages) {
    const std::string name = std::string(page.command) + " " + page.verb;
    const std::string text = run(0, {page.command, page.verb, "--help"}).out;
    EXPECT_EQ(run(0, {"help", page.command, page.verb}).out, text) << name;
    for (const std::string& part : {"Usage: polymorph " + name, std::string("Examples:\n"),
                                    "  polymorph " + name, std::string("Exit codes:\n")})
      EXPECT_TRUE(contains(text, part)) << name << ": " << part;
    for (const std::string& line : lines_of(text)) EXPECT_LE(line.size(), 80u) << line;
    for (const std::string& option : page.has)
      EXPECT_TRUE(contains(text, option)) << name << option;
    for (const std::string& option : page.lacks)
      EXPECT_FALSE(contains(text, option)) << name << option;
    EXPECT_TRUE(contains(reference, "\n### " + name + "\n")) << name;
    EXPECT_TRUE(contains(run(0, {page.command, "--help"}).out, "\n  " + std::string(page.verb)));
    const std::string brief = run(0, {page.command, "-h"}).out;
    EXPECT_TRUE(contains(brief, "\n  " + std::string(page.verb)));
    EXPECT_FALSE(contains(brief, "--device")) << "options of every command: " << brief;
  }
  EXPECT_TRUE(contains(run(2, {"help", "golden", "acept"}).err, "did you mean \"golden accept\""));
}

TEST_F(Help, BeginsWithExamplesAndEndsWithExitCodes) {
  for (const std::string& command : kCommands) {
    const std::string brief = run(0, {command, "-h"}).out, full = run(0, {command, "--help"}).out;
    for (const std::string& text : {brief, full}) {
      EXPECT_TRUE(contains(text, "\n\nUsage: polymorph " + command + " ")) << text;
      EXPECT_TRUE(contains(text, "\n\nExamples:\n  polymorph " + command)) << text;
    }
    EXPECT_FALSE(contains(brief, "Exit codes:"));
    const auto codes = full.rfind("\n\nExit codes:\n  0 ");
    ASSERT_NE(codes, std::string::npos) << full;
    EXPECT_EQ(full.find("\n\n", codes + 2), std::string::npos) << "something follows: " << full;
    EXPECT_TRUE(contains(full, "--threads N"));
  }
}

/// OpenImageIO takes 0.3 s to load: only the module that is opened on first use may need it.
TEST_F(Help, DoesNotLoadOpenImageIO) {
  variables = {{"LD_DEBUG", "libs"}};
  const Ran ran = run(0, {"--help"});
  EXPECT_TRUE(contains(ran.err, "libembree3")) << "LD_DEBUG says nothing here";
  EXPECT_FALSE(contains(ran.err, "OpenImageIO"));
  EXPECT_FALSE(contains(ran.err, "polymorph_oiio"));
}

TEST_F(Help, SchemaIsTheCommittedOne) {
  const Ran ran = run(0, {"schema"});
  EXPECT_EQ(ran.err, "");
  EXPECT_EQ(ran.out, read_text(source_dir() / "scenes" / "scene.schema.json"))
      << "run: polymorph schema > scenes/scene.schema.json";
}

TEST_F(Help, DevicesListsTheProcessor) {
  const Ran ran = run(0, {"devices"});
  EXPECT_EQ(ran.err, "");
  EXPECT_TRUE(ran.out.starts_with("cpu ")) << ran.out;
  EXPECT_TRUE(contains(ran.out, "\ncuda")) << ran.out;
  const auto json = parse(run(0, {"devices", "--json", "-t", "1"}).out);
  EXPECT_EQ(json["cpu"]["threads"], 1);
  EXPECT_TRUE(json["cuda"].is_array());
}

TEST_F(Help, BenchMeasures) {
  const Ran ran = run(0, {"bench", "surface", "--grid", "16", "--torus", "50", "--repeats", "1",
                          "--device", "cpu"});
  const auto between = ran.out.find("\nbetween objects 16^3"),
             balls = ran.out.find("\nsurface gaussian 16^3");
  EXPECT_NE(balls, std::string::npos) << ran.out;
  EXPECT_LT(between, balls) << ran.out;
  EXPECT_TRUE(contains(ran.out, "500 pairs, ")) << ran.out;
  EXPECT_EQ(ran.err, "");
  const Ran rays = run(0, {"bench", "render", "--grid", "16", "--torus", "50", "--repeats", "1",
                           "--spp", "1", "--device", "cpu"});
  EXPECT_TRUE(contains(rays.out, "M paths/s"));
  EXPECT_FALSE(contains(rays.out, "between objects"));
  EXPECT_TRUE(contains(rays.out, "BVH quality"));
}

TEST_F(Usage, AMemoryLimitEndsWithAMessageAndCodeFive) {
  const std::vector<std::string> bench = {"bench",     "surface", "--grid",   "96",
                                          "--repeats", "1",       "--device", "cpu"};
  std::vector<std::string> tight = bench, roomy = bench;
  tight.insert(tight.end(), {"--max-memory", "500K"});
  roomy.insert(roomy.end(), {"--max-memory", "1G"});
  const Ran ran = run(5, tight);
  EXPECT_TRUE(contains(ran.err, "the limit is 1 MB")) << ran.err;
  run(0, roomy);
  expect_usage({"bench", "surface", "--max-memory", "lots"}, "max-memory");
}

TEST_F(Usage, AModelIsNoScene) {
  write("m.obj", "v 0 0 0\n");
  const Ran ran = run(3, {"render", "m.obj", "-o", "x.png"});
  EXPECT_TRUE(contains(ran.err, "m.obj: is a model, not a scene - ")) << ran.err;
  EXPECT_TRUE(contains(ran.err, "polymorph init m.obj OTHER")) << ran.err;
  const Ran strip = run(3, {"strip", "m.obj", "-o", "s.png"});
  EXPECT_TRUE(contains(strip.err, "m.obj: is a model, not a scene - ")) << strip.err;
}

TEST_F(Usage, StatsAreSaidThoughTheRestIsQuiet) {
  write("scene.json", tiny_scene());
  const Ran ran = run(0, {"render", "scene.json", "-o", "f.####.png", "-f", "1", "-q", "--stats"});
  EXPECT_TRUE(contains(ran.err, "peak memory")) << ran.err;
  EXPECT_FALSE(contains(ran.err, "rendered")) << ran.err;
}

TEST_F(Usage, ProgressAsJsonHasNoOtherLines) {
  write("scene.json", tiny_scene());
  const Ran ran = run(0, {"render", "scene.json", "-o", "f.####.png", "--progress", "json"});
  for (const std::string& line : lines_of(ran.err)) EXPECT_TRUE(parse(line).is_object()) << line;
}

TEST_F(Usage, ProgressForOpenJobDescription) {
  write("scene.json", tiny_scene());
  const Ran ran =
      run(0, {"render", "scene.json", "-o", "f.####.png", "-f", "1-2", "--progress", "openjd"});
  std::vector<std::string> messages;
  for (const std::string& line : lines_of(ran.err))
    if (line.starts_with("openjd_")) messages.push_back(line);
  EXPECT_EQ(messages, (std::vector<std::string>{
                          "openjd_progress: 50.0", "openjd_status: frame 1 ok, 1 of 2",
                          "openjd_progress: 100.0", "openjd_status: frame 2 ok, 2 of 2"}));
  const Ran failed = run(3, {"render", "nowhere.json", "-o", "f.####.png", "--progress", "openjd"});
  EXPECT_TRUE(contains(failed.err, "\nopenjd_fail: ")) << failed.err;
  EXPECT_TRUE(contains(failed.err, "nowhere.json")) << failed.err;
}

TEST_F(Usage, ReportsSayWhatMadeThem) {
  write("scene.json", tiny_scene());
  const std::vector<std::vector<std::string>> commands{
      {"check", "scene.json", "--json"},
      {"cache", "ls", "--json"},
      {"spheres", "cube", "--balls", "4", "--json"},
      {"devices", "--json"},
      {"render", "scene.json", "-n", "--json"}};
  for (const auto& command : commands)
    EXPECT_TRUE(parse(run(0, command).out).contains("version")) << command[0];
}

}  // namespace
}  // namespace polymorph
