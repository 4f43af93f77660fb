#include "model/color_volume.h"

#include <gtest/gtest.h>

#include "testing/model.h"

namespace polymorph {
namespace {

Material colored(Vec3 color) {
  Material material;
  material.color = color;
  return material;
}

/// Two boxes side by side along x, the left one red, the right one green.
Model red_and_green() {
  Model model = box_model({0, 0, 0}, {1, 1, 1});
  add_box(model, {3, 0, 0}, {4, 1, 1});
  model.materials = {colored({1, 0, 0}), colored({0, 1, 0})};
  model.triangle_materials.assign(12, 0);
  model.triangle_materials.resize(24, 1);
  return model;
}

std::vector<FaceClass> all_bounding(const Model& model) {
  return std::vector<FaceClass>(model.triangles.size(), FaceClass::kBoundary);
}

TEST(ColorVolume, HasTheModelsColoursAtItsFaces) {
  const Model model = red_and_green();
  EXPECT_FALSE(is_one_color(model));
  const ColorVolume volume = make_color_volume(model, all_bounding(model));
  const Vec3 left = volume.at({0.2f, 1, 0.5f}), right = volume.at({3.8f, 0.5f, 1});
  EXPECT_GT(left.x, 0.99f);
  EXPECT_LT(left.y, 0.01f);
  EXPECT_GT(right.y, 0.99f);
  EXPECT_LT(right.x, 0.01f);
}

TEST(ColorVolume, MixesEvenlyHalfWayAndIsDefinedFarAway) {
  const Model model = red_and_green();
  const ColorVolume volume = make_color_volume(model, all_bounding(model));
  const Vec3 middle = volume.at({2, 0.5f, 0.5f});
  EXPECT_NEAR(middle.x, 0.5f, 0.05f);
  EXPECT_NEAR(middle.x + middle.y, 1, 1e-3f);
  const Vec3 far = volume.at({-50, 0.5f, 0.5f});
  EXPECT_GT(far.x, 0.9f) << "beyond the grid its border counts";
  float before = 1;
  for (float x = 1; x <= 3; x += 0.25f) {
    const Vec3 color = volume.at({x, 0.5f, 0.5f});
    EXPECT_LE(color.x, before + 1e-4f) << x;
    EXPECT_GE(color.x, -1e-6f);
    before = color.x;
  }
}

TEST(ColorVolume, LeavesOutHiddenFaces) {
  Model model = box_model({0, 0, 0}, {2, 2, 2});
  add_box(model, {0.6f, 0.6f, 0.6f}, {1.4f, 1.4f, 1.4f});
  model.materials = {colored({0, 0, 1}), colored({1, 0, 0})};
  model.triangle_materials.assign(12, 0);
  model.triangle_materials.resize(24, 1);
  const std::vector<FaceClass> classes = classify_faces(model, InsideTest(model), 0.01f);
  for (std::size_t t = 0; t < 24; ++t)
    EXPECT_EQ(classes[t], t < 12 ? FaceClass::kBoundary : FaceClass::kHidden) << t;
  EXPECT_EQ(list_outer_faces(classes).size(), 12u);
  const Vec3 seen = make_color_volume(model, classes).at({1, 1, 1.4f});
  EXPECT_EQ(seen.x, 0) << "the inner box is not seen";
  EXPECT_GT(make_color_volume(model, all_bounding(model)).at({1, 1, 1.4f}).x, 0.3f);
}

TEST(ColorVolume, OneColourIsToldFromSeveral) {
  Model model = red_and_green();
  model.materials[1].color = model.materials[0].color;
  EXPECT_TRUE(is_one_color(model));
  model.materials[1].texture = 0;
  EXPECT_FALSE(is_one_color(model));
}

}  // namespace
}  // namespace polymorph
