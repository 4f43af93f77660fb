#include "leg/pacing.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "leg/leg_surface.h"
#include "mesh/closest.h"
#include "mesh/mesh_check.h"
#include "sequence/prepare/prepare.h"
#include "spheres/cache.h"
#include "testing/forwarding_engine.h"
#include "testing/scene.h"

namespace polymorph {
namespace {

using std::string_literals::operator""s;

class PacingTest : public SceneTest {
 protected:
  PacingTest() : SceneTest(R"("spheres": {"balls": 16}, "surface": {"resolution": 40})") {}
};

TEST_F(PacingTest, RisesFromNothingToAll) {
  const PreparedScene prepared =
      prepared_of(R"("source": "cube", "target": "torus", "frames": {"count": 12})");
  const std::vector<float>& pacing = prepared.actors[0].legs[0]->plan.pacing;
  ASSERT_GE(pacing.size(), 3u);
  EXPECT_EQ(pacing.front(), 0);
  EXPECT_EQ(pacing.back(), 1);
  for (std::size_t i = 1; i < pacing.size(); ++i) EXPECT_GT(pacing[i], pacing[i - 1]);
}

TEST_F(PacingTest, EvensOutWhatChangesBetweenMoments) {
  const PreparedScene prepared =
      prepared_of(R"("source": "cube", "target": "torus", "frames": {"count": 12})");
  const auto relative_deviation = [&](const Leg& leg) {
    constexpr int kMoments = 16;
    std::vector<double> changes;
    Mesh before;
    for (int i = 0; i <= kMoments; ++i) {
      auto at = leg_surface(leg, static_cast<float>(i) / kMoments, *engine);
      EXPECT_TRUE(at.ok());
      const ClosestPointQuery query(at->mesh.positions, at->mesh.triangles);
      double sum = 0;
      for (const ClosestPoint& point : query.closest(before.positions))
        sum += static_cast<double>(point.distance);
      if (i > 0) changes.push_back(sum / static_cast<double>(before.positions.size()));
      before = std::move(at->mesh);
    }
    // The standard deviation over the mean. (Where the torus's hole opens, no pace makes the step
    // smaller.)
    const double mean = std::accumulate(changes.begin(), changes.end(), 0.0) / kMoments;
    double variance = 0;
    for (const double change : changes)
      variance += (change / mean - 1) * (change / mean - 1) / kMoments;
    return std::sqrt(variance);
  };
  Leg leg = *prepared.actors[0].legs[0];
  leg.plan.motion.easing = Easing::kLinear;
  const double paced = relative_deviation(leg);
  leg.plan.pacing.clear();
  const double plain = relative_deviation(leg);
  EXPECT_GT(plain, 0.15);
  EXPECT_LT(paced, 0.8 * plain);
}

TEST_F(PacingTest, AVolumeIsKeptByTwoSurfacesMoreThanTheOneThatShows) {
  const PreparedScene prepared =
      prepared_of(R"("source": "cube", "target": "torus", "frames": {"count": 12})");
  Leg leg = *prepared.actors[0].legs[0];
  leg.settings.min_component_share = 0;
  ASSERT_GE(std::get<DistanceLeg>(leg.kind).levels.size(), 3u);
  const double from = leg.from->distances.volume, to = leg.to->distances.volume;
  int all = 0;
  constexpr int kMoments = 23;
  for (int i = 1; i <= kMoments; ++i) {
    CountingEngine counting(*engine);
    const auto at = leg_surface(leg, static_cast<float>(i) / (kMoments + 1), counting);
    ASSERT_TRUE(at.ok()) << at.error().message;
    const auto u = static_cast<double>(at->state.u);
    EXPECT_NEAR(volume_of(at->mesh) / ((1 - u) * from + u * to), 1, 0.002) << i;
    EXPECT_LE(counting.surfaces, 3) << i;
    all += counting.surfaces;
  }
  EXPECT_LT(all, 2 * kMoments);
  // Nor is the level lost where nothing is known of it.
  std::get<DistanceLeg>(leg.kind).levels.clear();
  const auto searched = leg_surface(leg, 0.4f, *engine);
  ASSERT_TRUE(searched.ok());
  const auto u = static_cast<double>(searched->state.u);
  EXPECT_NEAR(volume_of(searched->mesh) / ((1 - u) * from + u * to), 1, 0.002);
}

/// On an arc the surface rises above both objects, where the camera must see it.
TEST_F(PacingTest, SurfacesBetweenTheObjectsAreInThePicture) {
  const auto objects = R"("source": "cube", "target": "torus", "frames": {"count": 12})"s;
  const PreparedScene straight = prepared_of(objects);
  for (const std::string orbit : {"0", "90"}) {
    const PreparedScene arc = prepared_of(
        objects + R"(, "motion": {"path": {"kind": "bezier", "bend": 1}}, "camera": {"orbit": )" +
        orbit + "}");
    const auto at = leg_surface(*arc.actors[0].legs[0], 0.5f, *engine);
    ASSERT_TRUE(at.ok());
    const auto highest = [&](const Camera& camera) {
      float largest = -1;
      for (const Vec3 p : at->mesh.positions) {
        const Vec3 way = p - camera.position;
        largest = std::max(largest,
                           dot(way, camera.up) / dot(way, camera.forward) / camera.tan_half_fov_y);
      }
      return largest;
    };
    EXPECT_GT(highest(straight.camera), 1) << "a camera for the models alone cuts it off";
    EXPECT_LT(highest(arc.camera), 1) << orbit;
  }
}

TEST_F(PacingTest, IsTheSameFromTheCache) {
  const Scene scene = scene_of(R"("source": "cube", "target": "torus", "frames": {"count": 12})");
  const auto pacing_of = [&](const std::filesystem::path& cache) {
    const auto prepared = prepare_scene(scene, *engine, {cache});
    const Leg& leg = *prepared->actors[0].legs[0];
    const std::vector<float>& levels = std::get<DistanceLeg>(leg.kind).levels;
    std::vector<float> all = leg.plan.pacing;
    all.insert(all.end(), levels.begin(), levels.end());
    for (const Vec3 p : std::get<DistanceLeg>(leg.kind).extremes)
      all.insert(all.end(), {p.x, p.y, p.z});
    return all;
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
  EXPECT_TRUE(prepared.actors[0].legs[0]->plan.pacing.empty());
}

}  // namespace
}  // namespace polymorph
