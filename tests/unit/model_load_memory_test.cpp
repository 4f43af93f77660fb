#include "model/load/load_memory.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "model/load/load_model.h"
#include "testing/model.h"

namespace polymorph {
namespace {

/// A square base of one face and four sides of a pyramid, with a vertex that no face uses.
MemoryMesh pyramid() {
  return {{{9, 9, 9}, {0, 0, 0}, {1, 0, 0}, {1, 0, 1}, {0, 0, 1}, {0.5f, 0.7f, 0.5f}},
          {1, 2, 3, 4, 1, 5, 2, 2, 5, 3, 3, 5, 4, 4, 5, 1},
          {4, 3, 3, 3, 3},
          {}};
}

std::string error_of(const MemoryMesh& mesh) {
  const auto loaded = load_memory(mesh, "name");
  EXPECT_FALSE(loaded);
  return loaded ? "" : loaded.error().message;
}

TEST(LoadMemory, GivesTheModelOfTheSameFile) {
  TemporaryFolder folder;
  const auto file = folder.write("model.obj",
                                 "v 9 9 9\nv 0 0 0\nv 1 0 0\nv 1 0 1\nv 0 0 1\nv 0.5 0.7 0.5\n"
                                 "f 2 3 4 5\nf 2 6 3\nf 3 6 4\nf 4 6 5\nf 5 6 2\n");
  const auto from_file = load_obj(file, {.vertices = true}),
             from_memory = load_memory(pyramid(), "name", {.vertices = true});
  ASSERT_TRUE(from_file && from_memory);
  const Model &a = from_file->model, &b = from_memory->model;
  EXPECT_EQ(a.points, b.points);
  EXPECT_EQ(a.corner_normals, b.corner_normals);
  ASSERT_EQ(a.triangles.size(), b.triangles.size());
  for (std::size_t t = 0; t < a.triangles.size(); ++t)
    EXPECT_TRUE(std::equal(a.triangles[t].v, a.triangles[t].v + 3, b.triangles[t].v));
  EXPECT_EQ(from_file->vertices, from_memory->vertices);
  EXPECT_EQ(from_file->warnings.size(), from_memory->warnings.size());
  EXPECT_EQ(a.label_names, b.label_names);
}

TEST(LoadMemory, IsFoundByItsPath) {
  MemoryModels models;
  const auto path = models.add("pyramid", pyramid());
  const auto loaded = load_model(path);
  ASSERT_TRUE(loaded) << loaded.error().message;
  EXPECT_EQ(loaded->model.name, "pyramid");
  EXPECT_EQ(loaded->model.triangles.size(), 6u);
}

TEST(LoadMemory, FacesHaveTheMeanColourOfTheirVertices) {
  MemoryMesh mesh = pyramid();
  mesh.colors.assign(3 * mesh.vertices.size(), 1);  // white is a colour here: it was chosen
  auto loaded = load_memory(mesh, "name");
  ASSERT_TRUE(loaded);
  EXPECT_EQ(loaded->model.materials.size(), 1u);
  EXPECT_EQ(loaded->model.materials.front().color, (Vec3{1, 1, 1}));
  for (std::size_t c = 0; c < 3; ++c) mesh.colors[3 * 5 + c] = 0;
  loaded = load_memory(mesh, "name");
  ASSERT_TRUE(loaded);
  EXPECT_EQ(loaded->model.materials.size(), 2u);  // the base, and the sides
}

TEST(LoadMemory, SaysWhatIsNoMesh) {
  const auto has = [](const std::string& text, const char* part) {
    return text.find(part) != std::string::npos;
  };
  MemoryMesh mesh = pyramid();
  mesh.corners[6] = 6;
  EXPECT_TRUE(has(error_of(mesh), "name: face 1 uses vertex 6, but there are 6"));
  mesh = pyramid();
  mesh.face_sizes = {4, 2, 4, 3, 3};
  EXPECT_TRUE(has(error_of(mesh), "name: face 1 has 2 corners"));
  mesh.face_sizes = {4, 3};
  EXPECT_TRUE(has(error_of(mesh), "need 7 corners, there are 16"));
  for (const float bad : {std::nanf(""), std::numeric_limits<float>::infinity(), 1e16f}) {
    mesh = pyramid();
    mesh.vertices[2].y = bad;
    EXPECT_TRUE(has(error_of(mesh), "vertex 2 has the coordinate"));
  }
  mesh = pyramid();
  mesh.colors = {1, 1, 1};
  EXPECT_TRUE(has(error_of(mesh), "6 vertices and 1 colours"));
  EXPECT_TRUE(has(error_of({}), "no faces"));
  mesh = pyramid();
  for (Vec3& v : mesh.vertices) v = {1, 1, 1};
  EXPECT_TRUE(has(error_of(mesh), "no faces: all 5 have no area"));
}

}  // namespace
}  // namespace polymorph
