// Which models are vessels, and what fills them.
#include "model/repair/vessel.h"

#include <gtest/gtest.h>

#include <cmath>

#include "mesh/mesh_check.h"
#include "model/shapes.h"
#include "testing/model.h"

namespace polymorph {
namespace {

std::optional<FilledVessel> fill(const Model& model) {
  return fill_vessel(model, InsideTest(model));
}

MeshReport check_filled(const std::optional<FilledVessel>& vessel) {
  return vessel ? check_mesh({vessel->model.points, {}, vessel->model.triangles}) : MeshReport{};
}

/// A cup of faces without thickness, of radius 1 and height 2.
Model cup_of_faces() { return lathe({{0, 0}, {1, 0}, {1, 2}}); }

TEST(Vessel, ACupOfFacesIsClosedAtItsRim) {
  const auto vessel = fill(cup_of_faces());
  ASSERT_TRUE(vessel);
  EXPECT_TRUE(vessel->is_sheet);
  const MeshReport report = check_filled(vessel);
  EXPECT_TRUE(report.is_closed());
  EXPECT_NEAR(report.volume, 2 * M_PI, 0.02 * 2 * M_PI);
}

TEST(Vessel, BothEndsOfATubeAreClosed) {
  const auto vessel = fill(lathe({{1, 0}, {1, 2}}));
  EXPECT_TRUE(check_filled(vessel).is_closed());
}

TEST(Vessel, AClosedCupOfThinWallsIsFilledToItsRim) {
  const auto vessel = fill(lathe({{0, 0}, {1, 0}, {1, 2}, {0.97f, 2}, {0.97f, 0.03f}, {0, 0.03f}}));
  ASSERT_TRUE(vessel);
  EXPECT_FALSE(vessel->is_sheet);
  EXPECT_NEAR(check_filled(vessel).volume, 2 * M_PI, 0.1 * 2 * M_PI);
}

TEST(Vessel, ACupWithALidIsNone) {
  Model model = cup_of_faces();
  const Model lid = lathe({{0, 1.9f}, {1.05f, 1.9f}, {1.05f, 2.2f}, {0, 2.2f}});
  const auto base = static_cast<std::uint32_t>(model.points.size());
  model.points.insert(model.points.end(), lid.points.begin(), lid.points.end());
  for (const Triangle& t : lid.triangles)
    model.triangles.push_back({{t.v[0] + base, t.v[1] + base, t.v[2] + base}});
  EXPECT_FALSE(fill(model));
}

TEST(Vessel, PlatesSolidsAndThickCupsAreNone) {
  EXPECT_FALSE(fill(lathe({{0, 0}, {0.7f, 0.05f}, {1, 0.15f}}))) << "a plate";
  EXPECT_FALSE(fill(lathe({{0, 0}, {1, 0}, {1, 2}, {0.7f, 2}, {0.7f, 0.3f}, {0, 0.3f}})));
  EXPECT_FALSE(fill(box_model({0, 0, 0}, {1, 1, 0.05f}))) << "a board encloses nothing";
  for (const char* shape : {"sphere", "torus", "cube"}) EXPECT_FALSE(fill(*make_shape(shape)));
}

TEST(Vessel, ASmallHoleMakesNoVessel) {
  EXPECT_FALSE(fill(lathe({{0, 0}, {1, 0}, {1, 2}, {0.3f, 2}})));
}

}  // namespace
}  // namespace polymorph
