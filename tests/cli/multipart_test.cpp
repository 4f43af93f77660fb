// EXR files with a part for each layer: what reads them, and what knows them.
#include "image/image_io.h"
#include "testing/program.h"

namespace polymorph {
namespace {

class Multipart : public ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    write("scene.json", tiny_scene(3));
  }
  Ran render(const std::string& output, std::vector<std::string> more = {}) {
    more.insert(more.begin(),
                {"render", "scene.json", "-o", output, "-f", "2", "--set", "image.aovs=all"});
    return run(0, more);
  }
  Image read(const std::string& name) {
    auto image = read_image(folder / name, {.single_picture = true});
    EXPECT_TRUE(image) << image.error().message;
    return image ? *std::move(image) : Image{};
  }
};

const std::vector<std::string> kParts{"--set", "output.multipart=true"};

TEST_F(Multipart, FilesOfPartsHoldTheSamePicture) {
  render("one.exr");
  render("parts.exr", kParts);
  EXPECT_TRUE(contains(run(0, {"compare", "parts.exr", "one.exr"}).out, "all values are equal"));
  EXPECT_EQ(pixel_digest(read("parts.exr")), pixel_digest(read("one.exr")));
  const std::string info = run(0, {"info", "parts.exr"}).out;
  EXPECT_TRUE(contains(info, " = rgba: 32 x 24, R, G, B, A\n")) << info;
  EXPECT_TRUE(contains(info, " = crypto_object00: 32 x 24, crypto_object00.R, ")) << info;
  for (const std::string& name : {std::string("one"), std::string("parts")})
    run(0, {"strip", name + ".exr", "--matte", "crypto_object.cube", "-o", name + ".png"});
  EXPECT_EQ(read_text(folder / "parts.png"), read_text(folder / "one.png"));
  // A difference in a part behind the first is found.
  Image image = read("parts.exr");
  image.at(3, 4, image.find_channel("N.X")) += 0.5f;
  std::erase_if(image.attributes, [](const Attribute& attribute) {
    return attribute.name.starts_with(kPartAttribute);
  });
  write("changed.exr", *encode_exr(image, {.multipart = true}));
  const Ran ran = run(1, {"compare", "changed.exr", "parts.exr", "--failpercent", "0"});
  EXPECT_TRUE(contains(ran.out, "N.X")) << ran.out;
}

TEST_F(Multipart, StatusAndReproduceKnowIt) {
  render("f.####.exr", kParts);
  const std::vector<std::string> status{"status", "f.####.exr", "scene.json",    "-f",
                                        "2",      "--set",      "image.aovs=all"};
  run(1, status);
  auto words = status;
  words.insert(words.end(), kParts.begin(), kParts.end());
  run(0, words);
  EXPECT_EQ(run(0, {"reproduce", "f.0002.exr"}).out,
            "f.0002.exr: same bits, every byte of the file\n");
  EXPECT_TRUE(contains(render("f.####.exr", {"--skip-existing"}).err, "1 frame rendered in"));
  run(0, status);
  run(1, words);
}

TEST_F(Multipart, SamplesAreMergedToIt) {
  const auto with = [](std::vector<std::string> words) {
    words.insert(words.end(), kParts.begin(), kParts.end());
    return words;
  };
  render("a.exr", with({"--samples", "0-15/32"}));
  render("b.exr", with({"--samples", "16-31/32"}));
  run(0, {"merge", "a.exr", "b.exr", "-o", "f.exr"});
  render("whole.exr", with({"--spp", "32"}));
  EXPECT_EQ(pixel_digest(read("f.exr")), pixel_digest(read("whole.exr")));
  EXPECT_TRUE(contains(run(0, {"info", "f.exr"}).out, " = rgba: "));
  EXPECT_FALSE(contains(run(0, {"info", "a.exr"}).out, " = rgba: "));
}

}  // namespace
}  // namespace polymorph
