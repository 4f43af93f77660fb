#include "scene/load_scene.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include "base/file.h"
#include "testing/paths.h"
#include "testing/temporary_folder.h"

namespace polymorph {
namespace {

namespace fs = std::filesystem;

class SceneTest : public FolderTest {
 protected:
  void SetUp() override {
    ASSERT_TRUE(write_file(folder / "a.obj", "v 0 0 0\n").ok());
    ASSERT_TRUE(write_file(folder / "b.obj", "v 0 0 0\n").ok());
  }
  fs::path scene_file(const std::string& text) {
    const fs::path path = folder / "scene.json";
    EXPECT_TRUE(write_file(path, text).ok());
    return path;
  }
  Result<Scene> load(const std::string& text, std::vector<Override> overrides = {}) {
    return load_scene(scene_file(text), overrides);
  }
  std::string error_of(const std::string& text) {
    const auto scene = load(text);
    EXPECT_FALSE(scene.ok()) << text;
    return scene.ok() ? "" : scene.error().message;
  }
};

TEST_F(SceneTest, KeysOfFormerVersionsAreErrorsThatSayTheNewOne) {
  const auto error = [&](const std::string& settings) {
    return error_of(R"({"source": "a.obj", "target": "b.obj", )" + settings + "}");
  };
  const auto has = [](const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
  };
  EXPECT_TRUE(has(error(R"("surface": {"crumbs": 0.05})"),
                  "/surface/crumbs: is a key no more - write surface.min_component_share"));
  EXPECT_TRUE(has(error(R"("motion": {"path": "explode", "burst": 2})"),
                  "/motion/burst: is a key no more - write motion.path.burst"));
  EXPECT_TRUE(has(error(R"("surface": {"flat": true})"), "write report.flat"));
  EXPECT_TRUE(has(error(R"("plan": {"size_weight": 2})"), "is a constant of the method now"));
  // They are not offered where a word is misspelt.
  EXPECT_FALSE(has(error(R"("surface": {"crumb": 0.1})"), "crumbs"));
}

TEST_F(SceneTest, TheCommandLineSetsPartsOfWhatTheFileSaysInAWord) {
  const auto scene =
      load(R"({"source": "a.obj", "target": "b.obj", "motion": {"path": "explode"}})",
           {{"target.rotate", "[0, 90, 0]"}, {"motion.path.burst", "2"}});
  ASSERT_TRUE(scene.ok()) << scene.error().message;
  EXPECT_EQ(scene->actors[0].target.model, folder / "b.obj");
  EXPECT_EQ(scene->actors[0].target.rotate.y, 90);
  EXPECT_EQ(scene->motion.path, Path::kExplode);
  EXPECT_EQ(scene->motion.burst, 2);
  const auto wrong = load(R"({"source": "a.obj", "target": "b.obj"})", {{"look.kind.x", "1"}});
  EXPECT_FALSE(wrong.ok());
}

TEST_F(SceneTest, PathEasingAndStaggerAreAWordOrAnObject) {
  const auto motion = [&](const std::string& text) {
    const auto scene = load(R"({"source": "a.obj", "target": "b.obj", "motion": )" + text + "}");
    EXPECT_TRUE(scene.ok()) << scene.error().message;
    return scene.ok() ? scene->motion : MotionSettings{};
  };
  const MotionSettings words =
      motion(R"({"path": "explode", "easing": "spring", "stagger": "noise"})");
  EXPECT_EQ(words.path, Path::kExplode);
  EXPECT_EQ(words.burst, MotionSettings{}.burst);
  EXPECT_EQ(words.easing, Easing::kSpring);
  EXPECT_EQ(words.stagger, Stagger::kNoise);
  const MotionSettings objects = motion(R"({"path": {"kind": "explode", "burst": 3, "gravity": 2},
                 "easing": {"kind": "bezier", "bezier": [0.1, 0.2, 0.3, 0.4], "damping": 9},
                 "stagger": {"kind": "axis", "axis": [1, 0, 0], "share": 0.2}})");
  EXPECT_EQ(objects.path, Path::kExplode);
  EXPECT_EQ(objects.burst, 3);
  EXPECT_EQ(objects.gravity, 2);
  EXPECT_EQ(objects.easing, Easing::kBezier);
  EXPECT_EQ(objects.bezier[3], 0.4f);
  EXPECT_EQ(objects.spring.damping, 9);
  EXPECT_EQ(objects.stagger, Stagger::kAxis);
  EXPECT_EQ(objects.stagger_axis.x, 1);
  EXPECT_EQ(objects.stagger_share, 0.2f);
  const auto error = [&](const std::string& text) {
    return error_of(R"({"source": "a.obj", "target": "b.obj", "motion": )" + text + "}");
  };
  EXPECT_NE(error(R"({"path": "explodes"})").find("/motion/path: must be"), std::string::npos);
  EXPECT_NE(error(R"({"path": 3})").find("/motion/path: must be an object"), std::string::npos);
}

TEST_F(SceneTest, ManyKeysAndEntriesAreAnsweredAtOnce) {
  std::string keys = R"({"source": "a.obj", "target": "torus")", actors = R"({"actors": [)";
  for (int i = 0; i < 200000; ++i) keys += fmt::format(", \"key{}\": 1", i);
  EXPECT_NE(error_of(keys + "}").find("/key0: unknown key"), std::string::npos);
  EXPECT_NE(error_of(keys + ", \"key7\": 2}").find("duplicate key \"key7\""), std::string::npos);
  for (int i = 0; i < 100000; ++i)
    actors += std::string(i ? "," : "") + R"({"source": "cube", "target": "torus"})";
  EXPECT_NE(error_of(actors + "]}").find("/actors: has 100000 entries"), std::string::npos);
}

TEST_F(SceneTest, SourceAndTargetAreEnough) {
  const auto scene = load(R"({"source": "a.obj", "target": "torus"})");
  ASSERT_TRUE(scene.ok()) << scene.error().message;
  EXPECT_EQ(scene->actors[0].source.model, folder / "a.obj");
  EXPECT_EQ(scene->actors[0].source.name, "a");
  EXPECT_EQ(scene->actors[0].target.shape, "torus");
  EXPECT_EQ(chain_objects(scene->actors[0]).size(), 2u);
  EXPECT_EQ(scene->image.width, 640);
}

TEST_F(SceneTest, EverySettingArrives) {
  const auto scene = load(R"({
    "spheres": {"method": "active", "resolution": 5},
    "report": {"inside": "parity", "blob_constant": 2, "magnitude": 3, "threshold": 4, "flat": true, "placement": "midpoint", "influence": 3},
    "source": {"model": "a.obj", "name": "first", "translate": [1, 2, 3], "rotate": [0, 90, 0], "scale": 2, "color": "#ff0000"},
    "intermediate": [{"shape": "puddle", "meta": true, "spheres": {"resolution": 4}}],
    "target": {"shape": "sphere", "scale": [1, 2, 1], "arrange": false},
    "arrange": "none",
    "frames": {"per_leg": [10, 20], "fps": 30, "hold_start": 2, "hold_end": 3},
    "field": {"kind": "inverse_square", "match_volume": false},
    "plan": {"method": "index", "seed": 7},
    "motion": {"easing": "linear", "keep_volume": false},
    "boundary": {"method": "cut", "look_share": 0.2, "boundary_share": 0.1},
    "surface": {"resolution": 64},
    "camera": {"position": [1, 2, 3], "target": [0, 1, 0], "fov": 40},
    "lights": {"key_azimuth": 10, "key_size": 0, "sky_intensity": 0.5},
    "ground": {"enabled": false, "height": -1},
    "look": {"kind": "matte", "color": [0.5, 0.25, 1], "roughness": 0.3},
    "image": {"width": 320, "height": 200, "samples": 4, "max_depth": 2, "seed": 9, "exposure": 1},
    "output": {"file": "x.####.png", "png": true}})");
  ASSERT_TRUE(scene.ok()) << scene.error().message;
  EXPECT_EQ(scene->actors[0].source.spheres.method, SphereMethod::kActive);
  EXPECT_EQ(scene->actors[0].source.spheres.inside, InsideMethod::kParity);
  EXPECT_EQ(scene->actors[0].intermediate[0].spheres.method, SphereMethod::kActive)
      << "an object's spheres start from the scene's";
  EXPECT_EQ(scene->actors[0].intermediate[0].spheres.resolution, 4);
  EXPECT_EQ(scene->actors[0].source.name, "first");
  EXPECT_EQ(scene->actors[0].source.scale.z, 2);
  EXPECT_EQ(scene->actors[0].target.scale.y, 2);
  EXPECT_FALSE(scene->actors[0].target.arrange);
  EXPECT_NEAR(scene->actors[0].source.color->x, 1, 1e-6);
  EXPECT_EQ(scene->arrange, Arrange::kNone);
  EXPECT_EQ(scene->frames.per_leg, (std::vector<int>{10, 20}));
  EXPECT_EQ(scene->field.kind, FieldKind::kInverseSquare);
  EXPECT_EQ(scene->field.blob_constant, 2);
  EXPECT_EQ(scene->field.magnitude, 3);
  EXPECT_EQ(scene->field.threshold, 4);
  EXPECT_TRUE(scene->surface.flat);
  EXPECT_EQ(scene->surface.placement, Placement::kMidpoint);
  EXPECT_EQ(scene->surface.influence, 3);
  EXPECT_EQ(scene->plan.method, PlanMethod::kIndex);
  EXPECT_EQ(scene->plan.seed, 7u);
  EXPECT_EQ(scene->motion.easing, Easing::kLinear);
  EXPECT_EQ(scene->boundary.method, BoundaryMethod::kCut);
  EXPECT_EQ(scene->surface.resolution, 64);
  EXPECT_EQ(scene->camera.position->z, 3);
  EXPECT_EQ(scene->ground.height, -1.0f);
  EXPECT_EQ(scene->look.kind, LookKind::kMatte);
  EXPECT_EQ(scene->image.seed, 9u);
  EXPECT_TRUE(scene->output.png);
}

TEST_F(SceneTest, UnknownKeyNamesLineColumnPointerAndTheNearestKey) {
  const std::string error =
      error_of("{\"source\": \"a.obj\",\n  \"target\": \"b.obj\",\n  \"frames\": {\"cuont\": 3}}");
  EXPECT_NE(error.find("scene.json:3:14: /frames/cuont: unknown key - did you mean \"count\"?"),
            std::string::npos)
      << error;
}

TEST_F(SceneTest, SeveralMistakesAreReportedTogetherInFileOrder) {
  const auto scene = load(
      "{\"source\": \"gone.obj\",\n\"target\": \"b.obj\",\n\"frames\": {\"count\": "
      "-3},\n\"image\": {\"width\": \"wide\"}}");
  ASSERT_FALSE(scene.ok());
  EXPECT_EQ(scene.error().code, ErrorCode::kInput);
  const std::string& error = scene.error().message;
  const auto missing = error.find(":1:12: /source: no such file"),
             range = error.find(":3:21: /frames/count: must be 0 to 100000 (is -3)"),
             type = error.find(":4:20: /image/width: must be a number (is a string)");
  EXPECT_TRUE(missing < range && range < type && type != std::string::npos) << error;
}

TEST_F(SceneTest, WrongValuesSayWhatIsAllowed) {
  const auto with = [&](const std::string& part) {
    return error_of("{\"source\": \"a.obj\", \"target\": \"b.obj\", " + part + "}");
  };
  EXPECT_NE(with("\"plan\": {\"method\": \"indx\"}")
                .find("must be \"index\", \"nearest\" or \"transport\" (is \"indx\") - did you "
                      "mean \"index\"?"),
            std::string::npos);
  EXPECT_NE(with("\"field\": {\"kind\": \"quartic\"}")
                .find("must be \"gaussian\", \"wyvill\" or \"inverse_square\" (is \"quartic\")"),
            std::string::npos);
  EXPECT_NE(with("\"image\": {\"samples\": 4.0}").find("(is 4 with a decimal point)"),
            std::string::npos);
  EXPECT_NE(
      with("\"image\": {\"samples\": 1.5}").find("must be a whole number, 1 to 65536 (is 1.5)"),
      std::string::npos);
  EXPECT_NE(with("\"image\": {\"samples\": 1e999}").find(":1:"), std::string::npos);
  EXPECT_NE(with("\"look\": {\"color\": [1, 2]}").find("list of 3 numbers"), std::string::npos);
  EXPECT_NE(with("\"look\": {\"color\": \"red\"}").find("#rrggbb"), std::string::npos);
  EXPECT_NE(with("\"camera\": {\"up\": [0, 0, 0]}").find("zero vector"), std::string::npos);
  EXPECT_NE(with("\"frames\": {\"per_leg\": [3, 4]}").find("has 2 entries for 1 leg"),
            std::string::npos);
  EXPECT_NE(with("\"frames\": {\"count\": 5, \"hold_start\": 2, \"hold_end\": 2}")
                .find("leaves 1 frame beside the holds (2 + 2) - at least two are needed"),
            std::string::npos);
  EXPECT_NE(with("\"intermediate\": {}").find("must be a list (is an object)"), std::string::npos);
  EXPECT_NE(with("\"intermediate\": [{\"shape\": \"spher\"}]").find("did you mean \"sphere\"?"),
            std::string::npos);
  EXPECT_NE(with("\"intermediate\": [{\"meta\": true}]").find("/intermediate/0: needs either"),
            std::string::npos);
}

TEST_F(SceneTest, MissingEndsAreNamed) {
  const std::string error = error_of("{}");
  EXPECT_NE(error.find("/source: is missing"), std::string::npos);
  EXPECT_NE(error.find("/target: is missing"), std::string::npos);
}

TEST_F(SceneTest, SyntaxErrorsShowThePlace) {
  const std::string error = error_of("{\n  \"source\": \"a.obj\",\n  \"target\": \"b.obj\",\n}");
  EXPECT_NE(error.find("scene.json:4:1:"), std::string::npos) << error;
  EXPECT_NE(error.find("\n  | }\n  | ^"), std::string::npos) << error;
  EXPECT_NE(error.find("remove the comma"), std::string::npos) << error;
  EXPECT_NE(error_of("{'source': 1}").find("double quotes"), std::string::npos);
  EXPECT_NE(error_of("{\"source\": 1, # x\n}").find("a comment starts with //"), std::string::npos);
  EXPECT_NE(error_of("{ /* no end \n").find("scene.json:"), std::string::npos);
  EXPECT_NE(error_of("  \n").find("is empty"), std::string::npos);
  EXPECT_NE(error_of("[1]").find("must be an object"), std::string::npos);
}

TEST_F(SceneTest, CommentsAreReadOverAndPlacesStayRight) {
  const auto scene = load(R"(// a scene, "source": 1
{ /* { */ "source": "a.obj", // the first: [
  "target" /* : */ : /* " */ "b.obj", "frames": {"count": 7/**/}
} // end)");
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_EQ(scene->frames.count, 7);
  const std::string error = error_of(
      "// one\n{\"source\": \"a.obj\", // x\n  \"target\": \"b.obj\",\n"
      "  /* two\n lines */ \"frames\": {/**/\"count\": /*,*/ -1}}");
  EXPECT_NE(error.find("scene.json:5:41: /frames/count: must be 0 to 100000 (is -1)"),
            std::string::npos)
      << error;
}

TEST_F(SceneTest, DuplicateKeysNameBothLines) {
  const std::string error =
      error_of("{\"source\": \"a.obj\",\n\"target\": \"b.obj\",\n\"source\": \"b.obj\"}");
  EXPECT_NE(error.find("scene.json:3:1: duplicate key \"source\" (first on line 1)"),
            std::string::npos)
      << error;
}

TEST_F(SceneTest, DeepNestingIsRefusedNotSurvivedByLuck) {
  const std::string error =
      error_of("{\"source\": " + std::string(100000, '[') + std::string(100000, ']') + "}");
  EXPECT_NE(error.find("nested deeper than 64"), std::string::npos) << error.substr(0, 300);
}

TEST_F(SceneTest, OverridesWinAndAreCheckedAlike) {
  const std::string text = R"({"source": "a.obj", "target": "b.obj", "intermediate": ["sphere"]})";
  const auto scene = load(text, {{"image.samples", "64"},
                                 {"intermediate.0", "{\"shape\": \"cube\", \"meta\": true}"},
                                 {"plan.method", "index"}});
  ASSERT_TRUE(scene.ok()) << scene.error().message;
  EXPECT_EQ(scene->image.samples, 64);
  EXPECT_TRUE(scene->actors[0].intermediate[0].meta);
  EXPECT_EQ(scene->plan.method, PlanMethod::kIndex);
  const auto bad = load(text, {{"image.samples", "0"}});
  ASSERT_FALSE(bad.ok());
  EXPECT_NE(bad.error().message.find("/image/samples: must be 1 to 65536 (is 0)"),
            std::string::npos);
  const auto out_of_range = load(text, {{"intermediate.3.meta", "true"}});
  ASSERT_FALSE(out_of_range.ok());
  EXPECT_EQ(out_of_range.error().code, ErrorCode::kUsage);
}

TEST_F(SceneTest, AListOfActorsIsReadAndOneChainIsAnActorToo) {
  const auto alone = load(R"({"source": "a.obj", "target": "b.obj"})");
  ASSERT_TRUE(alone.ok());
  ASSERT_EQ(alone->actors.size(), 1u);
  EXPECT_EQ(alone->actors[0].name, "a");
  const auto scene = load(R"({"spheres": {"balls": 77}, "plan": {"method": "nearest", "seed": 3,
      "landmarks": {"a.obj": {"nose": [0, 1, 0]}, "b": {"nose": "v2"}}},
    "actors": [{"source": "a.obj", "target": {"model": "b.obj", "spheres": {"fit": "round"}}},
               {"source": "a.obj", "intermediate": ["sphere"], "target": "b.obj", "start": 9,
                "translate": [2, 0, 0], "scale": 0.5, "per_leg": [5, 6],
                "plan": {"method": "index"}}]})");
  ASSERT_TRUE(scene.ok()) << scene.error().message;
  ASSERT_EQ(scene->actors.size(), 2u);
  const ActorSettings &first = scene->actors[0], &second = scene->actors[1];
  EXPECT_EQ(first.name, "a");
  EXPECT_EQ(second.name, "a 2") << "names tell actors apart";
  EXPECT_EQ(first.target.spheres.balls, 77) << "the scene's are every object's default";
  EXPECT_EQ(first.target.spheres.fit, FitKind::kRound);
  EXPECT_EQ(first.plan.method, PlanMethod::kNearest);
  EXPECT_EQ(second.plan.method, PlanMethod::kIndex);
  EXPECT_EQ(second.plan.seed, 3u) << "the scene's plan is every actor's default";
  EXPECT_EQ(first.plan.landmarks.at("b").at("nose").vertex, 2);
  EXPECT_EQ(second.start, 9);
  EXPECT_EQ(second.per_leg, (std::vector<int>{5, 6}));
  EXPECT_EQ(second.translate.x, 2);
  EXPECT_EQ(second.scale.y, 0.5f);
  const std::string text = scene_to_json(*scene, folder);
  const auto again = load(text);
  ASSERT_TRUE(again.ok()) << again.error().message;
  EXPECT_EQ(scene_to_json(*again, folder), text);
  EXPECT_EQ(again->actors[0].plan.landmarks.at("a.obj").at("nose").point, (Vec3{0, 1, 0}));
}

TEST_F(SceneTest, WhatIsWrongWithLandmarksHasItsPlace) {
  const auto expect_error = [&](const std::string& landmarks, const std::string& expected) {
    const auto bad = load(
        "{\"source\": \"a.obj\", \"intermediate\": [\"sphere\"], \"target\": \"b.obj\",\n"
        " \"plan\": {\"landmarks\": " +
        landmarks + "}}");
    ASSERT_FALSE(bad.ok()) << landmarks;
    EXPECT_NE(bad.error().message.find(expected), std::string::npos) << bad.error().message;
  };
  expect_error(R"([{"from": [0, 0, 0], "to": [0, 0, 0]}])",
               "scene.json:2:24: /plan/landmarks: is no list any more - write {\"first.obj\": "
               "{\"nose\": [x, y, z]}");
  expect_error(R"({"a.obj": [1, 2, 3]})",
               "scene.json:2:34: /plan/landmarks/a.obj: must be an object");
  expect_error(R"({"a.obj": {"nose": "1"}})",
               "scene.json:2:43: /plan/landmarks/a.obj/nose: must be a point [x, y, z]");
  for (const char* wrong :
       {"[1, 2]", "\"v0\"", "\"v-1\"", "\"v\"", "7", "[1, 2, \"3\"]", "[1, 2, 1e99]"})
    expect_error(R"({"a.obj": {"nose": )" + std::string(wrong) + "}}", "must be a point [x, y, z]");
  expect_error(R"({"c.obj": {"nose": [0, 0, 0]}})",
               "scene.json:2:25: /plan/landmarks/c.obj: no object is called that");
  expect_error(
      R"({"a.obj": {"nose": [0, 0, 0]}, "sphere": {"noes": [0, 1, 0]}})",
      "scene.json:2:35: /plan/landmarks/a.obj/nose: no neighbour of a.obj in the chain has a "
      "landmark \"nose\" - did you mean \"noes\"?");
  expect_error(R"({"a.obj": {"nose": [0, 0, 0]}, "b": {"nose": [0, 1, 0]}})",
               "no neighbour of a.obj in the chain has a landmark \"nose\"");
  expect_error(R"({"a.obj": {"nose": [0, 0, 0]}, "sphere": {"nose": "v1"}, "a": {"nose": "v1"}})",
               "/plan/landmarks/a: is the same object as \"a.obj\"");
}

TEST_F(SceneTest, WhatIsWrongWithActorsHasItsPlace) {
  EXPECT_NE(error_of(R"({"actors": []})").find("/actors: is empty"), std::string::npos);
  EXPECT_NE(error_of(R"({"actors": "a.obj"})").find("/actors: must be a list"), std::string::npos);
  const std::string both =
      error_of(R"({"source": "a.obj", "actors": [{"source": "a.obj", "target": "b.obj"}]})");
  EXPECT_NE(both.find("/source: contradicts \"actors\""), std::string::npos) << both;
  const std::string wrong = error_of(
      R"({"frames": {"count": 24}, "actors": [{"source": "a.obj", "target": "b.obj", "strat": 3},
          {"source": "a.obj"}, {"source": "a.obj", "target": "b.obj", "start": 24},
          {"source": "a.obj", "target": "b.obj", "per_leg": [4, 5]},
          {"source": "a.obj", "target": "b.obj", "start": 10, "per_leg": [30]}]})");
  for (const char* message :
       {"/actors/0/strat: unknown key - did you mean \"start\"?", "/actors/1/target: is missing",
        "/actors/2/start: leaves 1 of the scene's 24 frames, and the actor needs 2",
        "/actors/3/per_leg: has 2 entries for 1 leg (objects - 1)",
        "/actors/4/start: leaves 15 of the scene's 24 frames, and the actor needs 30"})
    EXPECT_NE(wrong.find(message), std::string::npos) << message << "\nin\n" << wrong;
}

TEST_F(SceneTest, WhatIsWrittenReadsBackTheSame) {
  const auto scene = load(
      R"({"source": "a.obj", "target": "b.obj", "look": {"roughness": 0.3}, "camera": {"fov": 41.5}})");
  ASSERT_TRUE(scene.ok());
  const std::string text = scene_to_json(*scene, folder);
  const auto again = load(text);
  ASSERT_TRUE(again.ok()) << again.error().message;
  EXPECT_EQ(scene_to_json(*again, folder), text);
  EXPECT_NE(text.find("\"roughness\": 0.3"), std::string::npos) << text;
  EXPECT_EQ(text.find("0.30000"), std::string::npos)
      << "floats are written as short as they read back";
  EXPECT_EQ(again->camera.fov, 41.5f);
}

TEST(SceneSchema, TheCommittedSchemaIsTheProgramsOwn) {
  const auto committed = read_file(source_dir() / "scenes" / "scene.schema.json");
  ASSERT_TRUE(committed.ok()) << committed.error().message;
  EXPECT_EQ(*committed, scene_schema())
      << "run: build/release/polymorph schema > scenes/scene.schema.json";
}

}  // namespace
}  // namespace polymorph
