// The step from an object's own mesh to its balls' surface and back, as polymorph analyze measures
// it, on the report's four tests.
#include <gtest/gtest.h>

#include "inspect/analyze_sequence.h"
#include "scene/load_scene.h"
#include "sequence/prepare/prepare.h"
#include "testing/paths.h"

namespace polymorph {
namespace {

namespace fs = std::filesystem;

class Standard : public ::testing::TestWithParam<const char*> {};

Analysis analyzed(const std::string& name, std::vector<Override> overrides) {
  // Fewer balls than the scenes have are quicker to fit, and no easier.
  overrides.emplace_back("spheres.balls", "128");
  const auto scene = load_scene(source_dir() / "scenes/standard" / (name + ".json"), overrides);
  EXPECT_TRUE(scene.ok()) << scene.error().message;
  const auto engine = make_cpu_engine();
  const auto prepared = prepare_scene(*scene, *engine, {shared_cache()});
  EXPECT_TRUE(prepared.ok()) << prepared.error().message;
  const auto morphs = analyze_scene(*prepared, *engine, 9, [](int, int) { return true; });
  EXPECT_TRUE(morphs.ok());
  return morphs.ok() ? morphs->front() : Analysis{};
}

TEST_P(Standard, TheHandoverCannotBeSeen) {
  const Analysis analysis = analyzed(GetParam(), {});
  EXPECT_LE(*analysis.find("pop")->value, 2);
  EXPECT_LE(*analysis.find("handover")->value, 0.001);
  EXPECT_EQ(*analysis.find("bad_surfaces")->value, 0);
}
INSTANTIATE_TEST_SUITE_P(Tests, Standard,
                         ::testing::Values("teapot-penguin", "penguin-monkey", "monkey-torus",
                                           "torus-teapot"));

/// A body's limbs and a penguin's, named in the scene: what the labels say is kept, and parts keep
/// neighbours together better than one turn for all.
TEST(Limbs, BecomeLimbsAndHoldTogether) {
  const Analysis parts = analyzed("../effects/limbs", {});
  EXPECT_GE(*parts.find("attributes")->value, 0.95);
  EXPECT_LE(*parts.find("pop")->value, 2);
  EXPECT_GE(*parts.find("dip")->value, 0.98);
  const Analysis rigid = analyzed("../effects/limbs", {{"motion.path", "\"rigid\""}});
  RecordProperty("rigid", std::to_string(*rigid.find("rigidity")->value));
  RecordProperty("parts", std::to_string(*parts.find("rigidity")->value));
  EXPECT_LT(*parts.find("rigidity")->value, *rigid.find("rigidity")->value);
}

TEST(Handover, OfBallsThatAreNotTheModelIsSeen) {
  // The report's few octree spheres, and nothing between them and the model.
  const Analysis analysis = analyzed("torus-teapot", {{"spheres.method", "octree"},
                                                      {"spheres.fit", "none"},
                                                      {"spheres.resolution", "4"},
                                                      {"boundary.method", "cut"},
                                                      {"motion.interpolate", "balls"}});
  EXPECT_GT(*analysis.find("handover")->value, 0.01);
}

}  // namespace
}  // namespace polymorph
