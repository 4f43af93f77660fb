#include "spheres/convex_hull.h"

#include <gtest/gtest.h>

#include <vector>

#include "testing/model.h"

namespace polymorph {
namespace {

TEST(HullVolume, OfABoxIsItsOwn) {
  EXPECT_NEAR(hull_volume(box_model({1, 2, 3}, {2, 4, 6}).points), 6, 1e-9);
}

TEST(HullVolume, OfFourPointsIsTheTetrahedrons) {
  EXPECT_NEAR(hull_volume(std::vector<Vec3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}), 1.0 / 6,
              1e-12);
}

TEST(HullVolume, CountsTheGapBetweenTwoBoxesAndNotWhatIsInside) {
  Model model = box_model({0, 0, 0}, {1, 1, 1});
  add_box(model, {4, 0, 0}, {5, 1, 1});
  add_box(model, {2, 0.25f, 0.25f}, {3, 0.75f, 0.75f});
  EXPECT_NEAR(hull_volume(model.points), 5, 1e-9);
}

TEST(HullVolume, OfWhatHasNoVolumeIsZero) {
  EXPECT_EQ(hull_volume({}), 0);
  EXPECT_EQ(hull_volume(std::vector<Vec3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}), 0);
  EXPECT_EQ(hull_volume(std::vector<Vec3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}, {2, 1, 0}}),
            0);
  EXPECT_EQ(hull_volume(std::vector<Vec3>(9, Vec3{1, 1, 1})), 0);
}

}  // namespace
}  // namespace polymorph
