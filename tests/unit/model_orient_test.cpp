#include "model/repair/orient.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/random.h"
#include "mesh/normals.h"
#include "model/repair/diagnose.h"
#include "model/shapes.h"
#include "testing/model.h"

namespace polymorph {
namespace {

void turn(Model& model, std::size_t t) {
  std::swap(model.triangles[t].v[1], model.triangles[t].v[2]);
}

bool same_faces(const Model& a, const Model& b) {
  for (std::size_t t = 0; t < a.triangles.size(); ++t)
    for (int k = 0; k < 3; ++k)
      if (a.triangles[t].v[k] != b.triangles[t].v[k]) return false;
  return a.triangles.size() == b.triangles.size();
}

Model shape(const char* name) {
  auto model = make_shape(name);
  EXPECT_TRUE(model);
  return std::move(*model);
}

TEST(OrientFaces, LeavesWhatIsRight) {
  Model model = shape("torus");
  const Model before = model;
  const Orientation faces = orient_faces(model);
  EXPECT_EQ(faces.flipped, 0u);
  EXPECT_EQ(faces.faces, before.triangles.size());
  EXPECT_TRUE(same_faces(model, before));
}

TEST(OrientFaces, MendsFacesTurnedAtRandom) {
  for (const float share : {0.1f, 0.5f, 0.9f, 1.0f}) {
    const Model good = shape("torus");
    Model model = good;
    std::size_t turned = 0;
    for (std::size_t t = 0; t < model.triangles.size(); ++t)
      if (random_float(3, 0, t) < share) turn(model, t), ++turned;
    EXPECT_EQ(orient_faces(model).flipped, turned) << share;
    EXPECT_TRUE(diagnose(model).closed);
    EXPECT_GT(volume_of(model), 0) << share;
  }
}

TEST(OrientFaces, MendsAnOpenModel) {
  Model model = shape("sphere");
  model.triangles.resize(model.triangles.size() * 9 / 10);
  const Model good = model;
  for (std::size_t t = 0; t < model.triangles.size(); ++t)
    if (random_float(5, 0, t) < 0.7f) turn(model, t);
  orient_faces(model);
  EXPECT_TRUE(same_faces(model, good));
  for (std::size_t t = 0; t < model.triangles.size(); ++t) turn(model, t);
  EXPECT_EQ(orient_faces(model).flipped, model.triangles.size()) << "inside out as a whole";
  EXPECT_TRUE(same_faces(model, good));
}

TEST(OrientFaces, TellsCavitiesFromBodies) {
  Model model = box_model({0, 0, 0}, {4, 4, 4});
  add_box(model, {1, 1, 1}, {2, 2, 2}, true);  // a cavity
  add_box(model, {6, 0, 0}, {7, 1, 1}, true);  // a body, inside out
  EXPECT_EQ(orient_faces(model).flipped, 12u);
  EXPECT_NEAR(volume_of(model), 64 - 1 + 1, 1e-5);
  EXPECT_EQ(diagnose(model).inverted_shells, 0u);
}

TEST(OrientFaces, ACupsInnerWallStays) {
  // Two boxes without lids, not joined at their rims: the inner one looks into the cup.
  Model cup;
  add_box(cup, {0, 0, 0}, {4, 4, 4});
  cup.triangles.resize(10);
  Model inner;
  add_box(inner, {0.2f, 0.2f, 0.2f}, {3.8f, 3.8f, 4}, true);
  inner.triangles.resize(10);
  for (const Triangle& t : inner.triangles)
    cup.triangles.push_back({{t.v[0] + 8, t.v[1] + 8, t.v[2] + 8}});
  cup.points.insert(cup.points.end(), inner.points.begin(), inner.points.end());
  EXPECT_EQ(orient_faces(cup).flipped, 0u);
}

TEST(OrientFaces, SheetsAndMoebiusStripsStay) {
  Model strip;
  constexpr std::uint32_t kSteps = 24;
  for (std::uint32_t i = 0; i < kSteps; ++i) {
    const float u = 6.2831853f * static_cast<float>(i) / kSteps;
    for (const float v : {-0.3f, 0.3f})
      strip.points.push_back({(1 + v * std::cos(u / 2)) * std::cos(u),
                              (1 + v * std::cos(u / 2)) * std::sin(u), v * std::sin(u / 2)});
  }
  for (std::uint32_t i = 0; i < kSteps; ++i) {
    const bool last = i + 1 == kSteps;
    const std::uint32_t a = 2 * i, b = a + 1, c = last ? 1 : a + 2, d = last ? 0 : a + 3;
    strip.triangles.push_back({{a, c, b}});
    strip.triangles.push_back({{b, c, d}});
  }
  EXPECT_EQ(orient_faces(strip).flipped, 0u);
  Model sheet;
  sheet.points = {{0, 0, 0}, {1, 0, 0.1f}, {1, 1, 0}, {0, 1, 0.1f}};
  sheet.triangles = {{{0, 1, 2}}, {{0, 2, 3}}};
  EXPECT_EQ(orient_faces(sheet).flipped, 0u);
}

TEST(OrientFaces, NormalsFollowUnlessTheyWereRight) {
  for (const bool right : {false, true}) {
    Model model = shape("sphere");
    model.corner_normals = creased_normals(model);
    model.corner_uvs.clear();
    const Model good = model;
    for (std::size_t t = 0; t < model.triangles.size(); t += 3) {
      turn(model, t);
      std::swap(model.corner_normals[3 * t + 1], model.corner_normals[3 * t + 2]);
      for (std::size_t k = 0; k < 3 && !right; ++k)
        model.corner_normals[3 * t + k] = -model.corner_normals[3 * t + k];
    }
    orient_faces(model);
    EXPECT_TRUE(same_faces(model, good));
    EXPECT_EQ(model.corner_normals, good.corner_normals) << right;
  }
}

}  // namespace
}  // namespace polymorph
