// The hierarchy of triangles for GPUs: it holds each triangle once, its boxes hold what is below
// them, and a ray's memory suffices for its depth, whatever the triangles.
#include "render/device/bvh.h"

#include <algorithm>

#include "render/device/device_scene.h"
#include "testing/render.h"

namespace polymorph {
namespace {

using namespace testing;

bool holds(const Box& outer, const Box& inner) {
  const Box both = unite(outer, inner);
  return both.low == outer.low && both.high == outer.high;
}

/// A mesh as the hierarchy sees it.
struct PackedMesh {
  DeviceMesh mesh;
  DeviceTracedMesh traced;
  DeviceScene scene;
  explicit PackedMesh(const TestMesh& from) {
    mesh.positions = from.positions;
    mesh.triangles = from.triangles;
    traced.mesh = &mesh;
    scene.meshes = {&traced, 1};
    scene.bounds = bounding_box(from.positions);
    scene.slack = 0.001f;
  }
};

/// Visits what is below a node; returns the depth.
int check_below(const Bvh& bvh, const DeviceScene& scene, std::int32_t node, const Box& box,
                std::vector<int>& seen) {
  if (node < 0) {
    const BvhTriangle triangle = bvh.triangles[static_cast<std::size_t>(~node)];
    EXPECT_TRUE(holds(box, scene.triangle_box(triangle)));
    ++seen[triangle.triangle];
    return 0;
  }
  const BvhNode& here = bvh.nodes[static_cast<std::size_t>(node)];
  int depth = 0;
  for (int i = 0; i < 2; ++i) {
    EXPECT_TRUE(holds(box, here.boxes[i]));
    depth = std::max(depth, check_below(bvh, scene, here.children[i], here.boxes[i], seen));
  }
  return depth + 1;
}

int check_hierarchy(const TestMesh& mesh) {
  const PackedMesh packed(mesh);
  const Bvh bvh = build_bvh(packed.scene);
  EXPECT_EQ(bvh.nodes.size(), mesh.triangles.size() - 1);
  std::vector<int> seen(mesh.triangles.size());
  const BvhNode& root = bvh.nodes[static_cast<std::size_t>(bvh.root)];
  const int depth =
      check_below(bvh, packed.scene, bvh.root, unite(root.boxes[0], root.boxes[1]), seen);
  EXPECT_EQ(std::count(seen.begin(), seen.end(), 1), std::ssize(seen));
  EXPECT_LE(depth, kMaxBvhDepth);
  return depth;
}

TEST(Bvh, HoldsEachTriangleOnce) { EXPECT_LT(check_hierarchy(make_ball(96, 48)), 32); }

TEST(Bvh, OfEqualTrianglesIsShallow) {
  TestMesh mesh = make_square({}, {1, 0, 0}, {0, 1, 0}, 0.7f);
  mesh.triangles.assign(5000, mesh.triangles[0]);
  EXPECT_LE(check_hierarchy(mesh), 14);
}

/// Each triangle is far larger than the ones before: no cluster would be another's nearest.
TEST(Bvh, OfGrowingTrianglesIsNotTooDeep) {
  TestMesh mesh;
  float size = 1e-6f;
  for (std::uint32_t i = 0; i < 600; ++i, size *= 1.05f) {
    for (const Vec3 corner : {Vec3{0, 0, 0}, Vec3{size, 0, 0}, Vec3{0, size, 0}})
      mesh.positions.push_back(corner);
    mesh.triangles.push_back({{3 * i, 3 * i + 1, 3 * i + 2}});
  }
  check_hierarchy(mesh);
}

TEST(Bvh, OfOneTriangleBeginsWithANode) {
  TestMesh mesh = make_square({}, {1, 0, 0}, {0, 1, 0}, 0.7f);
  mesh.triangles.resize(1);
  const PackedMesh packed(mesh);
  const Bvh bvh = build_bvh(packed.scene);
  ASSERT_EQ(bvh.nodes.size(), 1u);
  EXPECT_EQ(bvh.nodes[0].children[0], ~0);
  EXPECT_EQ(bvh.nodes[0].children[1], ~0);
}

}  // namespace
}  // namespace polymorph
