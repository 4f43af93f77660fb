// Landmarks of a scene: from the files to the legs' maps.
#include <gtest/gtest.h>

#include <fstream>

#include "assets/load_models.h"
#include "assets/place_landmarks.h"
#include "leg/leg_surface.h"
#include "mesh/closest.h"
#include "morph/motion.h"
#include "testing/scene.h"

namespace polymorph {
namespace {

class LandmarksTest : public SceneTest {
 protected:
  LandmarksTest()
      : SceneTest(R"("spheres": {"balls": 24, "fit": "none"}, "surface": {"resolution": 24},
          "frames": {"count": 8}, "image": {"width": 16, "height": 16})") {}

  /// Writes a model and returns its path as JSON.
  std::string model(const std::string& name) {
    std::filesystem::copy_file(source_dir() / "scenes/models" / name, folder / name,
                               std::filesystem::copy_options::overwrite_existing);
    return "\"" + name + "\"";
  }
  /// Landmarks of the monkey and the penguin: noses, crowns and what sticks out on the left.
  static std::string landmarks() {
    return R"("landmarks": {
      "monkey.obj": {"nose": [0.0875, 0.35, 0.815], "crown": "v2809", "left": [1.04, 0.8856, -0.193]},
      "penguin": {"nose": "v2455", "crown": [0, 1.9, 0.03], "left": "v5001"}})";
  }
  /// The largest distance by which a leg's map misses its landmarks, over the objects' size.
  double largest_miss(const Leg& leg) {
    double worst = 0;
    for (const float time : {0.0f, 0.2f, 0.5f, 0.85f, 1.0f}) {
      const auto state = leg_state(leg, time, *engine);
      EXPECT_TRUE(state.ok());
      const std::vector<Vec3> places = landmark_positions(leg.plan, time, state->balls);
      const auto met = pull_back(leg, *state, places, *engine);
      EXPECT_TRUE(met.ok());
      for (std::size_t l = 0; l < places.size(); ++l)
        for (const float miss : {length(met->source[l] - leg.plan.landmarks[l].from),
                                 length(met->target[l] - leg.plan.landmarks[l].to)})
          worst = std::max(worst, static_cast<double>(miss / object_size(leg, time)));
    }
    return worst;
  }
};

TEST_F(LandmarksTest, ArriveExactlyWithLabelsAndWithout) {
  for (const char* mode : {"off", "soft", "hard"})
    for (const char* path : {"rigid", "parts"}) {
      const PreparedScene prepared = prepared_of(
          "\"source\": " + model("monkey.obj") + ", \"target\": " + model("penguin.obj") +
          ", \"motion\": {\"path\": \"" + path + "\"}, \"plan\": {\"label_mode\": \"" + mode +
          "\", \"labels\": {\"muzzle\": \"beak\"}, " + landmarks() + "}");
      const Leg& leg = *prepared.actors[0].legs[0];
      EXPECT_EQ(leg.landmark_names, (std::vector<std::string>{"crown", "left", "nose"}));
      EXPECT_LT(largest_miss(leg), 1e-3) << mode << " " << path;
    }
}

TEST_F(LandmarksTest, FollowTheModelsPlace) {
  // The same points, however the objects stand.
  const auto placed_at = [&](const std::string& source, const std::string& arrange) {
    const Scene scene = scene_of("\"source\": {\"model\": " + model("monkey.obj") + source +
                                 "}, \"target\": " + model("penguin.obj") + ", \"arrange\": \"" +
                                 arrange + "\", \"plan\": {" + landmarks() + "}");
    const auto chain = chain_objects(scene);
    const auto loaded = load_models(scene, chain, false);
    EXPECT_TRUE(loaded.ok());
    std::vector<std::string> problems;
    auto placed = place_landmarks(scene, chain, *loaded, problems);
    EXPECT_TRUE(problems.empty()) << problems.front();
    return std::pair(placed[0], loaded->models[0]);
  };
  for (const auto& [source, arrange] :
       {std::pair("", "none"), std::pair(", \"scale\": [1, 2, 0.5]", "none"),
        std::pair(", \"up\": \"z\", \"rotate\": [0, 30, 10]", "stand"),
        std::pair(", \"rotate\": [90, 0, 0], \"translate\": [3, 0, 0]", "stand")}) {
    const auto [placed, moved] = placed_at(source, arrange);
    ASSERT_EQ(placed.size(), 3u);
    const auto [plain, model] = placed_at("", "none");
    // The placed landmarks lie among the moved points as the plain ones do among the plain.
    const auto nearest = [](const Model& m, Vec3 p) {
      std::size_t best = 0;
      for (std::size_t i = 0; i < m.points.size(); ++i)
        if (length(m.points[i] - p) < length(m.points[best] - p)) best = i;
      return best;
    };
    for (const auto& [name, place] : placed) {
      EXPECT_EQ(nearest(moved, place), nearest(model, plain.at(name))) << source << name;
      EXPECT_LT(ClosestPointQuery(moved).closest(place).distance, 1e-4f);
    }
  }
}

TEST_F(LandmarksTest, AreHandedOnByAnObjectThatIsLeftBefore) {
  const PreparedScene prepared = prepared_of(
      R"("source": "cube", "intermediate": [{"shape": "sphere", "retarget": 0.5}], "target": "torus",
         "plan": {"landmarks": {"cube": {"a": [1, 1, 0]},
                                "sphere": {"a": [1, 1, 0], "c": [0, 1, 1]},
                                "torus": {"a": "v1", "c": "v40"}}})");
  const PreparedActor& actor = prepared.actors[0];
  EXPECT_EQ(actor.legs[0]->landmark_names, (std::vector<std::string>{"a"}));
  ASSERT_EQ(actor.legs[1]->landmark_names, (std::vector<std::string>{"a"}));
  const Leg& first = *actor.legs[0];
  const auto left = leg_state(first, first.until, *engine);
  ASSERT_TRUE(left.ok());
  EXPECT_EQ(actor.legs[1]->plan.landmarks[0].from,
            landmark_positions(first.plan, first.until, left->balls)[0]);
  EXPECT_LT(largest_miss(*actor.legs[1]), 1e-3);
}

TEST_F(LandmarksTest, WarnWhereTheyFoldTheMap) {
  const auto warnings = [&](const std::string& target) {
    return prepared_of(R"("source": "cube", "target": "sphere",
        "plan": {"align": "none", "landmarks": {"cube": {"east": [1, 1, 0], "west": [-1, 1, 0]},
                               "sphere": )" +
                       target + "}}")
        .warnings;
  };
  EXPECT_TRUE(warnings(R"({"east": [1, 1, 0], "west": [-1, 1, 0]})").empty());
  const auto folded = warnings(R"({"east": [-1, 1, 0], "west": [1, 1, 0]})");
  ASSERT_EQ(folded.size(), 1u);
  EXPECT_NE(folded[0].find("cube -> sphere: landmarks fold the map, most of all around \""),
            std::string::npos)
      << folded[0];
}

}  // namespace
}  // namespace polymorph
