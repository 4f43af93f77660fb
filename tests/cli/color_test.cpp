// Colour spaces of files.
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

}  // namespace
}  // namespace polymorph
