#include <gtest/gtest.h>

#include <functional>
#include <set>

#include "sequence/content_hash.h"

namespace polymorph {
namespace {

Model triangle() {
  Model model;
  model.name = "triangle";
  model.points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  model.triangles = {Triangle{{0, 1, 2}}};
  model.corner_normals.assign(3, {0, 0, 1});
  model.corner_uvs = {{0, 0}, {1, 0}, {0, 1}};
  model.labels = {0};
  model.label_names = {"skin", "bone"};
  model.triangle_materials = {0};
  model.materials.resize(2);
  model.textures = {std::make_shared<const Image>(make_image(2, 2, {"R", "G", "B"}))};
  return model;
}

Scene scene() {
  Scene scene;
  scene.path = "/a/scene.json";
  scene.actors.resize(1);
  ActorSettings& actor = scene.actors[0];
  actor.name = actor.source.name = "penguin";
  actor.source.model = "/a/penguin.obj";
  actor.target.name = "monkey";
  actor.target.model = "/a/monkey.obj";
  return scene;
}

TEST(ContentHash, ContentsCountAndSpellingsDoNot) {
  Scene other = scene();
  other.path = "../a/scene.json";
  other.actors[0].source.model = "/a/../a/penguin.obj";
  other.actors[0].target.model = "/b/monkey.obj";
  other.output.file = "another.####.exr";
  Model renamed = triangle();
  renamed.name = "another";
  renamed.materials[0].name = "another";
  const Model model = triangle();
  EXPECT_EQ(content_hash(other, std::span(&renamed, 1), nullptr),
            content_hash(scene(), std::span(&model, 1), nullptr));
}

TEST(ContentHash, EverythingThatDecidesAFrameCounts) {
  const std::vector<std::function<void(Model&)>> changes{
      [](Model&) {},
      [](Model& m) { m.points[0].x = 0.5f; },
      [](Model& m) { m.triangles[0].v[0] = 1; },
      [](Model& m) { m.corner_normals[0].x = 1; },
      [](Model& m) { m.corner_uvs[0].x = 1; },
      [](Model& m) { m.labels[0] = 1; },
      [](Model& m) { std::swap(m.label_names[0], m.label_names[1]); },
      [](Model& m) { m.label_names.pop_back(); },
      [](Model& m) {
        m.label_names = {"skinbone", ""};
      },
      [](Model& m) { m.triangle_materials[0] = 1; },
      [](Model& m) { m.materials.pop_back(); },
      [](Model& m) { m.materials[0].color.x = 0; },
      [](Model& m) { m.materials[0].specular.x = 0; },
      [](Model& m) { m.materials[0].roughness = 0; },
      [](Model& m) { m.materials[0].metallic = 1; },
      [](Model& m) { m.materials[0].transmission = 1; },
      [](Model& m) { m.materials[0].ior = 1.3f; },
      [](Model& m) { m.materials[0].texture = 0; },
      [](Model& m) { m.textures.clear(); },
  };
  std::set<std::string> hashes;
  for (const auto& change : changes) {
    Model model = triangle();
    change(model);
    hashes.insert(content_hash(scene(), std::span(&model, 1), nullptr));
  }
  EXPECT_EQ(hashes.size(), changes.size());
  const Model model = triangle();
  const std::vector<std::function<void(Scene&)>> settings{
      [](Scene& s) { s.output.png_bits = 16; }, [](Scene& s) { s.output.dither = true; },
      [](Scene& s) { s.image.samples = 7; }, [](Scene& s) { s.actors[0].target.name = "torus"; }};
  for (const auto& change : settings) {
    Scene changed = scene();
    change(changed);
    EXPECT_TRUE(hashes.insert(content_hash(changed, std::span(&model, 1), nullptr)).second);
  }
  const Image sky = make_image(2, 1, {"R", "G", "B"});
  EXPECT_TRUE(hashes.insert(content_hash(scene(), std::span(&model, 1), &sky)).second);
  EXPECT_TRUE(
      hashes.insert(content_hash(scene(), std::span(&model, 1), nullptr, "another build")).second);
  EXPECT_FALSE(program_identity().empty());
}

}  // namespace
}  // namespace polymorph
