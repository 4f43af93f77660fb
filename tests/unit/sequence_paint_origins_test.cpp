// Colours of what becomes what: through a film, and of copies, whose points are known.
#include "sequence/frame/paint_origins.h"

#include <gtest/gtest.h>

#include "leg/leg_surface.h"
#include "leg/origin_colors.h"
#include "sequence/frame/render_scene.h"
#include "testing/scene.h"

namespace polymorph {
namespace {

class PaintTest : public SceneTest {
 protected:
  PaintTest()
      : SceneTest(R"("spheres": {"balls": 32, "fit": "none"}, "surface": {"resolution": 32},
          "frames": {"count": 9}, "image": {"width": 16, "height": 16})") {}

  /// A humanoid and its copy, which is moved and turned by 180 degrees.
  PreparedScene copies(const std::string& plan) {
    const std::string model = (source_dir() / "scenes/models/humanoid.obj").string();
    return prepared_of(
        "\"source\": \"" + model + "\", \"target\": {\"model\": \"" + model +
        "\", \"rotate\": [0, 180, 0], \"translate\": [0.4, 0, 0.2]}, \"plan\": " + plan);
  }
  FrameGeometry painted(const PreparedScene& prepared, int frame) {
    auto geometry = geometry_at(prepared, *engine, frame);
    EXPECT_TRUE(geometry.ok());
    EXPECT_TRUE(paint_origins(prepared, *engine, *geometry).ok());
    return std::move(*geometry);
  }
  /// Colours of the model's points in a frame that shows a model.
  std::vector<Vec3> model_paint(const PreparedScene& prepared, int frame) {
    const std::vector<Vec3> paint = painted(prepared, frame).actors[0].point_paint;
    EXPECT_EQ(paint.size(), prepared.actors[0].objects[0]->model.points.size());
    return paint;
  }
};

/// The mean distance of two lists of colours.
float difference(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  float sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += length(a[i] - b[i]);
  return sum / static_cast<float>(a.size());
}

TEST_F(PaintTest, AlikeActorsHaveTheSameColours) {
  const std::string chain = R"("source": "torus", "target": "cube"})";
  const PreparedScene pair = prepared_of(
      R"("actors": [{)" + chain + R"(, {"name": "twin", "translate": [5, 1, 0], )" + chain + "]");
  ASSERT_EQ(pair.actors[0].legs, pair.actors[1].legs);
  for (const int frame : {1, 5, 9}) {
    const std::vector<ActorGeometry> actors = painted(pair, frame).actors;
    const auto is_close = [](const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
      return a.size() == b.size() && (a.empty() || difference(a, b) < 1e-3f);
    };
    EXPECT_FALSE(actors[0].surface_paint.empty() && actors[0].point_paint.empty());
    EXPECT_TRUE(is_close(actors[0].surface_paint, actors[1].surface_paint)) << frame;
    EXPECT_TRUE(is_close(actors[0].point_paint, actors[1].point_paint)) << frame;
  }
}

TEST_F(PaintTest, CopiesHaveTheSameColours) {
  const PreparedScene turned = copies("{}");
  const std::vector<Vec3> source = model_paint(turned, 1);
  const float alike = difference(source, model_paint(turned, 9));
  EXPECT_LT(alike, 0.08f);  // 32 balls, not fitted, are not the same for both
  // Laid on each other as they stand, each hand becomes the other one.
  const PreparedScene unturned = copies(R"({"align": "none", "structure": "off"})");
  EXPECT_LT(difference(source, model_paint(unturned, 1)), 1e-6f);
  EXPECT_GT(difference(source, model_paint(unturned, 9)), 4 * alike);
  // On the way each hand keeps the colour that it has at both ends.
  const ActorGeometry half = painted(turned, 5).actors[0];
  ASSERT_EQ(half.surface_paint.size(), half.surface.positions.size());
  Vec3 low = half.surface_paint[0], high = low;
  for (const Vec3 color : half.surface_paint) low = min(low, color), high = max(high, color);
  EXPECT_LT(low.x, 0.05f);
  EXPECT_GT(high.x, 0.6f);
}

TEST_F(PaintTest, HidesTheMaterials) {
  const PreparedScene prepared = copies("{}");
  for (const int frame : {1, 5}) {
    const FrameGeometry geometry = painted(prepared, frame);
    for (const RenderMesh& mesh : render_scene(prepared, geometry).meshes) {
      EXPECT_EQ(mesh.vertex_colors.size(), mesh.positions.size());
      EXPECT_EQ(mesh.vertex_color_opacity, 1);
      EXPECT_TRUE(mesh.upper_layers.empty() && mesh.textures.empty() && mesh.look == 0);
    }
  }
}

TEST_F(PaintTest, GoesThroughTheObjectsOnTheWay) {
  // The second leg begins where the first is left, so colours do not jump there.
  const PreparedScene prepared = prepared_of(
      R"("source": "cube", "intermediate": [{"shape": "torus", "retarget": 0.45}],
         "target": {"shape": "sphere", "translate": [0.5, 0, 0]})");
  const PreparedActor& actor = prepared.actors[0];
  const auto legs = std::span(actor.legs);
  const auto surface = leg_surface(*actor.legs[1], 0, *engine);
  ASSERT_TRUE(surface.ok());
  const std::vector<Vec3>& points = surface->mesh.positions;
  const auto before = leg_state(*actor.legs[0], actor.legs[0]->until, *engine);
  const auto one = trace_back(legs.first(1), *before, points, *engine);
  const auto both = trace_back(legs, surface->state, points, *engine);
  ASSERT_TRUE(one.ok() && both.ok());
  const Box box = actor.objects[0]->model.box();
  EXPECT_LT(difference(*one, *both), 0.01f * box.diagonal());
  EXPECT_GT(difference(*one, points), 0.01f * box.diagonal());
  for (const Vec3 color : colors_by_position(*both, box))
    for (const float channel : {color.x, color.y, color.z}) {
      EXPECT_GE(channel, 0.1f);
      EXPECT_LE(channel, 0.9501f);
    }
}

}  // namespace
}  // namespace polymorph
