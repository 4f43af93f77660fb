#include "field/distance_grid.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "base/array3.h"
#include "base/random.h"
#include "field/extract_surface.h"
#include "mesh/components.h"
#include "mesh/mesh_check.h"
#include "testing/model.h"

namespace polymorph {
namespace {

DistanceGrid distances_of(const Model& model, float cell, float thinnest) {
  const InsideTest inside(model);
  return compute_signed_distances({model, inside, ClosestPointQuery(model),
                                   classify_faces(model, inside, 0.02f * cell), model.box()},
                                  cell, thinnest);
}

/// The value at the grid point nearest to p, and where that is.
std::pair<float, Vec3> value_near(const DistanceGrid& distances, Vec3 p) {
  const Grid& grid = distances.grid;
  const Vec3 d = (p - grid.origin) / grid.cell;
  const Int3 at{static_cast<int>(std::lround(d.x)), static_cast<int>(std::lround(d.y)),
                static_cast<int>(std::lround(d.z))};
  const std::size_t row = static_cast<std::size_t>(grid.points.x);
  const std::size_t index =
      static_cast<std::size_t>(at.x) +
      row * (static_cast<std::size_t>(at.y) +
             static_cast<std::size_t>(grid.points.y) * static_cast<std::size_t>(at.z));
  return {distances.values[index], grid_point(grid, at)};
}

Model joined(const Model& a, const Model& b) {
  Model both = a;
  const auto first = static_cast<std::uint32_t>(a.points.size());
  both.points.insert(both.points.end(), b.points.begin(), b.points.end());
  for (const Triangle& t : b.triangles)
    both.triangles.push_back({{t.v[0] + first, t.v[1] + first, t.v[2] + first}});
  return both;
}

TEST(DistanceGrid, IsExactBesideFaces) {
  const DistanceGrid distances = distances_of(box_model({-1, -1, -1}, {1, 1, 1}), 0.05f, 0.09f);
  for (const float x : {0.9f, 0.95f, 1.0f, 1.05f, 1.1f}) {
    const auto [value, at] = value_near(distances, {x, 0.1f, -0.2f});
    EXPECT_NEAR(value, 1 - at.x, 0.002f) << x;
  }
}

TEST(DistanceGrid, FarFromTheSurfaceIsSmoothAndOfTheRightSize) {
  const DistanceGrid distances = distances_of(box_model({-1, -1, -1}, {1, 1, 1}), 0.05f, 0.09f);
  const auto [middle, at] = value_near(distances, {0, 0, 0});
  // The ridge in the middle is rounded.
  EXPECT_GT(middle, 0.8f);
  EXPECT_LT(middle, 1.0f);
}

TEST(DistanceGrid, FacesHiddenInTheSolidDoNotCount) {
  const Model both =
      joined(box_model({-1, -1, -1}, {0.2f, 1, 1}), box_model({-0.2f, -1, -1}, {1, 1, 1}));
  const DistanceGrid distances = distances_of(both, 0.05f, 0.09f);
  // Beside the face of one box that lies within the other.
  EXPECT_GT(value_near(distances, {0.2f, 0, 0}).first, 0.6f);
  EXPECT_GT(value_near(distances, {-0.2f, 0.1f, 0}).first, 0.6f);
}

TEST(DistanceGrid, ASheetIsAsThickAsCellsCanShow) {
  Model sheet;
  sheet.points = {{-1, 0, -1}, {1, 0, -1}, {1, 0, 1}, {-1, 0, 1}, {-1, 2, -1}};
  sheet.triangles = {{{0, 1, 2}}, {{0, 2, 3}}};
  const DistanceGrid distances = distances_of(sheet, 0.04f, 0.072f);
  const auto engine = make_cpu_engine();
  const auto mesh =
      extract_distances(*engine, std::make_shared<const DistanceGrid>(distances), 0.08f, {});
  ASSERT_TRUE(mesh.ok()) << mesh.error().message;
  const MeshReport report = check_mesh(*mesh);
  EXPECT_TRUE(report.is_manifold());
  EXPECT_EQ(report.components, 1u);
  EXPECT_EQ(report.genus, 0) << "no holes";
  EXPECT_NEAR(report.area, 10, 1) << "both sides of the whole sheet, and its rim";
}

/// A wire thinner than a cell, askew to the grid, stays in one piece: some of it has no point of
/// the grid inside.
TEST(DistanceGrid, AWireThinnerThanACellIsWhole) {
  Model wire = box_model({-1, -0.01f, -0.01f}, {1, 0.01f, 0.01f});
  for (Vec3& p : wire.points) p = {p.x, p.y + 0.13f * p.x + 0.003f, p.z + 0.07f * p.x + 0.011f};
  const float cell = 0.05f;
  const auto distances =
      std::make_shared<const DistanceGrid>(distances_of(wire, cell, kThinnestPart * cell));
  const auto engine = make_cpu_engine();
  Mesh mesh = extract_distances(*engine, distances, 0.5f * cell, {}).value();
  ASSERT_FALSE(mesh.triangles.empty());
  EXPECT_EQ(smallest_component_share(mesh), 1);
  const Box box = bounding_box(mesh.positions);
  EXPECT_NEAR(box.low.x, -1, cell);
  EXPECT_NEAR(box.high.x, 1, cell);
}

/// A fin of a large body rises to more than its radius in its middle, so that on its way it comes
/// at once; a fin that is much of the whole does not.
TEST(DistanceGrid, AThinPartIsSteepWhereItIsLittleOfTheWhole) {
  const auto middle_of_fin = [](float half_body) {
    const Model model =
        joined(box_model({-half_body, -half_body, -half_body}, {half_body, 0, half_body}),
               box_model({-1, -0.02f, -0.01f}, {1, 0.6f, 0.01f}));
    return value_near(distances_of(model, 0.05f, 0.09f), {0.1f, 0.3f, 0}).first;
  };
  EXPECT_GT(middle_of_fin(3), 2 * middle_of_fin(1));
  EXPECT_LT(middle_of_fin(1), 0.09f * 1.35f);
}

/// Sides are concluded from those of neighbours where that is safe, also beside the rim of a hole,
/// through which the inside fades into the outside.
TEST(DistanceGrid, SidesAreThoseOfWindingNumbers) {
  std::vector<Vec2> profile;
  for (int k = 0; k <= 20; ++k) {
    const float angle = 0.13f * static_cast<float>(k);
    profile.push_back({k == 0 ? 0 : std::sin(angle), -std::cos(angle)});
  }
  const Model bowl = lathe(profile);
  const InsideTest inside(bowl);
  const std::vector<FaceClass> classes(bowl.triangles.size(), FaceClass::kBoundary);
  SmoothDistances smooth;
  const float cell = 0.04f;
  const ClosestPointQuery closest(bowl);
  const DistanceGrid distances = compute_signed_distances(
      {bowl, inside, closest, classes, bowl.box()}, cell, /*thinnest=*/0, &smooth);
  const auto count_wrong = [&](const Grid& grid, const std::vector<float>& values, float reach) {
    int wrong = 0;
    for (std::size_t i = 0; i < values.size(); ++i) {
      const Vec3 p = grid_point(grid, array3_position(grid.points, static_cast<std::int64_t>(i)));
      if (closest.closest(p).distance > reach) continue;
      wrong += (values[i] > 0) != inside.inside(p);
    }
    return wrong;
  };
  EXPECT_EQ(count_wrong(smooth.grid, smooth.values, 10), 0);
  EXPECT_EQ(count_wrong(distances.grid, distances.values, 2 * cell), 0);
}

TEST(DistanceGrid, NoTwoValuesDifferByMoreThanTheLipschitzConstantAllows) {
  const Model both =
      joined(box_model({-1, -1, -1}, {0.2f, 1, 1}), box_model({0, 0, 0}, {1.3f, 0.05f, 1}));
  const DistanceGrid distances = distances_of(both, 0.05f, 0.09f);
  EXPECT_LT(distances.lipschitz, 2.5f);
  const auto inside = [&](std::uint64_t key, std::uint64_t stream) {
    const Vec3 r{random_float(1, 3 * stream, key), random_float(1, 3 * stream + 1, key),
                 random_float(1, 3 * stream + 2, key)};
    return Vec3{-1.2f, -1.2f, -1.2f} + r * 2.4f;
  };
  for (std::uint64_t i = 0; i < 5000; ++i) {
    const auto [a, at_a] = value_near(distances, inside(i, 0));
    const auto [b, at_b] = value_near(distances, inside(i, 1));
    EXPECT_LE(std::abs(a - b), distances.lipschitz * length(at_a - at_b) + 1e-5f);
  }
}

}  // namespace
}  // namespace polymorph
