// FLIP against what NVIDIA's own evaluator says of the pictures in tests/data/flip (made once by
// make.py there), and against what must hold by its definition.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>

#include "base/parallel.h"
#include "compare/flip.h"
#include "image/image_io.h"
#include "testing/paths.h"

namespace polymorph {
namespace {

const std::filesystem::path kFolder = source_dir() / "tests/data/flip";

Image picture(const std::string& name) {
  auto image = read_image(kFolder / (name + ".png"));
  EXPECT_TRUE(image) << name;
  return image ? std::move(*image) : Image{};
}

TEST(Flip, IsThatOfItsAuthors) {
  std::ifstream file(kFolder / "values.json");
  const auto values = nlohmann::json::parse(file);
  const Image reference = picture("reference");
  ASSERT_EQ(values["pictures"].size(), 8u);
  for (const auto& [name, want] : values["pictures"].items()) {
    SCOPED_TRACE(name);
    const Image actual = name == "same" ? reference : picture(name);
    FlipSettings settings;
    settings.pixels_per_degree = want["pixels_per_degree"];
    const auto map = flip_map(actual, reference, settings);
    const FlipStatistics figures = flip_statistics(map);
    EXPECT_NEAR(figures.mean, want["mean"], 1e-3);
    EXPECT_NEAR(figures.p99, want["p99"], 1e-3);
    EXPECT_NEAR(figures.max, want["max"], 1e-3);
    double worst = 0;
    for (const auto& point : want["points"]) {
      const auto i = point[1].get<std::size_t>() * static_cast<std::size_t>(reference.width) +
                     point[0].get<std::size_t>();
      worst = std::max(worst, std::abs(static_cast<double>(map[i]) - point[2].get<double>()));
    }
    EXPECT_LT(worst, 1e-4);
    RecordProperty(name, fmt::format("mean {:.6f}, farthest point {:.2g}", figures.mean, worst));
  }
}

Image flat(float r, float g, float b, int width = 40, int height = 30) {
  Image image = make_image(width, height, {"R", "G", "B"});
  for (std::size_t i = 0; i < image.pixels.size(); i += 3) {
    image.pixels[i] = r;
    image.pixels[i + 1] = g;
    image.pixels[i + 2] = b;
  }
  return image;
}

TEST(Flip, GreenAndBlueAreAsFarAsColoursGo) {
  const auto map = flip_map(flat(0, 1, 0), flat(0, 0, 1));
  for (const float value : map) ASSERT_NEAR(value, 1, 1e-5);
}

TEST(Flip, IsSymmetricAndIgnoresWhatCannotBeShown) {
  const Image a = picture("reference"), b = picture("shifted");
  EXPECT_EQ(flip_map(a, b), flip_map(b, a));
  const auto over = flip_map(flat(4, 4, 4), flat(1, 1, 1));
  EXPECT_EQ(flip_statistics(over).max, 0);
  // Two stops down the same two differ.
  EXPECT_GT(flip_statistics(flip_map(flat(4, 4, 4), flat(1, 1, 1), {.exposure = -2})).mean, 0.2);
}

TEST(Flip, NotFiniteIsAsBadAsItGets) {
  const Image reference = flat(0.2f, 0.3f, 0.4f);
  Image bad = reference;
  bad.at(7, 9, 1) = std::numeric_limits<float>::quiet_NaN();
  for (const auto& map : {flip_map(bad, reference), flip_map(reference, bad)}) {
    EXPECT_EQ(map[9 * 40 + 7], 1);
    EXPECT_EQ(map.back(), 0) << "far from it nothing has changed";
    for (const float value : map) ASSERT_TRUE(std::isfinite(value));
  }
}

TEST(Flip, IsTheSameForAnyThreadCount) {
  const Image a = picture("reference"), b = picture("noise_10");
  set_thread_count(1);
  const auto one = flip_map(a, b);
  set_thread_count(3);
  EXPECT_EQ(flip_map(a, b), one);
  set_thread_count(0);
}

TEST(Flip, FiguresAreThoseOfTheDefinitions) {
  std::vector<float> map(200);
  for (std::size_t i = 0; i < map.size(); ++i) map[i] = static_cast<float>((i * 7) % 200);
  const FlipStatistics figures = flip_statistics(map);
  EXPECT_DOUBLE_EQ(figures.mean, 99.5);
  EXPECT_EQ(figures.median, 99);
  EXPECT_EQ(figures.p99, 197);
  EXPECT_EQ(figures.max, 199);
  EXPECT_EQ(flip_statistics({}).max, 0);
}

}  // namespace
}  // namespace polymorph
