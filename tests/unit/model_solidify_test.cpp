#include "model/repair/solidify.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/parallel.h"
#include "mesh/closest.h"
#include "mesh/inside.h"
#include "mesh/normals.h"
#include "model/repair/diagnose.h"
#include "model/repair/voxels.h"
#include "model/shapes.h"
#include "testing/model.h"

namespace polymorph {
namespace {

/// A cup of radius 1 and height 2 with walls of 0.1, closed as a mesh, open as a cup.
Model cup() { return lathe({{0, 0}, {1, 0}, {1, 2}, {0.9f, 2}, {0.9f, 0.1f}, {0, 0.1f}}); }

Diagnosis expect_solid(const Result<Model>& solid) {
  EXPECT_TRUE(solid) << solid.error().message;
  if (!solid) return {};
  const Diagnosis d = diagnose(*solid);
  EXPECT_TRUE(d.closed);
  EXPECT_EQ(d.touching_points, 0u);
  EXPECT_EQ(d.inverted_shells, 0u);
  EXPECT_GT(d.volume, 0);
  EXPECT_EQ(solid->corner_normals.size(), 3 * solid->triangles.size());
  EXPECT_EQ(solid->labels.size(), solid->triangles.size());
  EXPECT_EQ(solid->triangle_materials.size(), solid->triangles.size());
  return d;
}

TEST(Solidify, FillsACupUpToItsRim) {
  const Model model = cup();
  EXPECT_LT(volume_of(model), 2.1) << "the walls";
  const auto solid = solidify(model, {64, 0});
  const Diagnosis d = expect_solid(solid);
  EXPECT_EQ(d.shells, 1u);
  EXPECT_EQ(d.genus, 0);
  EXPECT_NEAR(d.volume, 2 * M_PI, 0.06 * 2 * M_PI);
  EXPECT_TRUE(InsideTest(*solid).inside({0, 1, 0}));
}

TEST(Solidify, FillsAnOpenShellWithoutWalls) {
  const auto solid = solidify(lathe({{0, 0}, {1, 0}, {1, 2}}), {64, 0});
  const Diagnosis d = expect_solid(solid);
  EXPECT_EQ(d.shells, 1u);
  EXPECT_EQ(d.genus, 0);
  EXPECT_NEAR(d.volume, 2 * M_PI, 0.06 * 2 * M_PI);
}

TEST(Solidify, AGapNarrowerThanTheMouthLeavesACupACup) {
  const auto solid = solidify(cup(), {96, 0.3f});
  const Diagnosis d = expect_solid(solid);
  EXPECT_EQ(d.shells, 1u);
  EXPECT_NEAR(d.volume, volume_of(cup()), 0.15 * volume_of(cup()));
  EXPECT_FALSE(InsideTest(*solid).inside({0, 1, 0}));
}

TEST(Solidify, LeavesASolidAsItIs) {
  for (const char* name : {"sphere", "torus", "cube", "puddle"}) {
    SCOPED_TRACE(name);
    const Model model = make_shape(name).value();
    const auto solid = solidify(model, {80, 0});
    const Diagnosis d = expect_solid(solid);
    EXPECT_EQ(d.shells, 1u);
    EXPECT_EQ(d.genus, name == std::string("torus") ? 1 : 0);
    EXPECT_NEAR(d.volume, volume_of(model), 0.02 * volume_of(model));
    const ClosestPointQuery query(model);
    for (const Vec3 p : solid->points) EXPECT_LT(query.closest(p).distance, 0.05f);
    EXPECT_EQ(solid->corner_uvs.size(), 3 * solid->triangles.size());
  }
}

TEST(Solidify, ManyCrossingAndNestedShellsBecomeOnePieceABody) {
  Model model = box_model({0, 0, 0}, {2, 2, 2});
  add_box(model, {1, 1, 1}, {3, 3, 3});                          // crossing
  add_box(model, {0.5f, 0.5f, 0.5f}, {0.9f, 0.9f, 0.9f}, true);  // a cavity
  add_box(model, {1.2f, 1.2f, 1.2f}, {1.8f, 1.8f, 1.8f});        // within
  add_box(model, {6, 0, 0}, {7, 1, 1}, true);                    // another body, inside out
  model.triangles.erase(model.triangles.begin() + 3);            // and a hole
  const auto solid = solidify(model, {100, 1.2f});
  const Diagnosis d = expect_solid(solid);
  EXPECT_EQ(d.shells, 2u);
  EXPECT_NEAR(d.volume, 15 + 1, 1.6);
}

TEST(Solidify, NothingToFillIsAnErrorWithARemedy) {
  Model sheet;
  sheet.name = "sheet";
  sheet.points = {{0, 0, 0}, {1, 0, 0}, {1, 0, 1}, {0, 0, 1}};
  sheet.triangles = {{{0, 1, 2}}, {{0, 2, 3}}};
  const auto nothing = solidify(sheet, {64, 0});
  ASSERT_FALSE(nothing);
  EXPECT_EQ(nothing.error().code, ErrorCode::kInput);
  EXPECT_NE(nothing.error().message.find("raise the gap"), std::string::npos)
      << nothing.error().message;
  EXPECT_FALSE(solidify(Model{}));
  EXPECT_FALSE(solidify(cup(), {4, 0}));
  EXPECT_FALSE(solidify(cup(), {128, -1}));
  EXPECT_FALSE(solidify(cup(), {128, 100}));
  EXPECT_FALSE(solidify(cup(), {128, std::nanf("")}));
}

TEST(Solidify, DoesNotDependOnThreads) {
  set_thread_count(1);
  const Model one = solidify(cup(), {48, 0}).value();
  set_thread_count(2);
  const Model two = solidify(cup(), {48, 0}).value();
  set_thread_count(0);
  ASSERT_EQ(one.points.size(), two.points.size());
  for (std::size_t i = 0; i < one.points.size(); ++i) EXPECT_EQ(one.points[i], two.points[i]);
}

TEST(Voxels, DistancesAreExact) {
  const Grid grid{{0, 0, 0}, 1, {13, 9, 11}};
  std::vector<std::uint8_t> seed(13 * 9 * 11, 0);
  const std::array<Int3, 3> seeds{Int3{2, 3, 4}, Int3{12, 8, 0}, Int3{7, 0, 10}};
  Voxels voxels{grid, {}, {}};
  for (const Int3 s : seeds) seed[voxels.index(s.x, s.y, s.z)] = 1;
  const std::vector<float> distances = compute_distances(grid, seed);
  for (int z = 0; z < 11; ++z)
    for (int y = 0; y < 9; ++y)
      for (int x = 0; x < 13; ++x) {
        double best = INFINITY;
        for (const Int3 s : seeds) best = std::min(best, std::hypot(x - s.x, y - s.y, z - s.z));
        EXPECT_FLOAT_EQ(distances[voxels.index(x, y, z)], static_cast<float>(best));
      }
}

TEST(Voxels, AnySetOfVoxelsGetsAClosedManifoldSurface) {
  // Noise has every kind of touching corner and edge there is.
  for (unsigned seed = 0; seed < 8; ++seed) {
    Voxels voxels{{{0, 0, 0}, 1, {14, 14, 14}}, {}, {}};
    voxels.depth.assign(14 * 14 * 14, -1);
    voxels.solid.assign(14 * 14 * 14, 0);
    std::uint32_t state = seed * 7919 + 1;
    for (int z = 2; z < 12; ++z)
      for (int y = 2; y < 12; ++y)
        for (int x = 2; x < 12; ++x) {
          state = state * 1664525 + 1013904223;
          const float value = static_cast<float>(state >> 8) * 0x1p-24f - 0.6f;
          voxels.depth[voxels.index(x, y, z)] = value;
          voxels.solid[voxels.index(x, y, z)] = value > 0;
        }
    make_manifold(voxels);
    VoxelSurface surface = make_surface_nets(voxels);
    Model model;
    model.points = surface.points;
    model.triangles = surface.triangles;
    const Diagnosis d = diagnose(model);
    EXPECT_TRUE(d.closed) << d.boundary_edges << " " << d.non_manifold_edges;
    EXPECT_EQ(d.touching_points, 0u);
    EXPECT_GT(d.volume, 0);
  }
}

}  // namespace
}  // namespace polymorph
