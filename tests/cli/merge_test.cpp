// Samples that add up: parts of frames, their merging, and what status and --skip-existing make of
// them.
#include "image/image_io.h"
#include "testing/program.h"

namespace polymorph {
namespace {

class Merge : public ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    write("scene.json", tiny_scene(2));
  }
  std::string render(const std::string& output, const std::string& samples,
                     std::vector<std::string> more = {}) {
    more.insert(more.begin(), {"render", "scene.json", "-o", output, "--samples", samples});
    return run(0, more).err;
  }
  /// All that is in the file but the command line that made it.
  std::string content(const Path& name) const {
    const auto image = read_image(folder / name, {.stored_colors = true});
    EXPECT_TRUE(image) << image.error().message;
    std::string text = pixel_digest(*image);
    for (const Attribute& attribute : image->attributes)
      if (attribute.name != "polymorph/command")
        std::visit([&](const auto& v) { text += fmt::format("\n{}={}", attribute.name, v); },
                   attribute.value);
    return text;
  }
  std::string error_of(int code, std::vector<std::string> words) {
    words.insert(words.begin(), "merge");
    return run(code, words).err;
  }
};

TEST_F(Merge, GivesTheFilesOfARenderAtOnce) {
  const std::vector<std::string> layers{"--set", "image.aovs=all", "--set", "camera.shutter=0.5"};
  auto words = layers;
  words.insert(words.begin(), {"render", "scene.json", "-o", "whole.####.exr", "--spp", "64"});
  run(0, words);
  render("a/f.####.exr", "0-15/64", layers);
  render("b/f.####.exr", "16-31/64", layers);
  render("c/f.####.exr", "32-47/64", layers);
  render("d/f.####.exr", "48-63/64", layers);
  run(0, {"merge", "c", "a", "d", "b", "-o", "out/f.####.exr"});
  run(0, {"merge", "d/f.0002.exr", "b/f.0002.exr", "a/f.0002.exr", "c/f.0002.exr", "-o", "2.exr"});
  run(0, {"merge", "c/f.####.exr", "b/f.####.exr", "--partial", "-o", "bc/f.####.exr"});
  const auto merged =
      parse(run(0, {"merge", "d", "bc", "a", "-o", "again.####.exr", "--json"}).out);
  EXPECT_EQ(merged["frames"].size(), 2u);
  EXPECT_EQ(merged["frames"][1]["samples"], "0-63/64");
  EXPECT_EQ(merged["frames"][1]["parts"].size(), 3u);
  for (const char* frame : {"0001", "0002"}) {
    const std::string whole = content(fmt::format("whole.{}.exr", frame));
    EXPECT_EQ(content(fmt::format("out/f.{}.exr", frame)), whole);
    EXPECT_EQ(content(fmt::format("again.{}.exr", frame)), whole);
  }
  EXPECT_EQ(content("2.exr"), content("whole.0002.exr"));
  words = layers;
  words.insert(words.begin(), {"status", "out/f.####.exr", "scene.json", "--spp", "64"});
  run(0, words);
}

TEST_F(Merge, RefinesAFilmLater) {
  write("scene.json", tiny_scene(3));
  // Frames 1 and 2 show the same, and are traced once.
  const std::vector<std::string> held{"--set", "frames.hold_start=1"};
  render("a/f.####.exr", "0-63/128", held);
  EXPECT_TRUE(contains(error_of(3, {"a", "-o", "f.####.exr"}),
                       "frame 3: there are samples 0-63 of 128 - render the others with --samples "
                       "64-127/128"));
  // A draft is the mean of its samples, and never taken for the frame.
  run(0, {"merge", "a", "--draft", "-o", "draft.####.exr"});
  run(0, {"render", "scene.json", "-f", "3", "-o", "other.exr", "--spp", "128", "--set",
          "frames.hold_start=1"});
  EXPECT_TRUE(contains(content("draft.0003.exr"), "polymorph/draft=0-63 of 128"));
  EXPECT_FALSE(contains(content("draft.0003.exr"), "polymorph/frame_hash"));
  run(1, {"compare", "draft.0003.exr", "other.exr", "--fail", "0", "--relative", "0"});
  run(0, {"compare", "draft.0003.exr", "other.exr", "--fail", "0.2"});
  EXPECT_TRUE(contains(run(3, {"reproduce", "draft.0003.exr"}).err, "some of the frame's samples"));
  EXPECT_TRUE(contains(run(1, {"status", "draft.####.exr", "scene.json", "--spp", "128", "--set",
                               "frames.hold_start=1"})
                           .out,
                       "whole           0"));
  render("b/f.####.exr", "64-127/128", held);
  run(0, {"merge", "a", "b", "-o", "f.####.exr"});
  render("whole.####.exr", "128", held);
  for (const char* frame : {"0001", "0002", "0003"})
    EXPECT_EQ(content(fmt::format("f.{}.exr", frame)), content(fmt::format("whole.{}.exr", frame)));
}

TEST_F(Merge, SmoothsAfterMerging) {
  const std::vector<std::string> preview{"--preview", "-f", "1"};
  render("a.exr", "0-15/32", preview);
  render("b.exr", "16-31/32", preview);
  run(0, {"merge", "a.exr", "b.exr", "-o", "f.exr"});
  run(0, {"render", "scene.json", "-o", "whole.exr", "--spp", "32", "--preview", "-f", "1"});
  EXPECT_EQ(content("f.exr"), content("whole.exr"));
}

TEST_F(Merge, ConvertsColorsAfterMerging) {
  const std::vector<std::string> acescg{
      "-f", "1", "--set", "output.colorspace=acescg", "--set", "image.aovs=all"};
  render("a.exr", "0-15/32", acescg);
  render("b.exr", "16-31/32", acescg);
  EXPECT_TRUE(contains(
      run(0, {"render", "scene.json", "-o", "a.exr", "--samples", "0-15/32", "-f", "1", "--set",
              "output.colorspace=acescg", "--set", "image.aovs=all", "--skip-existing"})
          .err,
      "0 frames rendered, 1 kept"));
  run(0, {"merge", "b.exr", "a.exr", "-o", "f.exr"});
  run(0, {"render", "scene.json", "-o", "whole.exr", "--spp", "32", "-f", "1", "--set",
          "output.colorspace=acescg", "--set", "image.aovs=all"});
  EXPECT_EQ(content("f.exr"), content("whole.exr"));
  EXPECT_TRUE(contains(content("f.exr"), "colorInteropID=lin_ap1_scene")) << content("f.exr");
  // A part of the same picture for a film in the other space.
  run(0, {"render", "scene.json", "-o", "c.exr", "--samples", "16-31/32", "-f", "1", "--set",
          "image.aovs=all"});
  EXPECT_TRUE(contains(error_of(3, {"a.exr", "c.exr", "-o", "g.exr"}), "different colour spaces"));
}

TEST_F(Merge, NamesWhatDoesNotFit) {
  const std::vector<std::string> first{"-f", "1"};
  render("a.exr", "0-15/64", first);
  render("b.exr", "16-31/64", first);
  render("d.exr", "48-63/64", first);
  EXPECT_TRUE(contains(error_of(3, {"a.exr", "b.exr", "d.exr", "--partial", "-o", "f.exr"}),
                       "frame 1: there are samples 0-31, 48-63 of 64 - render the others with "
                       "--samples 32-47/64"));
  render("ab.exr", "0-31/64", first);
  EXPECT_TRUE(contains(error_of(3, {"ab.exr", "b.exr", "-o", "f.exr"}),
                       "frame 1: ab.exr (0-31/64) and b.exr (16-31/64) have samples in common"));
  render("e.exr", "16-31/32", first);
  EXPECT_TRUE(contains(error_of(3, {"a.exr", "e.exr", "-o", "f.exr"}),
                       "a.exr (0-15/64) and e.exr (16-31/32) are parts of pictures with different "
                       "numbers of samples"));
  render("x.exr", "16-31/64", {"-f", "1", "--set", "camera.azimuth=3"});
  EXPECT_TRUE(contains(error_of(3, {"a.exr", "x.exr", "-o", "f.exr"}),
                       "a.exr (0-15/64) and x.exr (16-31/64) are not of one picture"));
  run(0, {"render", "scene.json", "-o", "whole.exr", "-f", "1"});
  EXPECT_TRUE(contains(error_of(3, {"whole.exr", "-o", "f.exr"}), "whole.exr: is no part"));
  EXPECT_TRUE(contains(error_of(3, {"scene.json", "-o", "f.exr"}), "scene.json: is no part"));
  EXPECT_TRUE(contains(error_of(3, {"none.exr", "-o", "f.exr"}), "none.exr: "));
  write("empty/note.txt", "");
  EXPECT_TRUE(contains(error_of(3, {"empty", "-o", "f.exr"}), "empty: has no parts"));
  EXPECT_TRUE(contains(error_of(2, {"a.exr", "-o", "f.png"}), "merged to EXR"));
  EXPECT_TRUE(contains(error_of(4, {"a.exr", "b.exr", "--partial", "-o", "b.exr", "--overwrite"}),
                       "b.exr"));
  EXPECT_TRUE(contains(error_of(4, {"a.exr", "b.exr", "--partial", "-o", "d.exr"}), "d.exr"));
  std::filesystem::resize_file(folder / "b.exr", 3000);
  EXPECT_TRUE(contains(error_of(3, {"a.exr", "b.exr", "--partial", "-o", "f.exr"}), "b.exr"));
  EXPECT_FALSE(exists("f.exr"));
}

TEST_F(Merge, RangesThatCannotBeRendered) {
  const auto refused = [&](const std::string& samples, const std::vector<std::string>& more) {
    std::vector<std::string> words{"render", "scene.json", "-f", "1", "--samples", samples};
    words.insert(words.end(), more.begin(), more.end());
    return run(2, words).err;
  };
  const std::vector<std::string> exr{"-o", "f.exr"};
  EXPECT_TRUE(contains(refused("8-15/64", exr), "write 0-15/64"));
  EXPECT_TRUE(contains(refused("0-15", exr), "write FIRST-LAST/TOTAL"));
  EXPECT_TRUE(contains(refused("0", exr), "--samples 0: write a number from 1 to 65536"));
  EXPECT_TRUE(contains(refused("0-15/64", {"-o", "f.png"}), "a part is an EXR file"));
  EXPECT_TRUE(contains(refused("0-15/64", {"-o", "f.exr", "--png"}), "a part is an EXR file"));
  EXPECT_TRUE(contains(refused("0-15/64", {"-o", "f.exr", "--set", "image.noise=0.1"}),
                       "adaptive sampling"));
  EXPECT_TRUE(
      contains(refused("0-15/64", {"-o", "f.exr", "--set", "image.denoise=true"}), "denoising"));
  refused("0-15/64", {"-o", "f.exr", "--spp", "64"});
  EXPECT_EQ(count_files(".exr"), 0u);
}

TEST_F(Merge, NoPartIsTakenForTheFrameOrForAnotherPart) {
  const auto again = [&](int code, const std::vector<std::string>& samples) {
    std::vector<std::string> words{"render", "scene.json", "-o", "f.####.exr", "--skip-existing"};
    words.insert(words.end(), samples.begin(), samples.end());
    return run(code, words).err;
  };
  render("f.####.exr", "0-15/64");
  EXPECT_TRUE(contains(again(0, {"--samples", "0-15/64"}), "0 frames rendered, 2 kept"));
  const std::string lost = "f.0001.exr: has samples 0-15/64 of this frame, which would be lost";
  EXPECT_TRUE(contains(again(4, {"--samples", "16-31/64"}), lost));
  EXPECT_TRUE(contains(again(4, {"--spp", "64"}), lost));
  const auto part = read_text(folder / "f.0001.exr");
  run(0, {"render", "scene.json", "-o", "f.####.exr", "--overwrite", "--spp", "64"});
  EXPECT_NE(read_text(folder / "f.0001.exr"), part);
  EXPECT_TRUE(contains(again(4, {"--samples", "0-15/64"}), "has all samples of this frame"));
  EXPECT_TRUE(contains(again(0, {"--samples", "0-15/32"}), "2 frames rendered"));
}

TEST_F(Merge, StatusKnowsTheSamples) {
  const std::vector<std::string> ask{"status", "out/f.####.exr", "scene.json", "--spp", "64"};
  render("out/a/f.####.exr", "0-31/64");
  render("out/b/f.####.exr", "48-63/64", {"-f", "1"});
  render("out/f.####.exr", "32-47/64", {"-f", "2"});
  Ran ran = run(1, ask);
  EXPECT_EQ(ran.out,
            "whole           0  \n"
            "missing         1  1\n"
            "part            1  2\n"
            "samples         1  1: 0-31, 48-63 of 64\n"
            "samples         1  2: 0-47 of 64\n");
  EXPECT_TRUE(contains(ran.err, "samples of 1: render them with --samples 32-47/64")) << ran.err;
  EXPECT_TRUE(contains(ran.err, "samples of 2: render them with --samples 48-63/64")) << ran.err;
  EXPECT_FALSE(contains(ran.err, "--skip-existing"));
  render("out/a/g.####.exr", "32-47/64", {"-f", "1"});
  ran = run(1, ask);
  EXPECT_TRUE(contains(ran.out, "samples         1  1: 0-63 of 64\n")) << ran.out;
  EXPECT_TRUE(contains(ran.err, "merge out/a out/b -o 'out/f.####.exr'")) << ran.err;
  auto words = ask;
  words.emplace_back("--json");
  const auto json = parse(run(1, words).out);
  EXPECT_EQ(json["part"], nlohmann::json({2}));
  EXPECT_EQ(json["samples"].size(), 2u);
  EXPECT_EQ(json["samples"][0]["samples"], "0-47");
  EXPECT_EQ(json["samples"][0]["frames"], nlohmann::json({2}));
  EXPECT_EQ(json["samples"][1]["total"], 64);
  // Of another picture: none of these samples.
  EXPECT_FALSE(contains(run(1, {"status", "out/f.####.exr", "scene.json"}).out, "samples"));
}

TEST_F(Merge, ADryRunEstimatesAPart) {
  const Ran ran =
      run(0, {"render", "scene.json", "-o", "f.####.exr", "--samples", "16-63/64", "-n"});
  EXPECT_TRUE(contains(ran.err, "2 frames to render: about ")) << ran.err;
  EXPECT_EQ(count_files(".exr"), 0u);
}

}  // namespace
}  // namespace polymorph
