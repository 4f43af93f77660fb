// compare and golden: the answer is the exit code.
#include <limits>
#include <map>

#include "image/image_io.h"
#include "testing/program.h"

namespace polymorph {
namespace {

class Compare : public ProgramTest {
 protected:
  /// A grey picture with one odd pixel.
  void write_image_file(const std::string& name, float odd, int width = 8) const {
    Image image = make_image(width, 6, {"R", "G", "B", "A"});
    for (float& v : image.pixels) v = 0.5f;
    image.at(3, 2, 1) = odd;
    const auto encoded = encode_exr(image);
    ASSERT_TRUE(encoded);
    write(name, *encoded);
  }
};

TEST_F(Compare, EqualImages) {
  write_image_file("a.exr", 0.5f);
  const Ran ran = run(0, {"compare", "a.exr", "a.exr"});
  EXPECT_EQ(ran.out, "a.exr: all values are equal\n");
  EXPECT_EQ(ran.err, "");
}

TEST_F(Compare, DifferentImages) {
  write_image_file("a.exr", 0.5f);
  write_image_file("b.exr", 0.75f);
  const Ran ran = run(1, {"compare", "a.exr", "b.exr", "--diff", "d.png"});
  EXPECT_TRUE(contains(ran.out, "0.25 in G at (3, 2)")) << ran.out;
  EXPECT_TRUE(exists("d.png"));
  run(0, {"compare", "a.exr", "b.exr", "--fail", "0.3"});
  run(0, {"compare", "a.exr", "b.exr", "--failpercent", "5"});
  const auto json = parse(run(1, {"compare", "a.exr", "b.exr", "--json"}).out)["cases"];
  EXPECT_EQ(json[0]["passed"], false);
  EXPECT_EQ(json[0]["failing_pixels"], 1);
  write_image_file("wide.exr", 0.5f, 9);
  run(1, {"compare", "a.exr", "wide.exr"});
}

TEST_F(Compare, MissingFile) {
  write_image_file("a.exr", 0.5f);
  EXPECT_TRUE(contains(run(3, {"compare", "a.exr", "gone.exr"}).err, "gone.exr: cannot read"));
  EXPECT_TRUE(contains(run(3, {"compare", "gone.exr", "a.exr"}).err, "gone.exr: cannot read"));
}

TEST_F(Compare, NanFailsEvenAgainstItself) {
  write_image_file("nan.exr", std::numeric_limits<float>::quiet_NaN());
  write_image_file("inf.exr", std::numeric_limits<float>::infinity());
  for (const char* name : {"nan.exr", "inf.exr"}) {
    const Ran ran = run(1, {"compare", name, name, "--fail", "1000", "--failpercent", "100"});
    EXPECT_TRUE(contains(ran.out, "NaN")) << ran.out;
  }
  EXPECT_EQ(parse(run(1, {"compare", "nan.exr", "nan.exr", "--json"}).out)["cases"][0]["verdict"],
            "not-finite");
}

TEST_F(Compare, Sequences) {
  for (const char* name : {"a.0001.exr", "a.0002.exr", "b.0001.exr", "b.0002.exr"})
    write_image_file(name, 0.5f);
  EXPECT_TRUE(contains(run(0, {"compare", "a.####.exr", "b.####.exr"}).out, "2 of 2 pairs pass\n"));
  write_image_file("b.0002.exr", 0.75f);
  const Ran ran = run(1, {"compare", "a.%04d.exr", "b.####.exr", "--diff", "d.png"});
  EXPECT_TRUE(contains(ran.out, "1 of 2 pairs pass\n")) << ran.out;
  EXPECT_TRUE(exists("a.0002.d.png"));
  run(2, {"compare", "a.####.exr", "b.0001.exr"});
  run(3, {"compare", "a.####.exr", "gone.####.exr"});
}

TEST_F(Compare, SequencesOfUnequalFramesFail) {
  for (const char* name : {"a.0001.exr", "a.0002.exr", "b.0001.exr"}) write_image_file(name, 0.5f);
  EXPECT_TRUE(contains(run(3, {"compare", "a.####.exr", "b.####.exr"}).err, "b.0002.exr"));
  EXPECT_TRUE(contains(run(3, {"compare", "b.####.exr", "a.####.exr"}).err, "b.0002.exr"));
}

class Golden : public ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    write("scenes/tiny.json", tiny_scene());
    write("golden_frames/tiny/suite.json",
          R"({"scene": "../../scenes/tiny.json", "frames": [1, 3]})");
  }
};

TEST_F(Golden, List) {
  const Ran ran = run(0, {"golden", "list"});
  EXPECT_TRUE(ran.out.starts_with("tiny: 2 frames of ")) << ran.out;
  EXPECT_EQ(run(0, {"golden", "list", "--root", "golden_frames"}).out, ran.out);
  EXPECT_TRUE(contains(run(3, {"golden", "list", "--root", "gone"}).err, "gone: "));
  EXPECT_TRUE(contains(run(3, {"golden", "test", "tinny"}).err, "did you mean"));
}

TEST_F(Golden, InfoListsThePartsOfAFileOfSeveral) {
  const std::string parts = (source_dir() / "tests/data/image/parts.exr").string();
  const Ran ran = run(0, {"info", parts});
  EXPECT_TRUE(contains(ran.out, "  part 1 of 2 = ")) << ran.out;
  EXPECT_TRUE(contains(ran.out, "  part 2 of 2 = ")) << ran.out;
}

TEST_F(Golden, InfoCountsThePagesOfATiffAndThePicturesOfAGif) {
  for (const char* name : {"pages.tif", "moments.gif"}) {
    const Ran ran = run(0, {"info", (source_dir() / "tests/data/image" / name).string()});
    EXPECT_TRUE(contains(ran.out, "  pictures = 3, of which this is the first\n")) << ran.out;
  }
  const Ran one = run(0, {"info", (source_dir() / "tests/data/image/rgb8.tif").string()});
  EXPECT_FALSE(contains(one.out, "pictures")) << one.out;
}

TEST_F(Golden, AFolderWithoutASuiteIsAnError) {
  std::filesystem::create_directories(folder / "empty");
  const Ran ran = run(3, {"golden", "test", "--root", "empty", "--junit", "junit.xml"});
  EXPECT_TRUE(contains(ran.err, "error: empty: no golden suite in it")) << ran.err;
  EXPECT_TRUE(contains(read_text(folder / "junit.xml"), "errors=\"1\""));
  // Nothing and 0 would be what a comparison of two machines' hashes passes.
  for (const char* verb : {"hash", "list"})
    EXPECT_TRUE(contains(run(3, {"golden", verb, "--root", "empty"}).err, "no golden suite in it"));
  // A folder without a suite.json may be a suite that lost it.
  write("golden_frames/lost/frame.0001.exr", "");
  run(0, {"golden", "update", "tiny", "--reason", "first"});
  const Ran lost = run(3, {"golden", "test", "--report", "out"});
  EXPECT_TRUE(contains(lost.out, "lost: could not be tested\n")) << lost.out;
  EXPECT_TRUE(contains(lost.out, "tiny: 2 of 2 frames pass\n")) << lost.out;
  EXPECT_TRUE(contains(lost.err, "golden_frames/lost: no suite.json in it")) << lost.err;
  const Ran list = run(3, {"golden", "list"});
  EXPECT_TRUE(contains(list.out, "tiny: 2 frames of ")) << list.out;
  EXPECT_TRUE(contains(list.err, "golden_frames/lost: no suite.json in it")) << list.err;
}

TEST_F(Golden, UpdateNeedsASuiteAndAReason) {
  EXPECT_TRUE(contains(run(2, {"golden", "update"}).err, "needs the suite's name"));
  EXPECT_TRUE(contains(run(2, {"golden", "update", "tiny"}).err, "needs --reason"));
  EXPECT_EQ(count_files(".exr"), 0u);
}

TEST_F(Golden, UpdateNeverRunsUnderCi) {
  variables = {{"CI", "true"}};
  const Ran ran = run(2, {"golden", "update", "tiny", "--reason", "first"});
  EXPECT_TRUE(contains(ran.err, "never runs under CI")) << ran.err;
  EXPECT_EQ(count_files(".exr"), 0u);
}

TEST_F(Golden, MissingFailsUpdatedPassesChangedFails) {
  const Ran missing = run(1, {"golden", "test", "tiny"});
  EXPECT_TRUE(contains(missing.out, "tiny frame 1: FAILED: ")) << missing.out;
  EXPECT_TRUE(contains(missing.out, "frame.0003.exr is missing")) << missing.out;
  EXPECT_TRUE(contains(missing.out, "tiny: 0 of 2 frames pass\n")) << missing.out;

  const Ran updated = run(0, {"golden", "update", "tiny", "--reason", "the first ones"});
  EXPECT_EQ(lines_of(updated.out).size(), 4u) << updated.out;
  EXPECT_TRUE(contains(updated.out, "golden_frames/tiny/surface.csv"));
  EXPECT_TRUE(contains(read_text(folder / "golden_frames/tiny/CHANGES.md"), ": the first ones\n"));
  EXPECT_TRUE(contains(run(0, {"golden", "test"}).out, "tiny: 2 of 2 frames pass\n"));
  const Ran nothing = run(0, {"golden", "update", "tiny", "--reason", "again"});
  EXPECT_EQ(nothing.out, "");
  EXPECT_FALSE(contains(read_text(folder / "golden_frames/tiny/CHANGES.md"), "again"));

  write("scenes/tiny.json", tiny_scene(4, R"({"shape": "torus", "spheres": {"balls": 12}})"));
  const Ran changed = run(1, {"golden", "test", "tiny", "--failures", "failed"});
  EXPECT_TRUE(contains(changed.out, "tiny frame 3: FAILED: surface has ")) << changed.out;
  EXPECT_TRUE(contains(changed.err, "polymorph golden update tiny --reason")) << changed.err;
  for (const char* name : {"actual.exr", "reference.exr", "difference.png"})
    EXPECT_TRUE(exists(std::string("failed/tiny/frame.0003.") + name)) << name;
}

TEST_F(Golden, AnUpdateThatCannotBeFinishedChangesNothing) {
  run(0, {"golden", "update", "tiny", "--reason", "first"});
  const auto state = [&] {
    std::map<std::string, std::string> files;
    for (const auto& entry : std::filesystem::directory_iterator(folder / "golden_frames/tiny"))
      files[entry.path().filename().string()] =
          entry.is_regular_file() ? read_text(entry.path()) : "";
    return files;
  };
  write("scenes/tiny.json", tiny_scene(4, R"({"shape": "torus", "spheres": {"balls": 12}})"));
  write("golden_frames/tiny/notes.txt", "not of the suite");
  // The last file of an update: the frames before it could all be written.
  const std::string changes = read_text(folder / "golden_frames/tiny/CHANGES.md");
  std::filesystem::remove(folder / "golden_frames/tiny/CHANGES.md");
  std::filesystem::create_directory(folder / "golden_frames/tiny/CHANGES.md");
  const auto before = state();
  const Ran refused = run({"golden", "update", "tiny", "--reason", "second"});
  EXPECT_NE(refused.code, 0);
  EXPECT_TRUE(contains(refused.err, "CHANGES.md")) << refused.err;
  EXPECT_EQ(state(), before);

  std::filesystem::remove(folder / "golden_frames/tiny/CHANGES.md");
  write("golden_frames/tiny/CHANGES.md", changes);
  // A signal at any moment leaves the suite of before or the suite of after.
  const auto old = state();
  run(0, {"golden", "update", "tiny", "--reason", "second"});
  const auto done = state();
  EXPECT_NE(done, old);
  for (const auto& [name, bytes] : done)
    if (old.count(name) == 0) std::filesystem::remove(folder / "golden_frames/tiny" / name);
  for (const auto& [name, bytes] : old) write("golden_frames/tiny/" + name, bytes);
  for (const int after_ms : {0, 60, 120, 180}) {
    const Started update = start({"golden", "update", "tiny", "--reason", "second"});
    ::usleep(static_cast<unsigned>(after_ms) * 1000);
    ::kill(update.id, SIGTERM);
    finish(update);
    const auto now = state();
    EXPECT_TRUE(now == old || now == done) << "after " << after_ms << " ms";
    if (now != old) break;
  }
}

TEST_F(Golden, BitsSaysThatTheBuildAgreesWithItself) {
  const Ran ran = run(0, {"golden", "test", "tiny", "--bits", "--junit", "bits.xml"});
  EXPECT_TRUE(contains(ran.out, "tiny: 8 of 8 pass\n")) << ran.out;
  for (const char* way : {"again", "1 thread", "3 threads", "cold cache", "warm cache", "3 shards",
                          "resumed", "a frame alone"})
    EXPECT_TRUE(contains(ran.out, std::string("tiny, bits, ") + way + ": ok")) << way;
  EXPECT_TRUE(contains(read_text(folder / "bits.xml"), "tests=\"8\" failures=\"0\""));
  EXPECT_EQ(count_files(".exr"), 0u) << "nothing is left behind";
}

TEST_F(Golden, BadSuites) {
  write("golden_frames/tiny/suite.json", R"({"scene": "../../scenes/tiny.json", "frames": [9]})");
  EXPECT_TRUE(contains(run(3, {"golden", "test"}).err, "frame 9 is outside the scene's 1-4"));
  write("golden_frames/tiny/suite.json", "{");
  EXPECT_TRUE(contains(run(3, {"golden", "test"}).err, "suite.json"));
}

}  // namespace
}  // namespace polymorph
