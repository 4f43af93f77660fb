#include <gtest/gtest.h>

#include <cmath>

#include "base/parallel.h"
#include "model/load/load_obj.h"
#include "model/shapes.h"
#include "spheres/cells.h"
#include "spheres/spheres.h"
#include "testing/model.h"
#include "testing/paths.h"

namespace polymorph {
namespace {

/// The report's methods, as it has them: no fit.
SphereSettings cells(SphereMethod method, int resolution,
                     InsideMethod inside = InsideMethod::kWinding) {
  SphereSettings settings;
  settings.method = method;
  settings.resolution = resolution;
  settings.inside = inside;
  settings.fit = FitKind::kNone;
  return settings;
}

SphereTree tree_of(const Model& model, SphereMethod method, int resolution,
                   InsideMethod inside = InsideMethod::kWinding) {
  auto tree = approximate(model, cells(method, resolution, inside));
  EXPECT_TRUE(tree) << (tree ? "" : tree.error().message);
  return tree ? std::move(tree->tree) : SphereTree{};
}

bool same_tree(const SphereTree& a, const SphereTree& b) {
  if (a.nodes.size() != b.nodes.size()) return false;
  for (std::size_t i = 0; i < a.nodes.size(); ++i) {
    const SphereNode &x = a.nodes[i], &y = b.nodes[i];
    if (!(x.sphere.center == y.sphere.center) || x.sphere.radius != y.sphere.radius ||
        x.parent != y.parent || x.level != y.level || x.leaf != y.leaf)
      return false;
  }
  return true;
}

TEST(Octree, FillsACubeCompletely) {
  const Model cube = box_model({-1, -1, -1}, {1, 1, 1});
  for (int resolution = 1; resolution <= 5; ++resolution) {
    const SphereTree tree = tree_of(cube, SphereMethod::kOctree, resolution);
    const std::size_t expected = std::size_t{1} << (3 * (resolution - 1));
    EXPECT_EQ(tree.leaves().size(), expected);
    // A full octree: (8^R - 1) / 7 nodes.
    EXPECT_EQ(tree.nodes.size(), (expected * 8 - 1) / 7);
  }
}

TEST(Octree, CellsOfABoxAreCountedExactly) {
  // 8 cells per axis of 0.25; the box fills 8 x 4 x 2 of them.
  const SphereTree tree = tree_of(box_model({0, 0, 0}, {2, 1, 0.5f}), SphereMethod::kOctree, 4);
  EXPECT_EQ(tree.leaves().size(), 64u);
  double volume = 0;
  for (const Sphere& s : tree.leaves()) {
    EXPECT_NEAR(s.radius, 0.25 * 0.6204, 1e-4);
    EXPECT_GT(s.center.y, 0);
    EXPECT_LT(s.center.z, 0.5f);
    volume += 4 * M_PI / 3 * std::pow(s.radius, 3);
  }
  EXPECT_NEAR(volume, 1, 1e-3) << "a sphere has its cell's volume";
}

TEST(Octree, ALargerRootCubeGivesTheCountsMeasured) {
  const auto monkey = load_obj(source_dir() / "scenes/models/monkey.obj", {});
  ASSERT_TRUE(monkey) << monkey.error().message;
  const auto count = [&](SphereMethod method, int resolution, float root_margin) {
    SphereSettings settings = cells(method, resolution);
    settings.root_margin = root_margin;
    const auto made = approximate(monkey->model, settings);
    return made ? made->tree.leaves().size() : 0;
  };
  EXPECT_EQ(count(SphereMethod::kOctree, 4, 0), 104u);
  EXPECT_EQ(count(SphereMethod::kOctree, 5, 0), 850u);
  EXPECT_EQ(count(SphereMethod::kOctree, 4, 0.092f), 84u);
  EXPECT_EQ(count(SphereMethod::kOctree, 5, 0.092f), 652u);
  EXPECT_EQ(count(SphereMethod::kOctree, 6, 0.092f), 5232u);
  EXPECT_EQ(count(SphereMethod::kActive, 5, 0), 192u);
  EXPECT_EQ(count(SphereMethod::kActive, 5, 0.092f), 164u);
}

TEST(Octree, LeavesComeInMortonOrderAndParentsFirst) {
  const SphereTree tree = tree_of(box_model({0, 0, 0}, {1, 1, 1}), SphereMethod::kOctree, 2);
  ASSERT_EQ(tree.nodes.size(), 9u);
  for (std::size_t i = 0; i < 8; ++i) {
    const SphereNode& node = tree.nodes[i + 1];
    EXPECT_EQ(node.parent, 0);
    EXPECT_EQ(node.level, 1);
    EXPECT_EQ(node.sphere.center.x > 0.5f, (i & 1) != 0);
    EXPECT_EQ(node.sphere.center.y > 0.5f, (i & 2) != 0);
    EXPECT_EQ(node.sphere.center.z > 0.5f, (i & 4) != 0);
  }
  EXPECT_NEAR(length(tree.nodes[0].sphere.center - Vec3{0.5f, 0.5f, 0.5f}), 0, 1e-6);
  const SphereTree deep = tree_of(*make_shape("torus"), SphereMethod::kOctree, 6);
  for (std::size_t i = 1; i < deep.nodes.size(); ++i) {
    const auto parent = static_cast<std::size_t>(deep.nodes[i].parent);
    ASSERT_LT(parent, i);
    EXPECT_EQ(deep.nodes[i].level, deep.nodes[parent].level + 1);
    EXPECT_FALSE(deep.nodes[parent].leaf);
    const Vec3 d = deep.nodes[i].sphere.center - deep.nodes[parent].sphere.center;
    EXPECT_NEAR(std::abs(d.x), std::abs(d.y), 1e-5);
  }
  EXPECT_EQ(deep.nodes[0].parent, -1);
}

TEST(Octree, FollowsTheVolumeOfASphere) {
  const SphereTree tree = tree_of(*make_shape("sphere"), SphereMethod::kOctree, 6);
  const double share = static_cast<double>(tree.leaves().size()) / 32768;
  EXPECT_NEAR(share, M_PI / 6, 0.01);
  for (const Sphere& s : tree.leaves()) EXPECT_LT(length(s.center - Vec3{0, 1, 0}), 1.0f);
}

// Which corners of the root and of its children are inside is laid by hand: a box over x < 1.25 of
// the cube [0, 2]^3 (the far faces are thin tabs that only make the bounding box that large).
Model half_filled() {
  Model model = box_model({0, 0, 0}, {1.25f, 2, 2});
  add_box(model, {1.9f, 0.9f, 0.9f}, {2, 0.91f, 0.91f});
  return model;
}

TEST(Active, FourCornersAreNotEnoughAndChildrenOfActiveCellsAreDropped) {
  // At R = 1 the root cube's corners lie just outside (the margin): nothing is active.
  const auto root = approximate(half_filled(), cells(SphereMethod::kActive, 1));
  ASSERT_FALSE(root);
  // Move in: corners of a lattice are strictly inside a box that contains them. Eight corners of
  // the cell
  // [-1, 1]^3 inside, tabs of no volume worth speaking of far out on all sides.
  Model model = box_model({-1.5f, -1.5f, -1.5f}, {1.5f, 1.5f, 1.5f});
  for (const float side : {-1.0f, 1.0f})
    add_box(model, {side * 3.99f - 0.01f, 0.31f, 0.31f}, {side * 3.99f + 0.01f, 0.32f, 0.32f});
  // Root [-4, 4]: level 1 cells have one corner (the middle) inside; level 2 cells are 2 wide: the
  // eight ones around the middle have corners at 0 and +-2: again one; level 3 cells are 1 wide:
  // corners at -1, 0, 1 are inside, +-2 are not.
  EXPECT_FALSE(approximate(model, cells(SphereMethod::kActive, 3)));
  const std::vector<Sphere> leaves = tree_of(model, SphereMethod::kActive, 4).leaves();
  // The 8 cells within [-1, 1]^3 have 8 corners inside. Those beyond a face have exactly 4: not
  // active.
  EXPECT_EQ(leaves.size(), 8u);
  for (const Sphere& s : leaves) {
    EXPECT_NEAR(s.radius, 0.6204, 1e-3);
    EXPECT_LT(std::max({std::abs(s.center.x), std::abs(s.center.y), std::abs(s.center.z)}), 1);
  }
}

TEST(Active, MoreThanFourCornersGiveOneSphereAndNothingBelow) {
  // [-2.5, 2.5]^2 x [-2.5, 0.5] in a root of [-4, 4]: of the level 2 cells (2 wide) the four in
  // [-2, 2]^2 x [-2, 0] have all 8 corners inside; those above z = 0 have 4, those beyond the sides
  // at most 4.
  Model model = box_model({-2.5f, -2.5f, -2.5f}, {2.5f, 2.5f, 0.5f});
  for (const float side : {-1.0f, 1.0f}) {
    add_box(model, {side * 3.99f - 0.01f, 0.31f, 0.31f}, {side * 3.99f + 0.01f, 0.32f, 0.32f});
    add_box(model, {0.31f, 0.31f, side * 3.99f - 0.01f}, {0.32f, 0.32f, side * 3.99f + 0.01f});
  }
  const SphereTree three = tree_of(model, SphereMethod::kActive, 3);
  EXPECT_EQ(three.leaves().size(), 4u);
  const SphereTree four = tree_of(model, SphereMethod::kActive, 4);
  std::size_t coarse = 0;
  for (const SphereNode& node : four.nodes) {
    if (!node.leaf) continue;
    coarse += node.level == 2;
    EXPECT_TRUE(node.level == 2 || node.level == 3);
    if (node.level == 3) {
      const Vec3 c = node.sphere.center;
      EXPECT_FALSE(std::abs(c.x) < 2 && std::abs(c.y) < 2 && c.z > -2 && c.z < 0)
          << "below an active cell";
    }
  }
  EXPECT_EQ(coarse, 4u);
  EXPECT_EQ(four.leaves().size(), 4u) << "level 3 cells at the sides have 4 corners inside at most";
}

TEST(Active, NeedsFarFewerSpheresThanTheOctree) {
  const Model sphere = *make_shape("sphere");
  const std::size_t octree = tree_of(sphere, SphereMethod::kOctree, 6).leaves().size();
  const std::size_t active = tree_of(sphere, SphereMethod::kActive, 6).leaves().size();
  EXPECT_LT(active * 5, octree);
  EXPECT_GT(active, 500u);
}

/// A torus' first cells have all their centres in its hole, a fine lattice thousands within it.
TEST(Approximate, EveryResolutionOfAnOctreeGivesAFit) {
  const Model torus = *make_shape("torus");
  for (const int resolution : {1, 2, 3}) {
    SphereSettings settings = cells(SphereMethod::kOctree, resolution);
    settings.fit = FitKind::kRound;
    const auto made = approximate(torus, settings);
    ASSERT_TRUE(made) << resolution << ": " << made.error().message;
    EXPECT_FALSE(made->balls.empty());
  }
  const InsideTest inside(torus);
  SphereSettings fine = cells(SphereMethod::kOctree, 8);
  EXPECT_GT(build_cell_spheres(torus, inside, fine, 8000)->leaves().size(), 50000u) << "unfitted";
  fine.fit = FitKind::kRound;
  const std::size_t fitted = build_cell_spheres(torus, inside, fine, 8000)->leaves().size();
  EXPECT_LE(fitted, 4096u);
  EXPECT_GT(fitted, 500u);
}

TEST(Approximate, ThinAndEmptyModelsSayWhatWouldHelp) {
  const Model plate = box_model({0, 0, 0}, {2, 2, 0.1f});
  const auto thin = approximate(plate, cells(SphereMethod::kOctree, 3));
  ASSERT_TRUE(thin) << thin.error().message;
  EXPECT_EQ(thin->tree.leaves().size(),
            approximate(plate, cells(SphereMethod::kOctree, 6))->tree.leaves().size())
      << "the next resolution that shows it";
  Model sheet;
  sheet.name = "sheet";
  sheet.points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  sheet.triangles = {{{0, 1, 2}}};
  SphereSettings few;
  few.balls = 12;
  const auto thickened = approximate(sheet, few);
  ASSERT_TRUE(thickened) << "a sheet is taken for a shell and given thickness";
  for (const Ball& ball : thickened->balls) {
    EXPECT_NEAR(ball.center.z, 0, 0.02f);
    EXPECT_GT(ball.center.x + ball.center.y, -0.02f);
  }
  EXPECT_FALSE(approximate(Model{}, {}));
  EXPECT_FALSE(approximate(plate, cells(SphereMethod::kOctree, 10)));
  EXPECT_FALSE(approximate(plate, cells(SphereMethod::kOctree, -1)));
}

TEST(Approximate, AutomaticResolutionKeepsTheCountInBounds) {
  for (const char* name : {"sphere", "cube", "torus", "puddle"}) {
    for (const SphereMethod method : {SphereMethod::kOctree, SphereMethod::kActive}) {
      const auto tree = approximate(*make_shape(name), cells(method, 0));
      ASSERT_TRUE(tree) << name;
      EXPECT_LE(tree->tree.leaves().size(), 8000u) << name;
      EXPECT_GE(tree->tree.leaves().size(), 500u) << name;
    }
  }
}

TEST(Approximate, TakesOpenAndCrossingModels) {
  Model sphere = *make_shape("sphere");
  const std::size_t closed = tree_of(sphere, SphereMethod::kOctree, 5).leaves().size();
  sphere.triangles.resize(sphere.triangles.size() - 40);
  const std::size_t open = tree_of(sphere, SphereMethod::kOctree, 5).leaves().size();
  EXPECT_NEAR(static_cast<double>(open), static_cast<double>(closed),
              0.02 * static_cast<double>(closed));
}

TEST(Approximate, IsTheSameForAnyNumberOfThreads) {
  const Model torus = *make_shape("torus");
  for (const SphereMethod method : {SphereMethod::kOctree, SphereMethod::kActive})
    for (const InsideMethod inside : {InsideMethod::kWinding, InsideMethod::kParity}) {
      set_thread_count(1);
      const SphereTree one = tree_of(torus, method, 6, inside);
      set_thread_count(2);
      EXPECT_TRUE(same_tree(one, tree_of(torus, method, 6, inside)));
      set_thread_count(0);
      EXPECT_FALSE(one.nodes.empty());
    }
}

TEST(BallsOf, ALoneBallsSurfaceIsAtItsRadius) {
  const std::vector<Sphere> spheres{{{1, 2, 3}, 0.5f}, {{0, 0, 0}, 2}};
  FieldSettings field;
  field.kind = FieldKind::kGaussian;
  field.blobbiness = 1.5f;
  std::vector<Ball> balls = convert_to_balls(spheres, field);
  ASSERT_EQ(balls.size(), 2u);
  EXPECT_EQ(balls[0].center, spheres[0].center);
  EXPECT_FLOAT_EQ(balls[0].a, 6);
  EXPECT_FLOAT_EQ(std::exp(balls[1].w - balls[1].a * 4), 1);
  field.kind = FieldKind::kInverseSquare;
  field.blob_constant = 2;
  field.magnitude = 3;
  field.threshold = 4;
  balls = convert_to_balls(spheres, field);
  EXPECT_FLOAT_EQ(balls[0].w, 2 * 3 * 0.25f / 4);
  EXPECT_FLOAT_EQ(balls[1].w, 6);
}

}  // namespace
}  // namespace polymorph
