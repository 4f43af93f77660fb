// Surfaces between two objects, and the regression that carries them, against their definitions.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <vector>

#include "kernels/morph_field.h"
#include "testing/backend.h"
#include "testing/between.h"
#include "testing/mesh.h"

namespace polymorph {
namespace {

class BetweenTest : public SurfaceTest {
 protected:
  Mesh between(const MorphSurface& surface, const Grid& grid,
               const ExtractSettings& settings = {}) {
    Mesh mesh;
    const EngineStatus status = engine_->extract(surface, grid, settings, mesh);
    EXPECT_EQ(status.code, EngineCode::kOk) << status.message;
    return mesh;
  }
  Mesh distances(const std::shared_ptr<const DistanceGrid>& object, const Grid& grid,
                 const ExtractSettings& settings = {}) {
    Mesh mesh;
    const EngineStatus status = engine_->extract(object, grid, settings, mesh);
    EXPECT_EQ(status.code, EngineCode::kOk) << status.message;
    return mesh;
  }
  std::vector<AttributeValues> regress(const std::shared_ptr<const Regression>& map,
                                       const std::vector<Vec3>& points) {
    std::vector<AttributeValues> values;
    const EngineStatus status = engine_->regress(map, points, values);
    EXPECT_EQ(status.code, EngineCode::kOk) << status.message;
    return values;
  }
};

std::vector<Vec3> scattered(int count, unsigned seed) {
  std::vector<Vec3> points;
  for (const Ball& ball : random_balls(count, FieldKind::kGaussian, seed))
    points.push_back(ball.center);
  return points;
}

double furthest_from_sphere(const Mesh& mesh, double radius) {
  double worst = 0;
  for (const Vec3 p : mesh.positions)
    worst = std::max(worst, std::abs(static_cast<double>(length(p)) - radius));
  return worst;
}

TEST_P(BetweenTest, IsTheObjectItselfAtEitherEnd) {
  const auto from = sphere_distances(1), to = sphere_distances(0.5f);
  const Grid grid = cube_grid(61, 1.5f);
  EXPECT_LT(furthest_from_sphere(between({identity_map(0), from, to, 1, 1, 0}, grid), 1), 0.002);
  EXPECT_LT(furthest_from_sphere(between({identity_map(1), from, to, 1, 1, 0}, grid), 0.5), 0.004);
}

TEST_P(BetweenTest, MixesDistancesBySmoothstepOfTheProgress) {
  // b(0.25) = 0.15625: the radius of concentric spheres is mixed likewise.
  const MorphSurface surface = {
      identity_map(0.25f), sphere_distances(1), sphere_distances(0.5f), 1, 1, 0};
  const Mesh mesh = between(surface, cube_grid(61, 1.5f));
  EXPECT_LT(furthest_from_sphere(mesh, 1 - 0.5 * 0.15625), 0.003);
  expect_sound(mesh);
  for (std::size_t i = 0; i < mesh.positions.size(); i += 7) {
    const Vec3 outward = normalized(mesh.positions[i]);
    EXPECT_GT(dot(outward, mesh.normals[i]), 0.999f);
  }
}

TEST_P(BetweenTest, LongDistancesCountAsTheirRoots) {
  const float range = 0.1f;
  const MorphSurface surface = {
      identity_map(0.25f), sphere_distances(1), sphere_distances(0.4f), 1, 1, 0, range};
  const auto compressed = [](double d) { return 0.1 * (std::sqrt(1 + 20 * d) - 1); };
  double low = 0.4, high = 1;
  while (high - low > 1e-9) {
    const double r = (low + high) / 2, mixed = 0.15625;
    ((1 - mixed) * compressed(1 - r) > mixed * compressed(r - 0.4) ? low : high) = r;
  }
  ASSERT_GT(low, 0.94);  // 0.906 without
  const Mesh mesh = between(surface, cube_grid(61, 1.5f));
  EXPECT_LT(furthest_from_sphere(mesh, low), 0.003);
  expect_sound(mesh);
  for (std::size_t i = 0; i < mesh.positions.size(); i += 7)
    EXPECT_GT(dot(normalized(mesh.positions[i]), mesh.normals[i]), 0.999f);
}

/// Neither object takes more than its share: half way the surface is in the middle.
TEST_P(BetweenTest, CompressionIsTheSameInsideAndOutside) {
  const MorphSurface surface = {
      identity_map(0.5f), sphere_distances(1), sphere_distances(0.4f), 1, 1, 0, 0.05f};
  EXPECT_LT(furthest_from_sphere(between(surface, cube_grid(61, 1.5f)), 0.7), 0.003);
}

TEST_P(BetweenTest, LevelMovesTheSurfaceInwardByItsWeight) {
  auto map = std::make_shared<Regression>(*identity_map(0));
  map->values[1].value[3] = 0.5f;
  const MorphSurface surface = {map, sphere_distances(1), sphere_distances(1), 1, 1, 0.2f};
  EXPECT_LT(furthest_from_sphere(between(surface, cube_grid(61, 1.5f)), 0.9), 0.003);
}

/// One object is thin where x > 0.3, the other where y > 0.3, with a slope between.
TEST_P(BetweenTest, LevelSparesWhatIsThin) {
  const auto thin_beyond = [](float Vec3::*axis) {
    return distances_of(33,
                        [axis](Vec3 p) { return std::clamp(4 * (p.*axis - 0.3f), 0.0f, 1.0f); });
  };
  auto map = std::make_shared<Regression>(*identity_map(0));
  map->thinness[0] = thin_beyond(&Vec3::x);
  map->thinness[1] = thin_beyond(&Vec3::y);
  const MorphSurface surface = {map, sphere_distances(1), sphere_distances(1), 1, 1, 0.2f};
  const Mesh mesh = between(surface, cube_grid(61, 1.5f));
  expect_sound(mesh);
  int spared = 0, moved = 0;
  for (const Vec3 p : mesh.positions) {
    // Nodes are 0.25 apart, and the spline reaches over one and a half.
    if (p.x > 0.9f || p.y > 0.9f) {
      ++spared;
      EXPECT_NEAR(length(p), 1, 0.005f);
    } else if (p.x < -0.1f && p.y < -0.1f) {
      ++moved;
      EXPECT_NEAR(length(p), 0.8f, 0.005f);
    }
  }
  EXPECT_GT(spared, 50);
  EXPECT_GT(moved, 50);
}

TEST_P(BetweenTest, ScalesEitherObjectsDistances) {
  // Both maps shrink space by two: a sphere of radius 0.5 is one of radius 1 here.
  auto map = std::make_shared<Regression>(*identity_map(0.5f));
  for (AffineMap& affine : map->affine)
    for (int i = 0; i < 3; ++i) affine.rows[i] = affine.rows[i] * 0.5f;
  const MorphSurface surface = {map, sphere_distances(0.5f), sphere_distances(0.5f), 2, 2, 0.1f};
  EXPECT_LT(furthest_from_sphere(between(surface, cube_grid(61, 1.5f)), 0.9), 0.005);
}

TEST_P(BetweenTest, DetailOfTheSourceGoesBeforeThatOfTheTargetComes) {
  // The detail of both is a third of their radius.
  MorphSurface surface = {nullptr, sphere_distances(0.9f), sphere_distances(0.9f), 1, 1, 0};
  surface.smooth_from = surface.smooth_to = sphere_distances(0.6f);
  for (const float t : {0.0f, 0.05f, 0.2f, 0.4f, 0.5f, 0.7f, 0.9f, 1.0f}) {
    surface.map = identity_map(t);
    const auto share = [](float x) {
      x = std::clamp((0.55f - x) / 0.45f, 0.0f, 1.0f);
      return x * x * (3 - 2 * x);
    };
    const float mixed = t * t * (3 - 2 * t);
    const float radius = 0.6f + 0.3f * ((1 - mixed) * share(t) + mixed * share(1 - t));
    const Mesh mesh = between(surface, cube_grid(61, 1.5f));
    EXPECT_LT(furthest_from_sphere(mesh, radius), 0.004) << t;
    expect_sound(mesh);
  }
}

/// Where the progress differs from place to place, detail does, and normals turn with it.
TEST_P(BetweenTest, NormalsKnowThatDetailGoes) {
  MorphSurface surface = {nullptr, sphere_distances(0.9f), sphere_distances(0.9f), 1, 1, 0};
  surface.smooth_from = surface.smooth_to = sphere_distances(0.6f);
  auto map = std::make_shared<Regression>(*identity_map(0.3f));
  map->sloped = true;
  map->values[0].slope[3] = {0.15f, 0, 0};
  surface.map = map;
  const Mesh mesh = between(surface, cube_grid(81, 1.2f));
  expect_sound(mesh);
  // Small triangles have odd normals, so those around a vertex are added.
  std::vector<Vec3> normals(mesh.positions.size());
  for (const Triangle& triangle : mesh.triangles) {
    const Vec3 a = mesh.positions[triangle.v[0]], b = mesh.positions[triangle.v[1]],
               c = mesh.positions[triangle.v[2]];
    for (const std::uint32_t v : triangle.v) normals[v] = normals[v] + cross(b - a, c - a);
  }
  float worst = 1;
  for (std::size_t v = 0; v < normals.size(); ++v)
    worst = std::min(worst, dot(normalized(normals[v]), mesh.normals[v]));
  EXPECT_GT(worst, 0.995f);
}

TEST_P(BetweenTest, IsClosedAndManifoldWhereMapsAreWild) {
  for (const unsigned seed : {1u, 2u, 3u}) {
    for (const bool sloped : {false, true}) {
      const MorphSurface surface = {random_map(60, 0.4f, seed, sloped),
                                    torus_distances(1, 0.3f),
                                    sphere_distances(0.6f, {0.3f, 0, 0}),
                                    1,
                                    1,
                                    0.05f,
                                    sloped ? 0.05f : 0.0f,
                                    sloped ? torus_distances(1, 0.28f) : nullptr,
                                    sphere_distances(0.55f, {0.3f, 0, 0})};
      const Mesh mesh = between(surface, cube_grid(70, 1.7f));
      ASSERT_FALSE(mesh.triangles.empty());
      expect_sound(mesh);
    }
  }
}

TEST_P(BetweenTest, BricksLeftOutHoldNoSurface) {
  // The same cells, all in one brick's reach and as part of a grid of many levels: what is culled
  // must not change a vertex.
  const MorphSurface surface = {random_map(80, 0.3f, 9),
                                torus_distances(1, 0.3f),
                                sphere_distances(0.7f),
                                1,
                                1,
                                0,
                                0,
                                torus_distances(1, 0.2f),
                                sphere_distances(0.5f),
                                {0, 0.3f}};
  const Grid fine = cube_grid(161, 1.6f);
  const Mesh whole = between(surface, fine);
  // Sampled at every point by hand: as many crossed edges as vertices.
  const auto field_at = [&](const std::vector<Vec3>& points) {
    const std::vector<AttributeValues> maps = regress(surface.map, points);
    DistanceField from(surface.from->grid, surface.from->values.data()),
        to(surface.to->grid, surface.to->values.data());
    from.set_detail(surface.smooth_from->values.data(), surface.fade_from);
    to.set_detail(surface.smooth_to->values.data(), surface.fade_to);
    std::vector<float> values;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const float *a = maps[2 * i].v, *b = maps[2 * i + 1].v;
      const float t = a[3], mix = t * t * (3 - 2 * t);
      values.push_back((1 - mix) *
                           from.value(Points<float>{a[0], a[1], a[2]}, from.detail_share(t)) +
                       mix * to.value(Points<float>{b[0], b[1], b[2]}, to.detail_share(1 - t)));
    }
    return values;
  };
  std::size_t crossed = 0;
  std::vector<float> below;
  for (int z = 0; z < fine.points.z; ++z) {
    std::vector<Vec3> points;
    for (int y = 0; y < fine.points.y; ++y)
      for (int x = 0; x < fine.points.x; ++x) points.push_back(grid_point(fine, {x, y, z}));
    const std::vector<float> values = field_at(points);
    const auto row = static_cast<std::size_t>(fine.points.x);
    for (std::size_t i = 0; i < values.size(); ++i) {
      const bool in = values[i] > 0;
      if (i % row + 1 < row) crossed += in != (values[i + 1] > 0);
      if (i + row < values.size()) crossed += in != (values[i + row] > 0);
      if (!below.empty()) crossed += in != (below[i] > 0);
    }
    below = values;
  }
  // The sums differ by rounding: a handful of points at the very level.
  EXPECT_NEAR(static_cast<double>(crossed), static_cast<double>(whole.positions.size()),
              1e-4 * static_cast<double>(crossed));
}

TEST_P(BetweenTest, RegressionIsTheKernelMeanOfItsSamples) {
  const auto map = random_map(40, 1, 5, true);
  const std::vector<Vec3> points = scattered(200, 6);
  const std::vector<AttributeValues> values = regress(map, points);
  ASSERT_EQ(values.size(), 2 * points.size());
  double worst = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    double sum = 0, mean = 0;
    for (std::size_t e = 0; e < map->samples.size(); ++e) {
      const RegressionSample& sample = map->samples[e];
      const Vec3 d = points[i] - sample.center;
      const double d2 = static_cast<double>(dot(d, d));
      const double s2 = 2 * std::pow(static_cast<double>(sample.deviation), 2);
      const double k =
          static_cast<double>(sample.mass) *
          (std::exp(-d2 / s2) + 0.02 * std::exp(-d2 / 4 / s2) + 0.0005 * std::exp(-d2 / 16 / s2));
      const BallAttribute& c = map->values[2 * e];
      sum += k;
      mean += k * static_cast<double>(c.value[0] + dot(c.slope[0], d));
    }
    mean = mean / sum + static_cast<double>(points[i].x);
    worst = std::max(worst, std::abs(static_cast<double>(values[2 * i].v[0]) - mean));
  }
  // The spline smooths by half a node's spacing, 0.125, where kernels are 0.2 to 0.4 wide.
  EXPECT_LT(worst, 0.12);
}

TEST_P(BetweenTest, RegressionReproducesAffineMapsExactly) {
  auto map = std::make_shared<Regression>(*random_map(50, 0, 7));
  map->affine[0] = {{{0, 1, 0}, {-1, 0, 0}, {0, 0, 2}}, {1, 2, 3}};
  const std::vector<Vec3> points = scattered(300, 8);
  const std::vector<AttributeValues> values = regress(map, points);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vec3 p = points[i];
    EXPECT_EQ(values[2 * i].v[0], p.y + 1);
    EXPECT_EQ(values[2 * i].v[1], -p.x + 2);
    EXPECT_EQ(values[2 * i].v[2], 2 * p.z + 3);
    EXPECT_EQ(values[2 * i + 1].v[0], p.x);
  }
}

/// Only the nodes around a few points are computed.
TEST_P(BetweenTest, FewPointsHaveTheValuesThatTheyHaveAmongMany) {
  const auto map = random_map(40, 1, 5, true);
  const Int3 nodes = map->lattice.points;
  std::vector<Vec3> points = scattered(nodes.x * nodes.y * nodes.z, 6);
  // Points at the lattice's ends, and beyond.
  for (const float far : {-10.0f, 10.0f}) points.push_back({far, 0.1f * far, far});
  const std::vector<AttributeValues> all = regress(map, points);
  const auto expect_same = [&](const std::vector<AttributeValues>& values, std::size_t first) {
    EXPECT_TRUE(std::equal(values.begin(), values.end(),
                           all.begin() + static_cast<std::ptrdiff_t>(2 * first),
                           [](const AttributeValues& a, const AttributeValues& b) {
                             return std::equal(std::begin(a.v), std::end(a.v), std::begin(b.v));
                           }))
        << first;
  };
  for (const std::size_t first : {std::size_t{0}, std::size_t{50}, points.size() - 2}) {
    // Another map's nodes are in the engine's memory before.
    const auto other = std::make_shared<Regression>(*map);
    for (BallAttribute& attribute : other->values)
      for (float& value : attribute.value) value = 3 - 2 * value;
    (void)regress(other, points);
    const auto fresh = std::make_shared<Regression>(*map);
    const std::vector<Vec3> few(points.begin() + static_cast<std::ptrdiff_t>(first),
                                points.begin() + static_cast<std::ptrdiff_t>(first + 2));
    expect_same(regress(fresh, few), first);
    expect_same(regress(fresh, points), 0);  // the other nodes, too
  }
}

TEST_P(BetweenTest, RegressionTakesLandmarksWhereTheyBelong) {
  const auto plain = random_map(40, 0.5f, 5, true);
  const auto map = map_with_landmarks(*plain, 12, 0.3f, 9);
  std::vector<Vec3> places;
  for (const RegressionLandmark& landmark : map->landmarks) places.push_back(landmark.position);
  const std::vector<AttributeValues> met = regress(map, places), before = regress(plain, places);
  for (std::size_t l = 0; l < places.size(); ++l)
    for (std::size_t m = 0; m < 2; ++m) {
      const auto away = [&](const AttributeValues& at) {
        return length(Vec3{at.v[0], at.v[1], at.v[2]} - map->landmarks[l].goal[m]);
      };
      EXPECT_GT(away(before[2 * l + m]), 0.01f);
      EXPECT_LT(away(met[2 * l + m]), 1e-5f);
      EXPECT_EQ(met[2 * l + m].v[3], before[2 * l + m].v[3]) << "progress and weight stay";
    }
  // Far from all landmarks nothing changes.
  const std::vector<Vec3> corner{{-1.95f, -1.95f, 1.95f}};
  auto one = std::make_shared<Regression>(*map);
  one->landmarks.resize(1);
  one->landmarks[0].position = {0.5f, 0.5f, -0.5f};
  EXPECT_EQ(regress(one, corner)[0].v[0], regress(plain, corner)[0].v[0]);
}

TEST_P(BetweenTest, LandmarksThatAreThereAlreadyChangeNothing) {
  auto map = std::make_shared<Regression>(*identity_map(0.5f));
  for (const Vec3 place : scattered(5, 3)) map->landmarks.push_back({place, 0.3f, {place, place}});
  for (const Vec3 p : scattered(100, 4)) {
    const AttributeValues at = regress(map, {p})[0];
    EXPECT_EQ((Vec3{at.v[0], at.v[1], at.v[2]}), p);
  }
}

/// Two landmarks in one place with two goals cannot both be met.
TEST_P(BetweenTest, LandmarksThatContradictEachOtherStayFinite) {
  auto map = std::make_shared<Regression>(*identity_map(0.5f));
  const Vec3 place{0.1f, 0.2f, 0.3f}, aside{0.3f, 0, 0};
  for (const Vec3 away : {Vec3{0, 0, 0}, Vec3{1e-4f, 0, 0}}) {
    map->landmarks = {{place, 0.2f, {place + aside, place}},
                      {place + away, 0.2f, {place - aside, place}}};
    const AttributeValues at = regress(std::make_shared<Regression>(*map), {place})[0];
    EXPECT_LT(length(Vec3{at.v[0], at.v[1], at.v[2]} - place), 1);
  }
}

TEST_P(BetweenTest, RefusesWhatItCannotMakeASurfaceOf) {
  const Grid grid = cube_grid(21, 1.5f);
  Mesh mesh;
  const auto code = [&](const MorphSurface& surface) {
    return engine_->extract(surface, grid, {}, mesh).code;
  };
  const auto object = sphere_distances(1);
  EXPECT_EQ(code({nullptr, object, object, 1, 1, 0}), EngineCode::kBadInput);
  EXPECT_EQ(code({identity_map(0), object, nullptr, 1, 1, 0}), EngineCode::kBadInput);
  EXPECT_EQ(code({identity_map(0), object, object, 1, 1, NAN}), EngineCode::kBadInput);
  EXPECT_EQ(code({identity_map(0), object, object, 1, 1, 0, -1}), EngineCode::kBadInput);
  EXPECT_EQ(code({identity_map(0), object, object, 1, 1, 0, 0, torus_distances(1, 0.3f)}),
            EngineCode::kBadInput);
  auto broken = std::make_shared<DistanceGrid>(*object);
  broken->values.pop_back();
  EXPECT_EQ(code({identity_map(0), broken, object, 1, 1, 0}), EngineCode::kBadInput);
  auto map = std::make_shared<Regression>(*identity_map(0));
  map->values.pop_back();
  EXPECT_EQ(code({map, object, object, 1, 1, 0}), EngineCode::kBadInput);
  map->values.resize(2);
  map->samples[0].mass = 0;
  EXPECT_EQ(code({map, object, object, 1, 1, 0}), EngineCode::kBadInput);
  map = std::make_shared<Regression>(*identity_map(0));
  map->landmarks = {{{NAN, 0, 0}, 1, {}}};
  EXPECT_EQ(code({map, object, object, 1, 1, 0}), EngineCode::kBadInput);
  map->landmarks = {{{0, 0, 0}, 0, {}}};
  EXPECT_EQ(code({map, object, object, 1, 1, 0}), EngineCode::kBadInput);
  map = std::make_shared<Regression>(*identity_map(0));
  map->thinness[0] = object;
  EXPECT_EQ(code({map, object, object, 1, 1, 0}), EngineCode::kBadInput);
  map->thinness[1] = broken;
  EXPECT_EQ(code({map, object, object, 1, 1, 0}), EngineCode::kBadInput);
}

/// A backend that keeps copies of distances makes room for new ones.
TEST_P(BetweenTest, DistancesOfManyObjectsNeedNoMoreMemoryThanThoseOfTheLastFew) {
  const Grid grid = cube_grid(33, 1.5f);
  const auto extract_objects = [&](int count) {
    for (int i = 0; i < count; ++i) {
      const float radius = 0.5f + 0.01f * static_cast<float>(i);
      const Mesh mesh = distances(sphere_distances(radius), grid);
      ASSERT_LT(furthest_from_sphere(mesh, static_cast<double>(radius)), 0.01);
    }
  };
  extract_objects(40);
  const std::size_t used = engine_->memory_used();
  extract_objects(40);
  EXPECT_EQ(engine_->memory_used(), used);
}

/// The surface of distances is that between an object and itself.
TEST_P(BetweenTest, DistancesHaveTheSurfaceOfAnObjectThatIsMorphedToItself) {
  auto map = std::make_shared<Regression>(*identity_map(0));
  map->values[1].value[3] = 0;
  for (const auto& object : {sphere_distances(1), torus_distances(1, 0.3f)})
    for (const Grid& grid : {object->grid, cube_grid(97, 1.7f), cube_grid(30, 0.9f)}) {
      const Mesh mesh = distances(object, grid);
      ASSERT_FALSE(mesh.triangles.empty());
      expect_sound(mesh);
      expect_same_mesh(mesh, between({map, object, object, 1, 1, 0}, grid));
    }
  EXPECT_LT(furthest_from_sphere(distances(sphere_distances(1), cube_grid(61, 1.5f)), 1), 0.002);
}

/// Plain values on their own grid: a vertex on each crossed edge, where the value is 0.
TEST_P(BetweenTest, PlainValuesAreLinearAlongTheirEdges) {
  std::mt19937 random(11);
  auto values = std::make_shared<DistanceGrid>();
  const int n = 40;
  values->grid = {{0, 0, 0}, 1, {n, n, n}};
  values->lipschitz = 4;  // neighbours differ by at most 2 along each axis
  const auto index = [&](int x, int y, int z) {
    return static_cast<std::size_t>(x + n * (y + n * z));
  };
  for (int z = 0; z < n; ++z)
    for (int y = 0; y < n; ++y)
      for (int x = 0; x < n; ++x) {
        const bool border = std::min({x, y, z}) == 0 || std::max({x, y, z}) == n - 1;
        const float value = static_cast<float>(random() >> 8) * 0x1p-23f - 1;
        values->values.push_back(border ? -1 : value);
      }
  ExtractSettings settings;
  settings.refine_steps = 0;
  const Mesh mesh = distances(values, values->grid, settings);
  expect_sound(mesh);
  std::size_t crossed = 0;
  for (int z = 0; z + 1 < n; ++z)
    for (int y = 0; y + 1 < n; ++y)
      for (int x = 0; x + 1 < n; ++x) {
        const bool in = values->values[index(x, y, z)] > 0;
        crossed += in != (values->values[index(x + 1, y, z)] > 0);
        crossed += in != (values->values[index(x, y + 1, z)] > 0);
        crossed += in != (values->values[index(x, y, z + 1)] > 0);
      }
  EXPECT_EQ(mesh.positions.size(), crossed);
  for (const Vec3 p : mesh.positions) {
    const int x = static_cast<int>(p.x), y = static_cast<int>(p.y), z = static_cast<int>(p.z);
    const Vec3 f = p - Vec3{static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)};
    const float t = std::max({f.x, f.y, f.z});
    ASSERT_EQ(f.x + f.y + f.z, t);  // on an edge
    const float a = values->values[index(x, y, z)];
    const float b = values->values[index(x + (f.x > 0), y + (f.y > 0), z + (f.z > 0))];
    ASSERT_NEAR(t, std::clamp(a / (a - b), 1 / 512.0f, 511 / 512.0f), 1e-5f);
  }
}

TEST_P(BetweenTest, RefusesDistancesThatItCannotMakeASurfaceOf) {
  const Grid grid = cube_grid(21, 1.5f);
  Mesh mesh;
  const auto code = [&](std::shared_ptr<const DistanceGrid> object,
                        const ExtractSettings& settings = {}) {
    mesh.positions.resize(1);
    const EngineCode result = engine_->extract(object, grid, settings, mesh).code;
    EXPECT_TRUE(mesh.positions.empty());
    return result;
  };
  EXPECT_EQ(code(nullptr), EngineCode::kBadInput);
  auto broken = std::make_shared<DistanceGrid>(*sphere_distances(1));
  broken->lipschitz = NAN;
  EXPECT_EQ(code(broken), EngineCode::kBadInput);
  broken->lipschitz = 1;
  broken->values.pop_back();
  EXPECT_EQ(code(broken), EngineCode::kBadInput);
  ExtractSettings settings;
  settings.refine_steps = 5;
  EXPECT_EQ(code(sphere_distances(1), settings), EngineCode::kBadInput);
}

TEST_P(BetweenTest, FlatSurfacesAndMidpointsAreServedToo) {
  const MorphSurface surface = {
      identity_map(0.5f), sphere_distances(1), torus_distances(1, 0.3f), 1, 1, 0};
  ExtractSettings settings;
  settings.flat = true;
  settings.placement = Placement::kMidpoint;
  const Mesh mesh = between(surface, cube_grid(41, 1.7f), settings);
  ASSERT_FALSE(mesh.triangles.empty());
  EXPECT_TRUE(mesh.normals.empty());
  expect_closed(mesh);
}

PM_EVERY_BACKEND(BetweenTest);

}  // namespace
}  // namespace polymorph
