#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "interchange/material_catalog.h"
#include "interchange/mesh_file.h"
#include "interchange/obj.h"
#include "interchange/ply.h"
#include "interchange/simplify.h"
#include "interchange/split_surface.h"
#include "mesh/closest.h"
#include "model/shapes.h"

namespace polymorph {
namespace {

SurfaceFrame tetrahedron() {
  SurfaceFrame frame;
  frame.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  frame.normals = {{-1, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  frame.triangles = {{{0, 2, 1}}, {{0, 1, 3}}, {{0, 3, 2}}, {{1, 2, 3}}};
  return frame;
}

SurfaceFrame textured_surface() {
  SurfaceFrame frame = tetrahedron();
  frame.colors = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0.2158605f, 0.2158605f, 0.2158605f}};
  frame.velocities = {{1, 2, 3}, {0, 0, 0}, {0, 0, 0}, {4, 5, 6}};
  frame.labels = {0, 0, 1, 1};
  for (int c = 0; c < 12; ++c)
    frame.corner_uvs.push_back({0.25f * static_cast<float>(c % 3), 0.5f});
  frame.triangle_materials = {0, 0, 1, 1};
  frame.materials.resize(2);
  frame.materials[0].name = "red paint";
  frame.materials[0].color = {1, 0, 0};
  frame.materials[1].name = "red paint";
  return frame;
}

std::string obj_of(const SurfaceFrame& frame) {
  MaterialCatalog none;
  return encode_obj({&frame, 1}, {}, "", none);
}

std::size_t body_of(const std::string& ply) { return ply.find("end_header\n") + 11; }

TEST(MeshFiles, ObjAndPlyHoldTheWholeMesh) {
  const SurfaceFrame frame = tetrahedron();
  const std::string obj = obj_of(frame);
  EXPECT_NE(obj.find("v 0 1 0\n"), std::string::npos);
  EXPECT_NE(obj.find("f 2//2 3//3 4//4\n"), std::string::npos);
  const std::string ply = encode_ply({&frame, 1}, {});
  ASSERT_EQ(ply.size() - body_of(ply), 4 * 24 + 4 * 13u);
  float x = 0;
  std::memcpy(&x, ply.data() + body_of(ply) + 24, 4);
  EXPECT_EQ(x, 1.0f);
  EXPECT_EQ(write_mesh("/tmp/x.stl", {}).error().code, ErrorCode::kUsage);
}

TEST(MeshFiles, FlatMeshesHaveNoNormals) {
  SurfaceFrame frame = tetrahedron();
  frame.normals.clear();
  EXPECT_EQ(obj_of(frame).find("vn "), std::string::npos);
  EXPECT_NE(obj_of(frame).find("f 2 3 4\n"), std::string::npos);
  const std::string ply = encode_ply({&frame, 1}, {});
  EXPECT_EQ(ply.find("float nx"), std::string::npos);
  EXPECT_EQ(ply.size() - body_of(ply), 4 * 12 + 4 * 13u);
}

TEST(MeshFiles, PlyHasWhatPointsCarry) {
  const SurfaceFrame frame = textured_surface();
  SurfaceSequence sequence;
  sequence.actors = {"it"};
  sequence.label_names = {{"head", "foot"}};
  const std::string ply = encode_ply({&frame, 1}, sequence);
  EXPECT_NE(ply.find("comment label 1 foot\n"), std::string::npos);
  constexpr std::size_t kVertex = 24 + 3 + 8 + 12 + 4, kFace = 13 + 25;
  ASSERT_EQ(ply.size() - body_of(ply), 4 * kVertex + 4 * kFace);
  const char* last = ply.data() + body_of(ply) + 3 * kVertex;
  EXPECT_EQ(static_cast<unsigned char>(last[24]), 128) << "0.2159 linear is 128 of 255 in sRGB";
  float velocity[3];
  std::memcpy(velocity, last + 35, sizeof velocity);
  EXPECT_EQ(velocity[2], 6.0f);
  int label = 0;
  std::memcpy(&label, last + 47, 4);
  EXPECT_EQ(label, 1);
}

TEST(MeshFiles, ObjNamesMaterialsOnce) {
  const SurfaceFrame frame = textured_surface();
  MaterialCatalog catalog;
  const std::string obj = encode_obj({&frame, 1}, {}, "it.mtl", catalog);
  EXPECT_NE(obj.find("mtllib it.mtl\n"), std::string::npos);
  EXPECT_NE(obj.find("v 0 0 1 0.502 0.502 0.502\n"), std::string::npos) << obj;
  EXPECT_NE(obj.find("usemtl red_paint\nf 1/1/1 3/2/3 2/3/2\n"), std::string::npos) << obj;
  EXPECT_NE(obj.find("usemtl red_paint_2\n"), std::string::npos) << obj;
  encode_obj({&frame, 1}, {}, "it.mtl", catalog);
  EXPECT_EQ(catalog.materials.size(), 2u);
  EXPECT_NE(encode_mtl(catalog, {}).find("newmtl red_paint\nKd 1 0 0\n"), std::string::npos);
}

/// A sphere whose texture has a seam.
SurfaceFrame seamed_sphere() {
  const Result<Model> model = make_shape("sphere");
  SurfaceFrame frame;
  frame.positions = model->points;
  frame.triangles = model->triangles;
  for (const Vec3 p : frame.positions) frame.normals.push_back(normalized(p));
  for (const Triangle& t : frame.triangles) {
    const Vec3 middle = frame.positions[t.v[0]] + frame.positions[t.v[1]] + frame.positions[t.v[2]];
    const float half = middle.x > 0 ? 0.0f : 10.0f;
    for (const std::uint32_t v : t.v)
      frame.corner_uvs.push_back({half + frame.positions[v].y, frame.positions[v].z});
    frame.triangle_materials.push_back(middle.y > 0 ? 1 : 0);
  }
  frame.materials.resize(2);
  return frame;
}

double hausdorff(const SurfaceFrame& a, const SurfaceFrame& b) {
  const auto one_sided = [](const SurfaceFrame& from, const SurfaceFrame& to) {
    const ClosestPointQuery query(to.positions, to.triangles);
    float largest = 0;
    for (const Triangle& t : from.triangles)
      for (int i = 0; i <= 4; ++i)
        for (int j = 0; i + j <= 4; ++j) {
          const float u = static_cast<float>(i) / 4, v = static_cast<float>(j) / 4;
          const Vec3 p = from.positions[t.v[0]] * (1 - u - v) + from.positions[t.v[1]] * u +
                         from.positions[t.v[2]] * v;
          largest = std::max(largest, query.closest(p).distance);
        }
    return static_cast<double>(largest);
  };
  return std::max(one_sided(a, b), one_sided(b, a));
}

TEST(Simplify, KeepsTheDistanceTheSeamsAndTheBorders) {
  const SurfaceFrame whole = seamed_sphere();
  const float diagonal = bounding_box(whole.positions).diagonal();
  for (const float share : {0.002f, 0.01f}) {
    SurfaceFrame frame = whole;
    const float reached = simplify(frame, share * diagonal);
    EXPECT_LT(frame.triangles.size(), whole.triangles.size() * 3 / 4) << share;
    EXPECT_GT(reached, 0);
    // Sampled more finely than the program does.
    EXPECT_LE(hausdorff(whole, frame), 1.1 * static_cast<double>(share * diagonal));
    ASSERT_EQ(frame.corner_uvs.size(), 3 * frame.triangles.size());
    ASSERT_EQ(frame.triangle_materials.size(), frame.triangles.size());
    // Whatever a corner says is still true of its point, and of one side of the seam.
    for (std::size_t t = 0; t < frame.triangles.size(); ++t)
      for (std::size_t k = 0; k < 3; ++k) {
        const Vec3 p = frame.positions[frame.triangles[t].v[k]];
        const Vec2 uv = frame.corner_uvs[3 * t + k], first = frame.corner_uvs[3 * t];
        EXPECT_EQ(uv.y, p.z);
        EXPECT_EQ(uv.x > 5, first.x > 5);
        EXPECT_NEAR(uv.x, p.y + (first.x > 5 ? 10 : 0), 1e-5f);
      }
    // Still closed: every edge once in each direction.
    std::vector<std::pair<std::uint32_t, std::uint32_t>> edges;
    for (const Triangle& t : frame.triangles)
      for (int k = 0; k < 3; ++k) edges.emplace_back(t.v[k], t.v[(k + 1) % 3]);
    std::sort(edges.begin(), edges.end());
    EXPECT_EQ(std::adjacent_find(edges.begin(), edges.end()), edges.end());
    for (const auto& [a, b] : edges)
      EXPECT_TRUE(std::binary_search(edges.begin(), edges.end(), std::pair(b, a)));
  }
}

TEST(Simplify, LeavesWhatCannotBeLess) {
  SurfaceFrame frame = tetrahedron();
  simplify(frame, 1e-4f);
  EXPECT_EQ(frame.triangles.size(), 4u);
  SurfaceFrame none;
  EXPECT_EQ(simplify(none, 1), 0);
}

TEST(SplitCorners, SplitsAtSeamsOnly) {
  const SurfaceFrame frame = seamed_sphere();
  const SplitSurface plain = split_corners(frame, {false, false});
  EXPECT_EQ(plain.position_of.size(), frame.positions.size());
  const SplitSurface split = split_corners(frame, {true, false});
  EXPECT_GT(split.position_of.size(), frame.positions.size());
  EXPECT_LT(split.position_of.size(), 2 * frame.positions.size());
  for (std::size_t t = 0; t < frame.triangles.size(); ++t)
    for (int k = 0; k < 3; ++k)
      EXPECT_EQ(split.position_of[split.triangles[t].v[k]], frame.triangles[t].v[k]);
}

}  // namespace
}  // namespace polymorph
