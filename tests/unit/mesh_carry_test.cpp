// Parts of carried meshes: distances with a bound, division, what is measured again.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>
#include <string>

#include "base/activity.h"
#include "mesh/carry/carry.h"
#include "mesh/carry/carry_measure.h"
#include "mesh/carry/coarsen.h"
#include "mesh/carry/deviation.h"
#include "mesh/carry/divide.h"
#include "mesh/carry/patch_map.h"
#include "mesh/mesh_check.h"
#include "model/shapes.h"

namespace polymorph {
namespace {

Vec3 middle_of(const std::vector<Vec3>& points) {
  Vec3 sum;
  for (const Vec3 p : points) sum = sum + p;
  return sum / static_cast<float>(points.size());
}

Mesh shape(const std::string& name) {
  const Model model = *make_shape(name);
  Mesh mesh;
  mesh.positions = model.points;
  mesh.triangles = model.triangles;
  const Vec3 middle = middle_of(mesh.positions);
  for (const Vec3 p : mesh.positions) mesh.normals.push_back(normalized(p - middle));
  return mesh;
}

float largest(const Deviation& deviation) {
  float most = 0;
  for (const Deviation::PerTriangle& t : deviation.triangles) most = std::max(most, t.distance);
  return most;
}

TEST(Deviation, FindsWhatCornersAndMiddlesMiss) {
  // A square above a valley, whose ground is furthest from a line that meets no corner and no
  // middle of the square's triangles.
  const std::vector<Vec3> square = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  const std::vector<Triangle> halves = {{{0, 1, 2}}, {{0, 2, 3}}};
  const float deepest = 0.3f;
  const std::vector<Vec3> valley = {{-9, -9, 0}, {deepest, -9, -0.1f}, {9, -9, 0},
                                    {-9, 9, 0},  {deepest, 9, -0.1f},  {9, 9, 0}};
  const std::vector<Triangle> sides = {{{0, 1, 4}}, {{0, 4, 3}}, {{1, 2, 5}}, {{1, 5, 4}}};
  const ClosestPointQuery tree(valley, sides);
  const Deviation d =
      measure_deviation({square, halves}, {valley, sides, tree}, {0.001f, 0.0001f, 1});
  // The distance of (0.3, y, 0) from the steeper side.
  const float slope = 0.1f / (9 - deepest), truth = 0.1f / std::sqrt(1 + slope * slope);
  EXPECT_GE(largest(d), truth * 0.999f);
  EXPECT_LE(largest(d), truth + 0.0002f);
}

TEST(Deviation, BoundsEveryPoint) {
  const Mesh ball = shape("sphere"), cube = shape("cube");
  const ClosestPointQuery tree(cube.positions, cube.triangles);
  const MeshQuery other{cube.positions, cube.triangles, tree};
  const float precision = 0.005f;
  const Deviation d = measure_deviation(ball, other, {0.01f, precision, 1});
  for (std::size_t f = 0; f < ball.triangles.size(); ++f) {
    const Triangle& t = ball.triangles[f];
    float most = 0;
    for (int i = 0; i <= 8; ++i)
      for (int j = 0; i + j <= 8; ++j) {
        const Vec3 p = (ball.positions[t.v[0]] * static_cast<float>(i) +
                        ball.positions[t.v[1]] * static_cast<float>(j) +
                        ball.positions[t.v[2]] * static_cast<float>(8 - i - j)) /
                       8;
        most = std::max(most, tree.closest(p).distance);
      }
    ASSERT_GE(d.triangles[f].distance, most - 1e-6f);
    ASSERT_LE(d.triangles[f].distance, std::max(0.01f, most + 2 * precision));
  }
}

TEST(Deviation, SufficientHintsChangeNoBound) {
  const Mesh ball = shape("sphere"), cube = shape("cube");
  const ClosestPointQuery tree(cube.positions, cube.triangles);
  const MeshQuery other{cube.positions, cube.triangles, tree};
  const float negligible = 0.05f, precision = 0.002f, sufficient = 0.04f;
  // Each point is hinted a triangle that is not its nearest one.
  std::vector<std::uint32_t> hints;
  for (const Vec3 p : ball.positions)
    hints.push_back((tree.closest(p).triangle + 1) %
                    static_cast<std::uint32_t>(cube.triangles.size()));
  const Deviation exact = measure_deviation(ball, other, {negligible, precision, 1}),
                  hinted =
                      measure_deviation(ball, other, {negligible, precision, 1, sufficient}, hints);
  ASSERT_GT(largest(exact), 2 * negligible);
  for (std::size_t f = 0; f < ball.triangles.size(); ++f) {
    const Triangle& t = ball.triangles[f];
    for (const std::uint32_t v : t.v)
      ASSERT_GE(hinted.triangles[f].distance, tree.closest(ball.positions[v]).distance - 1e-6f);
    if (exact.triangles[f].distance > negligible)
      ASSERT_NEAR(hinted.triangles[f].distance, exact.triangles[f].distance, precision * 1.01f);
    else
      ASSERT_LE(hinted.triangles[f].distance, negligible + precision);
  }
}

TEST(ClosestNear, WalksToTheClosestPointOfASmoothSurface) {
  const CarryTarget target = make_carry_target(shape("sphere"));
  const Mesh& ball = target.surface;
  std::size_t walks = 0;
  for (std::uint32_t f = 0; f < ball.triangles.size(); f += 7) {
    const Vec3 p = ball.positions[ball.triangles[f].v[0]] * 1.01f + Vec3{0.01f, 0, 0};
    const ClosestPoint exact = target.tree->closest(p);
    for (const std::uint32_t hint : {f, ClosestPoint::kNoTriangle}) {
      const ClosestPoint hit = closest_near(target, p, hint);
      ASSERT_NEAR(hit.distance, exact.distance, 1e-5f);
      ASSERT_LT(length(hit.point - exact.point), 1e-3f);
      walks += hit.triangle != f;
    }
  }
  EXPECT_GT(walks, 0u);
  // A hint on the far side leads no walk to the point: the whole surface is searched.
  const Vec3 p = ball.positions[0] * 1.1f;
  float furthest = 0;
  std::uint32_t far = 0;
  for (std::uint32_t f = 0; f < ball.triangles.size(); ++f)
    if (const float d = length(ball.positions[ball.triangles[f].v[0]] - p); d > furthest)
      furthest = d, far = f;
  EXPECT_NEAR(closest_near(target, p, far).distance, target.tree->closest(p).distance, 1e-5f);
}

TEST(Coarsen, LeavesTheShapeAndItsTopology) {
  for (const char* name : {"torus", "sphere", "cube"}) {
    SCOPED_TRACE(name);
    const Mesh before = shape(name);
    Mesh after = before;
    after.normals.clear();
    const float diagonal = 3, deviation = 0.003f * diagonal;
    float mean = 0;
    for (const Triangle& t : before.triangles)
      mean += length(before.positions[t.v[0]] - before.positions[t.v[1]]);
    mean /= static_cast<float>(before.triangles.size());
    coarsen({{&after.positions}, after.triangles}, {2.5f * mean, deviation});
    EXPECT_LT(after.triangles.size(), before.triangles.size());
    const MeshReport was = check_mesh(before), is = check_mesh(after);
    EXPECT_TRUE(is.is_manifold());
    EXPECT_EQ(is.genus, was.genus);
    EXPECT_EQ(is.components, was.components);
    EXPECT_EQ(is.degenerate_triangles, 0u);
    EXPECT_NEAR(is.volume, was.volume, 0.03 * was.volume);
    for (const Triangle& t : after.triangles)
      for (int k = 0; k < 3; ++k)
        ASSERT_LE(length(after.positions[t.v[k]] - after.positions[t.v[(k + 1) % 3]]),
                  1.5f * 2.5f * mean * 1.5f);
  }
}

TEST(Coarsen, KeepsEachShapeWithinTheDeviation) {
  // The second shape is a ball that is rough where x > 0: there no edge may be collapsed.
  const Mesh ball = shape("sphere");
  std::vector<Vec3> smooth = ball.positions, rough = ball.positions;
  const float deviation = 0.01f;
  for (std::size_t i = 0; i < rough.size(); ++i)
    if (rough[i].x > 0)
      rough[i] = rough[i] + ball.normals[i] * (0.02f * static_cast<float>(i * i % 11));
  std::vector<Triangle> triangles = ball.triangles;
  std::vector<float> deviations(smooth.size(), 0.0f);
  for (std::size_t i = 0; i < deviations.size(); ++i)
    if (smooth[i].z > 0.3f) deviations[i] = 2 * deviation;  // spent: no collapses here either
  const std::vector<float> first_deviations = deviations;
  const std::vector<std::uint32_t> new_index =
      coarsen({{&smooth, &rough}, triangles, &deviations}, {0.3f, deviation});
  ASSERT_EQ(new_index.size(), ball.positions.size());
  ASSERT_EQ(rough.size(), smooth.size());
  ASSERT_EQ(deviations.size(), smooth.size());
  EXPECT_LT(smooth.size(), ball.positions.size());
  std::vector<int> merged(smooth.size(), 0);
  for (const std::uint32_t i : new_index) ++merged[i];
  for (std::size_t i = 0; i < new_index.size(); ++i) {
    const Vec3 p = ball.positions[i];
    if (merged[new_index[i]] > 1) {
      EXPECT_LT(p.x, 0.2f) << "a rough part has been coarsened";
      EXPECT_LE(p.z, 0.3f) << "a part without allowance has been coarsened";
      EXPECT_GT(deviations[new_index[i]], 0.0f);
      EXPECT_LE(deviations[new_index[i]], deviation);
    } else {
      EXPECT_EQ(smooth[new_index[i]], p);
      EXPECT_EQ(deviations[new_index[i]], first_deviations[i]);
    }
  }
  // The smooth shape is within the sum of what its collapses may do.
  const CarryMeasure m = CarryMeter(make_carry_target(ball), 0.05f).measure(smooth, triangles);
  EXPECT_EQ(m.fault.inverted, 0u);
  EXPECT_LE(m.fault.distance, 0.05f);
}

TEST(Coarsen, RemovesChosenTrianglesWhereTheRestIsAccepted) {
  // One point is pushed across an opposite edge of its fan, which inverts triangles.
  const Mesh ball = shape("sphere");
  const CarryTarget target = make_carry_target(ball);
  std::vector<Vec3> points = ball.positions;
  std::vector<Triangle> triangles = ball.triangles;
  const Triangle t = triangles[triangles.size() / 2];
  const Vec3 edge_middle = (points[t.v[1]] + points[t.v[2]]) * 0.5f;
  points[t.v[0]] = points[t.v[0]] + (edge_middle - points[t.v[0]]) * 1.3f;
  const CarryMeasure before = CarryMeter(target, 0.1f).measure(points, triangles);
  ASSERT_GT(before.inverted.size(), 0u);
  const std::function<bool(Vec3, Vec3, Vec3)> faces_outwards = [](Vec3 a, Vec3 b, Vec3 c) {
    return dot(cross(b - a, c - a), a + b + c) > 0;
  };
  coarsen({{&points}, triangles}, {/*edge=*/1, /*deviation=*/0, &faces_outwards, before.inverted});
  EXPECT_LT(triangles.size(), ball.triangles.size());
  EXPECT_GE(triangles.size() + 4 * before.inverted.size(), ball.triangles.size());
  EXPECT_EQ(CarryMeter(target, 0.1f).measure(points, triangles).inverted.size(), 0u);
  Mesh mesh{points, {}, triangles};
  EXPECT_TRUE(check_mesh(mesh).is_manifold());
}

TEST(CarryMeter, MeasuresAMeshThatChangesAsOneThatIsNew) {
  const Mesh ball = shape("sphere");
  const CarryTarget target = make_carry_target(ball);
  const float limit = 0.05f;
  CarryMeter meter(target, limit);
  std::vector<Vec3> points = ball.positions;
  std::vector<Triangle> triangles = ball.triangles;
  int compared_count = 0;
  const auto expect_same = [&](const char* change) {
    SCOPED_TRACE(change);
    const CarryMeasure again = meter.measure(points, triangles),
                       fresh = CarryMeter(target, limit).measure(points, triangles);
    EXPECT_EQ(again.inverted, fresh.inverted);
    EXPECT_NEAR(again.fault.distance, fresh.fault.distance, 0.02f * limit);
    for (std::size_t f = 0; f < triangles.size(); ++f) {
      if (fresh.triangle_distance[f] <= 0.85f * limit) continue;
      ++compared_count;
      EXPECT_NEAR(again.triangle_distance[f], fresh.triangle_distance[f], 0.03f * limit);
    }
    return fresh.inverted.size();
  };
  EXPECT_EQ(expect_same("nothing"), 0u);
  // A point is pushed across an opposite edge of its fan.
  const Triangle t = triangles[triangles.size() / 2];
  const Vec3 edge_middle = (points[t.v[1]] + points[t.v[2]]) * 0.5f, before = points[t.v[0]];
  points[t.v[0]] = before + (edge_middle - before) * 1.3f;
  const std::size_t inverted_count = expect_same("a point");
  EXPECT_GT(inverted_count, 0u);
  // More neighbouring triangles are divided than the walk through both meshes skips.
  std::vector<std::uint32_t> chosen(40);
  std::iota(chosen.begin(), chosen.end(), static_cast<std::uint32_t>(triangles.size() / 4));
  Division division = halve_triangles(points, triangles, chosen);
  triangles = std::move(division.triangles);
  for (const auto& [a, b] : division.halved) points.push_back((points[a] + points[b]) * 0.5f);
  EXPECT_EQ(expect_same("divided"), inverted_count);
  std::reverse(triangles.begin(), triangles.end());
  EXPECT_EQ(expect_same("reversed"), inverted_count);
  points[t.v[0]] = before;
  EXPECT_EQ(expect_same("moved back"), 0u);
  EXPECT_EQ(compared_count, 0);
  points[t.v[0]] = before * 1.3f;
  expect_same("raised");
  EXPECT_GT(compared_count, 0);
}

/// Raises a bump on a sphere at its point of largest x.
Mesh with_bump(Mesh mesh, float height) {
  for (Vec3& p : mesh.positions) {
    const float from_axis = std::sqrt(p.y * p.y + p.z * p.z);
    if (p.x > 0 && from_axis < 0.3f) p.x += height * (1 - from_axis / 0.3f);
  }
  return mesh;
}

TEST(MapPatches, LaysAPatchOverABumpAndBisectsIt) {
  const Mesh ball = shape("sphere");
  const CarryTarget target = make_carry_target(with_bump(ball, 0.8f));
  std::vector<Vec3> points = ball.positions;
  std::vector<Triangle> triangles = ball.triangles;
  coarsen({{&points}, triangles}, {0.15f, 0.02f});
  const float limit = 0.03f;
  const CarryMeasure before = CarryMeter(target, limit).measure(points, triangles);
  ASSERT_GT(before.fault.distance, 10 * limit);
  std::vector<std::uint32_t> seeds;
  for (std::uint32_t f = 0; f < triangles.size(); ++f)
    if (before.triangle_distance[f] > limit) seeds.push_back(f);
  const std::size_t old_count = points.size();
  PatchMesh mesh{points, triangles};
  const PatchSettings settings{3, 0.5f * limit, 0.3f, 100000};
  // Told to end, it begins no patch, or no bisection.
  for (const int patches : {0, 1}) {
    std::vector<Vec3> moved = points;
    std::vector<Triangle> divided = triangles;
    PatchMesh unfinished{moved, divided};
    int calls = 0;
    const std::function<bool()> keep_going = [&] { return ++calls <= patches; };
    PatchSettings stopped = settings;
    stopped.keep_going = &keep_going;
    EXPECT_EQ(map_patches(unfinished, seeds, stopped, target, before.mesh_near),
              static_cast<std::size_t>(patches));
    EXPECT_TRUE(unfinished.halved.empty());
    EXPECT_EQ(moved == points, patches == 0);
  }
  ASSERT_GE(map_patches(mesh, seeds, settings, target, before.mesh_near), 1u);
  EXPECT_EQ(points.size(), old_count + mesh.halved.size());
  EXPECT_GT(mesh.halved.size(), 0u);
  const CarryMeasure after = CarryMeter(target, limit).measure(points, triangles);
  EXPECT_LT(after.fault.distance, 0.2f * before.fault.distance);
  EXPECT_LT(after.badness, 0.1f * before.badness);
  Mesh mapped{points, {}, triangles};
  EXPECT_TRUE(check_mesh(mapped).is_manifold());
}

TEST(HalveTriangles, KeepsTheSurfaceAndItsClosedness) {
  const Mesh cube = shape("cube");
  const std::vector<std::uint32_t> chosen = {0, 5};
  const Division division = halve_triangles(cube.positions, cube.triangles, chosen);
  Mesh halved{cube.positions, {}, division.triangles};
  for (const auto& [a, b] : division.halved)
    halved.positions.push_back((cube.positions[a] + cube.positions[b]) * 0.5f);
  const MeshReport before = check_mesh(cube), after = check_mesh(halved);
  EXPECT_GE(after.triangles, before.triangles + 2 * chosen.size());
  EXPECT_TRUE(after.is_manifold());
  EXPECT_EQ(after.genus, before.genus);
  EXPECT_NEAR(after.area, before.area, 1e-4);
  EXPECT_NEAR(after.volume, before.volume, 1e-4);
}

TEST(CarryMeter, MeasuresAgainWhatHasMoved) {
  const CarryTarget target = make_carry_target(shape("sphere"));
  std::vector<Vec3> points = target.surface.positions;
  const std::vector<Triangle>& triangles = target.surface.triangles;
  const float limit = 0.02f;
  CarryMeter meter(target, limit);
  EXPECT_LE(meter.measure(points, triangles).fault.distance, 0.8f * limit);
  const Vec3 place = points[7];
  points[7] = place + target.surface.normals[7] * 0.1f;
  const CarryMeasure out = meter.measure(points, triangles);
  EXPECT_NEAR(out.fault.distance, 0.1f, 0.005f);
  EXPECT_LT(length(out.fault.position - points[7]), 0.01f);
  const CarryFault fresh = CarryMeter(target, limit).measure(points, triangles).fault;
  EXPECT_NEAR(out.fault.distance, fresh.distance, 0.02f * limit);
  EXPECT_EQ(out.fault.inverted, fresh.inverted);
  points[7] = place;
  EXPECT_LE(meter.measure(points, triangles).fault.distance, 0.8f * limit);
}

TEST(CarryMeter, CountsInvertedTriangles) {
  const CarryTarget target = make_carry_target(shape("sphere"));
  std::vector<Vec3> points = target.surface.positions;
  CarryMeter meter(target, 0.02f);
  EXPECT_EQ(meter.measure(points, target.surface.triangles).fault.inverted, 0u);
  // A corner that is drawn across the opposite edge turns its triangle over.
  const Triangle& t = target.surface.triangles[100];
  points[t.v[0]] = points[t.v[1]] + points[t.v[2]] - points[t.v[0]];
  const CarryMeasure measure = meter.measure(points, target.surface.triangles);
  EXPECT_GT(measure.fault.inverted, 0u);
  EXPECT_EQ(find_inverted(points, target.surface.triangles, target, measure.near),
            measure.inverted);
  const std::vector<float> badness = list_badness(measure, 0.02f);
  ASSERT_EQ(badness.size(), target.surface.triangles.size());
  for (const std::uint32_t f : measure.inverted) EXPECT_GE(badness[f], 1.0f);
  EXPECT_NEAR(std::accumulate(badness.begin(), badness.end(), 0.0f), measure.badness,
              1e-4f * measure.badness);
}

TEST(Carry, FaultsHoldAtTimesThatWereMeasuredBeforeDivisions) {
  // A bump grows from a ball. The mesh is divided at the later times, and the first one is not
  // measured again.
  const Mesh ball = shape("sphere");
  const float radius = length(ball.positions.front() - middle_of(ball.positions));
  const Vec3 middle = middle_of(ball.positions);
  const auto height = [&](Vec3 direction, float time) {
    const Vec3 d = direction - Vec3{1, 0, 0};
    return radius * (1 + time / (1 + 30 * dot(d, d)));
  };
  MovingSurface surface;
  surface.at = [&](float time) -> Result<CarryTarget> {
    Mesh mesh = ball;
    for (Vec3& p : mesh.positions) {
      const Vec3 direction = normalized(p - middle);
      p = middle + direction * height(direction, time);
    }
    mesh.normals.assign(mesh.positions.size(), {});
    for (const Triangle& t : mesh.triangles)
      for (const std::uint32_t v : t.v)
        mesh.normals[v] = mesh.normals[v] + area_normal(mesh.positions, t);
    for (Vec3& n : mesh.normals) n = normalized(n);
    return make_carry_target(std::move(mesh));
  };
  surface.flow = [&](std::span<const Vec3> points, float from,
                     float to) -> Result<std::vector<Vec3>> {
    std::vector<Vec3> moved;
    for (const Vec3 p : points) {
      const Vec3 direction = normalized(p - middle);
      moved.push_back(p + direction * (height(direction, to) - height(direction, from)));
    }
    return moved;
  };
  CarrySettings settings;
  settings.limit = 0.005f * radius;
  settings.cell = 0.2f * radius;
  const std::vector<float> times = {0, 0.4f, 0.8f};
  const auto first = carry(surface, std::span(times).first(1), 0, settings);
  const auto carried = carry(surface, times, 0, settings);
  ASSERT_TRUE(first.ok() && carried.ok());
  EXPECT_GT(carried->triangles.size(), first->triangles.size()) << "no division is tested";
  for (std::size_t k = 0; k < times.size(); ++k) {
    const CarryTarget target = *surface.at(times[k]);
    const CarryFault fresh =
        CarryMeter(target, settings.limit).measure(carried->points[k], carried->triangles).fault;
    EXPECT_EQ(fresh.inverted, 0u) << "time " << k;
    EXPECT_LE(fresh.distance, settings.limit * 1.02f) << "time " << k;
    EXPECT_EQ(carried->faults[k].inverted, 0u) << "time " << k;
    EXPECT_LE(carried->faults[k].distance, settings.limit) << "time " << k;
  }
}

TEST(Carry, CollapsesTrianglesWhereTheSurfaceShrinks) {
  // A ball shrinks, so that its edges become shorter than a cell.
  const Mesh ball = shape("sphere");
  MovingSurface surface;
  surface.at = [&](float time) -> Result<CarryTarget> {
    Mesh mesh = ball;
    for (Vec3& p : mesh.positions) p = p * time;
    return make_carry_target(std::move(mesh));
  };
  surface.flow = [](std::span<const Vec3> points, float from,
                    float to) -> Result<std::vector<Vec3>> {
    std::vector<Vec3> moved;
    for (const Vec3 p : points) moved.push_back(p * (to / from));
    return moved;
  };
  const std::vector<float> times = {1, 0.3f, 0.28f};
  CarrySettings settings;
  settings.limit = 0.02f;
  settings.cell = 0.15f;
  const auto first = carry(surface, std::span(times).first(1), 0, settings);
  const auto carried = carry(surface, times, 0, settings);
  ASSERT_TRUE(first.ok() && carried.ok());
  EXPECT_LT(carried->triangles.size(), first->triangles.size());
  for (std::size_t k = 0; k < times.size(); ++k) {
    const CarryTarget target = *surface.at(times[k]);
    const CarryFault fresh =
        CarryMeter(target, settings.limit).measure(carried->points[k], carried->triangles).fault;
    EXPECT_EQ(fresh.inverted, 0u) << "time " << k;
    EXPECT_LE(fresh.distance, settings.limit) << "time " << k;
    // Distances up to 0.8 of the limit are only bounded, by different numbers.
    EXPECT_LE(fresh.distance, 1.02f * std::max(carried->faults[k].distance, 0.8f * settings.limit))
        << "time " << k << ": not measured after the last collapse";
  }
}

TEST(Carry, EndsAtAnyMoveWhenToldAndNamesItsStages) {
  const Mesh ball = shape("sphere");
  const auto scaled = [&](float size) {
    Mesh mesh = ball;
    for (Vec3& p : mesh.positions) p = p * size;
    return mesh;
  };
  MovingSurface surface;
  surface.at = [&](float time) -> Result<CarryTarget> { return make_carry_target(scaled(time)); };
  surface.flow = [](std::span<const Vec3> points, float from,
                    float to) -> Result<std::vector<Vec3>> {
    std::vector<Vec3> moved;
    for (const Vec3 p : points) moved.push_back(p * (to / from));
    return moved;
  };
  const std::vector<float> times = {1, 1.1f};
  int calls = 0, last = 1 << 30;
  std::set<std::string> stages;
  CarrySettings settings;
  settings.limit = 0.1f;
  settings.cell = 1;
  settings.name = "the ball";
  settings.check_stop = [&]() -> Status {
    stages.insert(current_activity());
    if (++calls > last) return Error{ErrorCode::kTerminated, "enough"};
    return Ok{};
  };
  ASSERT_TRUE(carry(surface, times, 0, settings).ok());
  EXPECT_EQ(stages.count("beginning the ball at time 1 of 2"), 1u);
  EXPECT_EQ(stages.count("carrying the ball at time 2 of 2"), 1u);
  const int all = calls;
  ASSERT_GT(all, 12);
  for (const int moves : {0, 5, all - 1}) {
    calls = 0;
    last = moves;
    const auto carried = carry(surface, times, 0, settings);
    ASSERT_FALSE(carried.ok()) << moves << " of " << all;
    EXPECT_EQ(carried.error().message, "enough");
    EXPECT_LE(calls, moves + 2) << "it goes on after it was told to end";
  }
}

}  // namespace
}  // namespace polymorph
