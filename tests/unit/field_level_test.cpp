#include "field/level.h"

#include <gtest/gtest.h>

#include <cmath>

#include "field/extract_surface.h"
#include "mesh/mesh_check.h"
#include "testing/between.h"
#include "testing/field.h"
#include "testing/forwarding_engine.h"

namespace polymorph {
namespace {

constexpr double kPi = 3.14159265358979323846;

std::vector<Ball> rod_and_block() {
  std::vector<Ball> balls;
  for (int x = 0; x < 6; ++x)
    for (int y = 0; y < 6; ++y)
      for (int z = 0; z < 6; ++z)
        balls.push_back(gaussian_ball({0.1f * static_cast<float>(x), 0.1f * static_cast<float>(y),
                                       0.1f * static_cast<float>(z)},
                                      0.062f, 0.12f));
  for (int x = 6; x < 14; ++x)
    balls.push_back(gaussian_ball({0.1f * static_cast<float>(x), 0.3f, 0.3f}, 0.062f, 0.12f));
  return balls;
}

TEST(FitGrid, CoversTheBoxAndIsAnchoredInTheWorld) {
  const auto one = fit_grid({{-1, -1, -1}, {1, 2, 1}}, 0.25f),
             two = fit_grid({{-1.1f, -1, -1}, {1, 2, 1}}, 0.25f);
  ASSERT_TRUE(one.ok() && two.ok());
  EXPECT_LE(one->origin.x, -1.25f);
  EXPECT_GE(one->origin.y + 0.25f * static_cast<float>(one->points.y - 1), 2.25f);
  const float shift = (one->origin.x - two->origin.x) / 0.25f;
  EXPECT_EQ(shift, std::round(shift)) << "grids of one cell size share their points";
}

TEST(FitGrid, AnAbsurdSizeIsRefusedBeforeAnythingIsAllocated) {
  const auto grid = fit_grid({{-1e6f, -1e6f, -1e6f}, {1e6f, 1e6f, 1e6f}}, 1e-3f);
  ASSERT_FALSE(grid.ok());
  EXPECT_EQ(grid.error().code, ErrorCode::kResource);
}

TEST(SurfaceBounds, TheSurfaceNeverReachesTheGridsBorder) {
  const auto engine = make_cpu_engine();
  for (const FieldKind kind : {FieldKind::kGaussian, FieldKind::kInverseSquare}) {
    std::vector<Ball> balls{{{0, 0, 0}, 4, 1}, {{0.5f, 0, 0}, 4, 1}, {{0.5f, 0.1f, 0}, 4, 1}};
    ExtractSettings settings;
    settings.field = kind;
    const auto mesh = extract_surface(*engine, balls, 0.05f, settings);
    ASSERT_TRUE(mesh.ok());
    const Box bounds = surface_bounds(balls, settings);
    for (const Vec3& p : mesh->positions) {
      EXPECT_TRUE(p.x > bounds.low.x && p.x < bounds.high.x && p.y > bounds.low.y &&
                  p.y < bounds.high.y);
    }
    EXPECT_TRUE(check_mesh(*mesh).is_manifold());
  }
}

TEST(ExtractSurface, NothingVisibleIsAnEmptyMesh) {
  const auto engine = make_cpu_engine();
  const auto none = extract_surface(*engine, {}, 0.1f, {});
  ASSERT_TRUE(none.ok());
  EXPECT_TRUE(none->triangles.empty());
}

TEST(IsoForVolume, FindsTheLevelOfTheWantedVolume) {
  const auto engine = make_cpu_engine();
  ExtractSettings settings;
  for (const FieldKind kind : {FieldKind::kGaussian, FieldKind::kInverseSquare}) {
    settings.field = kind;
    std::vector<Ball> balls = kind == FieldKind::kGaussian
                                  ? std::vector<Ball>{gaussian_ball({0, 0, 0}, 0.5f)}
                                  : std::vector<Ball>{{{0, 0, 0}, 1, 0.25f}};
    const double wanted = 4.0 / 3 * kPi * 0.3 * 0.3 * 0.3;
    const auto iso = iso_for_volume(*engine, balls, {wanted, 0.02f, settings});
    ASSERT_TRUE(iso.ok());
    settings.iso = *iso;
    const auto mesh = extract_surface(*engine, balls, 0.02f, settings);
    EXPECT_NEAR(volume_of(*mesh) / wanted, 1, 0.003);
    settings.iso = 1;
    const auto same = extract_surface(*engine, rescale_balls(balls, kind, *iso), 0.02f, settings);
    EXPECT_NEAR(volume_of(*same) / wanted, 1, 0.003) << "rescaled balls have that surface at iso 1";
  }
}

TEST(IsoForVolume, ComesBackFromAStartWhereNothingShows) {
  const auto engine = make_cpu_engine();
  const std::vector<Ball> balls{gaussian_ball({0, 0, 0}, 0.5f)};
  const auto iso = iso_for_volume(*engine, balls, {0.4, 0.02f}, 1e4f);
  ASSERT_TRUE(iso.ok());
  ExtractSettings settings;
  settings.iso = *iso;
  EXPECT_NEAR(volume_of(*extract_surface(*engine, balls, 0.02f, settings)), 0.4, 0.0012);
}

TEST(IsoForVolume, TakesFewSurfacesEvenNextToAVanishingOne) {
  struct Counting : Engine {
    std::unique_ptr<Engine> inner = make_cpu_engine();
    int calls = 0;
    EngineStatus extract(const BallSet& balls, const Grid& grid, const ExtractSettings& settings,
                         Mesh& mesh) override {
      ++calls;
      return inner->extract(balls, grid, settings, mesh);
    }
    EngineStatus sample(const BallSet& balls, const std::vector<Vec3>& points,
                        const ExtractSettings& settings, std::vector<float>& values) override {
      return inner->sample(balls, points, settings, values);
    }
    EngineStatus move_balls(const std::shared_ptr<const BallPaths>& paths,
                            const MotionState& moment, const std::vector<float>& own,
                            BallSet& balls) override {
      return inner->move_balls(paths, moment, own, balls);
    }
    EngineStatus interpolate(const BallSet& balls, const std::vector<BallAttribute>& carried,
                             const std::vector<Vec3>& points, const ExtractSettings& settings,
                             std::vector<AttributeValues>& values) override {
      return inner->interpolate(balls, carried, points, settings, values);
    }
    EngineStatus extract(const MorphSurface& between, const Grid& grid,
                         const ExtractSettings& settings, Mesh& mesh) override {
      return inner->extract(between, grid, settings, mesh);
    }
    EngineStatus extract(const std::shared_ptr<const DistanceGrid>& object, const Grid& grid,
                         const ExtractSettings& settings, Mesh& mesh) override {
      return inner->extract(object, grid, settings, mesh);
    }
    EngineStatus regress(const std::shared_ptr<const Regression>& regression,
                         const std::vector<Vec3>& points,
                         std::vector<AttributeValues>& values) override {
      return inner->regress(regression, points, values);
    }
    std::vector<PassTime> pass_times() const override { return inner->pass_times(); }
  } engine;
  // A flat-topped field: a little too high a level and nothing is left.
  const auto even = equalize_field(engine, rod_and_block(), {});
  ASSERT_TRUE(even.ok());
  const auto iso = iso_for_volume(engine, *even, {0.22, 0.02f});
  ASSERT_TRUE(iso.ok());
  EXPECT_LE(engine.calls, 14);
  ExtractSettings settings;
  settings.iso = *iso;
  EXPECT_NEAR(volume_of(*extract_surface(engine, *even, 0.02f, settings)) / 0.22, 1, 0.0021);
}

TEST(Grown, RunsFromNothingToTheWholeSurface) {
  const auto engine = make_cpu_engine();
  ExtractSettings settings;
  const std::vector<Ball> balls{gaussian_ball({0, 0, 0}, 0.5f), gaussian_ball({0.3f, 0, 0}, 0.5f)};
  const auto maximum = find_field_maximum(*engine, balls, settings);
  ASSERT_TRUE(maximum.ok());
  double before = 0;
  for (const float growth : {0.0f, 0.01f, 0.3f, 0.6f, 1.0f}) {
    const auto mesh = extract_surface(
        *engine, grow_balls(balls, FieldKind::kGaussian, growth, *maximum), 0.03f, settings);
    ASSERT_TRUE(mesh.ok());
    const double volume = volume_of(*mesh);
    EXPECT_GE(volume, before);
    before = volume;
    if (growth == 0) {
      EXPECT_EQ(volume, 0);
    }
  }
  EXPECT_NEAR(before, volume_of(*extract_surface(*engine, balls, 0.03f, settings)), 1e-9);
}

TEST(Grown, AnInverseSquareBallsVisibleRadiusGrowsLinearly) {
  const auto half = grow_balls({{{0, 0, 0}, 1, 0.25f}}, FieldKind::kInverseSquare, 0.5f, 1);
  EXPECT_FLOAT_EQ(std::sqrt(half[0].w), 0.25f);
}

TEST(SurfaceOfVolume, TakesFewSurfacesWhereTheLevelWeighsLittle) {
  const auto cpu = make_cpu_engine();
  const double ball = 4 * kPi / 3;
  for (const float weight : {1.0f, 0.3f, 0.1f, 0.04f}) {
    // Maps that move nothing, with the level's weight the same everywhere, as between objects of
    // limbs that are all equally thin.
    auto map = std::make_shared<Regression>(*random_map(20, 0, 1));
    for (std::size_t i = 1; i < map->values.size(); i += 2) map->values[i].value[3] = weight;
    const MorphSurface between = {map, sphere_distances(1), sphere_distances(1)};
    CountingEngine engine(*cpu);
    const auto found =
        surface_of_volume(engine, between, {{-2, -2, -2}, {2, 2, 2}},
                          {0.05f, {}, LevelEstimate{}, 0.002}, {1.1 * ball, 0.05f, 2});
    ASSERT_TRUE(found.ok());
    EXPECT_NEAR(volume_of(found->mesh) / (1.1 * ball), 1, 0.002) << weight;
    EXPECT_LE(engine.surfaces, 4) << weight;
  }
}

TEST(FacetingLoss, IsWhatCoarseCellsLackOfASphere) {
  const auto engine = make_cpu_engine();
  const std::vector<Ball> balls{gaussian_ball({0, 0, 0}, 0.5f)};
  const double sphere = volume_of(*extract_surface(*engine, balls, 0.005f, {}));
  for (const float cell : {0.05f, 0.1f, 0.15f}) {
    const auto mesh = extract_surface(*engine, balls, cell, {});
    ASSERT_TRUE(mesh.ok());
    const double lacks = sphere - volume_of(*mesh);
    EXPECT_GT(lacks, 0.003 * sphere) << cell;
    EXPECT_NEAR(faceting_loss(*mesh) / lacks, 1, 0.12) << cell;
  }
  Mesh flat = *extract_surface(*engine, balls, 0.1f, {});
  flat.normals.clear();
  EXPECT_EQ(faceting_loss(flat), 0);
}

TEST(Evened, AThinPartStandsAsFirmAsABody) {
  const auto engine = make_cpu_engine();
  const std::vector<Ball> balls = rod_and_block();
  const auto middle_of_rod = [&](const std::vector<Ball>& set) {
    std::vector<float> values;
    const std::vector<Vec3> points{{1.1f, 0.3f, 0.3f}, {0.25f, 0.25f, 0.25f}};
    EXPECT_EQ(engine->sample(set, points, {}, values).code, EngineCode::kOk);
    return values[0] / values[1];
  };
  EXPECT_LT(middle_of_rod(balls), 0.35f);
  const auto even = equalize_field(*engine, balls, {});
  ASSERT_TRUE(even.ok());
  EXPECT_GT(middle_of_rod(*even), 0.75f);
}

}  // namespace
}  // namespace polymorph
