// Blends in scenes: reading, mistakes, order, weights over the film, writing.
#include "scene/blends.h"

#include <gtest/gtest.h>

#include "base/file.h"
#include "scene/load_scene.h"
#include "testing/temporary_folder.h"

namespace polymorph {
namespace {

class BlendTest : public FolderTest {
 protected:
  void SetUp() override {
    for (const char* name : {"a.obj", "b.obj", "c.obj"})
      ASSERT_TRUE(write_file(folder / name, "v 0 0 0\n").ok());
  }
  Result<Scene> load(const std::string& text) {
    return load_scene_text(folder / "scene.json", text);
  }
  /// Everything that is wrong with a scene.
  std::string errors_of(const std::string& text) {
    const auto scene = load(text);
    EXPECT_FALSE(scene.ok()) << text;
    return scene.ok() ? "" : scene.error().message;
  }
  void expect_error(const std::string& text, const std::string& part) {
    EXPECT_NE(errors_of(text).find(part), std::string::npos) << errors_of(text);
  }
};

constexpr const char* kThree = R"({"blend": [
  {"model": "c.obj", "weight": {"easing": "linear", "keys": [
    {"t": 0, "value": 2}, {"t": 1, "value": 0}]}},
  {"model": "a.obj", "weight": 0, "rotate": [0, 90, 0]},
  {"shape": "sphere", "weight": {"keys": [{"t": 0, "value": 0}, {"t": 1, "value": 3}]}}],
  "frames": {"count": 5}})";

TEST_F(BlendTest, ObjectsHaveTheOrderOfTheirNamesAndTheirOwnKeyframes) {
  const auto scene = load(kThree);
  ASSERT_TRUE(scene.ok()) << scene.error().message;
  const std::vector<ObjectSettings>& blend = scene->actors[0].blend;
  ASSERT_EQ(blend.size(), 3u);
  EXPECT_EQ(blend[0].name, "a");
  EXPECT_EQ(blend[0].rotate.y, 90);
  EXPECT_EQ(blend[1].name, "c");
  EXPECT_EQ(blend[2].name, "sphere");
  EXPECT_EQ(scene->actors[0].name, "blend");
  EXPECT_TRUE(mixes_many(scene->actors[0]));
  EXPECT_EQ(chain_objects(scene->actors[0]).size(), 3u);
  EXPECT_EQ(blend_weights(*scene, 0, {0, 1, 1, 0}), (std::vector<float>{0, 1, 0}));
  EXPECT_EQ(blend_weights(*scene, 0, {1, 5, 2, 0}), (std::vector<float>{0, 0, 1}));
  const std::vector<float> middle = blend_weights(*scene, 0, {0.5, 3, 1.5, 0});
  EXPECT_NEAR(middle[1], 1 / 2.5, 1e-6);
  EXPECT_NEAR(middle[2], 1.5 / 2.5, 1e-6);
}

TEST_F(BlendTest, TheOrderOfTheListChangesNothing) {
  const std::string first = R"({"model": "a.obj", "weight": 1})",
                    second = R"({"model": "b.obj", "weight": {"keys": [{"t": 0, "value": 2}]}})",
                    again = R"({"model": "b.obj", "weight": 3, "scale": 2})";
  const auto text = [](const std::string& a, const std::string& b, const std::string& c) {
    return R"({"blend": [)" + a + "," + b + "," + c + "]}";
  };
  const auto one = load(text(first, second, again)), other = load(text(again, second, first));
  ASSERT_TRUE(one.ok() && other.ok());
  EXPECT_EQ(scene_to_json(*one, folder), scene_to_json(*other, folder));
}

TEST_F(BlendTest, AWrittenSceneReadsTheSame) {
  const auto scene = load(kThree);
  ASSERT_TRUE(scene.ok());
  const std::string written = scene_to_json(*scene, folder);
  EXPECT_EQ(written.find("\"source\""), std::string::npos);
  const auto again = load(written);
  ASSERT_TRUE(again.ok()) << again.error().message;
  EXPECT_EQ(scene_to_json(*again, folder), written);
  EXPECT_EQ(blend_weights(*again, 0, {0.5, 3, 1.5, 0}), blend_weights(*scene, 0, {0.5, 3, 1.5, 0}));
  // Scenes without a blend say nothing of it: their frames are known by their text.
  const auto chain = load(R"({"source": "a.obj", "target": "b.obj"})");
  ASSERT_TRUE(chain.ok());
  EXPECT_EQ(scene_to_json(*chain, folder).find("blend\": ["), std::string::npos);
  EXPECT_EQ(scene_to_json(*chain, folder).find("weight"), std::string::npos);
}

TEST_F(BlendTest, KeyedWeightsAreThoseOfTheFrame) {
  const auto scene = load(kThree);
  ASSERT_TRUE(scene.ok());
  const Scene moment = scene_at(*scene, FilmTime{0.5, 3, 1.5, 0});
  EXPECT_FLOAT_EQ(moment.actors[0].blend[1].weight.value_or(-1), 1);
  EXPECT_FLOAT_EQ(moment.actors[0].blend[2].weight.value_or(-1), 1.5f);
}

TEST_F(BlendTest, MistakesAreNamed) {
  expect_error(R"({"blend": [{"model": "a.obj", "weight": 1}]})",
               "/blend: has 1 object - a blend has two or more");
  expect_error(R"({"blend": ["a.obj", {"model": "b.obj", "weight": 1}]})",
               "/blend/0/weight: is missing");
  expect_error(R"({"blend": [{"model": "a.obj", "weight": -1}, {"model": "b.obj", "weight": 1}]})",
               "/blend/0/weight: must be 0 to 1e+06 (is -1)");
  expect_error(R"({"blend": [{"model": "a.obj", "weight": 0}, {"model": "b.obj", "weight": 0}]})",
               "/blend: all weights are 0");
  const std::string two =
      R"("blend": [{"model": "a.obj", "weight": 1}, {"model": "b.obj", "weight": 1}])";
  expect_error("{" + two + R"(, "source": "a.obj"})", "/source: contradicts \"blend\"");
  expect_error("{" + two + R"(, "actors": [{"source": "a.obj", "target": "b.obj"}]})",
               "/blend: contradicts \"actors\"");
  expect_error("{" + two + R"(, "frames": {"per_leg": [3, 4]}})",
               "/frames/per_leg: has 2 entries for 1 leg");
  expect_error(R"({"actors": [{)" + two + R"(, "start": 4}]})", "/actors/0/start: is for morphs");
  expect_error(R"({"source": {"model": "a.obj", "weight": 1}, "target": "b.obj"})",
               "/source/weight: is for the objects of a \"blend\"");
  expect_error(R"({"blend": [{"model": "a.obj", "weight": 1, "hold": 3},
                             {"model": "b.obj", "weight": 1, "meta": true}]})",
               "/blend/1/meta: is for an object on the way");
  expect_error(R"({"blend": [{"model": "a.obj", "weight": 1}, {"model": "b.obj", "weight": 1},
                             {"shape": "drops", "weight": 1}]})",
               "/blend/2: needs another shape than \"drops\"");
  expect_error("{" + two + R"(, "camera": {"azimuth": {"keys": [{"leg": 2.5, "value": 1}]}}})",
               "is at leg 2.5");
}

}  // namespace
}  // namespace polymorph
