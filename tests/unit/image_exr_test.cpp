#include <ImfChannelList.h>
#include <ImfChromaticitiesAttribute.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputPart.h>
#include <ImfMultiPartInputFile.h>
#include <ImfOutputFile.h>
#include <ImfStringAttribute.h>

#include <cmath>
#include <limits>

#include "base/parallel.h"
#include "image/exr_header.h"
#include "image/image_io.h"
#include "testing/image.h"
#include "testing/temporary_folder.h"

namespace polymorph {
namespace {

TEST(EncodeExr, KeepsHalfColoursAndFloatChannelsExactly) {
  Image image = random_image(37, 21, {"R", "G", "B", "A", "Z", "N.X", "N.Y", "N.Z", "id"});
  image.at(3, 2, 4) = 1e10f;
  image.at(4, 2, 4) = 3.14159265f;  // no half holds it
  image.at(5, 2, 0) = -0.25f;
  const auto bytes = encode_exr(image);
  ASSERT_TRUE(bytes);
  const Image back = read_back("a.exr", *bytes);
  EXPECT_EQ(back.width, 37);
  EXPECT_EQ(back.height, 21);
  EXPECT_EQ(back.channels, image.channels);
  EXPECT_EQ(back.pixels, image.pixels);
  EXPECT_EQ(pixel_digest(back), pixel_digest(image));
}

TEST(EncodeExr, RoundsColoursToHalf) {
  Image image = make_image(1, 1, {"R", "G", "B"});
  image.pixels = {0.1f, 1.0f + 0x1p-12f, 0x1p-30f};
  const Image back = read_back("a.exr", *encode_exr(image));
  EXPECT_EQ(back.pixels, (std::vector<float>{0.0999755859375f, 1.0f, 0.0f}));
}

TEST(EncodeExr, ClampsFiniteColoursAndKeepsNotFiniteOnes) {
  Image image = make_image(2, 1, {"R", "G", "B"});
  image.pixels = {1e6f, -1e6f, 0, std::numeric_limits<float>::infinity(), NAN, 1};
  const Image back = read_back("a.exr", *encode_exr(image));
  EXPECT_EQ(back.at(0, 0, 0), 65504.0f);
  EXPECT_EQ(back.at(0, 0, 1), -65504.0f);
  EXPECT_TRUE(std::isinf(back.at(1, 0, 0)));
  EXPECT_TRUE(std::isnan(back.at(1, 0, 1)));
}

TEST(EncodeExr, OrdersChannelsOnReading) {
  Image image =
      random_image(5, 4, {"zeta", "Z", "N.Z", "N.X", "N.Y", "alpha.x", "A", "B", "G", "R"});
  const Image back = read_back("a.exr", *encode_exr(image));
  EXPECT_EQ(back.channels, (std::vector<std::string>{"R", "G", "B", "A", "Z", "N.X", "N.Y", "N.Z",
                                                     "alpha.x", "zeta"}));
  for (const std::string& name : image.channels)
    EXPECT_EQ(back.at(4, 3, back.find_channel(name)), image.at(4, 3, image.find_channel(name)))
        << name;
}

TEST(EncodeExr, KeepsAttributesWithTheirTypes) {
  Image image = random_image(4, 4, {"R", "G", "B"});
  const std::string long_name = "polymorph/" + std::string(60, 'x');
  image.attributes = {{"polymorph/frame", 17},
                      {"polymorph/t", 0.125f},
                      {"polymorph/scene", std::string("scenes/a.json")},
                      {long_name, -3}};
  const Image back = read_back("a.exr", *encode_exr(image));
  const auto find = [&](const std::string& name) -> const Attribute* {
    for (const Attribute& attribute : back.attributes)
      if (attribute.name == name) return &attribute;
    return nullptr;
  };
  for (const Attribute& attribute : image.attributes) {
    ASSERT_NE(find(attribute.name), nullptr) << attribute.name;
    EXPECT_EQ(find(attribute.name)->value, attribute.value) << attribute.name;
  }
  // What was given, and the name of the colours' space: all else that the encoder adds describes
  // the file.
  EXPECT_EQ(back.attributes.size(), image.attributes.size() + 1);
  EXPECT_TRUE(encode_exr(back)) << "what was read can be written again";
}

TEST(EncodeExr, NamesTheSpaceOfItsColours) {
  const auto names = [](const Image& image) {
    std::vector<std::string> found;
    for (const Attribute& attribute : image.attributes)
      if (attribute.name == "colorInteropID")
        found.push_back(std::get<std::string>(attribute.value));
    return found;
  };
  Image image = random_image(3, 2, {"R", "G", "B"});
  EXPECT_EQ(names(read_back("a.exr", *encode_exr(image))),
            std::vector<std::string>{"lin_rec709_scene"});
  // What another file said of itself is no word about this one.
  image.attributes = {{"colorInteropID", std::string("g22_adobergb_scene")}};
  EXPECT_EQ(names(read_back("a.exr", *encode_exr(image))),
            std::vector<std::string>{"lin_rec709_scene"});
}

TEST(EncodeExr, GivesTheSameBytesOnEachRunAndForAnyThreadCount) {
  Image image = random_image(200, 150, {"R", "G", "B", "A", "Z"});
  image.attributes = {{"polymorph/frame", 3}};
  set_thread_count(1);
  const std::string one = *encode_exr(image);
  set_thread_count(2);
  const std::string two = *encode_exr(image), again = *encode_exr(image);
  set_thread_count(0);
  EXPECT_TRUE(one == two);
  EXPECT_TRUE(two == again);
}

TEST(EncodeExr, RefusesWhatItCannotStore) {
  Image image = random_image(2, 2, {"R", "G", "B"});
  image.attributes = {{"compression", std::string("none")}};
  ASSERT_FALSE(encode_exr(image));
  EXPECT_NE(encode_exr(image).error().message.find("'compression'"), std::string::npos);
  image.attributes = {{"a", 1}, {"a", 2}};
  EXPECT_FALSE(encode_exr(image));
  EXPECT_FALSE(encode_exr(random_image(2, 2, {"R", "R"})));
  EXPECT_FALSE(encode_exr(make_image(0, 4, {"R"})));
  EXPECT_FALSE(encode_exr(random_image(2, 2, {std::string(300, 'x')})));
  EXPECT_FALSE(encode_exr(random_image(2, 2, {std::string("a\0b", 3)})));
  image.attributes = {{"a", std::string("x\0y", 3)}};
  EXPECT_EQ(encode_exr(image).error().code, ErrorCode::kOutput);
}

TEST(EncodeExr, ReportsWhatOpenExrRefuses) {
  Image image = random_image(2, 2, {"R", "G", "B"});
  image.attributes = {{kPixelAspectAttribute, 0.0f}};
  const auto bytes = encode_exr(image);
  ASSERT_FALSE(bytes);
  EXPECT_EQ(bytes.error().code, ErrorCode::kOutput);
  EXPECT_NE(bytes.error().message.find("cannot encode the EXR"), std::string::npos);
}

/// A picture of 2 x 2 with R and "id", which is UINT.
Result<Image> read_with_ids(std::vector<unsigned> ids) {
  const TemporaryFolder folder;
  const std::string path = (folder.path() / "ids.exr").string();
  std::vector<float> reds{0.25f, 0.5f, 0.75f, 1.0f};
  {
    Imf::Header header(2, 2);
    header.channels().insert("id", Imf::Channel(Imf::UINT));
    header.channels().insert("R", Imf::Channel(Imf::FLOAT));
    Imf::OutputFile file(path.c_str(), header);
    Imf::FrameBuffer buffer;
    buffer.insert("id", Imf::Slice(Imf::UINT, reinterpret_cast<char*>(ids.data()), 4, 8));
    buffer.insert("R", Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(reds.data()), 4, 8));
    file.setFrameBuffer(buffer);
    file.writePixels(2);
  }
  return read_image(path);
}

TEST(ReadImage, KeepsTheNumbersOfUintChannels) {
  const auto image = read_with_ids({7, 4000000, 0, 1});
  ASSERT_TRUE(image) << image.error().message;
  EXPECT_EQ(image->channels, (std::vector<std::string>{"R", "id"}));
  ASSERT_EQ(image->attributes.size(), 1u);
  EXPECT_EQ(image->attributes[0].name, kIdChannelsAttribute);
  EXPECT_EQ(std::get<std::string>(image->attributes[0].value), "id");
  EXPECT_EQ(image->pixels, (std::vector<float>{0.25f, 7, 0.5f, 4000000, 0.75f, 0, 1, 1}));
}

TEST(ReadImage, KeepsIdsApartThatAFloatWouldRound) {
  const auto image = read_with_ids({0xfffffffe, 0xffffffff, 0x80000001, 5});
  ASSERT_TRUE(image) << image.error().message;
  EXPECT_EQ(image->channels, (std::vector<std::string>{"R", "id", "id.low"}));
  EXPECT_EQ(std::get<std::string>(image->attributes.at(0).value), "id,id.low");
  EXPECT_EQ(image->pixels, (std::vector<float>{0.25f, 0xffffff00, 254, 0.5f, 0xffffff00, 255, 0.75f,
                                               0x80000000, 1, 1, 0, 5}));
}

TEST(ReadImage, PlacesTheDataWindowInTheDisplayWindow) {
  const auto image = read_image(data_file("crop.exr"));
  ASSERT_TRUE(image) << image.error().message;
  ASSERT_EQ(image->width, 8);
  ASSERT_EQ(image->height, 4);
  for (int y = 0; y < 4; ++y)
    for (int x = 0; x < 8; ++x) {
      const bool inside = x >= 2 && x < 5 && y >= 1 && y < 3;
      EXPECT_EQ(image->at(x, y, 1), inside ? 0.5f : 0.0f) << x << ", " << y;
    }
}

Image layered_image() {
  Image image = random_image(19, 33,
                             {"R", "G", "B", "A", "Z", "N.X", "N.Y", "N.Z", "albedo.B", "albedo.G",
                              "albedo.R", "crypto_object00.G", "crypto_object00.R"});
  image.attributes = {{"note", std::string("a")},
                      {"pixelAspectRatio", 2.0f},
                      {"cryptomatte/1234567/name", std::string("crypto_object")},
                      {"cryptomatte/1234567/manifest", std::string("{}")}};
  return image;
}

/// Channels of a part, as in "A half, B half".
std::string describe_channels(const Imf::Header& header) {
  std::string text;
  for (auto c = header.channels().begin(); c != header.channels().end(); ++c)
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", c.name(),
                        c.channel().type == Imf::HALF ? "half" : "float");
  return text;
}

std::string header_text(const Imf::Header& header, const char* name) {
  const auto* text = header.findTypedAttribute<Imf::StringAttribute>(name);
  return text ? text->value() : "none";
}

TEST(EncodeExr, GivesEachLayerAPart) {
  const Image image = layered_image();
  const auto bytes = encode_exr(image, {.multipart = true});
  ASSERT_TRUE(bytes);
  const TemporaryFolder folder;
  const Imf::MultiPartInputFile file(folder.write("a.exr", *bytes).c_str());
  ASSERT_EQ(file.parts(), 5);
  const char* const expected[][3] = {
      {"rgba", "A half, B half, G half, R half", "lin_rec709_scene"},
      {"N", "N.X float, N.Y float, N.Z float", "data"},
      {"Z", "Z float", "data"},
      {"albedo", "albedo.B float, albedo.G float, albedo.R float", "lin_rec709_scene"},
      {"crypto_object00", "crypto_object00.G float, crypto_object00.R float", "data"}};
  for (int i = 0; i < file.parts(); ++i) {
    const Imf::Header& header = file.header(i);
    EXPECT_EQ(header.name(), expected[i][0]);
    EXPECT_EQ(describe_channels(header), expected[i][1]);
    EXPECT_EQ(header_text(header, "colorInteropID"), expected[i][2]);
    EXPECT_EQ(header.pixelAspectRatio(), 2.0f);
    EXPECT_NE(header.findTypedAttribute<Imf::ChromaticitiesAttribute>("chromaticities"), nullptr);
    EXPECT_EQ(header_text(header, "note"), i == 0 ? "a" : "none");
    EXPECT_EQ(header_text(header, "cryptomatte/1234567/manifest"),
              i == 0 || i == 4 ? "{}" : "none");
  }
}

TEST(EncodeExr, TheEntriesOfAFileCanBeWrittenAgain) {
  Image image = random_image(5, 4, {"R", "G", "B"});
  image.attributes = {{"polymorph/frame", 17}, {"note", std::string("a")}};
  const TemporaryFolder folder;
  const auto entries = read_exr_attributes(folder.write("a.exr", *encode_exr(image)));
  ASSERT_TRUE(entries);
  image.attributes = *entries;
  const auto bytes = encode_exr(image);
  ASSERT_TRUE(bytes) << bytes.error().message;
  const auto again = read_exr_attributes(folder.write("b.exr", *bytes));
  ASSERT_TRUE(again);
  ASSERT_EQ(again->size(), entries->size());
  for (std::size_t i = 0; i < entries->size(); ++i) {
    EXPECT_EQ((*again)[i].name, (*entries)[i].name);
    EXPECT_EQ((*again)[i].value, (*entries)[i].value);
  }
}

TEST(EncodeExr, PartsAreReadAsOnePicture) {
  const Image image = layered_image();
  const std::string one = *encode_exr(image), parts = *encode_exr(image, {.multipart = true});
  const Image expected = read_back("a.exr", one), back = read_back("a.exr", parts);
  EXPECT_EQ(back.channels, expected.channels);
  EXPECT_EQ(back.pixels, expected.pixels);
  const auto own_entries = [](const Image& read) {
    std::vector<std::string> names;
    for (const Attribute& attribute : read.attributes)
      if (!attribute.name.starts_with(kPartAttribute)) names.push_back(attribute.name);
    std::sort(names.begin(), names.end());
    return names;
  };
  EXPECT_EQ(own_entries(back), own_entries(expected));
  EXPECT_EQ(back.attributes.size(), expected.attributes.size() + 5) << "the list of parts";
  EXPECT_TRUE(decode_image(parts, "a.exr", {.single_picture = true}));
  set_thread_count(1);
  const std::string alone = *encode_exr(image, {.multipart = true});
  set_thread_count(3);
  EXPECT_EQ(*encode_exr(image, {.multipart = true}), alone);
  set_thread_count(0);
  // One layer makes no parts.
  const Image colors = random_image(5, 4, {"R", "G", "B", "A"});
  EXPECT_EQ(*encode_exr(colors, {.multipart = true}), *encode_exr(colors));
}

}  // namespace
}  // namespace polymorph
