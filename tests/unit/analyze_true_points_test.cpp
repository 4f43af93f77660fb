#include "analyze/true_points.h"

#include <gtest/gtest.h>

#include "testing/model.h"

namespace polymorph {
namespace {

class TruthFile : public FolderTest {
 protected:
  Result<Truth> read(const std::string& text) {
    std::ofstream(folder / "truth.json") << text;
    return load_truth(folder);
  }
  std::string error(const std::string& text) {
    const auto truth = read(text);
    return truth ? "" : truth.error().message;
  }
};

constexpr const char* kTwo = R"({
  "models": {
    "elk": {"model": "models/elk.obj", "up": "z", "points": {"nose": [1, 2, 3], "tail": [0, 0, -1]}},
    // Its nose has no name.
    "spot": {"model": "spot.obj", "points": {"tail": [4, 5, 6], "ear": [7, 8, 9]}}
  },
  "pairs": [["elk", "spot"], ["spot", "elk"]]
})";

TEST_F(TruthFile, NamesModelsPointsAndPairs) {
  const auto truth = read(kTwo);
  ASSERT_TRUE(truth) << truth.error().message;
  ASSERT_EQ(truth->models.size(), 2u);
  EXPECT_EQ(truth->models[0].model, folder / "models/elk.obj");
  EXPECT_EQ(truth->models[0].up, UpAxis::kZ);
  EXPECT_EQ(truth->models[1].up, UpAxis::kY);
  EXPECT_EQ(truth->models[0].points.at("nose"), (Vec3{1, 2, 3}));
  const std::vector<std::pair<std::size_t, std::size_t>> pairs{{0, 1}, {1, 0}};
  EXPECT_EQ(truth->pairs, pairs);
}

TEST_F(TruthFile, PointsOfTheSameNameBelongTogether) {
  const auto truth = read(kTwo);
  const PointPairs pairs = pair_points(truth->models[0], truth->models[1]);
  EXPECT_EQ(pairs.from, (std::vector<Vec3>{{0, 0, -1}}));
  EXPECT_EQ(pairs.to, (std::vector<Vec3>{{4, 5, 6}}));
}

TEST_F(TruthFile, FindsAModelByItsFileThenByItsName) {
  const auto truth = read(kTwo);
  EXPECT_EQ(truth->find(folder / "models/../spot.obj", "elk"), &truth->models[1]);
  EXPECT_EQ(truth->find("/elsewhere/elk.ply", "elk"), &truth->models[0]);
  EXPECT_EQ(truth->find({}, "elk"), &truth->models[0]);
  EXPECT_EQ(truth->find("/elsewhere/cow.obj", "cow"), nullptr);
}

TEST_F(TruthFile, WhatIsWrongHasAPlace) {
  EXPECT_NE(error("{\"modells\": {}}")
                .find("truth.json:1:13: the file has no key \"modells\" - "
                      "did you mean \"models\""),
            std::string::npos);
  EXPECT_NE(error("{}").find("\"models\" must be an object (is missing)"), std::string::npos)
      << error("{}");
  const std::string models = R"({"models": {"a": {"model": "a.obj", "points": {}}},)";
  EXPECT_NE(
      error(models + "\n \"pairs\": [[\"a\", \"b\"]]}").find(":2:18: no model is called \"b\""),
      std::string::npos);
  EXPECT_NE(error(models + "\n \"pairs\": [[\"a\"]]}").find(":2:12: a pair must be"),
            std::string::npos);
  for (const char* point : {"[1, 2]", "[1, 2, \"3\"]", "\"v12\"", "[1, 2, 1e300]"})
    EXPECT_NE(error(R"({"models": {"a": {"model": "a.obj", "points": {"nose": )" +
                    std::string(point) + "}}}}")
                  .find("point \"nose\" must be three numbers"),
              std::string::npos)
        << point;
  EXPECT_NE(error(R"({"models": {"a": {"model": "a.obj", "up": "w", "points": {}}}})")
                .find("\"up\" must be"),
            std::string::npos);
  EXPECT_EQ(load_truth(folder / "none.json").error().code, ErrorCode::kInput);
}

TEST(PlacePoints, FollowTheirTriangleFromTheNearestPlaceOfTheSurface) {
  const Model box = box_model({0, 0, 0}, {1, 1, 1});
  Model stretched = box;
  for (Vec3& p : stretched.points) p = Vec3{4 * p.x, p.y, 2 * p.z} + Vec3{1, 1, 1};
  const std::vector<Vec3> placed =
      move_with_mesh({{0.25f, 0.5f, 1.3f}, {0.5f, -2, 0.5f}}, box, stretched.points);
  EXPECT_LT(length(placed[0] - Vec3{2, 1.5f, 3}), 1e-5f);
  EXPECT_LT(length(placed[1] - Vec3{3, 1, 2}), 1e-5f);
}

}  // namespace
}  // namespace polymorph
