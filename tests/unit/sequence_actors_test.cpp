// Several actors in one scene.
#include <gtest/gtest.h>

#include <set>

#include "assets/load_models.h"
#include "film/render_sequence.h"
#include "inspect/analyze_sequence.h"
#include "mesh/mesh_check.h"
#include "sequence/frame/frame_geometry.h"
#include "sequence/frame/render_scene.h"
#include "sequence/prepare/prepare.h"
#include "testing/scene.h"

namespace polymorph {
namespace {

constexpr const char* kTwoActors =
    R"("spheres": {"balls": 12}, "surface": {"resolution": 24},
       "image": {"width": 64, "height": 32, "samples": 1})";
constexpr const char* kCube = R"("source": "cube", "target": "sphere")";
constexpr const char* kTorus = R"("source": "torus", "target": "cube")";

class ActorsTest : public SceneTest {
 protected:
  ActorsTest() : SceneTest(kTwoActors) {}
  FrameGeometry frame_of(const PreparedScene& prepared, int frame) {
    auto geometry = geometry_at(prepared, *engine, frame);
    EXPECT_TRUE(geometry.ok()) << geometry.error().message;
    return geometry.ok() ? std::move(*geometry) : FrameGeometry{};
  }
};

TEST_F(ActorsTest, AnActorInCompanyIsWhatItIsAloneLaterAndElsewhere) {
  // Nothing is brought to a common size, so that the torus is the same alone and among others.
  const std::string own = R"(, "arrange": "none")";
  const PreparedScene cube = prepared_of(kCube + own + R"(, "frames": {"count": 12})");
  const PreparedScene torus =
      prepared_of(std::string(R"("actors": [{"translate": [3, 0, 0], "rotate": [0, 30, 0], )") +
                  kTorus + "}]" + own + R"(, "frames": {"count": 12})");
  const PreparedScene both = prepared_of(
      std::string(R"("actors": [{"per_leg": [12], )") + kCube +
      R"(}, {"start": 6, "translate": [3, 0, 0], "rotate": [0, 30, 0], "per_leg": [12], )" +
      kTorus + "}]" + own);
  ASSERT_EQ(both.frame_count, 17);
  ASSERT_EQ(both.actors.size(), 2u);
  std::set<std::string> seen;
  for (int frame = 1; frame <= 17; ++frame) {
    const FrameGeometry company = frame_of(both, frame);
    const FrameGeometry first = frame_of(cube, std::min(frame, 12));
    const FrameGeometry second = frame_of(torus, std::max(frame - 5, 1));
    for (const auto& [alone, actor] : {std::pair(&first.actors[0], &company.actors[0]),
                                       std::pair(&second.actors[0], &company.actors[1])}) {
      EXPECT_EQ(mesh_digest(alone->surface), mesh_digest(actor->surface)) << frame;
      ASSERT_EQ(alone->points.size(), actor->points.size()) << frame;
      for (std::size_t i = 0; i < alone->points.size(); ++i)
        ASSERT_EQ(length(alone->points[i] - actor->points[i]), 0) << frame;
    }
    // Each has ids of its own.
    std::set<float> ids;
    const RenderScene scene = render_scene(both, company);
    for (const RenderMesh& mesh : scene.meshes) ids.insert(mesh.id);
    EXPECT_EQ(ids.size(), scene.meshes.size());
    EXPECT_EQ(ids.size(), 2u);
    for (const float id : ids) EXPECT_GE(id, 2);
    seen.insert(company.stage);
  }
  EXPECT_TRUE(seen.contains("volume, look-out")) << "each is in its own stage";
}

TEST_F(ActorsTest, AllComeToTheFirstSourcesSizeAndToTheirPlaces) {
  const Scene scene = scene_of(std::string(R"("actors": [{"scale": 2, )") + kCube +
                               R"(}, {"translate": [3, 1, 0], )" + kTorus + "}]");
  const auto loaded = load_models(scene, chain_objects(scene), false);
  ASSERT_TRUE(loaded.ok());
  ASSERT_EQ(loaded->models.size(), 4u);
  const float size = loaded->models[0].box().diagonal();
  EXPECT_NEAR(loaded->models[1].box().diagonal() / size, 1, 1e-4) << "its actor is twice as large";
  for (const std::size_t i : {2u, 3u}) {
    const Box box = loaded->models[i].box();
    EXPECT_NEAR(box.diagonal() / size, 0.5, 1e-4);
    EXPECT_NEAR(box.center().x, 3, 1e-4);
    EXPECT_NEAR(box.low.y, 1, 1e-4);
  }
}

TEST_F(ActorsTest, AlikeActorsShareObjectsAndLegs) {
  const std::string twin = std::string(", \"per_leg\": [6], ") + kCube + "}";
  const std::string crowd =
      R"("actors": [{"translate": [0, 0, 0])" + twin +
      R"(, {"name": "twin", "translate": [3, 0.5, 1])" + twin +
      R"(, {"name": "late", "start": 3, "translate": [-3, 0, 0])" + twin +
      R"(, {"name": "turned", "rotate": [0, 30, 0], "translate": [6, 0, 0])" + twin +
      R"(, {"name": "ring", "translate": [9, 0, 0], "per_leg": [6], )" + kTorus + "}]";
  const PreparedScene shared = prepared_of(crowd);
  ASSERT_EQ(shared.actors.size(), 5u);
  const auto& legs = shared.actors[0].legs;
  for (const std::size_t a : {1u, 2u}) {
    EXPECT_EQ(shared.actors[a].legs, legs) << a;
    EXPECT_EQ(shared.actors[a].objects, shared.actors[0].objects) << a;
  }
  for (const std::size_t a : {3u, 4u}) EXPECT_NE(shared.actors[a].legs.front(), legs.front()) << a;
  const auto alone = prepare_scene(shared.scene, *engine, {{}, {}, Fits::kMake, Sharing::kNone});
  ASSERT_TRUE(alone.ok()) << alone.error().message;
  EXPECT_LT(4 * shared.memory.distances, 3 * alone->memory.distances);
  EXPECT_NEAR(length(shared.camera.position - alone->camera.position), 0, 1e-2);
  for (int frame = 1; frame <= shared.frame_count; ++frame) {
    const FrameGeometry company = frame_of(shared, frame), each = frame_of(*alone, frame);
    for (std::size_t a = 0; a < 5; ++a) {
      const ActorGeometry &got = company.actors[a], &own = each.actors[a];
      EXPECT_EQ(got.moment.time, own.moment.time) << frame;
      ASSERT_EQ(got.points.size(), own.points.size()) << frame << " " << a;
      for (std::size_t i = 0; i < own.points.size(); ++i)
        ASSERT_NEAR(length(got.points[i] - own.points[i]), 0, 1e-5) << frame << " " << a;
      // The fit of a model elsewhere is not the same to the last bit.
      const Box box = bounding_box(got.surface.positions), at = bounding_box(own.surface.positions);
      if (!at.empty()) {
        EXPECT_NEAR(length(box.center() - at.center()), 0, 0.02) << frame << " " << a;
        EXPECT_NEAR(box.diagonal(), at.diagonal(), 0.02) << frame << " " << a;
      }
      ASSERT_EQ(got.balls.empty(), own.balls.empty());
      Box balls, own_balls;
      for (const Ball& ball : got.balls) balls = extend(balls, ball.center);
      for (const Ball& ball : own.balls) own_balls = extend(own_balls, ball.center);
      if (!own_balls.empty()) {
        EXPECT_NEAR(length(balls.center() - own_balls.center()), 0, 0.1) << frame << " " << a;
      }
    }
  }
}

TEST_F(ActorsTest, AnalysesAreAnActorEach) {
  const PreparedScene both =
      prepared_of(std::string(R"("actors": [{)") + kCube +
                  R"(}, {"name": "ring", "translate": [3, 0, 0], )" + kTorus + "}]");
  const auto morphs = analyze_scene(both, *engine, 5, [](int, int) { return true; });
  ASSERT_TRUE(morphs.ok()) << morphs.error().message;
  ASSERT_EQ(morphs->size(), 2u);
  EXPECT_EQ(morph_name((*morphs)[0]), "cube: cube -> sphere");
  EXPECT_EQ(morph_name((*morphs)[1]), "ring: torus -> cube");
  for (const Analysis& morph : *morphs) EXPECT_EQ(*morph.find("bad_surfaces")->value, 0);
}

}  // namespace
}  // namespace polymorph
