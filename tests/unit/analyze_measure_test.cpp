#include "analyze/measure.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "analyze/analyze.h"
#include "field/extract_surface.h"
#include "testing/morph.h"

namespace polymorph {
namespace {

Mesh surface_of(const std::vector<Ball>& balls, float cell = 0.04f) {
  const auto engine = make_cpu_engine();
  auto mesh = extract_surface(*engine, balls, cell, {});
  EXPECT_TRUE(mesh);
  return *mesh;
}

MeasuredSurface measured(const Mesh& mesh) { return {mesh.positions, mesh.triangles}; }

TEST(BendingEnergy, OfASphereIsFourPiWhateverItsSize) {
  for (const float radius : {0.5f, 1.0f, 2.0f})
    EXPECT_NEAR(bending_energy(surface_of({ball_at({}, radius)}, radius / 25)),
                4 * std::numbers::pi, 0.15);
}

TEST(BendingEnergy, OfALongPillIsMoreThanASpheres) {
  std::vector<Ball> pill;
  for (int i = 0; i <= 40; ++i)
    pill.push_back(ball_at({0.05f * static_cast<float>(i), 0, 0}, 0.2f));
  EXPECT_GT(bending_energy(surface_of(pill, 0.02f)), 1.5 * 4 * std::numbers::pi);
}

TEST(BendingEnergy, OfASurfaceWithoutNormalsIsMeasuredByItsTriangles) {
  // What the engine gives for report.flat.
  Mesh sphere = surface_of({ball_at({}, 1)});
  sphere.normals.clear();
  EXPECT_NEAR(bending_energy(sphere), 4 * std::numbers::pi, 0.3);
  EXPECT_EQ(bending_energy({}), 0);
}

TEST(Distance, BetweenSpheresIsTheDifferenceOfTheirRadii) {
  const auto distance =
      measured(surface_of({ball_at({}, 1)})).distance_to(measured(surface_of({ball_at({}, 1.1f)})));
  EXPECT_NEAR(distance.mean, 0.1, 2e-3);
  EXPECT_NEAR(distance.largest, 0.1, 3e-3);
}

TEST(Distance, OfSpheresApartIsLargestAtTheirFarEnds) {
  const auto distance = measured(surface_of({ball_at({}, 1)}))
                            .distance_to(measured(surface_of({ball_at({5, 0, 0}, 1)})));
  EXPECT_NEAR(distance.largest, 5, 0.02);
}

TEST(Distance, LeavesOutWhatIsHiddenInside) {
  const MeasuredSurface unit(surface_of({ball_at({}, 1)}));
  // One sphere around the middle of the other and one outside.
  Mesh two = surface_of({ball_at({}, 0.4f), ball_at({3, 0, 0}, 0.4f)});
  const double all = MeasuredSurface(two).distance_to(unit).mean;
  const double seen = MeasuredSurface(two).distance_to(unit, 0.1).mean;
  EXPECT_LT(all, 1.1);
  // Out there every point is about 2 from the unit sphere, which is 0.6 from the hidden one.
  EXPECT_NEAR(2 * seen, 2.02 + 0.6, 0.05);
}

TEST(Distance, FromNothingIsInfinite) {
  EXPECT_TRUE(std::isinf(measured({}).distance_to(measured(surface_of({ball_at({}, 1)}))).mean));
  EXPECT_EQ(measured({}).distance_to(measured({})).mean, 0);
}

TEST(DilatedHull, HoldsWhatIsInsideAndMeasuresWhatIsNot) {
  const Mesh unit = surface_of({ball_at({}, 1)});
  const DilatedHull hull(unit.positions, 0.05);
  EXPECT_EQ(hull.leakage(unit), 0);
  EXPECT_EQ(hull.leakage(surface_of({ball_at({0, 0.04f, 0}, 1)})), 0);
  // All of a sphere that lies elsewhere, and about half of one across the border.
  const double whole = 4.18879 * 0.125;
  EXPECT_NEAR(hull.leakage(surface_of({ball_at({5, 0, 0}, 0.5f)})), whole, 0.02 * whole);
  const double part = hull.leakage(surface_of({ball_at({1, 0, 0}, 0.5f)}));
  EXPECT_GT(part, 0.3 * whole);
  EXPECT_LT(part, 0.7 * whole);
}

TEST(DilatedHull, FlatAndNearlyFlatMeshesHaveNoVolume) {
  const DilatedHull hull(surface_of({ball_at({}, 1)}).positions, 0.05);
  for (const float thickness : {0.0f, 1e-30f, 1e-6f}) {
    Mesh sheet;
    sheet.positions = {{5, 0, 0}, {6, 0, 0}, {6, thickness, 1}, {5, thickness, 1}};
    sheet.triangles = {{0, 1, 2}, {0, 2, 3}};
    EXPECT_EQ(hull.leakage(sheet), 0) << thickness;
  }
}

TEST(SimilarityOf, FindsTheTurnGrowthAndShiftOrNothing) {
  std::vector<Vec3> points;
  for (const Ball& ball : random_balls(40, 3)) points.push_back(ball.center);
  const Mat3 turn = exp_rotation(Vec3d{0.3, 1.2, -0.4});
  std::vector<Vec3> sent;
  for (const Vec3& p : points) sent.push_back(to_float(turn * Vec3d(p) * 2.5 + Vec3d{1, 2, 3}));
  const auto fit = fit_similarity(points, sent);
  ASSERT_TRUE(fit);
  EXPECT_LT(angle_between(fit->rotation, turn), 1e-3);
  EXPECT_NEAR(fit->scale, 2.5, 1e-5);
  sent[3].x += 0.1f;
  EXPECT_FALSE(fit_similarity(points, sent));
}

}  // namespace
}  // namespace polymorph
