#include "model/repair/face_classes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace polymorph {
namespace {

/// A cone of `count` triangles without a base; with a second one below it, a closed bipyramid.
Model cone(std::uint32_t count, bool closed) {
  Model model;
  model.points = {{0, 0, 1}, {0, 0, -1}};
  for (std::uint32_t i = 0; i < count; ++i) {
    const float angle =
        2 * std::numbers::pi_v<float> * static_cast<float>(i) / static_cast<float>(count);
    model.points.push_back({std::cos(angle), std::sin(angle), 0});
  }
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint32_t a = 2 + i, b = 2 + (i + 1) % count;
    model.triangles.push_back({{0, a, b}});
    if (closed) model.triangles.push_back({{1, b, a}});
  }
  return model;
}

double share_of(const std::vector<FaceClass>& classes, FaceClass face_class) {
  return static_cast<double>(std::count(classes.begin(), classes.end(), face_class)) /
         static_cast<double>(classes.size());
}

TEST(FaceClasses, AClosedBodyHasBoundaries) {
  for (const std::uint32_t count : {90u, 9000u}) {
    const Model model = cone(count, true);
    const auto classes = classify_faces(model, InsideTest(model), 1e-3f);
    EXPECT_EQ(share_of(classes, FaceClass::kBoundary), 1) << count;
  }
}

TEST(FaceClasses, ThousandsOfLongTrianglesAreAsFewAre) {
  const Model few = cone(90, false), many = cone(20000, false);
  const auto classes = classify_faces(few, InsideTest(few), 1e-3f),
             of_many = classify_faces(many, InsideTest(many), 1e-3f);
  ASSERT_EQ(of_many.size(), many.triangles.size());
  for (const FaceClass face_class :
       {FaceClass::kBoundary, FaceClass::kMixed, FaceClass::kSheet, FaceClass::kHidden})
    EXPECT_NEAR(share_of(of_many, face_class), share_of(classes, face_class), 0.02);
}

}  // namespace
}  // namespace polymorph
