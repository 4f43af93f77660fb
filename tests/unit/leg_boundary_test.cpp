// The boundary stages: a model becomes its balls' surface.
#include <gtest/gtest.h>

#include <cmath>

#include "field/extract_surface.h"
#include "leg/blend.h"
#include "leg/project.h"
#include "mesh/mesh_check.h"
#include "mesh/normals.h"
#include "model/shapes.h"

namespace polymorph {
namespace {

/// A ball whose surface is the sphere of this radius.
Ball ball_of(Vec3 center, float radius) { return {center, 4 / (radius * radius), 4, {}}; }

struct ModelAndBalls {
  Model model;
  std::vector<Ball> balls;
};

/// The sphere shape (radius 0.5 or so about its own middle) and a ball 2 % larger.
ModelAndBalls sphere_and_ball() {
  ModelAndBalls pair;
  pair.model = *make_shape("sphere");
  const Box box = pair.model.box();
  pair.balls = {ball_of(box.center(), 1.02f * box.size().x / 2)};
  return pair;
}

TEST(Project, MovesEveryPointOntoTheBalls) {
  const ModelAndBalls pair = sphere_and_ball();
  const Projection projection =
      project_model(pair.model, InsideTest(pair.model), pair.balls, FieldKind::kGaussian);
  EXPECT_DOUBLE_EQ(projection.arrived, 1);
  const float radius = 2 / std::sqrt(pair.balls[0].a);
  for (std::size_t i = 0; i < projection.points.size(); ++i) {
    const Vec3 d = projection.points[i] - pair.balls[0].center;
    EXPECT_NEAR(length(d), radius, 1e-4f * radius);
    EXPECT_GT(dot(normalized(d), projection.normals[i]), 0.999f);
  }
  const MovingMesh start = projected_mesh(pair.model, projection, 0);
  EXPECT_EQ(start.points, pair.model.points) << "to the bit";
  EXPECT_EQ(projected_mesh(pair.model, projection, 1).points, projection.points);
}

TEST(Project, SaysHowMuchArrives) {
  ModelAndBalls pair = sphere_and_ball();
  pair.balls[0].center = pair.balls[0].center + Vec3{0.3f * pair.model.box().size().x, 0, 0};
  const double arrived =
      project_model(pair.model, InsideTest(pair.model), pair.balls, FieldKind::kGaussian).arrived;
  EXPECT_GT(arrived, 0.05);
  EXPECT_LT(arrived, 0.9) << "the far side has no surface within reach";
}

class Blend : public ::testing::Test {
 protected:
  void prepare(ModelAndBalls given, float cell) {
    pair = std::move(given);
    const auto to_model = std::make_shared<const ClosestPointQuery>(pair.model);
    Mesh surface = *extract_surface(*engine, pair.balls, cell, {});
    auto made = make_blend_field(
        {pair.model, InsideTest(pair.model), to_model, pair.balls, std::move(surface)}, cell, {},
        *engine);
    ASSERT_TRUE(made.ok());
    field = std::move(*made);
  }
  Mesh at(float progress) const { return *blend_surface(field, pair.model, progress, {}, *engine); }

  ModelAndBalls pair;
  BlendField field;
  std::unique_ptr<Engine> engine = make_cpu_engine();
};

TEST_F(Blend, GoesFromTheModelToTheBallsWithoutAHole) {
  const ModelAndBalls given = sphere_and_ball();
  const float size = given.model.box().size().x;
  prepare(given, size / 40);
  float before = 0;
  for (const float progress : {0.0f, 0.25f, 0.5f, 0.75f, 1.0f}) {
    const Mesh mesh = at(progress);
    EXPECT_TRUE(check_mesh(mesh).is_closed()) << progress;
    float radius = 0;
    for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
      const Vec3 d = mesh.positions[i] - pair.balls[0].center;
      radius += length(d) / static_cast<float>(mesh.positions.size());
      EXPECT_GT(dot(normalized(d), mesh.normals[i]), 0.98f);
    }
    EXPECT_NEAR(radius, size / 2 * (1 + 0.02f * progress), 0.003f * size) << progress;
    EXPECT_GT(radius, before);
    before = radius;
  }
}

TEST_F(Blend, FarApartAndOpenModelsStaySound) {
  ModelAndBalls given = sphere_and_ball();
  given.balls[0].center = given.balls[0].center + Vec3{0.4f * given.model.box().size().x, 0, 0};
  given.model.triangles.resize(given.model.triangles.size() * 3 / 5);  // a large opening
  given.model.corner_normals.resize(given.model.triangles.size() * 3);
  if (!given.model.corner_uvs.empty())
    given.model.corner_uvs.resize(given.model.triangles.size() * 3);
  prepare(given, given.model.box().size().x / 30);
  for (const float progress : {0.0f, 0.3f, 0.5f, 0.9f, 1.0f}) {
    const MeshReport report = check_mesh(at(progress));
    EXPECT_TRUE(report.is_closed()) << progress;
    EXPECT_EQ(report.degenerate_triangles, 0u);
  }
}

}  // namespace
}  // namespace polymorph
