// A change of target on the way: the balls as they then are go on to another object.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>

#include "analyze/measure.h"
#include "inspect/analyze_sequence.h"
#include "leg/leg_surface.h"
#include "mesh/mesh_check.h"
#include "morph/motion.h"
#include "sequence/frame/frame_geometry.h"
#include "testing/scene.h"

namespace polymorph {
namespace {

class RetargetTest : public SceneTest {
 protected:
  RetargetTest() : SceneTest(R"("spheres": {"balls": 16}, "surface": {"resolution": 40})") {}
  Mesh surface_of(const PreparedScene& prepared, int leg, float time) {
    auto surface =
        leg_surface(*prepared.actors[0].legs[static_cast<std::size_t>(leg)], time, *engine);
    EXPECT_TRUE(surface.ok()) << surface.error().message;
    return surface.ok() ? std::move(surface->mesh) : Mesh{};
  }
};

constexpr const char* kPlasticToClear =
    R"("source": "cube", "intermediate": [{"shape": "torus", "retarget": 0.45}],
       "target": {"shape": "sphere", "translate": [0.5, 0, 0]}, "frames": {"count": 60})";

MeasuredSurface measured(const Mesh& mesh) { return {mesh.positions, mesh.triangles}; }

/// The same but at ridges: a surface of cells shows them rounded, and so do the distances to it.
void expect_same_surface(const Mesh& a, const Mesh& b, float cell) {
  const auto apart = measured(a).distance_to(measured(b));
  EXPECT_LT(apart.mean, 0.05 * static_cast<double>(cell));
  EXPECT_LT(apart.largest, 0.5 * static_cast<double>(cell));
}

TEST_F(RetargetTest, TheSurfaceAtTheChangeIsOneAndTheSame) {
  const PreparedScene prepared = prepared_of(kPlasticToClear);
  const PreparedActor& actor = prepared.actors[0];
  ASSERT_EQ(actor.legs.size(), 2u);
  ASSERT_EQ(actor.objects.size(), 4u) << "the balls in flight are an object after the chain's";
  EXPECT_EQ(actor.legs[1]->from, actor.objects[3]);
  EXPECT_EQ(actor.legs[1]->before, actor.legs[0]);
  EXPECT_EQ(actor.legs[1]->to, actor.objects[2]);
  const Mesh before = surface_of(prepared, 0, 0.45f), after = surface_of(prepared, 1, 0);
  const double size = static_cast<double>(bounding_box(before.positions).diagonal());
  expect_same_surface(before, after, actor.settings.cell);
  EXPECT_NEAR(check_mesh(before).volume / check_mesh(after).volume, 1, 3e-3);
  // It is neither of the objects that it lies between.
  EXPECT_GT(measured(before).distance_to(measured(surface_of(prepared, 0, 0))).largest,
            0.02 * size);
  EXPECT_GT(measured(before).distance_to(measured(surface_of(prepared, 0, 1))).largest,
            0.02 * size);
}

TEST_F(RetargetTest, NoFrameJumps) {
  const PreparedScene prepared = prepared_of(kPlasticToClear);
  const Timeline& timeline = prepared.actors[0].timeline;
  int change = 1;
  while (morph_state_at(timeline, change).leg == 0) ++change;
  std::vector<double> steps;
  std::optional<MeasuredSurface> previous;
  for (int frame = change - 4; frame <= change + 4; ++frame) {
    const auto geometry = geometry_at(prepared, *engine, frame);
    ASSERT_TRUE(geometry.ok());
    const ActorGeometry& one = geometry->actors[0];
    EXPECT_EQ(one.moment.object, -1) << "the torus is never reached, frame " << frame;
    EXPECT_TRUE(check_mesh(one.surface).is_manifold()) << frame;
    MeasuredSurface now = measured(one.surface);
    if (previous) steps.push_back(previous->distance_to(now).mean);
    previous = std::move(now);
  }
  for (std::size_t k = 1; k + 1 < steps.size(); ++k)
    EXPECT_LE(2 * steps[k] / (steps[k - 1] + steps[k + 1]), 2) << k;
}

/// Of all balls: root mean square of what changes of their velocity at the change, over it.
double velocity_change(const PreparedScene& prepared, bool carried) {
  const PreparedActor& actor = prepared.actors[0];
  MorphPlan plan = actor.legs[1]->plan;
  if (!carried) {
    BallPaths paths = *plan.paths;
    for (BallPath& path : paths.balls) path.drift = {};
    plan.paths = std::make_shared<const BallPaths>(std::move(paths));
  }
  const MorphPlan& before = actor.legs[0]->plan;
  const float step = 1e-2f;
  const auto at = [&](double frames, int leg) {
    return static_cast<float>(frames) * static_cast<float>(leg_pace(actor.timeline.legs[leg]));
  };
  const auto earlier = balls_at(before, 0.45f - at(step, 0)), last = balls_at(before, 0.45f);
  const auto first = balls_at(plan, 0), later = balls_at(plan, at(step, 1));
  double change = 0, had = 0;
  for (std::size_t e = 0; e < plan.pairs.size(); ++e) {
    const std::uint32_t i = plan.pairs[e].from;
    EXPECT_LT(length(first[e].center - last[i].center), 1e-6f);
    const Vec3d came = Vec3d(last[i].center) - Vec3d(earlier[i].center);
    const Vec3d goes = Vec3d(later[e].center) - Vec3d(first[e].center);
    change += dot(goes - came, goes - came);
    had += dot(came, came);
  }
  return std::sqrt(change / had);
}

TEST_F(RetargetTest, BallsKeepTheirVelocityWhateverTheEasingAndThePace) {
  for (const char* motion :
       {R"({"easing": "quintic"})", R"({"easing": "linear"})",
        R"({"easing": "quintic", "path": "bezier"})", R"({"stagger": "noise"})"}) {
    const PreparedScene prepared = prepared_of(
        std::string(R"("source": "cube", "intermediate": [{"shape": "torus", "retarget": 0.45}],
          "target": {"shape": "sphere", "translate": [0.5, 0, 0], "motion": )") +
        motion + R"(}, "frames": {"per_leg": [20, 50]})");
    EXPECT_LT(velocity_change(prepared, true), 0.05) << motion;
    EXPECT_GT(velocity_change(prepared, false), 0.3) << motion << ": what would be without";
  }
}

TEST_F(RetargetTest, ItsColoursAreThoseOfAllThatItWasBetween) {
  const PreparedScene prepared = prepared_of(kPlasticToClear);
  const Timeline& timeline = prepared.actors[0].timeline;
  int change = 1;
  while (morph_state_at(timeline, change).leg == 0) ++change;
  const auto before = geometry_at(prepared, *engine, change - 1),
             after = geometry_at(prepared, *engine, change);
  ASSERT_TRUE(before.ok() && after.ok());
  const auto& old_layers = before->actors[0].look.layers;
  const auto& layers = after->actors[0].look.layers;
  ASSERT_EQ(old_layers.size(), 2u);
  ASSERT_EQ(layers.size(), 2u) << "the new target has no share yet";
  EXPECT_EQ(layers[0].object, prepared.actors[0].objects[0]);
  EXPECT_EQ(layers[1].object, prepared.actors[0].objects[1]);
  const auto late = geometry_at(prepared, *engine, prepared.frame_count - 1);
  ASSERT_TRUE(late.ok());
  ASSERT_EQ(late->actors[0].look.layers.size(), 1u) << "all others have no share any more";
  EXPECT_EQ(late->actors[0].look.layers[0].object, prepared.actors[0].objects[2]);
  EXPECT_NEAR(layers[1].opacity, old_layers[1].opacity, 0.1f);
  const float left = progress_at(prepared.actors[0].legs[0]->plan, 0.45f);
  EXPECT_GT(layers[1].opacity, 0.0f);
  EXPECT_LT(layers[1].opacity, left);  // colours change later than the shape, until half way
}

TEST_F(RetargetTest, ItHasColoursWhereverItWasLeft) {
  std::ofstream(folder / "two.mtl") << "newmtl red\nKd 1 0 0\nnewmtl blue\nKd 0 0 1\n";
  std::ofstream(folder / "two.obj")
      << "mtllib two.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nusemtl red\nf 1 3 2\nf 1 2 4\n"
         "usemtl blue\nf 1 4 3\nf 2 3 4\n";
  // Near an end of its leg nothing but detail shows, and the next leg asks for colours all the
  // same.
  for (const char* left : {"0.05", "0.95"}) {
    const PreparedScene prepared =
        prepared_of(R"("source": {"model": ")" + (folder / "two.obj").string() +
                    R"("}, "intermediate": [{"shape": "torus", "retarget": )" + left +
                    R"(}], "target": "sphere", "frames": {"count": 40})");
    const PreparedActor& actor = prepared.actors[0];
    int frame = 1;
    const auto moment = [&] { return morph_state_at(actor.timeline, frame); };
    while (moment().leg == 0 || progress_at(actor.legs[1]->plan, moment().time) < 0.3f) ++frame;
    const auto geometry = geometry_at(prepared, *engine, frame);
    ASSERT_TRUE(geometry.ok()) << geometry.error().message;
    const ActorGeometry& one = geometry->actors[0];
    ASSERT_EQ(one.look.colors.size(), one.surface.positions.size());
    for (const Vec3 color : one.look.colors) {
      EXPECT_GE(std::min({color.x, color.y, color.z}), 0.0f);
      EXPECT_LE(std::max({color.x, color.y, color.z}), 1.0f);
      EXPECT_GT(std::max({color.x, color.y, color.z}), 0.05f);
    }
  }
}

TEST_F(RetargetTest, AnalysesKnowWhereALegIsLeft) {
  const PreparedScene prepared = prepared_of(kPlasticToClear);
  const auto morphs = analyze_scene(prepared, *engine, 9, [](int, int) { return true; });
  ASSERT_TRUE(morphs.ok()) << morphs.error().message;
  ASSERT_EQ(morphs->size(), 2u);
  EXPECT_EQ(morph_name((*morphs)[0]), "cube -> cube -> torus at 0.45");
  EXPECT_EQ(morph_name((*morphs)[1]), "cube -> torus at 0.45 -> sphere");
  for (const Analysis& morph : *morphs) {
    EXPECT_EQ(morph.frames.back().u, 1) << "of the way that is gone";
    EXPECT_EQ(*morph.find("bad_surfaces")->value, 0);
    EXPECT_LE(*morph.find("pop")->value, 2);
    EXPECT_LE(*morph.find("target_error")->value, 0.02);
    EXPECT_GE(*morph.find("dip")->value, 0.98);
  }
}

TEST_F(RetargetTest, MindsMayBeChangedTwice) {
  const PreparedScene prepared = prepared_of(
      R"("source": "cube", "intermediate": [{"shape": "torus", "retarget": 0.4},
           {"shape": "puddle", "retarget": 0.6}], "target": "sphere", "frames": {"count": 40})");
  const PreparedActor& actor = prepared.actors[0];
  ASSERT_EQ(actor.legs.size(), 3u);
  EXPECT_EQ(actor.legs[2]->from, actor.objects[5]);
  const Mesh before = surface_of(prepared, 1, 0.6f), after = surface_of(prepared, 2, 0);
  expect_same_surface(before, after, actor.settings.cell);
  const auto last = geometry_at(prepared, *engine, 34);
  ASSERT_TRUE(last.ok());
  EXPECT_EQ(last->actors[0].look.layers.size(), 4u);
  // Vertices still know what they belong to.
  EXPECT_EQ(actor.label_names, (std::vector<std::string>{"cube", "torus", "puddle", "sphere"}));
  const auto labels = surface_labels(last->actors[0], *engine);
  ASSERT_TRUE(labels.ok());
  ASSERT_EQ(labels->size(), last->actors[0].surface.positions.size());
  for (const std::uint32_t label : *labels) ASSERT_LT(label, 4u);
}

TEST_F(RetargetTest, OnlyWhatIsOnTheWayCanBeLeft) {
  const auto wrong = [&](const std::string& chain) {
    EXPECT_TRUE(write_file(folder / "bad.json", "{" + chain + "}").ok());
    const auto scene = load_scene(folder / "bad.json");
    return scene.ok() ? std::string() : scene.error().message;
  };
  EXPECT_NE(wrong(R"("source": "cube", "target": {"shape": "torus", "retarget": 0.5})")
                .find("/target/retarget: only an object on the way"),
            std::string::npos);
  EXPECT_NE(wrong(R"("source": "cube", "target": "torus",
                     "intermediate": [{"shape": "sphere", "retarget": 0.5, "hold": 3}])")
                .find("/intermediate/0/hold: an object that is left"),
            std::string::npos);
}

}  // namespace
}  // namespace polymorph
