#include "model/color_cache.h"

#include <gtest/gtest.h>

#include "base/cache_file.h"
#include "base/file.h"
#include "base/hash.h"
#include "testing/model.h"
#include "testing/temporary_folder.h"
#include "testing/texture.h"

namespace polymorph {
namespace {

/// A box with a texture of red and green texels, beside a blue box.
Model textured_model() {
  Model model = box_model({0, 0, 0}, {1, 1, 1});
  add_box(model, {3, 0, 0}, {4, 1, 1});
  model.materials.resize(2);
  model.materials[0].texture = 0;
  model.materials[1].color = {0.1f, 0.2f, 0.9f};
  model.triangle_materials.assign(12, 0);
  model.triangle_materials.resize(24, 1);
  model.corner_uvs.resize(3 * model.triangles.size());
  for (std::size_t i = 0; i < model.corner_uvs.size(); ++i)
    model.corner_uvs[i] = {static_cast<float>(i % 3 == 1), static_cast<float>(i % 3 == 2)};
  Image image = make_image(2, 1, {"R", "G", "B"});
  image.at(0, 0, 0) = image.at(1, 0, 1) = 1;
  model.textures = {float_texture(std::move(image))};
  return model;
}

class ColorCacheTest : public ::testing::Test {
 protected:
  ColorVolume made(const Model& model, FaceClass first = FaceClass::kBoundary) {
    std::vector<FaceClass> face_classes(model.triangles.size(), FaceClass::kBoundary);
    face_classes[0] = first;
    return load_or_make_color_volume(model, face_classes, folder_.path());
  }
  std::vector<std::filesystem::path> files() {
    std::vector<std::filesystem::path> found;
    for (const auto& entry : std::filesystem::directory_iterator(folder_.path()))
      found.push_back(entry.path());
    return found;
  }
  TemporaryFolder folder_;
};

void expect_same_colors(const ColorVolume& a, const ColorVolume& b) {
  EXPECT_EQ(a.grid.origin, b.grid.origin);
  EXPECT_EQ(a.grid.cell, b.grid.cell);
  EXPECT_EQ(a.colors, b.colors);
}

TEST_F(ColorCacheTest, GivesBackWhatWasMadeToTheBit) {
  const Model model = textured_model();
  const std::vector<FaceClass> face_classes(model.triangles.size(), FaceClass::kBoundary);
  const ColorVolume fresh = make_color_volume(model, face_classes);
  expect_same_colors(fresh, made(model));
  ASSERT_EQ(files().size(), 1u);
  EXPECT_EQ(files()[0].extension(), kColorFiles.extension);
  expect_same_colors(fresh, made(model));
  EXPECT_EQ(files().size(), 1u);
}

TEST_F(ColorCacheTest, ReadsTheFileInsteadOfTheModel) {
  const Model model = textured_model();
  ColorVolume stored = made(model);
  // A file of the same key with another colour shows which of the two is used.
  const std::string key = files().at(0).stem().string();
  stored.colors[0] = {7, 8, 9};
  std::string bytes;
  put(bytes, stored.grid.origin);
  put(bytes, stored.grid.cell);
  put(bytes, stored.grid.points);
  put_array(bytes, stored.colors);
  store_cached(folder_.path(), key, kColorFiles, "", bytes);
  expect_same_colors(stored, made(model));
}

TEST_F(ColorCacheTest, AllInputsChangeTheKey) {
  const auto expect_new_key = [&](const Model& model, const char* what) {
    const std::size_t before = files().size();
    made(model);
    EXPECT_EQ(files().size(), before + 1) << what;
  };
  const Model model = textured_model();
  expect_new_key(model, "first");
  Model other = model;
  other.points[0].x = -0.5f;
  expect_new_key(other, "points");
  other = model;
  other.materials[1].color.y = 0.3f;
  expect_new_key(other, "colour");
  other = model;
  other.triangle_materials[3] = 1;
  expect_new_key(other, "materials of triangles");
  other = model;
  other.corner_uvs[5] = {0.5f, 0.5f};
  expect_new_key(other, "texture coordinates");
  other = model;
  Image image = model.textures[0]->image;
  image.at(0, 0, 2) = 0.5f;
  other.textures = {float_texture(std::move(image))};
  expect_new_key(other, "texture");
  const std::size_t before = files().size();
  made(model, FaceClass::kHidden);
  EXPECT_EQ(files().size(), before + 1) << "face_classes";
}

TEST_F(ColorCacheTest, ADamagedFileIsMadeAnew) {
  const Model model = textured_model();
  const ColorVolume fresh = made(model);
  const std::filesystem::path file = files().at(0);
  const std::string bytes = *read_file(file);
  ASSERT_TRUE(write_file(file, bytes.substr(0, bytes.size() / 2)).ok());
  expect_same_colors(fresh, made(model));
  EXPECT_EQ(*read_file(file), bytes) << "and kept again";
  // The checksum is right, but the colours are fewer than the grid's points.
  store_cached(folder_.path(), file.stem().string(), kColorFiles, "",
               std::string(sizeof(Vec3) + sizeof(float) + sizeof(Int3), '\1'));
  expect_same_colors(fresh, made(model));
  EXPECT_EQ(*read_file(file), bytes);
}

/// Where this fails although the colours are meant to have changed: raise kColorVolumeVersion, and
/// put the new digest here. Else files of an older program would be taken for this one's.
TEST_F(ColorCacheTest, TheVersionBelongsToTheseColours) {
  Hasher hasher;
  hasher.add(std::span<const Vec3>(made(textured_model()).colors));
  EXPECT_EQ(kColorVolumeVersion, 1u);
  EXPECT_EQ(hasher.hex(), "fcc2dd0a672cbe334469ec57fe002391");
}

}  // namespace
}  // namespace polymorph
