// Constant topology: one mesh through the frames of a leg.
#include "export/carried_frames.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "export/surface_frames.h"
#include "leg/leg_surface.h"
#include "mesh/closest.h"
#include "morph/timeline.h"
#include "testing/scene.h"

namespace polymorph {
namespace {

class CarriedFramesTest : public SceneTest {
 protected:
  CarriedFramesTest()
      : SceneTest(R"("spheres": {"balls": 48}, "surface": {"resolution": 40},
                     "frames": {"count": 5, "fps": 10})") {}
  static Status go_on() { return Ok{}; }
  static std::string chain(const std::string& source, const std::string& target) {
    const auto model = [](const std::string& name) {
      return "\"" + (source_dir() / "scenes/models" / (name + ".obj")).string() + "\"";
    };
    return "\"source\": " + model(source) + ", \"target\": " + model(target);
  }
};

Vec3 normal_of(const std::vector<Vec3>& points, const Triangle& t) {
  return cross(points[t.v[1]] - points[t.v[0]], points[t.v[2]] - points[t.v[0]]);
}

/// Corners, and ten points within each triangle.
std::vector<Vec3> dense(const std::vector<Vec3>& points, const std::vector<Triangle>& triangles) {
  std::vector<Vec3> all = points;
  for (const Triangle& t : triangles)
    for (int i = 0; i <= 3; ++i)
      for (int j = 0; i + j <= 3; ++j)
        all.push_back((points[t.v[0]] * static_cast<float>(i) +
                       points[t.v[1]] * static_cast<float>(j) +
                       points[t.v[2]] * static_cast<float>(3 - i - j)) /
                      3);
  return all;
}

float furthest(const std::vector<Vec3>& from, const ClosestPointQuery& to) {
  float most = 0;
  for (const ClosestPoint& hit : to.closest(from)) most = std::max(most, hit.distance);
  return most;
}

TEST_F(CarriedFramesTest, StaysOnTheSurfaceAndShowsItsFront) {
  struct Case {
    const char *source, *target;
    std::vector<int> frames;
  };
  for (const auto& [source, target, frames] :
       {Case{"penguin", "monkey", {4, 5}}, {"sphere", "cube", {1, 3, 5}}}) {
    SCOPED_TRACE(fmt::format("{} to {}", source, target));
    const PreparedScene prepared = prepared_of(chain(source, target));
    const PreparedActor& actor = prepared.actors[0];
    const ActorFrames shown{prepared.scene, actor, frames};
    const auto carried = carry_actor(shown, *engine, go_on);
    ASSERT_TRUE(carried.ok()) << carried.error().message;
    const float size = std::min(object_size(*actor.legs[0], 0), object_size(*actor.legs[0], 1));
    const std::vector<Triangle>& triangles = carried->mesh.triangles;
    for (std::size_t k = 0; k < frames.size(); ++k) {
      const MorphState moment = morph_state_at(actor.timeline, frames[k]);
      const auto truth = leg_surface(*actor.legs[0], moment.time, *engine);
      ASSERT_TRUE(truth.ok());
      const Mesh& surface = truth->mesh;
      const std::vector<Vec3>& points = carried->mesh.points[carried->state_of_frame[k]];
      const ClosestPointQuery to_surface(surface.positions, surface.triangles),
          to_mesh(points, triangles);
      EXPECT_LE(furthest(dense(points, triangles), to_surface), 0.003f * size) << frames[k];
      EXPECT_LE(furthest(dense(surface.positions, surface.triangles), to_mesh), 0.003f * size)
          << frames[k];
      std::size_t inverted = 0;
      for (const Triangle& t : triangles) {
        const Vec3 middle = (points[t.v[0]] + points[t.v[1]] + points[t.v[2]]) / 3;
        const ClosestPoint hit = to_surface.closest(middle);
        inverted += !(dot(normal_of(points, t),
                          normal_of(surface.positions, surface.triangles[hit.triangle])) > 0);
      }
      EXPECT_EQ(inverted, 0u) << frames[k];
    }
  }
}

TEST_F(CarriedFramesTest, FramesAreAlikeInAllButPlaces) {
  PreparedScene prepared = prepared_of(chain("penguin", "sphere"));
  request_attributes(prepared.scene, true, true);
  const PreparedActor& actor = prepared.actors[0];
  const std::vector<int> frames = {3, 5};
  const ActorFrames shown{prepared.scene, actor, frames};
  const auto carried = carry_actor(shown, *engine, go_on);
  ASSERT_TRUE(carried.ok()) << carried.error().message;
  std::vector<SurfaceFrame> made;
  for (std::size_t k = 0; k < frames.size(); ++k) {
    auto frame = make_carried_frame(shown, *carried, k, *engine);
    ASSERT_TRUE(frame.ok());
    made.push_back(std::move(*frame));
  }
  for (const SurfaceFrame& frame : made) {
    EXPECT_EQ(frame.triangles.size(), made[0].triangles.size());
    EXPECT_EQ(frame.corner_uvs.size(), 3 * frame.triangles.size());
    EXPECT_EQ(frame.normals.size(), frame.positions.size());
    EXPECT_EQ(frame.colors.size(), frame.positions.size());
    EXPECT_EQ(frame.labels.size(), frame.positions.size());
    for (const std::uint32_t label : frame.labels) ASSERT_LT(label, actor.label_names.size());
  }
  // The surfaces that were kept are those that are made again without them.
  CarriedActor bare = *carried;
  for (auto& surface : bare.surfaces) {
    EXPECT_TRUE(surface);
    surface = nullptr;
  }
  for (std::size_t k = 0; k < frames.size(); ++k) {
    const auto frame = make_carried_frame(shown, bare, k, *engine);
    ASSERT_TRUE(frame.ok());
    EXPECT_EQ(frame->normals, made[k].normals);
    EXPECT_EQ(frame->colors, made[k].colors);
    EXPECT_EQ(frame->labels, made[k].labels);
  }
  // There is another frame between them.
  for (std::size_t i = 0; i < made[0].positions.size(); ++i)
    ASSERT_LT(length(made[0].positions[i] + made[0].velocities[i] * 0.2f - made[1].positions[i]),
              1e-4f);
}

TEST_F(CarriedFramesTest, AlikeActorsHaveTheirMeshesAndTheirRefusalsWhereTheyStand) {
  const auto pair_of = [&](const std::string& target) {
    const std::string actor = "], " + chain("sphere", target) + "}";
    return prepared_of(R"("actors": [{"translate": [1, 0, 0)" + actor +
                       R"(, {"name": "twin", "translate": [21, 0, 0)" + actor + "]");
  };
  const PreparedScene cubes = pair_of("cube");
  ASSERT_EQ(cubes.actors[0].legs, cubes.actors[1].legs);
  const std::vector<int> frames = {2, 3};
  std::vector<SurfaceFrame> made;
  for (const PreparedActor& actor : cubes.actors) {
    const ActorFrames shown{cubes.scene, actor, frames};
    const auto carried = carry_actor(shown, *engine, go_on);
    ASSERT_TRUE(carried.ok()) << carried.error().message;
    auto frame = make_carried_frame(shown, *carried, 0, *engine);
    ASSERT_TRUE(frame.ok());
    made.push_back(std::move(*frame));
  }
  ASSERT_EQ(made[0].positions.size(), made[1].positions.size());
  for (std::size_t i = 0; i < made[0].positions.size(); ++i) {
    ASSERT_LT(length(made[1].positions[i] - made[0].positions[i] - Vec3{20, 0, 0}), 1e-4f);
    ASSERT_EQ(length(made[1].velocities[i] - made[0].velocities[i]), 0);
  }
  const PreparedScene tori = pair_of("torus");
  std::vector<double> places;
  for (const PreparedActor& actor : tori.actors) {
    const std::vector<int> all = {1, 2, 3, 4, 5};
    const auto torn = carry_actor({tori.scene, actor, all}, *engine, go_on);
    ASSERT_FALSE(torn.ok());
    const std::string place = "they differ most at (";
    const std::size_t found = torn.error().message.find(place);
    ASSERT_NE(found, std::string::npos) << torn.error().message;
    places.push_back(std::stod(torn.error().message.substr(found + place.size())));
  }
  EXPECT_NEAR(places[1] - places[0], 20, 0.1);
}

TEST_F(CarriedFramesTest, ARefusalNamesFrameAndPlace) {
  const std::vector<int> frames = {1, 2, 3, 4, 5};
  const PreparedScene changing = prepared_of(chain("sphere", "torus"));
  const auto torn = carry_actor({changing.scene, changing.actors[0], frames}, *engine, go_on);
  ASSERT_FALSE(torn.ok());
  const std::string& text = torn.error().message;
  EXPECT_NE(text.find("the topology changes: frame "), std::string::npos) << text;
  EXPECT_NE(text.find("1 part of genus 0, and frame "), std::string::npos) << text;
  EXPECT_NE(text.find("they differ most at ("), std::string::npos) << text;
  EXPECT_NE(text.find("leave out --topology"), std::string::npos) << text;

  const PreparedScene two =
      prepared_of(R"("source": "sphere", "intermediate": ["cube"], "target": "torus")");
  const auto legs = carry_actor({two.scene, two.actors[0], frames}, *engine, go_on);
  ASSERT_FALSE(legs.ok());
  EXPECT_NE(legs.error().message.find("belong to different legs"), std::string::npos);

  const PreparedScene balls =
      prepared_of(R"("source": "sphere", "target": "cube", "motion": {"interpolate": "balls"})");
  const auto models = carry_actor({balls.scene, balls.actors[0], frames}, *engine, go_on);
  ASSERT_FALSE(models.ok());
  EXPECT_NE(models.error().message.find("frame 1 shows a model"), std::string::npos);
}

}  // namespace
}  // namespace polymorph
