#include "model/repair/shell.h"

#include <gtest/gtest.h>

#include "testing/model.h"

namespace polymorph {
namespace {

double undecided(const Model& model) {
  return measure_undecided_fraction(model, InsideTest(model));
}

TEST(Shell, AClosedModelIsDecided) { EXPECT_EQ(undecided(box_model({-1, 0, 2}, {1, 1, 3})), 0); }

TEST(Shell, SoIsOneWithASmallHole) {
  Model model = box_model({0, 0, 0}, {1, 1, 1});
  // A hole of an eighth of one side.
  const auto first = static_cast<std::uint32_t>(model.points.size());
  const Triangle side = model.triangles[0];
  const auto corner = [&](int k) { return model.points[side.v[k]]; };
  model.points.push_back(lerp(corner(1), corner(2), 0.75f));
  model.triangles[0] = {{side.v[0], side.v[1], first}};
  EXPECT_LT(undecided(model), 0.25);
  EXPECT_GT(undecided(model), 0);
}

TEST(Shell, OpenSheetsAndTurnedFacesAreNot) {
  Model lid_off = box_model({0, 0, 0}, {1, 1, 1});
  lid_off.triangles.resize(6);  // three of six sides
  EXPECT_GT(undecided(lid_off), kMinShellFraction);
  Model sheet;
  sheet.points = {{0, 0, 0}, {1, 0, 0.1f}, {1, 1, 0}, {0, 1, 0.1f}};
  sheet.triangles = {{{0, 1, 2}}, {{0, 2, 3}}};
  EXPECT_EQ(undecided(sheet), 1);
  Model inverted;
  add_box(inverted, {0, 0, 0}, {1, 1, 1}, true);
  EXPECT_EQ(undecided(inverted), 1) << "it encloses nothing outward";
}

}  // namespace
}  // namespace polymorph
