// Colour spaces of files, and views.
#include "image/color_space.h"
#include "image/image_io.h"
#include "testing/program.h"

namespace polymorph {
namespace {

class Color : public ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    std::string scene = tiny_scene();
    scene.replace(scene.find('{'), 1, R"({"look": {"kind": "metal", "color": "#ff3010"}, )");
    write("scene.json", scene);
  }
  Image read(const std::string& name, ReadImageSettings settings = {.stored_colors = true}) const {
    auto image = read_image(folder / name, settings);
    EXPECT_TRUE(image) << image.error().message;
    return image ? *std::move(image) : Image{};
  }
};

const std::vector<std::string> kAcesCg{"--set", "output.colorspace=acescg"};

std::vector<std::string> operator+(std::vector<std::string> a, const std::vector<std::string>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

TEST_F(Color, FilesInAcesCgSaySoAndAreReadRightly) {
  const auto render = [&](const std::string& name) {
    return std::vector<std::string>{
        "render", "scene.json", "-f",    "2-3",
        "-o",     name,         "--set", "image.aovs=Z,albedo,crypto_object"};
  };
  run(0, render("a.####.exr"));
  run(0, render("b.####.exr") + kAcesCg);
  Image plain = read("a.0002.exr");
  const Image aces = read("b.0002.exr");
  EXPECT_EQ(color_space_name(plain), "lin_rec709_scene");
  EXPECT_EQ(color_space_name(aces), "lin_ap1_scene");
  ASSERT_EQ(aces.channels, plain.channels);
  const Image before = plain;
  convert_colors(plain, ColorSpace::kAcesCg);
  int changed = 0;
  for (std::size_t i = 0; i < aces.pixels.size(); ++i) {
    const std::string& channel = aces.channels[i % aces.channel_count()];
    if (channel.size() > 1 || channel == "Z" || channel == "A")  // floats, and alpha
      EXPECT_EQ(aces.pixels[i], plain.pixels[i]) << channel;
    else
      EXPECT_NEAR(aces.pixels[i], plain.pixels[i], 2e-3f * (1 + plain.pixels[i])) << channel;
    changed += std::abs(aces.pixels[i] - before.pixels[i]) > 0.05f;
  }
  EXPECT_GT(changed, 100) << "the picture has colours";

  EXPECT_TRUE(contains(run(0, {"info", "b.0002.exr"}).out, "colorInteropID = lin_ap1_scene"));
  EXPECT_TRUE(
      contains(run(0, {"compare", "b.0002.exr", "b.0002.exr"}).out, "all values are equal"));
  const Ran across =
      run(1, {"compare", "b.0002.exr", "a.0002.exr", "--fail", "9", "--diff", "d.png"});
  EXPECT_TRUE(contains(across.out, "colour space lin_ap1_scene instead of lin_rec709_scene"))
      << across.out;
  for (const char* name : {"a", "b"})
    run(0, {"strip", std::string(name) + ".####.exr", "-o", std::string(name) + ".png"});
  run(0, {"compare", "b.png", "a.png", "--fail", "0.01", "--relative", "0.02"});

  // Frames in the other space are not those that are asked for.
  run(0, {"status", "a.####.exr", "scene.json", "-f", "2-3", "--set",
          "image.aovs=Z,albedo,crypto_object"});
  run(1, std::vector<std::string>{"status", "a.####.exr", "scene.json", "-f", "2-3", "--set",
                                  "image.aovs=Z,albedo,crypto_object"} +
             kAcesCg);
  const Ran again =
      run(0, render("a.####.exr") + kAcesCg + std::vector<std::string>{"--skip-existing"});
  EXPECT_TRUE(contains(again.err, "2 frames rendered in")) << again.err;
  EXPECT_EQ(pixel_digest(read("a.0003.exr")), pixel_digest(read("b.0003.exr")));
}

TEST_F(Color, GoldenSuitesRefuseAcesCg) {
  std::string scene = tiny_scene();
  scene.replace(scene.find('{'), 1, R"({"output": {"colorspace": "acescg"}, )");
  write("scenes/tiny.json", scene);
  write("golden_frames/tiny/suite.json", R"({"scene": "../../scenes/tiny.json", "frames": [1]})");
  const Ran ran = run(3, {"golden", "update", "tiny", "--reason", "first"});
  EXPECT_TRUE(contains(ran.err, "golden frames are in linear Rec. 709")) << ran.err;
  run(3, {"golden", "test", "tiny", "--bits"});
}

/// A golden of another program in ACEScg is compared as it is, and not with one in Rec. 709.
TEST_F(Color, GoldensOfOtherProgramsKeepTheirSpace) {
  const auto write_picture = [&](float value, ColorSpace space) {
    Image image = make_image(8, 6, {"R", "G", "B"});
    for (std::size_t i = 0; i < image.pixels.size(); ++i)
      image.pixels[i] = i % 3 == 0 ? value : 0.25f;
    write("golden_frames/other/picture.exr", *encode_exr(image, {.color_space = space}));
  };
  write("golden_frames/other/suite.json", R"({"command": "cp picture.exr {out}", "frames": [1]})");
  write_picture(0.75f, ColorSpace::kAcesCg);
  run(0, {"golden", "update", "other", "--reason", "first"});
  run(0, {"golden", "test"});
  write_picture(0.75f, ColorSpace::kRec709);
  const Ran ran = run(1, {"golden", "test", "--report", "out", "--failures", "out/frames"});
  EXPECT_TRUE(contains(ran.out, "colour space lin_rec709_scene instead of lin_ap1_scene"))
      << ran.out;
  // The reference that is kept is as all that is written here.
  const Image kept = read("out/frames/other/frame.0001.reference.exr");
  EXPECT_EQ(color_space_name(kept), "lin_rec709_scene");
  EXPECT_NEAR(kept.pixels[0], 0.75f, 2e-3f);
}

TEST_F(Color, PicturesByAView) {
  const std::string config = (source_dir() / "docs/color/aces.ocio").string();
  const std::vector<std::string> render{"render", "scene.json", "-f",   "2-3",
                                        "-o",     "f.####.exr", "--png"};
  const std::vector<std::string> view{"--display", "sRGB", "--view", "ACES SDR"};
  run(0, render);
  const std::string plain = read_text(folder / "f.0002.png"),
                    exr = read_text(folder / "f.0002.exr");
  run(0, {"strip", "f.####.exr", "-o", "plain.png"});

  variables = {{"OCIO", config}, {"POLYMORPH_OCIO_MODULE", "/nowhere/ocio.so"}};
  EXPECT_TRUE(contains(run(5, render + view + std::vector<std::string>{"--overwrite"}).err,
                       "/nowhere/ocio.so"));
  if (!std::filesystem::exists(program_path().parent_path() / "polymorph_ocio.so"))
    GTEST_SKIP() << "built without OpenColorIO";
  variables = {{"OCIO", ""}};
  EXPECT_TRUE(contains(run(3, render + view + std::vector<std::string>{"--overwrite"}).err,
                       "OCIO=/studio/config.ocio"));
  variables = {{"OCIO", config}};
  EXPECT_TRUE(contains(run(3, {"strip", "f.####.exr", "-o", "x.png", "--view", "ACES HDR"}).err,
                       "has no view \"ACES HDR\" (known: \"ACES SDR\", \"Plain\")"));
  EXPECT_EQ(read_text(folder / "f.0002.png"), plain) << "nothing was written";

  // PNGs without the view are stale, and those with it are not.
  const std::vector<std::string> status{"status", "f.####.exr", "scene.json", "-f", "2-3", "--png"};
  run(0, status);
  run(1, status + view);
  EXPECT_TRUE(contains(run(0, render + view + std::vector<std::string>{"--skip-existing"}).err,
                       "2 frames rendered in"));
  run(0, status + view);
  run(1, status);
  EXPECT_NE(read_text(folder / "f.0002.png"), plain);
  const auto is_same = [&](const std::string& a, const std::string& b) {
    return run({"compare", a, b, "--fail", "0.012", "--relative", "0.03"}).code == 0;
  };
  // The strip of the EXRs by the view shows what the PNGs show.
  run(0, std::vector<std::string>{"strip", "f.####.exr", "-o", "view.png"} + view);
  run(0, {"strip", "f.####.png", "-o", "pngs.png"});
  EXPECT_TRUE(is_same("view.png", "pngs.png"));
  EXPECT_FALSE(is_same("view.png", "plain.png"));
  // A view that has the sRGB curve alone changes nothing that can be seen.
  run(0, {"strip", "f.####.exr", "-o", "same.png", "--view", "Plain"});
  EXPECT_TRUE(is_same("same.png", "plain.png"));

  const Ran twice = run(2, std::vector<std::string>{"strip", "f.####.png", "-o", "x.png"} + view);
  EXPECT_TRUE(contains(twice.err, "by a view already")) << twice.err;
  run(2, std::vector<std::string>{"strip", "f.####.exr", "-o", "x.exr"} + view);
}

}  // namespace
}  // namespace polymorph
