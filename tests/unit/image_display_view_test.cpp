#include "image/display_view.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>

#include "image/color_space.h"
#include "image/image_io.h"
#include "image/srgb.h"
#include "testing/image.h"

namespace polymorph {
namespace {

/// Sets $OCIO while it lives.
class ConfigSet {
 public:
  explicit ConfigSet(const std::filesystem::path& config) { setenv("OCIO", config.c_str(), 1); }
  ~ConfigSet() { unsetenv("OCIO"); }
};

bool has_module() {
  std::error_code error;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", error);
  return std::filesystem::exists(program.parent_path() / "polymorph_ocio.so");
}
#define PM_SKIP_WITHOUT_OCIO() \
  if (!has_module()) GTEST_SKIP() << "built without OpenColorIO"

Image two_pixels() {
  Image image = make_image(2, 1, {"R", "G", "B", "A"});
  image.pixels = {0.08f, 0.18f, 0.5f, 1, 0.25f, 0.125f, 4, 0.5f};
  return image;
}

/// Codes of the picture that a view makes of two_pixels().
std::vector<float> codes_of(const DisplayView& view) {
  const auto transform = ViewTransform::open(view);
  EXPECT_TRUE(transform) << transform.error().message;
  Image image = two_pixels();
  EXPECT_TRUE(transform->apply(image));
  std::vector<float> codes;
  for (std::size_t i = 0; i < 8; ++i) {
    if (i % 4 == 3) continue;
    codes.push_back(linear_to_srgb(image.pixels[i] / image.pixels[i / 4 * 4 + 3]));
  }
  EXPECT_EQ(image.pixels[3], 1.0f);
  EXPECT_EQ(image.pixels[7], 0.5f);
  return codes;
}

void expect_near(const std::vector<float>& codes, const std::vector<float>& expected) {
  ASSERT_EQ(codes.size(), expected.size());
  for (std::size_t i = 0; i < codes.size(); ++i) EXPECT_NEAR(codes[i], expected[i], 2e-5f) << i;
}

TEST(DisplayView, GivesTheCodesOfTheView) {
  PM_SKIP_WITHOUT_OCIO();
  const ConfigSet config(data_file("view.ocio"));
  // Half the light, and its root; the second pixel's colours are 0.5, 0.25 and 8 without alpha.
  const std::vector<float> dim{0.2f, 0.3f, 0.5f, 0.5f, std::sqrt(0.125f), 1};
  expect_near(codes_of({"screen", "dim"}), dim);
  expect_near(codes_of({"screen", ""}), dim);  // the first view, and display, are the defaults
  expect_near(codes_of({"", "dim"}), dim);
  expect_near(codes_of({"screen", "swapped"}), {0.5f, 0.18f, 0.08f, 1, 0.25f, 0.5f});
}

TEST(DisplayView, FindsRec709ByTheInterchangeRole) {
  PM_SKIP_WITHOUT_OCIO();
  const ConfigSet config(data_file("interchange.ocio"));
  Image expected = two_pixels();
  convert_colors(expected, ColorSpace::kAcesCg);
  std::vector<float> values;
  for (std::size_t i = 0; i < 8; ++i)
    if (i % 4 != 3)
      values.push_back(std::min(expected.pixels[i] / expected.pixels[i / 4 * 4 + 3], 1.0f));
  // OpenColorIO's own matrix: output.colorspace has the same one.
  expect_near(codes_of({"screen", "ap1"}), values);
}

TEST(DisplayView, SaysWhatIsMissing) {
  const auto message = [](const DisplayView& view) {
    const auto transform = ViewTransform::open(view);
    return transform ? std::string() : transform.error().message;
  };
  const auto says = [&](const DisplayView& view, const std::string& words) {
    EXPECT_NE(message(view).find(words), std::string::npos) << message(view);
  };
  setenv("POLYMORPH_OCIO_MODULE", "/nowhere/ocio.so", 1);
  says({"screen", "dim"}, "cannot open polymorph_ocio.so");
  says({"screen", "dim"}, "/nowhere/ocio.so: does not exist");
  unsetenv("POLYMORPH_OCIO_MODULE");
  PM_SKIP_WITHOUT_OCIO();
  unsetenv("OCIO");
  says({"screen", "dim"}, "name it in the environment");
  const TemporaryFolder folder;
  {
    const ConfigSet config(folder.path() / "gone.ocio");
    says({"screen", "dim"}, "gone.ocio: ");
  }
  const ConfigSet config(data_file("view.ocio"));
  says({"sreen", "dim"}, "has no display \"sreen\" (known: \"screen\", \"wall\")");
  says({"screen", "dimm"}, "has no view \"dimm\" (known: \"dim\", \"swapped\")");
}

TEST(DisplayView, PicturesHaveTheCodesInTheirFiles) {
  PM_SKIP_WITHOUT_OCIO();
  const ConfigSet config(data_file("view.ocio"));
  const auto transform = ViewTransform::open({"screen", "dim"});
  ASSERT_TRUE(transform) << transform.error().message;
  Image image = make_image(1, 1, {"R", "G", "B"});
  image.pixels = {0.08f, 0.18f, 0.5f};  // codes 0.2, 0.3, 0.5
  ASSERT_TRUE(transform->apply(image));
  const auto png = encode_png(image);
  ASSERT_TRUE(png);
  const auto codes = decode_image(*png, "a.png", {.integer_curve = TransferCurve::kLinear});
  ASSERT_TRUE(codes);
  for (std::size_t c = 0; c < 3; ++c)
    EXPECT_EQ(std::lround(255 * codes->pixels[c]),
              std::lround(255 * std::sqrt(std::vector<float>{0.04f, 0.09f, 0.25f}[c])));
}

}  // namespace
}  // namespace polymorph
