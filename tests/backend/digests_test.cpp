// SHA-256 of surfaces and values, the same on every processor. They change if a compiler contracts
// a product and a sum to one operation (FMA), or reorders sums.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "kernels/simd_math.h"
#include "testing/backend.h"
#include "testing/between.h"
#include "testing/digest.h"

namespace polymorph {
namespace {

/// Makes three of every four balls ellipsoids. Their shapes are constants; shapes computed with the
/// C library's sine would differ between platforms.
std::vector<Ball> stretched(std::vector<Ball> balls) {
  const Sym3 shapes[] = {
      {4, 0.5f, 0.5f, 0, 0, 0}, {1.25f, 1, 1, 0.5f, 0, 0}, {0.25f, 2, 2, 0, 0, 0}};
  for (std::size_t i = 0; i < balls.size(); ++i)
    if (i % 4 != 3) balls[i].shape = shapes[i % 4];
  return balls;
}

void add(Digest& digest, const Mesh& mesh) {
  EXPECT_FALSE(mesh.triangles.empty());
  digest.add(mesh.positions);
  digest.add(mesh.normals);
  digest.add(mesh.triangles);
}

class DigestsTest : public SurfaceTest {
 protected:
  std::string surface(const std::vector<Ball>& balls, FieldKind field, int refine_steps) {
    ExtractSettings settings;
    settings.field = field;
    settings.refine_steps = refine_steps;
    Digest digest;
    add(digest, extract(balls, cube_grid(41, 1.6f), settings));
    std::vector<Vec3> points;
    for (const Ball& ball : random_balls(500, field, 41)) points.push_back(1.2f * ball.center);
    digest.add(sample(balls, points, settings));
    return digest.hex();
  }
  std::string between(int landmarks) {
    auto map = std::make_shared<Regression>(*random_map(60, 0.3f, 3, true));
    if (landmarks > 0)
      map = std::make_shared<Regression>(*map_with_landmarks(*map, landmarks, 0.2f, 4));
    const auto torus = torus_distances(1, 0.3f), sphere = sphere_distances(0.8f, {0.2f, 0, 0});
    // Any grids serve as thinness here.
    map->thinness[0] = sphere, map->thinness[1] = torus;
    Mesh mesh;
    const MorphSurface surface = {map, torus, sphere, 1.1f, 0.9f, 0.03f};
    EXPECT_EQ(engine_->extract(surface, cube_grid(41, 1.7f), {}, mesh).code, EngineCode::kOk);
    std::vector<Vec3> points;
    for (const Ball& ball : random_balls(500, FieldKind::kGaussian, 42))
      points.push_back(1.3f * ball.center);
    std::vector<AttributeValues> values;
    EXPECT_EQ(engine_->regress(map, points, values).code, EngineCode::kOk);
    Digest digest;
    add(digest, mesh);
    digest.add(values);
    return digest.hex();
  }
};

TEST_P(DigestsTest, surfaces_of_balls_are_those_of_every_processor) {
  const auto round = [](FieldKind field) { return random_balls(60, field, 40); };
  EXPECT_EQ(surface(round(FieldKind::kGaussian), FieldKind::kGaussian, 1), "709a0fe4679fe7fe");
  EXPECT_EQ(surface(stretched(round(FieldKind::kGaussian)), FieldKind::kGaussian, 2),
            "ea5e110f25090059");
  EXPECT_EQ(surface(round(FieldKind::kWyvill), FieldKind::kWyvill, 1), "5a734995ef6917a5");
  EXPECT_EQ(surface(stretched(round(FieldKind::kWyvill)), FieldKind::kWyvill, 2),
            "a66465ac88ab45ae");
  EXPECT_EQ(surface(with_holes(round(FieldKind::kInverseSquare)), FieldKind::kInverseSquare, 2),
            "8ba60b35909f516a");
}

TEST_P(DigestsTest, surfaces_between_objects_are_those_of_every_processor) {
  EXPECT_EQ(between(0), "86e5b3eed52b6452");
  EXPECT_EQ(between(5), "2755d307ec719a23");
}
PM_EVERY_BACKEND(DigestsTest);

TEST(Digests, powers_and_logarithms_are_those_of_every_processor) {
  std::vector<float> values;
  for (int i = 0; i < 20000; ++i) {
    const float e = kMinExponent + (kMaxExponent - kMinExponent) * static_cast<float>(i) / 20000;
    values.push_back(exp2(e));
    values.push_back(log2(1 + static_cast<float>(i) * 0.37f));
  }
  Digest digest;
  digest.add(values);
  EXPECT_EQ(digest.hex(), "d0d52fb05a862b20");
}

}  // namespace
}  // namespace polymorph
