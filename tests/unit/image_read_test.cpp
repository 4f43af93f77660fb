#include <sys/mount.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <cstring>

#include "image/image_io.h"
#include "testing/image.h"

namespace polymorph {
namespace {

using Names = std::vector<std::string>;

/// The message of reading bytes under a name; the error must be bad input and name the file.
std::string failure_of(const std::filesystem::path& path, const ReadImageSettings& settings = {}) {
  const auto image = read_image(path, settings);
  EXPECT_FALSE(image);
  if (image) return "";
  EXPECT_EQ(image.error().code, ErrorCode::kInput) << image.error().message;
  EXPECT_EQ(image.error().message.find(path.string()), 0u) << image.error().message;
  return image.error().message;
}

void expect_mentions(const std::string& message, const std::string& part) {
  EXPECT_NE(message.find(part), std::string::npos) << message;
}

std::string bytes_of(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return std::string(std::istreambuf_iterator<char>(file), {});
}

TEST(ReadImage, GreyPngBecomesColours) {
  const TemporaryFolder folder;
  const auto image =
      read_image(folder.write("g.png", make_png(2, 1, 8, 0, {std::string("\x00\xbc", 2)})));
  ASSERT_TRUE(image) << image.error().message;
  EXPECT_EQ(image->channels, (Names{"R", "G", "B"}));
  EXPECT_EQ(image->at(0, 0, 0), 0.0f);
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(image->at(1, 0, c), srgb_to_linear(188 / 255.0f), 1e-7f);
}

TEST(ReadImage, GreyAlphaSixteenBitPng) {
  const TemporaryFolder folder;
  const auto path =
      folder.write("ga.png", make_png(1, 1, 16, 4, {std::string("\x80\x00\x40\x00", 4)}));
  const auto image = read_image(path);
  ASSERT_TRUE(image) << image.error().message;
  EXPECT_EQ(image->channels, (Names{"R", "G", "B", "A"}));
  const float grey = srgb_to_linear(0x8000 / 65535.0f), alpha = 0x4000 / 65535.0f;
  EXPECT_NEAR(image->at(0, 0, 3), alpha, 1e-6f);
  EXPECT_NEAR(image->at(0, 0, 1), grey * alpha, 1e-6f);
  const auto straight = read_image(path, {.alpha = AlphaMode::kStraight});
  EXPECT_NEAR(straight->at(0, 0, 1), grey, 1e-6f);
}

TEST(ReadImage, RadianceIsLinearLight) {
  const TemporaryFolder folder;
  const std::string head = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 4\n";
  std::string pixels;
  for (int i = 0; i < 8; ++i) pixels += std::string("\x80\x40\x20\x82", 4);
  const auto image = read_image(folder.write("sky.hdr", head + pixels));
  ASSERT_TRUE(image) << image.error().message;
  EXPECT_EQ(image->width, 4);
  EXPECT_EQ(image->height, 2);
  EXPECT_NEAR(image->at(3, 1, 0), 2.0f, 1e-5f);
  EXPECT_NEAR(image->at(3, 1, 2), 0.5f, 1e-5f);
  EXPECT_FALSE(read_image(folder.write("cut.hdr", head + pixels.substr(0, 9))));
  EXPECT_FALSE(read_image(folder.write("bare.hdr", "#?RADIANCE\n")));
}

TEST(ReadImage, PalettePng) {
  const TemporaryFolder folder;
  const std::string palette("\xff\x00\x00\x00\xff\x80", 6);
  const auto image =
      read_image(folder.write("p.png", make_png(2, 1, 8, 3, {std::string("\x01\x00", 2)}, palette)),
                 {.integer_curve = TransferCurve::kLinear});
  ASSERT_TRUE(image) << image.error().message;
  EXPECT_EQ(image->channels, (Names{"R", "G", "B"}));
  EXPECT_EQ(image->pixels, (std::vector<float>{0, 1, 128 / 255.0f, 1, 0, 0}));
}

TEST(ReadImage, PngOfFewBitsAndWithTransparentColours) {
  const TemporaryFolder folder;
  const ReadImageSettings linear{.integer_curve = TransferCurve::kLinear};
  // Grey of 2 bits: 0, 1, 2, 3 in a byte, then 3 and filling.
  const auto grey =
      read_image(folder.write("2.png", make_png(5, 1, 2, 0, {std::string("\x1b\xc0", 2)})), linear);
  ASSERT_TRUE(grey) << grey.error().message;
  EXPECT_EQ(grey->channels, (Names{"R", "G", "B"}));
  for (int x = 0; x < 5; ++x)
    EXPECT_NEAR(grey->at(x, 0, 1), static_cast<float>(std::min(x, 3)) / 3, 1e-6f);
  // A palette of which the first colour is half transparent.
  std::string png =
      make_png(2, 1, 1, 3, {std::string("\x40", 1)}, std::string("\xff\0\0\0\xff\0", 6));
  png.insert(png.find("IDAT") - 4, png_chunk("tRNS", "\x80"));
  const auto palette =
      read_image(folder.write("t.png", png), {TransferCurve::kLinear, AlphaMode::kStraight});
  ASSERT_TRUE(palette) << palette.error().message;
  EXPECT_EQ(palette->channels, (Names{"R", "G", "B", "A"}));
  EXPECT_EQ(palette->pixels, (std::vector<float>{1, 0, 0, 128 / 255.0f, 0, 1, 0, 1}));
}

TEST(ReadImage, TextsOfPngsAreAttributes) {
  Image image = random_image(3, 2, {"R", "G", "B"});
  image.attributes = {{"polymorph.scene", std::string("scene.json")}, {"polymorph.frame", 7}};
  const auto back = decode_image(*encode_png(image), "memory");
  ASSERT_TRUE(back) << back.error().message;
  ASSERT_EQ(back->attributes.size(), 2u);
  EXPECT_EQ(back->attributes[0].name, "polymorph.scene");
  EXPECT_EQ(std::get<std::string>(back->attributes[0].value), "scene.json");
  EXPECT_EQ(std::get<std::string>(back->attributes[1].value), "7");
}

TEST(ReadImage, TransparentPixelsOfPngKeepTheirColourWhenStraight) {
  const TemporaryFolder folder;
  const auto path =
      folder.write("t.png", make_png(1, 1, 8, 6, {std::string("\xff\x80\x00\x00", 4)}));
  EXPECT_EQ(read_image(path)->pixels, (std::vector<float>{0, 0, 0, 0}));
  const auto straight = read_image(path, {.alpha = AlphaMode::kStraight});
  EXPECT_EQ(straight->at(0, 0, 0), 1.0f);
  EXPECT_NEAR(straight->at(0, 0, 1), srgb_to_linear(128 / 255.0f), 1e-7f);
  EXPECT_EQ(straight->at(0, 0, 3), 0.0f);
}

TEST(ReadImage, Jpeg) {
  const auto image = read_image(data_file("rgb.jpg"));  // 0.8, 0.4, 0.2 encoded, 4:2:0
  ASSERT_TRUE(image) << image.error().message;
  EXPECT_EQ(image->width, 16);
  EXPECT_EQ(image->channels, (Names{"R", "G", "B"}));
  const float expected[] = {0.8f, 0.4f, 0.2f};
  for (int c = 0; c < 3; ++c)
    EXPECT_NEAR(linear_to_srgb(image->at(7, 9, c)), expected[c], 2 / 255.0f);
}

TEST(ReadImage, CmykJpegIsConverted) {
  const auto image = read_image(data_file("cmyk.jpg"));
  ASSERT_TRUE(image) << image.error().message;
  EXPECT_EQ(image->channels, (Names{"R", "G", "B"}));
  EXPECT_NEAR(linear_to_srgb(image->at(8, 8, 0)), 1.0f, 2 / 255.0f);
  EXPECT_NEAR(linear_to_srgb(image->at(8, 8, 1)), 0.5f, 3 / 255.0f);
  EXPECT_NEAR(linear_to_srgb(image->at(8, 8, 2)), 0.0f, 2 / 255.0f);
}

TEST(ReadImage, Tiff) {
  const auto rgb = read_image(data_file("rgb8.tif"));
  ASSERT_TRUE(rgb) << rgb.error().message;
  EXPECT_EQ(rgb->height, 3);
  EXPECT_EQ(rgb->at(3, 0, 0), 0.0f);
  EXPECT_EQ(rgb->at(0, 2, 0), 1.0f);
  const auto grey = read_image(data_file("grey.tif"));
  ASSERT_TRUE(grey) << grey.error().message;
  EXPECT_EQ(grey->channels, (Names{"R", "G", "B"}));
  EXPECT_NEAR(grey->at(3, 3, 2), srgb_to_linear(128 / 255.0f), 1e-7f);
}

TEST(ReadImage, FloatTiffIsTakenAsItIs) {
  const auto image = read_image(data_file("float.tif"));
  ASSERT_TRUE(image) << image.error().message;
  EXPECT_EQ(image->channels, (Names{"R", "G", "B", "A"}));
  EXPECT_EQ(image->at(3, 1, 0), 2.5f);
  EXPECT_EQ(image->at(3, 1, 2), -1.0f);
  EXPECT_EQ(image->at(3, 1, 3), 0.5f);
}

TEST(ReadImage, TiffAlphaOfBothKinds) {
  // Codes 0.25, 0.5, 0 with alpha 0.5. Associated: the straight code of red is 0.5, of green 1.
  const auto associated = read_image(data_file("associated.tif"));
  ASSERT_TRUE(associated) << associated.error().message;
  EXPECT_NEAR(associated->at(0, 0, 0), srgb_to_linear(0.5f) * 0.5f, 1e-4f);
  EXPECT_NEAR(associated->at(0, 0, 1), 0.5f, 1e-4f);
  const auto straight = read_image(data_file("straight.tif"));
  ASSERT_TRUE(straight) << straight.error().message;
  const float alpha = straight->at(1, 1, 3);
  EXPECT_NEAR(alpha, 0.5f, 0.003f);
  EXPECT_NEAR(straight->at(1, 1, 0), srgb_to_linear(64 / 255.0f) * alpha, 2e-3f);
  EXPECT_NEAR(straight->at(1, 1, 1), srgb_to_linear(128 / 255.0f) * alpha, 2e-3f);
}

TEST(ReadImage, ContentWinsOverTheName) {
  const TemporaryFolder folder;
  const auto image = read_image(folder.write("a.exr", make_png(1, 1, 8, 2, {"\xff\xff\xff"})));
  ASSERT_TRUE(image) << image.error().message;
  EXPECT_EQ(image->pixels, (std::vector<float>{1, 1, 1}));
}

/// A red and a green pixel, as a Targa of `type` with the rows from the bottom up.
std::string targa(int type, const std::string& pixels) {
  std::string bytes(18, 0);
  bytes[2] = static_cast<char>(type);
  bytes[12] = 2, bytes[14] = 1, bytes[16] = 24;
  return bytes + pixels;
}

/// What game models' textures come as. Targa says nowhere in front what it is.
TEST(ReadImage, ReadsWhatTexturesComeAs) {
  const std::string red_green("\0\0\xff\0\xff\0", 6), runs("\x80\0\0\xff\0\0\xff\0", 8);
  std::string bmp("BM\x3e\0\0\0\0\0\0\0\x36\0\0\0\x28\0\0\0\2\0\0\0\1\0\0\0\1\0\x18\0", 30);
  bmp += std::string(24, 0) + red_green + std::string(2, 0);
  Image picture = make_image(2, 1, {"R", "G", "B"});
  picture.pixels = {1, 0, 0, 0, 1, 0};
  const auto gif = encode_gif(std::span(&picture, 1), 10);
  ASSERT_TRUE(gif);
  const std::string webp(
      "RIFF\x1e\0\0\0WEBPVP8L\x11\0\0\0\x2f\1\0\0\0\x0f\xb0\xff\xf3\x1f\xf3\x1f\x15\x32\xa2\xff\1"
      "\0",
      38);
  const TemporaryFolder folder;
  const std::vector<std::pair<std::string, std::string>> files{
      {"a.tga", targa(2, red_green)},
      {"runs.tga", targa(10, runs)},
      {"new.tga", targa(2, red_green) + std::string(8, 0) + std::string("TRUEVISION-XFILE.\0", 18)},
      {"nameless", targa(2, red_green)},
      {"wrong.png", targa(2, red_green)},
      {"a.bmp", bmp},
      {"bmp.tga", bmp},
      {"a.gif", *gif},
      {"a.webp", webp},
      {"a.ppm", "P6\n2 1\n255\n" + std::string("\xff\0\0\0\xff\0", 6)}};
  for (const auto& [name, bytes] : files) {
    const auto image = read_image(folder.write(name, bytes), {.alpha = AlphaMode::kStraight});
    ASSERT_TRUE(image) << image.error().message;
    ASSERT_EQ(image->width, 2) << name;
    ASSERT_EQ(image->height, 1) << name;
    for (int x = 0; x < 2; ++x)
      for (int c = 0; c < 3; ++c) EXPECT_NEAR(image->at(x, 0, c), x == c, 0.02) << name << x << c;
  }
}

TEST(ReadImage, RefusesBrokenTextures) {
  const TemporaryFolder folder;
  const std::string red_green("\0\0\xff\0\xff\0", 6);
  expect_mentions(failure_of(folder.write("a.tga", targa(2, red_green.substr(1)))), "truncated");
  failure_of(folder.write("runs.tga", targa(10, "\x81")));
  // A map of two colours, and a third that a pixel names: OpenImageIO would read beyond the map.
  std::string mapped = targa(1, std::string(6, 0) + "\1\2");
  mapped[1] = 1, mapped[5] = 2, mapped[7] = 24, mapped[16] = 8;
  expect_mentions(failure_of(folder.write("map.tga", mapped)), "colour map");
  mapped.back() = 0;
  EXPECT_TRUE(read_image(folder.write("map.tga", mapped)));
  expect_mentions(failure_of(folder.write("b.tga", "hello, this is text")), "header is damaged");
  const std::string vast = std::string("GIF89a\xff\xff\xff\xff\0\0\0", 13);
  expect_mentions(failure_of(folder.write("vast.gif", vast)), "more than the limit");
  std::string bmp = "BM" + std::string(60, 0);
  bmp[14] = 40, bmp[18] = 2, bmp[22] = 1, bmp[28] = 8, bmp[30] = 1;
  expect_mentions(failure_of(folder.write("rle.bmp", bmp)), "run-length encoded BMPs are not read");
  bmp[30] = 0, bmp[22] = 120;
  expect_mentions(failure_of(folder.write("cut.bmp", bmp)), "the BMP is truncated");
}

TEST(ReadImage, TellsWhatIsNotAnImage) {
  const TemporaryFolder folder;
  expect_mentions(failure_of(folder.write("t.png", "hello, this is text\n")), "not an image");
  expect_mentions(failure_of(folder.write("e.png", "")), "empty");
  expect_mentions(failure_of(folder.write("g.png", "GIF89a.....")), "GIF is truncated");
  expect_mentions(failure_of(folder.write("b.png", std::string("\x01\x02\x00\x03", 4))), "binary");
  expect_mentions(failure_of(folder.path()), "directory");
  failure_of(folder.path() / "missing.png");
}

TEST(ReadImage, RefusesEveryTruncationOfEveryFormat) {
  const TemporaryFolder folder;
  Image picture = random_image(40, 30, {"R", "G", "B"});
  const std::string whole[] = {*encode_png(picture), *encode_exr(picture),
                               bytes_of(data_file("rgb.jpg")), bytes_of(data_file("rgb8.tif")),
                               bytes_of(data_file("float.tif"))};
  for (const std::string& bytes : whole) {
    ASSERT_TRUE(read_image(folder.write("whole", bytes)));
    for (const double share : {0.02, 0.1, 0.3, 0.5, 0.7, 0.9, 0.98})
      failure_of(folder.write(
          "part",
          bytes.substr(0, static_cast<std::size_t>(share * static_cast<double>(bytes.size())))));
  }
}

TEST(ReadImage, DamagedPngNamesTheChecksum) {
  const TemporaryFolder folder;
  std::string bytes = *encode_png(random_image(20, 20, {"R", "G", "B"}));
  bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 1);
  expect_mentions(failure_of(folder.write("d.png", bytes)), "checksum");
}

TEST(ReadImage, SurvivesRandomDamage) {
  const TemporaryFolder folder;
  const std::string wholes[] = {*encode_exr(random_image(16, 16, {"R", "G", "B", "Z"})),
                                bytes_of(data_file("rgb.jpg")), bytes_of(data_file("rgb8.tif")),
                                bytes_of(data_file("float.tif"))};
  for (const std::string& whole : wholes) {
    int refused = 0;
    for (std::uint64_t round = 0; round < 100; ++round) {
      std::string bytes = whole;
      for (std::uint64_t k = 0; k < 3; ++k)
        bytes[random_below(static_cast<std::uint32_t>(bytes.size()), 7, round, 2 * k)] =
            static_cast<char>(random_u64(7, round, 2 * k + 1));
      const auto image = read_image(folder.write("damaged", bytes), {.max_bytes = 1 << 24});
      if (image) continue;
      ++refused;
      EXPECT_EQ(image.error().code, ErrorCode::kInput) << image.error().message;
    }
    EXPECT_GT(refused, 5);
  }
}

TEST(ReadImage, AnExrAttributeLargerThanTheFileIsNotAllocated) {
  const TemporaryFolder folder;
  Image image = random_image(4, 4, {"R", "G", "B"});
  image.attributes = {{"polymorph/note", std::string("text")}};
  std::string bytes = *encode_exr(image);
  const std::string start = std::string("polymorph/note") + '\0' + "string" + '\0';
  const std::size_t size_at = bytes.find(start) + start.size();
  bytes.replace(size_at, 4, std::string("\x00\x00\x00\x7f", 4));  // 2 GB
  expect_mentions(failure_of(folder.write("a.exr", bytes)), "header is damaged");
}

TEST(ReadImage, ChecksTheSizeBeforeReadingPixels) {
  const TemporaryFolder folder;
  // A header of 100000 x 100000 over a few bytes of pixels.
  const auto bomb = folder.write("bomb.png", make_png(100000, 100000, 8, 6, {"\x01"}));
  const std::string message = failure_of(bomb);
  expect_mentions(message, "100000 x 100000");
  expect_mentions(message, "160.0 GB");
  const auto small = folder.write("small.png", *encode_png(random_image(20, 20, {"R", "G", "B"})));
  expect_mentions(failure_of(small, {.max_bytes = 4799}), "20 x 20");
  EXPECT_TRUE(read_image(small, {.max_bytes = 4800}));
}

TEST(ReadImage, NamesThePathsWhereTheModuleWasLookedFor) {
  // The module may be open already: "threadsafe" asks in a fresh process.
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  const TemporaryFolder folder;
  const auto path = folder.write("a.exr", *encode_exr(random_image(2, 2, {"R", "G", "B"})));
  const auto png = folder.write("a.png", make_png(1, 1, 8, 2, {"\xff\xff\xff"}));
  EXPECT_EXIT(
      {
        setenv("POLYMORPH_OIIO_MODULE", "/nowhere/polymorph_oiio.so", 1);
        if (!read_image(png)) std::exit(1);  // needs no module
        const auto image = read_image(path);
        if (image) std::exit(0);
        std::fputs(image.error().message.c_str(), stderr);
        std::exit(static_cast<int>(image.error().code));
      },
      testing::ExitedWithCode(5), "/nowhere/polymorph_oiio.so: does not exist");
}

TEST(OiioModule, IsTheOnlyOneThatKnowsOpenImageIo) {
  const std::string own = std::filesystem::read_symlink("/proc/self/exe").string();
  const auto links_openimageio = [](const std::string& file) {
    return std::system(("readelf -d '" + file + "' | grep -q libOpenImageIO").c_str()) == 0;
  };
  if (std::system("readelf --version >/dev/null 2>&1") != 0)
    GTEST_SKIP() << "readelf is not installed";
  EXPECT_FALSE(links_openimageio(own));
  EXPECT_TRUE(
      links_openimageio((std::filesystem::path(own).parent_path() / "polymorph_oiio.so").string()));
}

TEST(WriteImage, ChoosesTheFormatByExtension) {
  const TemporaryFolder folder;
  const Image image = random_image(8, 8, {"R", "G", "B"});
  ASSERT_TRUE(write_image(folder.path() / "a.exr", image));
  ASSERT_TRUE(write_image(folder.path() / "b.PNG", image));
  EXPECT_EQ(read_image(folder.path() / "a.exr")->pixels, image.pixels);
  EXPECT_TRUE(read_image(folder.path() / "b.PNG"));
  const auto other = write_image(folder.path() / "c.jpg", image);
  ASSERT_FALSE(other);
  EXPECT_EQ(other.error().code, ErrorCode::kUsage);
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "c.jpg"));
}

TEST(WriteImage, LeavesNothingBehindWhereItCannotWrite) {
  const TemporaryFolder folder;
  folder.write("file", "x");
  const Image image = random_image(8, 8, {"R", "G", "B"});
  const auto below_a_file = write_image(folder.path() / "file" / "a.png", image);
  ASSERT_FALSE(below_a_file);
  EXPECT_EQ(below_a_file.error().code, ErrorCode::kOutput);
  std::filesystem::create_directory(folder.path() / "b.png");
  const auto over_a_folder = write_image(folder.path() / "b.png", image);
  ASSERT_FALSE(over_a_folder);
  EXPECT_EQ(over_a_folder.error().code, ErrorCode::kOutput);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 2);
  if (geteuid() == 0) return;  // root may write anywhere
  std::filesystem::permissions(
      folder.path(), std::filesystem::perms::owner_read | std::filesystem::perms::owner_exec);
  EXPECT_FALSE(write_image(folder.path() / "c.png", image));
  std::filesystem::permissions(folder.path(), std::filesystem::perms::owner_all);
}

TEST(WriteImage, ReportsAFullDisk) {
  const TemporaryFolder folder;
  if (mount("tmpfs", folder.path().c_str(), "tmpfs", 0, "size=65536") != 0)
    GTEST_SKIP() << "no right to mount a small tmpfs here";
  const Image image = random_image(256, 256, {"R", "G", "B"});
  const auto png = write_image(folder.path() / "a.png", image),
             exr = write_image(folder.path() / "a.exr", image);
  const auto left = std::distance(std::filesystem::directory_iterator(folder.path()), {});
  umount(folder.path().c_str());
  ASSERT_FALSE(png);
  ASSERT_FALSE(exr);
  EXPECT_EQ(png.error().code, ErrorCode::kOutput);
  expect_mentions(png.error().message, "No space left");
  EXPECT_EQ(left, 0);
}

TEST(PixelDigest, DependsOnSizeNamesAndEveryValue) {
  const Image image = random_image(6, 4, {"R", "G"});
  Image other = image;
  std::swap(other.width, other.height);
  EXPECT_NE(pixel_digest(image), pixel_digest(other));
  other = image;
  other.channels[1] = "B";
  EXPECT_NE(pixel_digest(image), pixel_digest(other));
  other = image;
  other.pixels[17] = std::nextafter(other.pixels[17], 2.0f);
  EXPECT_NE(pixel_digest(image), pixel_digest(other));
  other = image;
  other.attributes = {{"note", 1}};
  EXPECT_EQ(pixel_digest(image), pixel_digest(other));
}

TEST(ReadImage, AFileOfSeveralPicturesIsRefusedWhereItMustBeOne) {
  const ReadImageSettings single{.single_picture = true};
  EXPECT_TRUE(read_image(data_file("part.exr"), single));
  const TemporaryFolder folder;
  // More channels than are joined.
  Image many = random_image(2, 2, {"R", "G", "B"}, 1);
  for (int i = 0; i < 254; ++i) many.channels.push_back(fmt::format("layer{:03}", i));
  many.pixels.resize(4 * many.channels.size());
  const auto layers = folder.write("many.exr", *encode_exr(many, {.multipart = true}));
  expect_mentions(failure_of(layers, single), "several parts");
  const auto first = read_image(layers);
  ASSERT_TRUE(first) << first.error().message;
  EXPECT_EQ(first->channels, (std::vector<std::string>{"R", "G", "B"}));
  const Image frames[] = {random_image(8, 8, {"R", "G", "B"}, 1),
                          random_image(8, 8, {"R", "G", "B"}, 2)};
  const auto gif = encode_gif(frames, 10);
  ASSERT_TRUE(gif);
  expect_mentions(failure_of(folder.write("a.gif", *gif), single), "several parts");
}

TEST(ReadImage, EqualNamesInSeveralPartsAreTold) {
  const auto image = read_image(data_file("parts.exr"), {.single_picture = true});
  ASSERT_TRUE(image) << image.error().message;
  EXPECT_EQ(image->channels, (std::vector<std::string>{"Y", "two.Y"}));
}

TEST(ReadImage, EntriesThatShowPixelsDifferentlyAreKept) {
  const TemporaryFolder folder;
  const auto entry = [&](const Result<Image>& image, const char* name) -> double {
    EXPECT_TRUE(image);
    for (const Attribute& a : image->attributes) {
      if (a.name != name) continue;
      const int* integer = std::get_if<int>(&a.value);
      return integer ? *integer : static_cast<double>(std::get<float>(a.value));
    }
    return 0;
  };
  const auto exr = read_image(data_file("aspect.exr"));
  EXPECT_EQ(entry(exr, kPixelAspectAttribute), 2);
  EXPECT_EQ(entry(read_image(data_file("part.exr")), kPixelAspectAttribute), 0) << "the usual one";
  // It survives being written.
  const auto again = encode_exr(*exr);
  ASSERT_TRUE(again) << again.error().message;
  EXPECT_EQ(entry(decode_image(*again, "again"), kPixelAspectAttribute), 2);

  const std::string png = make_png(1, 1, 8, 0, {std::string("\x80", 1)});
  const auto with_chunk = [&](const std::string& chunk) {
    constexpr std::size_t kAfterHeader = 33;
    return read_image(folder.write("x.png", std::string(png).insert(kAfterHeader, chunk)));
  };
  EXPECT_NEAR(entry(with_chunk(png_chunk("gAMA", read_big_endian(100000))), kGammaAttribute), 1,
              1e-6);
  EXPECT_EQ(entry(with_chunk(png_chunk("gAMA", read_big_endian(45455))), kGammaAttribute), 0)
      << "sRGB's";
  EXPECT_EQ(
      entry(with_chunk(png_chunk("gAMA", read_big_endian(100000)) + png_chunk("sRGB", {"\0", 1})),
            kGammaAttribute),
      0)
      << "sRGB overrides it";
  const std::string exif("II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0\x06\0\0\0\0\0\0\0", 26);
  EXPECT_EQ(entry(with_chunk(png_chunk("eXIf", exif)), kOrientationAttribute), 6);
  const std::string size = read_big_endian(2000) + read_big_endian(1000) + std::string(1, '\0');
  EXPECT_EQ(entry(with_chunk(png_chunk("pHYs", size)), kPixelAspectAttribute), 0.5);
}

/// The text of an entry, or "".
std::string text_of(const Result<Image>& image, const char* name) {
  EXPECT_TRUE(image) << image.error().message;
  for (const Attribute& a : image->attributes)
    if (a.name == name) return std::get<std::string>(a.value);
  return "";
}

TEST(ReadImage, ColorProfilesAndPrimariesAreKept) {
  const std::string png = make_png(1, 1, 8, 2, {std::string("\x80\x80\x80", 3)});
  const auto with_chunk = [&](const std::string& chunk) {
    constexpr std::size_t kAfterHeader = 33;
    return decode_image(std::string(png).insert(kAfterHeader, chunk), "x.png");
  };
  const auto primaries = [](std::uint32_t red_x) {
    std::string bytes;
    for (const std::uint32_t v : {31270u, 32900u, red_x, 33000u, 30000u, 60000u, 15000u, 6000u})
      bytes += read_big_endian(v);
    return png_chunk("cHRM", bytes);
  };
  EXPECT_EQ(text_of(with_chunk(primaries(64000)), kColorPrimariesAttribute), "") << "sRGB's";
  EXPECT_EQ(text_of(with_chunk(primaries(66000)), kColorPrimariesAttribute),
            "0.66 0.33 0.3 0.6 0.15 0.06 0.3127 0.329");
  // A cICP chunk goes before the others: Rec. 2020 by the PQ curve, and sRGB.
  const auto coding = [](const char(&numbers)[5]) {
    return png_chunk("cICP", std::string(numbers, 4));
  };
  const std::string gamma = png_chunk("gAMA", read_big_endian(100000));
  const auto wide = with_chunk(coding("\x09\x10\x00\x01") + gamma + primaries(66000));
  EXPECT_EQ(text_of(wide, kColorProfileAttribute), "cICP 9 16 0 1");
  EXPECT_EQ(text_of(wide, kColorPrimariesAttribute), "");
  const auto usual = with_chunk(coding("\x01\x0d\x00\x01") + gamma + primaries(66000));
  for (const char* name : {kColorProfileAttribute, kColorPrimariesAttribute})
    EXPECT_EQ(text_of(usual, name), "");
  for (const auto* image : {&wide, &usual})
    for (const Attribute& a : (*image)->attributes) EXPECT_NE(a.name, kGammaAttribute);

  auto exr = encode_exr(make_image(2, 2, {"R", "G", "B"}));
  ASSERT_TRUE(exr);
  EXPECT_EQ(text_of(decode_image(*exr, "a.exr"), kColorPrimariesAttribute), "");
  const std::string name("chromaticities\0chromaticities\0", 30);
  const std::size_t at = exr->find(name);
  ASSERT_NE(at, std::string::npos);
  const float red_x = 0.7f;
  std::memcpy(exr->data() + at + name.size() + 4, &red_x, sizeof red_x);
  EXPECT_EQ(text_of(decode_image(*exr, "a.exr"), kColorPrimariesAttribute).substr(0, 8),
            "0.7 0.33");

  // An APP2 segment of one part; OpenImageIO hands it on as it is.
  std::string jpeg = bytes_of(data_file("rgb.jpg"));
  const std::string profile(200, 'p'), part = std::string("ICC_PROFILE\0\1\1", 14) + profile;
  jpeg.insert(2, std::string("\xff\xe2\0", 3) + static_cast<char>(part.size() + 2) + part);
  EXPECT_NE(text_of(decode_image(jpeg, "a.jpg"), kColorProfileAttribute), "");
}

}  // namespace
}  // namespace polymorph
