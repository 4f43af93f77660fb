#include "scene/memory_models.h"

#include <gtest/gtest.h>

#include "scene/load_scene.h"
#include "scene/mesh_numbers.h"

namespace polymorph {
namespace {

MemoryMesh triangle(float x) { return {{{x, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {0, 1, 2}, {3}, {}}; }

TEST(MemoryModels, AreFoundByTheirPathsWhileTheirOwnerLives) {
  std::filesystem::path path;
  {
    MemoryModels models, others;
    path = models.add("mesh1", triangle(2));
    EXPECT_EQ(path.stem(), "mesh1");
    EXPECT_NE(others.add("mesh1", triangle(3)), path);
    ASSERT_TRUE(find_memory_mesh(path));
    EXPECT_EQ(find_memory_mesh(path)->vertices.front().x, 2);
    EXPECT_TRUE(model_exists(path));
  }
  EXPECT_FALSE(find_memory_mesh(path));
  EXPECT_FALSE(model_exists(path));
}

TEST(MemoryModels, StayForThoseWhoHaveThem) {
  std::shared_ptr<const MemoryMesh> mesh;
  {
    MemoryModels models;
    mesh = find_memory_mesh(models.add("mesh1", triangle(4)));
  }
  ASSERT_TRUE(mesh);
  EXPECT_EQ(mesh->vertices.front().x, 4);
}

TEST(MemoryModels, StandForFilesInAScene) {
  MemoryModels models;
  const std::string one = models.add("mesh1", triangle(2)).string(),
                    many = models.add("mesh2", {triangle(2), triangle(3), triangle(4)}).string();
  const auto scene = load_scene_text(
      "scene.json", R"({"source": ")" + one + R"(", "target": {"model": ")" + many + R"("}})");
  ASSERT_TRUE(scene) << scene.error().message;
  const ActorSettings& actor = scene->actors.front();
  EXPECT_EQ(actor.source.name, "mesh1");
  EXPECT_FALSE(is_mesh_sequence(actor.source));
  EXPECT_EQ(actor.target.name, "mesh2");
  EXPECT_EQ(mesh_numbers(actor.target), (std::vector<int>{1, 2, 3}));
  EXPECT_EQ(find_memory_mesh(mesh_file(actor.target, 3))->vertices.front().x, 4);
  EXPECT_EQ(describe_sequence(actor.target), "3 meshes, frames 1 to 3");
}

TEST(MemoryModels, ThatAreGoneAreMissingFiles) {
  std::string path;
  {
    MemoryModels models;
    path = models.add("mesh1", triangle(2)).string();
  }
  const auto scene =
      load_scene_text("scene.json", R"({"source": ")" + path + R"(", "target": "cube"})");
  ASSERT_FALSE(scene);
  EXPECT_NE(scene.error().message.find("no such file"), std::string::npos);
}

}  // namespace
}  // namespace polymorph
