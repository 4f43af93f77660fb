// Golden suites beside testing: hashes, accepting a run, other programs' frames, masks, merged
// reports.
#include <cmath>

#include "image/image_io.h"
#include "testing/program.h"

namespace polymorph {
namespace {

class GoldenTest : public ProgramTest {
 protected:
  void make_suite() const {
    write("scenes/tiny.json", tiny_scene());
    write("golden_frames/tiny/suite.json",
          R"({"scene": "../../scenes/tiny.json", "frames": [1, 3]})");
  }
  void change_scene() const {
    write("scenes/tiny.json", tiny_scene(4, R"({"shape": "torus", "spheres": {"balls": 12}})"));
  }
  void write_picture(const std::string& name, float level, int width = 16) const {
    Image image = make_image(width, 16, {"R", "G", "B"});
    for (float& v : image.pixels) v = 0.4f;
    for (int i = 0; i < 12; ++i) image.pixels[static_cast<std::size_t>(i)] = level;
    const auto bytes = encode_png(image);
    ASSERT_TRUE(bytes);
    write(name, *bytes);
  }
};

TEST_F(GoldenTest, OneHashForEveryInstructionSet) {
  make_suite();
  const std::string wanted = run(0, {"golden", "hash"}).out;
  const std::vector<std::string> lines = lines_of(wanted);
  ASSERT_EQ(lines.size(), 2u) << wanted;
  EXPECT_EQ(lines[0].find("  tiny/frame.0001"), 64u) << wanted;
  int supported = 0;
  for (const char* isa : {"sse2", "sse4.2", "avx", "avx2", "avx512"}) {
    variables = {{"POLYMORPH_ISA", isa}};
    const Ran ran = run({"golden", "hash", "tiny"});
    variables.clear();
    if (ran.code == 5) continue;  // this processor lacks it
    EXPECT_EQ(ran.code, 0) << ran.err;
    EXPECT_EQ(ran.out, wanted) << isa;
    ++supported;
  }
  EXPECT_GE(supported, 1);
  // Of a scene: its first, middle and last frame.
  const auto scene = lines_of(run(0, {"golden", "hash", "scenes/tiny.json"}).out);
  ASSERT_EQ(scene.size(), 3u);
  EXPECT_EQ(scene[0], lines[0]);
}

TEST_F(GoldenTest, ARunsFramesAreAcceptedWithoutRendering) {
  make_suite();
  run(0, {"golden", "update", "tiny", "--reason", "first"});
  change_scene();
  run(1, {"golden", "test", "--report", "out"});
  const std::string golden = "golden_frames/tiny/frame.0003.exr";
  const std::string before = read_text(folder / golden);
  const auto accept = [&](int code, std::vector<std::string> more) {
    more.insert(more.begin(), {"golden", "accept"});
    return run(code, more);
  };
  EXPECT_TRUE(contains(accept(2, {"out"}).err, "--reason"));
  EXPECT_TRUE(contains(accept(2, {"--reason", "x"}).err, "needs the report"));
  EXPECT_TRUE(contains(accept(3, {"golden_frames", "--reason", "x"}).err, "no report.json"));
  // The scene is another one than the report's.
  write("scenes/tiny.json", tiny_scene());
  EXPECT_TRUE(contains(accept(3, {"out", "--reason", "x"}).err, "from another scene"));
  change_scene();
  // A frame that is not what the run wrote.
  const std::string kept = read_text(folder / "out/frames/tiny/frame.0003.actual.exr");
  write("out/frames/tiny/frame.0003.actual.exr", kept + " ");
  EXPECT_TRUE(contains(accept(3, {"out", "--reason", "x"}).err, "not the file that the run wrote"));
  EXPECT_EQ(read_text(folder / golden), before) << "all or nothing";
  write("out/frames/tiny/frame.0003.actual.exr", kept);
  // Another program's report.
  const std::string report = read_text(folder / "out/report.json");
  std::string other = report;
  other.replace(other.find("\"program\": \"") + 12, 3, "???");
  write("out/report.json", other);
  EXPECT_TRUE(contains(accept(3, {"out", "--reason", "x"}).err, "another program"));
  write("out/report.json", report);

  EXPECT_TRUE(contains(accept(3, {"out", "--reason", "x", "-f", "7"}).err, "no failed frame"));
  const Ran one = accept(0, {"out", "--reason", "a torus", "-f", "3"});
  EXPECT_TRUE(contains(one.out, "frame.0003.exr")) << one.out;
  EXPECT_FALSE(contains(one.out, "frame.0001.exr")) << one.out;
  EXPECT_EQ(read_text(folder / golden), kept);
  ASSERT_EQ(
      std::system(("cd '" + folder.string() + "' && tar czf out.tar.gz out && rm -r out").c_str()),
      0);
  accept(0, {"out.tar.gz", "--reason", "a torus"});
  const std::string changes = read_text(folder / "golden_frames/tiny/CHANGES.md");
  const std::string entry = ": a torus\n";
  EXPECT_TRUE(contains(changes, entry)) << changes;
  EXPECT_EQ(changes.find(entry), changes.rfind(entry)) << "one reason, one line\n" << changes;
  run(0, {"golden", "test"});
}

TEST_F(GoldenTest, AFailureSaysWhatChanged) {
  make_suite();
  run(0, {"golden", "update", "tiny", "--reason", "first"});
  std::string scene = tiny_scene();
  scene.replace(scene.find('{'), 1, R"({"lights": {"key_intensity": 4.5}, )");
  write("scenes/tiny.json", scene);
  const auto json = parse(run(1, {"golden", "test", "--json"}).out);
  EXPECT_EQ(json["cases"][0]["cause"], "only light differs");
}

TEST_F(GoldenTest, FramesOfAnotherProgram) {
  write("golden_frames/other/suite.json",
        R"({"command": "cp picture{frame}.png {out}", "format": "png", "frames": [0, 2]})");
  write_picture("golden_frames/other/picture0.png", 0.4f);
  write_picture("golden_frames/other/picture2.png", 0.8f);
  run(0, {"golden", "update", "other", "--reason", "first"});
  EXPECT_EQ(read_text(folder / "golden_frames/other/frame.0002.png"),
            read_text(folder / "golden_frames/other/picture2.png"));
  EXPECT_FALSE(exists("golden_frames/other/surface.csv"));
  run(0, {"golden", "test"});
  write_picture("golden_frames/other/picture0.png", 0.1f);
  const Ran changed = run(1, {"golden", "test", "--report", "out", "--failures", "out/frames"});
  EXPECT_TRUE(contains(changed.out, "other frame 0: FAILED: ")) << changed.out;
  run(0, {"golden", "accept", "out", "--reason", "darker"});
  run(0, {"golden", "test"});
  write("golden_frames/other/suite.json", R"({"command": "false {out}", "frames": [1]})");
  EXPECT_TRUE(contains(run(3, {"golden", "test"}).err, "exit code 1"));
  write("golden_frames/other/suite.json", R"({"command": "true", "frames": [1]})");
  EXPECT_TRUE(contains(run(3, {"golden", "test"}).err, "{out}"));
}

TEST_F(GoldenTest, MaskedPixelsMayDiffer) {
  const std::string command =
      R"("command": "cp picture.png {out}", "format": "png", "frames": [1])";
  write("golden_frames/other/suite.json", "{" + command + "}");
  write_picture("golden_frames/other/picture.png", 0.4f);
  run(0, {"golden", "update", "other", "--reason", "first"});
  write_picture("golden_frames/other/picture.png", 0.9f);
  run(1, {"golden", "test"});
  Image mask = make_image(16, 16, {"R", "G", "B"});
  for (int i = 0; i < 12; ++i) mask.pixels[static_cast<std::size_t>(i)] = 1;
  const auto bytes = encode_png(mask);
  ASSERT_TRUE(bytes);
  write("golden_frames/other/mask.png", *bytes);
  write("golden_frames/other/suite.json",
        "{" + command +
            R"(, "masks": [{"file": "mask.png", "why": "a clock"}], "max_masked_percent": 2})");
  const auto json = parse(run(0, {"golden", "test", "--json"}).out);
  EXPECT_TRUE(contains(json["cases"][0]["reason"], "1.56 % masked")) << json["cases"][0]["reason"];
  EXPECT_TRUE(contains(run(0, {"golden", "test"}).out, "other frame 1: ok, 1.56 % masked\n"));
  EXPECT_FALSE(contains(json["notes"].dump(), "mask.png")) << "a mask is no orphan";
  write_picture("golden_frames/other/mask.png", 1, 8);
  EXPECT_TRUE(contains(run(3, {"golden", "test"}).err, "the frames have 16 x 16"));
  write("golden_frames/other/suite.json", "{" + command + R"(, "masks": [{"file": "mask.png"}]})");
  EXPECT_TRUE(contains(run(3, {"golden", "test"}).err, "no reason"));
}

TEST_F(GoldenTest, MasksThatCoverEverythingFail) {
  const std::string command =
      R"("command": "cp picture.png {out}", "format": "png", "frames": [1])";
  write("golden_frames/other/suite.json", "{" + command + "}");
  write_picture("golden_frames/other/picture.png", 0.4f);
  run(0, {"golden", "update", "other", "--reason", "first"});
  write_picture("golden_frames/other/picture.png", 0.9f);
  // A frame of the suite as its own mask: green counts as well as red.
  Image mask = make_image(16, 16, {"R", "G", "B"});
  for (std::size_t i = 1; i < mask.pixels.size(); i += 3) mask.pixels[i] = 1;
  write("golden_frames/other/mask.png", *encode_png(mask));
  write("golden_frames/other/suite.json",
        "{" + command +
            R"(, "masks": [{"file": "mask.png", "why": "all"}], "max_masked_percent": 99})");
  const Ran ran = run(1, {"golden", "test"});
  EXPECT_TRUE(contains(ran.out, "100 % of the pixels are masked, suite.json allows 99 %"))
      << ran.out;
  EXPECT_FALSE(contains(ran.out, "100 % masked")) << "said once: " << ran.out;
}

TEST_F(GoldenTest, NoMaskHidesNaN) {
  const auto write_frame = [&](const std::string& name, float value, float alpha) {
    Image image = make_image(8, 8, {"R", "G", "B", "A", "id"});
    for (std::size_t i = 0; i < image.pixels.size(); ++i) image.pixels[i] = i % 5 == 4 ? 0 : 0.5f;
    image.at(0, 0, 0) = value;
    image.at(0, 0, 3) = alpha;
    image.at(0, 0, 4) = 3;
    const auto bytes = encode_exr(image);
    ASSERT_TRUE(bytes);
    write(name, *bytes);
  };
  Image mask = make_image(8, 8, {"R", "G", "B"});
  mask.at(0, 0, 0) = 1;
  write("golden_frames/other/mask.png", *encode_png(mask));
  for (const char* masks : {R"({"file": "mask.png", "why": "x"})", R"({"ids": [3], "why": "x"})"}) {
    write(
        "golden_frames/other/suite.json",
        R"({"command": "cp picture.exr {out}", "frames": [1], "max_masked_percent": 5, "masks": [)" +
            std::string(masks) + "]}");
    write_frame("golden_frames/other/picture.exr", 0.5f, 1);
    run(0, {"golden", "update", "other", "--reason", "first"});
    write_frame("golden_frames/other/picture.exr", 0.9f, 1);
    run(0, {"golden", "test"});
    write_frame("golden_frames/other/picture.exr", std::nanf(""), 1);
    EXPECT_TRUE(contains(run(1, {"golden", "test"}).out, "1 pixel is NaN or infinite")) << masks;
    run(3, {"golden", "update", "other", "--reason", "NaN"});
    write_frame("golden_frames/other/picture.exr", 0.5f, -1);
    EXPECT_TRUE(contains(run(1, {"golden", "test"}).out, "negative alpha")) << masks;
  }
}

TEST_F(GoldenTest, OptionsOfOtherVerbsAreRefused) {
  make_suite();
  const Ran ran = run(2, {"golden", "test", "tiny", "-f", "99"});
  EXPECT_TRUE(contains(ran.err, "golden test takes no -f - that is for golden new, accept"))
      << ran.err;
  run(2, {"golden", "test", "--reason", "x"});
  run(2, {"golden", "update", "tiny", "--reason", "x", "--bits"});
  run(2, {"golden", "list", "--junit", "j.xml"});
  run(2, {"golden", "accept", "out", "--reason", "x", "-o", "y"});
}

TEST_F(GoldenTest, NothingIsWrittenAmongTheSuites) {
  make_suite();
  run(0, {"golden", "update", "tiny", "--reason", "first"});
  change_scene();
  for (const char* place : {"golden_frames", "golden_frames/tiny/report", "golden_frames/report"}) {
    for (const char* option : {"--report", "--failures"}) {
      const Ran ran = run(2, {"golden", "test", option, place});
      EXPECT_TRUE(contains(ran.err, "lies in golden_frames, where each entry is a suite"))
          << ran.err;
    }
    EXPECT_TRUE(exists(place) == (std::string(place) == "golden_frames")) << place;
  }
  std::filesystem::create_directory_symlink("golden_frames", folder / "link");
  run(2, {"golden", "test", "--report", "link/report"});
  run(1, {"golden", "test", "--report", "golden_frames_report"});
  run(1, {"golden", "test", "--report", "second"});
  for (const char* inside : {"second", "second/frames", "second/new"})
    EXPECT_TRUE(
        contains(run(2, {"golden", "merge", "golden_frames_report", "second", "-o", inside}).err,
                 "one of the reports to merge, or in one"));
  EXPECT_FALSE(exists("second/new"));
}

TEST_F(GoldenTest, NewMakesASuite) {
  write("scenes/tiny.json", tiny_scene());
  EXPECT_TRUE(contains(run(2, {"golden", "new", "logo"}).err, "needs a name, a scene and frames"));
  run(2, {"golden", "new", "../logo", "scenes/tiny.json", "-f", "1"});
  run(3, {"golden", "new", "logo", "scenes/gone.json", "-f", "1"});
  EXPECT_TRUE(contains(run(3, {"golden", "new", "logo", "scenes/tiny.json", "-f", "9"}).err,
                       "outside the scene's 1-4"));
  EXPECT_FALSE(exists("golden_frames/logo")) << "all or nothing";
  const Ran made = run(0, {"golden", "new", "logo", "scenes/tiny.json", "-f", "3,1"});
  for (const char* name : {"suite.json", "frame.0001.exr", "frame.0003.exr", "CHANGES.md"})
    EXPECT_TRUE(contains(made.out, std::string("golden_frames/logo/") + name)) << made.out;
  EXPECT_TRUE(contains(made.err, "polymorph golden test logo --report golden-report")) << made.err;
  EXPECT_EQ(parse(read_text(folder / "golden_frames/logo/suite.json"))["scene"],
            "../../scenes/tiny.json");
  EXPECT_TRUE(contains(run(0, {"golden", "test"}).out, "logo: 2 of 2 frames pass\n"));
  EXPECT_TRUE(contains(run(4, {"golden", "new", "logo", "scenes/tiny.json", "-f", "1"}).err,
                       "exists - choose another name"));
  variables = {{"CI", "true"}};
  run(2, {"golden", "new", "other", "scenes/tiny.json", "-f", "1"});
}

TEST_F(GoldenTest, AJunitFileIsWrittenAgain) {
  make_suite();
  run(0, {"golden", "update", "tiny", "--reason", "first"});
  run(0, {"golden", "test", "--junit", "j.xml"});
  run(0, {"golden", "test", "--junit", "j.xml"});
  write("j.xml", "<?xml version=\"1.0\"?><notes/>");
  EXPECT_TRUE(contains(run(4, {"golden", "test", "--junit", "j.xml"}).err, "exists"));
}

TEST_F(GoldenTest, ReportsOfShardsBecomeOne) {
  make_suite();
  for (const char* name : {"one", "two"})
    write(Path("golden_frames") / name / "suite.json",
          R"({"scene": "../../scenes/tiny.json", "frames": [1]})");
  run(0, {"golden", "update", "one", "--reason", "first"});
  run(0, {"golden", "test", "one", "--report", "a", "--failures", "a/frames"});
  run(1, {"golden", "test", "two", "--report", "b", "--failures", "b/frames"});
  run(2, {"golden", "merge", "a", "b"});
  run(1, {"golden", "merge", "a", "b/report.json", "-o", "all"});
  const auto json = parse(read_text(folder / "all/report.json"));
  EXPECT_EQ(json["cases"].size(), 2u);
  EXPECT_EQ(json["failed"], 1);
  EXPECT_EQ(json["suites"].size(), 2u);
  EXPECT_TRUE(contains(read_text(folder / "all/junit.xml"), "tests=\"2\" failures=\"1\""));
  EXPECT_TRUE(exists("all/frames/two/frame.0001.actual.exr"));
  EXPECT_TRUE(contains(run(3, {"golden", "merge", "a", "a", "-o", "twice"}).err,
                       "stands in another report"));
  // Archives as CIs keep them; never over its own input.
  ASSERT_EQ(std::system(("cd '" + folder.string() + "' && tar czf b.tar.gz b").c_str()), 0);
  run(1, {"golden", "merge", "a", "b.tar.gz", "-o", "packed"});
  EXPECT_EQ(read_text(folder / "packed/junit.xml"), read_text(folder / "all/junit.xml"));
  const std::string before = read_text(folder / "a/report.json");
  EXPECT_TRUE(contains(run(2, {"golden", "merge", "a", "b", "-o", "./a"}).err,
                       "one of the reports to merge"));
  EXPECT_EQ(read_text(folder / "a/report.json"), before);
  EXPECT_TRUE(exists("a/index.html"));
  run(0, {"golden", "accept", "all", "--reason", "first"});
  run(0, {"golden", "test", "one", "two"});
}

TEST_F(GoldenTest, AMergeDoesNotBelieveAReportThatContradictsItself) {
  write("golden_frames/other/suite.json",
        R"({"command": "cp p{frame}.png {out}", "format": "png", "frames": [1, 2]})");
  write_picture("golden_frames/other/p1.png", 0.4f);
  write_picture("golden_frames/other/p2.png", 0.4f);
  run(0, {"golden", "update", "other", "--reason", "first"});
  write("two/good/suite.json", R"({"command": "cp p.png {out}", "format": "png", "frames": [1]})");
  write_picture("two/good/p.png", 0.4f);
  run(0, {"golden", "update", "good", "--root", "two", "--reason", "first"});
  run(0, {"golden", "test", "--root", "two", "--report", "good"});
  write_picture("golden_frames/other/p2.png", 0.9f);
  run(1, {"golden", "test", "--report", "bad"});
  run(1, {"golden", "merge", "bad", "good", "-o", "all"});
  // The order of the facts counts.
  using Json = nlohmann::ordered_json;
  const Json original = Json::parse(read_text(folder / "bad/report.json"));
  const auto refused = [&](const char* what, const auto& change) {
    Json forged = original;
    change(forged);
    write("bad/report.json", forged.dump());
    const Ran ran = run(3, {"golden", "merge", "bad", "good", "-o", "forged"});
    EXPECT_TRUE(contains(ran.err, "error: bad: ")) << what << ": " << ran.err;
    EXPECT_FALSE(contains(ran.err, "this is a bug")) << what << ": " << ran.err;
    EXPECT_FALSE(exists("forged/report.json")) << what;
  };
  refused("no cases", [](Json& r) { r["cases"] = Json::array(); });
  refused("no cases, counted", [](Json& r) {
    r["cases"] = Json::array();
    r["passed"] = r["failed"] = r["errors"] = 0;
  });
  refused("passed beside differs", [](Json& r) { r["cases"][1]["passed"] = true; });
  refused("nothing failed", [](Json& r) {
    r["cases"][1]["passed"] = true;
    r["cases"][1]["message"] = "";
  });
  refused("all of it", [](Json& r) {
    r["cases"][1]["passed"] = true;
    r["cases"][1]["message"] = "";
    r["cases"][1]["verdict"] = "same";
    r["passed"] = 2;
    r["failed"] = 0;
  });
  refused("a case less", [](Json& r) {
    r["cases"].erase(1);
    r["passed"] = 1;
    r["failed"] = 0;
  });
  refused("numbers for cases", [](Json& r) { r["cases"] = {1, 2}; });
  refused("a text for passed", [](Json& r) { r["cases"][0]["passed"] = "yes"; });
  refused("a list of suites", [](Json& r) { r["suites"] = {1}; });
  refused("a number for a name", [](Json& r) { r["cases"][0]["name"] = 1; });
  refused("a number for the title", [](Json& r) { r["title"] = 1; });
  write("bad/report.json", original.dump());
  run(1, {"golden", "merge", "bad", "good", "-o", "forged"});
  write("bad/junit.xml", "<testsuites></testsuites>");
  run(3, {"golden", "merge", "bad", "good", "-o", "again"});
}

TEST_F(GoldenTest, FlickerIsWhatChangesWhereNothingMoves) {
  for (int frame = 1; frame <= 3; ++frame) {
    write_picture("ref.000" + std::to_string(frame) + ".png", 0.4f);
    write_picture("new.000" + std::to_string(frame) + ".png", frame == 2 ? 0.8f : 0.4f);
  }
  const auto json =
      parse(run(1, {"compare", "new.####.png", "ref.####.png", "--json"}).out)["cases"];
  EXPECT_GT(json[0]["flicker"].get<double>(), 0);
  EXPECT_EQ(json[0]["reference_flicker"].get<double>(), 0);
  EXPECT_EQ(json[0]["flicker"], json[1]["flicker"]);
  EXPECT_FALSE(json[2].contains("flicker"));
}

}  // namespace
}  // namespace polymorph
