#include "analyze/registration_error.h"

#include <gtest/gtest.h>

#include "testing/analyze.h"

namespace polymorph {
namespace {

/// A slab 4 x 4 x 0.2: 32 of its area of 35.2 are 0.1 thick, from there to the middle.
Mesh slab() { return box_mesh({-2, -2, -0.1f}, {2, 2, 0.1f}); }

std::vector<Vec3> shifted(std::vector<Vec3> points, Vec3 shift) {
  for (Vec3& p : points) p = p + shift;
  return points;
}

TEST(SampleThickness, OfASlabIsHalfItsHeightOnTheFaces) {
  const ThicknessSamples samples = sample_thickness(slab());
  ASSERT_EQ(samples.points.size(), 4000u);
  std::size_t thin = 0;
  for (const double half : samples.half_thickness) {
    thin += half < 1;
    EXPECT_NEAR(half, half < 1 ? 0.1 : 2, 1e-5);
  }
  EXPECT_NEAR(static_cast<double>(thin) / 4000, 32 / 35.2, 1e-3);
}

TEST(SampleThickness, LeavesOutWhatHasNoOppositeWall) {
  Mesh face;
  face.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  face.triangles = {{{0, 1, 2}}};
  EXPECT_TRUE(sample_thickness(face).points.empty());
  EXPECT_FALSE(missed_fraction(sample_thickness(face), {}, slab(), 1));
}

TEST(ShareOff, IsTheAreaThatWasCarriedFurtherThanItIsThick) {
  const ThicknessSamples samples = sample_thickness(slab());
  EXPECT_EQ(missed_fraction(samples, samples.points, slab(), 1), 0);
  // The faces end 0.35 above the slab's top, and 0.15 above it.
  const std::vector<Vec3> above = shifted(samples.points, {0, 0, 0.35f});
  EXPECT_NEAR(*missed_fraction(samples, above, slab(), 1), 32 / 35.2, 1e-3);
  // The upper face alone is off by more than twice its half thickness.
  EXPECT_NEAR(*missed_fraction(samples, above, slab(), 2), 16 / 35.2, 1e-3);
  EXPECT_EQ(missed_fraction(samples, above, slab(), 4), 0);
  // And by less than half of it.
  EXPECT_EQ(missed_fraction(samples, shifted(samples.points, {0, 0, 0.04f}), slab(), 1), 0);
}

}  // namespace
}  // namespace polymorph
