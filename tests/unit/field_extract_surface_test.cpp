#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "base/file.h"
#include "field/balls_io.h"
#include "field/extract_surface.h"
#include "leg/crossfade.h"
#include "mesh/mesh_check.h"
#include "model/shapes.h"
#include "morph/plan.h"
#include "testing/field.h"
#include "testing/temporary_folder.h"

namespace polymorph {
namespace {

Mesh tetrahedron() {
  Mesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  mesh.normals = {{-1, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  mesh.triangles = {{{0, 2, 1}}, {{0, 1, 3}}, {{0, 3, 2}}, {{1, 2, 3}}};
  return mesh;
}

TEST(CheckMesh, ATetrahedronIsClosedManifoldAndASphere) {
  const MeshReport report = check_mesh(tetrahedron());
  EXPECT_TRUE(report.is_manifold());
  EXPECT_EQ(report.components, 1u);
  EXPECT_EQ(report.euler, 2);
  EXPECT_EQ(report.genus, 0);
  EXPECT_NEAR(report.volume, 1.0 / 6, 1e-12);
  EXPECT_EQ(report.degenerate_triangles, 0u);
}

TEST(CheckMesh, FindsHolesFlipsPinchesAndSlivers) {
  Mesh open = tetrahedron();
  open.triangles.pop_back();
  EXPECT_EQ(check_mesh(open).open_edges, 3u);
  Mesh flipped = tetrahedron();
  std::swap(flipped.triangles[0].v[0], flipped.triangles[0].v[1]);
  EXPECT_EQ(check_mesh(flipped).flipped_edges, 3u);
  Mesh pinched = tetrahedron();  // two of them that share a point
  for (const Vec3 p : {Vec3{-1, 0, 0}, Vec3{0, -1, 0}, Vec3{0, 0, -1}})
    pinched.positions.push_back(p), pinched.normals.push_back(p);
  for (const Triangle t :
       {Triangle{{0, 4, 5}}, Triangle{{0, 6, 4}}, Triangle{{0, 5, 6}}, Triangle{{4, 6, 5}}})
    pinched.triangles.push_back(t);
  const MeshReport report = check_mesh(pinched);
  EXPECT_TRUE(report.is_closed());
  EXPECT_EQ(report.pinched_vertices, 1u);
  EXPECT_FALSE(report.is_manifold());
  Mesh sliver = tetrahedron();
  sliver.positions[3] = {0.5f, 0, 0};
  EXPECT_GE(check_mesh(sliver).degenerate_triangles, 1u);
}

TEST(MeshDigest, ChangesWithTheLastBit) {
  Mesh mesh = tetrahedron();
  const std::string before = mesh_digest(mesh);
  mesh.positions[3].z = std::nextafter(1.0f, 2.0f);
  EXPECT_NE(mesh_digest(mesh), before);
}

TEST(Surface, ATorusOfBallsHasGenusOne) {
  std::vector<Ball> balls;
  for (int i = 0; i < 40; ++i) {
    const float angle = 6.2831853f * static_cast<float>(i) / 40;
    balls.push_back(gaussian_ball({std::cos(angle), 0, std::sin(angle)}, 0.25f));
  }
  const auto mesh = extract_surface(*make_cpu_engine(), balls, 0.06f, {});
  ASSERT_TRUE(mesh.ok());
  const MeshReport report = check_mesh(*mesh);
  EXPECT_TRUE(report.is_manifold());
  EXPECT_EQ(report.genus, 1);
}

TEST(Crossfade, PointsRunFromTheModelIntoItsOwnBalls) {
  const auto model = make_shape("sphere");
  ASSERT_TRUE(model.ok());
  const Box box = model->box();
  // One ball left, one right: each side shrinks into its own.
  const Vec3 c = box.center();
  const std::vector<Ball> balls{gaussian_ball(c - Vec3{0.4f, 0, 0}, 0.3f),
                                gaussian_ball(c + Vec3{0.4f, 0, 0}, 0.3f)};
  for (const FieldKind kind : {FieldKind::kGaussian, FieldKind::kInverseSquare}) {
    const auto targets = shrink_targets(*model, balls, kind);
    const auto whole = shrunk_points(*model, targets, 1), gone = shrunk_points(*model, targets, 0);
    for (std::size_t i = 0; i < whole.size(); ++i) {
      EXPECT_EQ(whole[i].x, model->points[i].x);
      EXPECT_LE(std::abs(gone[i].x - c.x), 0.4001f);
      if (model->points[i].x > c.x + 0.5f) {
        EXPECT_GT(gone[i].x, c.x);
      }
    }
  }
}

TEST(Balls, FilesThatAreReadCanBeWritten) {
  const auto decoded = [](const std::string& ball) {
    return decode_balls(R"({"field": "wyvill", "balls": [)" + ball + "]}", "balls.json");
  };
  const auto one =
      decoded(R"({"center": [1, 2, 3], "a": 4, "w": 2, "shape": [1, 2, 0.5, 0, 0, 0]})");
  ASSERT_TRUE(one) << one.error().message;
  EXPECT_EQ(one->balls[0].shape.yy, 2);
  for (const char* bad :
       {R"({"center": [1, 2, 3], "a": 0, "w": 2})", R"({"center": [1, 2], "w": 2})",
        R"({"center": [1e60, 2, 3], "w": 2})", R"({"center": [1, 2, 3]})", "7"}) {
    const auto refused = decoded(bad);
    ASSERT_FALSE(refused) << bad;
    EXPECT_EQ(refused.error().code, ErrorCode::kInput);
  }
  // So small an `a` that the radius leaves the range of float.
  const std::string wide = encode_balls({{{}, 1e-44f, 1e30f}}, FieldKind::kGaussian);
  EXPECT_TRUE(decode_balls(wide, "wide.json")) << wide;
}

TEST(MeshFiles, BallsSayTheirVisibleRadius) {
  const std::string json = encode_balls({gaussian_ball({1, 2, 3}, 0.5f)}, FieldKind::kGaussian);
  EXPECT_NE(json.find("\"center\": [1, 2, 3], \"a\": 8, \"w\": 2, \"radius\": 0.5"),
            std::string::npos)
      << json;
}

TEST(MeshFiles, BallsAreReadAsTheyWereWritten) {
  Ball oval{{1, -2, 3}, 1, 0.5f};
  oval.shape = {0.25f, 2, 1, 0.125f, 0, -0.5f};
  const TemporaryFolder folder;
  const auto file = folder.path() / "balls.json";
  const auto read = [&](const std::string& text) {
    EXPECT_TRUE(write_file(file, text));
    return read_balls(file);
  };
  const auto balls = read(encode_balls({oval}, FieldKind::kWyvill));
  ASSERT_TRUE(balls) << balls.error().message;
  EXPECT_EQ(balls->kind, FieldKind::kWyvill);
  ASSERT_EQ(balls->balls.size(), 1u);
  EXPECT_EQ(balls->balls[0].center.y, -2);
  EXPECT_EQ(balls->balls[0].w, 0.5f);
  EXPECT_EQ(balls->balls[0].shape.xy, 0.125f);
  for (const char* bad :
       {"[]", "{\"balls\": [{\"w\": 1}]}", "{\"field\": \"soup\", \"balls\": []}"}) {
    const auto wrong = read(bad);
    ASSERT_FALSE(wrong) << bad;
    EXPECT_EQ(wrong.error().code, ErrorCode::kInput);
  }
}

TEST(SurfaceBounds, HoldEveryBallOfFieldsThatEnd) {
  // Wyvill's balls end at 1 / sqrt(a), whatever w is.
  ExtractSettings settings;
  settings.field = FieldKind::kWyvill;
  settings.iso = 0.5f;
  Ball ball{{1, 2, 3}, 1 / (0.8f * 0.8f), 1.0f};
  const Box round = surface_bounds({ball}, settings);
  EXPECT_NEAR(round.low.x, 0.2f, 1e-5f);
  EXPECT_NEAR(round.high.z, 3.8f, 1e-5f);
  ball.shape = {0.25f, 2, 2, 0, 0, 0};
  const Box flat = surface_bounds({ball}, settings);
  EXPECT_NEAR(flat.high.x, 1 + 1.6f, 1e-5f);
  EXPECT_NEAR(flat.high.y, 2 + 0.8f / std::sqrt(2.0f), 1e-5f);
}

}  // namespace
}  // namespace polymorph
