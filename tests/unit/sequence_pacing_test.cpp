#include "sequence/pacing.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "spheres/cache.h"
#include "testing/scene.h"

namespace polymorph {
namespace {

class PacingTest : public SceneTest {
 protected:
  PacingTest() : SceneTest(R"("spheres": {"balls": 16}, "surface": {"resolution": 40})") {}
};

TEST_F(PacingTest, RisesFromNothingToAll) {
  const PreparedScene prepared =
      prepared_of(R"("source": "cube", "target": "torus", "frames": {"count": 12})");
  const std::vector<float>& pacing = prepared.actors[0].legs[0].plan.pacing;
  ASSERT_GE(pacing.size(), 3u);
  EXPECT_EQ(pacing.front(), 0);
  EXPECT_EQ(pacing.back(), 1);
  for (std::size_t i = 1; i < pacing.size(); ++i) EXPECT_GT(pacing[i], pacing[i - 1]);
}

TEST_F(PacingTest, IsTheSameFromTheCache) {
  const Scene scene = scene_of(R"("source": "cube", "target": "torus", "frames": {"count": 12})");
  const auto pacing_of = [&](const std::filesystem::path& cache) {
    return prepare_scene(scene, *engine, cache)->actors[0].legs[0].plan.pacing;
  };
  const std::filesystem::path cache = folder / "paces";
  const std::vector<float> fresh = pacing_of({}), stored = pacing_of(cache);
  const auto files = list_cache(cache);
  const auto paces = std::count_if(files.begin(), files.end(), [](const CacheEntry& entry) {
    return entry.kind == &kPacingFiles;
  });
  EXPECT_EQ(paces, 1);
  EXPECT_EQ(stored, fresh);
  EXPECT_EQ(pacing_of(cache), fresh);
  for (const CacheEntry& entry : verify_cache(cache)) EXPECT_EQ(entry.problem, "");
}

TEST_F(PacingTest, IsLeftToBallsThatHaveTimesOfTheirOwn) {
  const PreparedScene prepared = prepared_of(
      R"("source": "cube", "target": "torus", "frames": {"count": 12},
         "motion": {"stagger": "axis"})");
  EXPECT_TRUE(prepared.actors[0].legs[0].plan.pacing.empty());
}

}  // namespace
}  // namespace polymorph
