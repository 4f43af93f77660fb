#include "scene/keyframes.h"

#include <gtest/gtest.h>

#include "base/file.h"
#include "scene/load_scene.h"
#include "testing/temporary_folder.h"

namespace polymorph {
namespace {

namespace fs = std::filesystem;

KeyframeTrack track_of(KeyEasing easing, std::vector<Keyframe> keys) {
  KeyframeTrack track;
  track.easing = easing;
  track.keys = std::move(keys);
  return track;
}
float at(const KeyframeTrack& track, double share) { return value_at(track, {share, 1, 1}).x; }

TEST(Keyframes, KeysAreMetAndTheEndsStay) {
  for (const KeyEasing easing : {KeyEasing::kSmooth, KeyEasing::kLinear, KeyEasing::kSmoothstep,
                                 KeyEasing::kQuintic, KeyEasing::kHold}) {
    const KeyframeTrack track =
        track_of(easing, {{0.2, {1, 0, 0}}, {0.5, {3, 0, 0}}, {0.6, {-1, 0, 0}}});
    for (const Keyframe& key : track.keys) EXPECT_FLOAT_EQ(at(track, key.at), key.value.x);
    EXPECT_FLOAT_EQ(at(track, 0), 1);
    EXPECT_FLOAT_EQ(at(track, 1), -1);
  }
}

TEST(Keyframes, EasingsGoAsTheySay) {
  const std::vector<Keyframe> keys{{0, {0, 0, 0}}, {1, {2, 0, 0}}};
  EXPECT_FLOAT_EQ(at(track_of(KeyEasing::kLinear, keys), 0.25), 0.5f);
  EXPECT_FLOAT_EQ(at(track_of(KeyEasing::kHold, keys), 0.99), 0);
  EXPECT_FLOAT_EQ(at(track_of(KeyEasing::kSmoothstep, keys), 0.25), 2 * 0.15625f);
  EXPECT_FLOAT_EQ(at(track_of(KeyEasing::kQuintic, keys), 0.25), 2 * 0.103515625f);
  // Between two keys the smooth curve rests at both ends, as smoothstep does.
  EXPECT_FLOAT_EQ(at(track_of(KeyEasing::kSmooth, keys), 0.25), 2 * 0.15625f);
}

TEST(Keyframes, TheSmoothCurveHasNoKinkAndNeverOvershoots) {
  const KeyframeTrack track = track_of(
      KeyEasing::kSmooth, {{0, {0, 5, 1}}, {0.3, {1, 5, 0}}, {0.4, {4, 5, 3}}, {1, {4.5f, 5, 2}}});
  const double h = 1e-3;
  for (double t = h; t < 1; t += h) {
    const Vec3 v = value_at(track, {t, 1, 1});
    const std::size_t i = t < 0.3 ? 0 : t < 0.4 ? 1 : 2;
    const Vec3 a = track.keys[i].value, b = track.keys[i + 1].value;
    EXPECT_GE(v.x, std::min(a.x, b.x) - 1e-5f);
    EXPECT_LE(v.x, std::max(a.x, b.x) + 1e-5f);
    EXPECT_GE(v.z, std::min(a.z, b.z) - 1e-5f);
    EXPECT_LE(v.z, std::max(a.z, b.z) + 1e-5f);
    EXPECT_FLOAT_EQ(v.y, 5);
    const float before = value_at(track, {t - h, 1, 1}).x, after = value_at(track, {t + h, 1, 1}).x;
    EXPECT_NEAR((after - v.x) / h, (v.x - before) / h, 2.0) << t;  // slopes reach 30
  }
}

TEST(Keyframes, UnitsAreTheMomentsOwn) {
  KeyframeTrack track = track_of(KeyEasing::kLinear, {{1, {0, 0, 0}}, {11, {10, 0, 0}}});
  const FilmTime time{0.5, 3, 2.5};
  track.unit = KeyUnit::kFrame;
  EXPECT_FLOAT_EQ(value_at(track, time).x, 2);
  track.unit = KeyUnit::kLeg;
  EXPECT_FLOAT_EQ(value_at(track, time).x, 1.5f);
  track.unit = KeyUnit::kShare;
  EXPECT_FLOAT_EQ(value_at(track, time).x, 0);
}

class KeyframesInScenes : public FolderTest {
 protected:
  Result<Scene> load(const std::string& keys, std::vector<Override> overrides = {}) {
    const fs::path file = folder / "scene.json";
    EXPECT_TRUE(
        write_file(file, "{\"source\": \"cube\", \"target\": \"torus\",\n" + keys + "}").ok());
    return load_scene(file, overrides);
  }
  std::string error_of(const std::string& keys) {
    const auto scene = load(keys);
    EXPECT_FALSE(scene.ok()) << keys;
    return scene.ok() ? "" : scene.error().message;
  }
};

TEST_F(KeyframesInScenes, EveryKindOfSettingTakesThem) {
  const auto scene = load(R"(
    "camera": {"azimuth": {"keys": [{"t": 0, "value": 10}, {"t": 1, "value": 50}], "easing": "linear"},
               "position": {"keys": [{"t": 0, "value": [0, 1, 2]}, {"t": 1, "value": [0, 3, 2]}]},
               "focus": {"keys": [{"t": 0, "value": 2}, {"t": 1, "value": 4}], "easing": "linear"}},
    "lights": {"key_color": {"keys": [{"t": 0, "value": "#ffffff"}, {"t": 1, "value": [0, 0, 1]}]},
               "lamps": [{"kind": "sun"},
                         {"intensity": {"keys": [{"t": 0.5, "value": 3}, {"t": 1, "value": 1}]}}]},
    "ground": {"height": {"keys": [{"t": 0, "value": -1}, {"t": 1, "value": -2}]}},
    "look": {"roughness": {"keys": [{"t": 0, "value": 0}, {"t": 1, "value": 1}]}},
    "image": {"exposure": {"keys": [{"t": 0, "value": -2}, {"t": 1, "value": 2}], "easing": "linear"}})");
  ASSERT_TRUE(scene.ok()) << scene.error().message;
  EXPECT_EQ(scene->tracks.size(), 8u);
  EXPECT_FLOAT_EQ(scene->camera.azimuth, 10);  // the first key's
  const Scene middle = scene_at(*scene, {0.5, 1, 1});
  EXPECT_TRUE(middle.tracks.empty());
  EXPECT_FLOAT_EQ(middle.camera.azimuth, 30);
  EXPECT_EQ(*middle.camera.position, (Vec3{0, 2, 2}));
  EXPECT_FLOAT_EQ(*middle.camera.focus, 3);
  EXPECT_FLOAT_EQ(middle.lights.key_color.x, 0.5f);
  EXPECT_FLOAT_EQ(middle.lights.key_color.z, 1);
  EXPECT_FLOAT_EQ(middle.lights.lamps[1].intensity, 3);
  EXPECT_FLOAT_EQ(*middle.ground.height, -1.5f);
  EXPECT_FLOAT_EQ(middle.look.roughness, 0.5f);
  EXPECT_FLOAT_EQ(scene_at(*scene, {0.75, 1, 1}).image.exposure, 1);
}

TEST_F(KeyframesInScenes, AWrittenSceneReadsBackTheSame) {
  const auto scene = load(R"("camera": {"fov": {"keys": [{"frame": 1, "value": 20},
    {"frame": 9, "value": 30}], "easing": "quintic"}}, "lights": {"lamps": [{"color":
    {"keys": [{"leg": 1, "value": [1, 0, 0]}, {"leg": 1.5, "value": [0, 1, 0]}]}}]})");
  ASSERT_TRUE(scene.ok()) << scene.error().message;
  const std::string text = scene_to_json(*scene, folder);
  ASSERT_TRUE(write_file(folder / "again.json", text).ok());
  const auto again = load_scene(folder / "again.json");
  ASSERT_TRUE(again.ok()) << again.error().message;
  EXPECT_EQ(scene_to_json(*again, folder), text);
  ASSERT_EQ(again->tracks.size(), 2u);
  EXPECT_EQ(again->tracks[0].easing, KeyEasing::kQuintic);
  EXPECT_EQ(again->tracks[1].unit, KeyUnit::kLeg);
}

TEST_F(KeyframesInScenes, SetTakesThemToo) {
  const auto scene =
      load("", {{"camera.fov", R"({"keys": [{"t": 0, "value": 20}, {"t": 1, "value": 40}]})"}});
  ASSERT_FALSE(scene.ok());  // "{..., }" is no JSON
  const auto good =
      load("\"frames\": {}", {{"camera.fov", R"({"keys": [{"t": 0, "value": 20}]})"}});
  ASSERT_TRUE(good.ok()) << good.error().message;
  EXPECT_EQ(good->tracks.size(), 1u);
}

TEST_F(KeyframesInScenes, WhatIsWrongIsNamedWithItsLineAndKey) {
  const auto fails = [&](const std::string& keys, const std::string& with) {
    EXPECT_NE(error_of(keys).find(with), std::string::npos) << error_of(keys);
  };
  const auto azimuth = [](const std::string& track) {
    return "\"camera\": {\"azimuth\":\n" + track + "}";
  };
  fails(azimuth(R"({"keys": []})"), "scene.json:3:1: /camera/azimuth: needs \"keys\"");
  fails(azimuth(R"({"easing": "linear"})"), "/camera/azimuth: needs \"keys\"");
  fails(azimuth(R"({"keys": [{"t": 0, "value": 400}]})"),
        "scene.json:3:29: /camera/azimuth/keys/0/value: must be -360 to 360 (is 400)");
  fails(azimuth(R"({"keys": [{"t": 2, "value": 4}]})"), "/camera/azimuth/keys/0/t: must be 0 to 1");
  fails(azimuth(R"({"keys": [{"value": 4}]})"), "/keys/0: needs one of \"t\"");
  fails(azimuth(R"({"keys": [{"t": 0, "frame": 2, "value": 4}]})"), "/keys/0: needs one of \"t\"");
  fails(azimuth(R"({"keys": [{"t": 0}]})"), "/keys/0: needs a \"value\"");
  fails(azimuth(R"({"keys": [{"t": 0, "value": 4}, {"frame": 2, "value": 4}]})"),
        "/keys/1: all keys of a setting");
  fails(azimuth(R"({"keys": [{"t": 0.5, "value": 4}, {"t": 0.5, "value": 4}]})"),
        "/keys/1: must come after the key before it (is at 0.5, after 0.5)");
  fails(azimuth(R"({"keys": [{"t": 0, "value": 4, "ease": 1}]})"), "/keys/0/ease: unknown key");
  fails(azimuth(R"({"keys": [{"t": 0, "value": 4}], "easing": "lineal"})"),
        "/camera/azimuth/easing: must be \"smooth\"");
  fails(azimuth(R"({"keys": [{"t": 0, "value": "4"}]})"),
        "/keys/0/value: must be a number (is a string)");
  fails(azimuth(R"({"keys": [{"leg": 2.5, "value": 4}]})"),
        "/keys/0: is at leg 2.5, but the first actor's last leg, 1, ends at 2");
  fails(azimuth(R"({"keys": [4]})"), "/keys/0: must be {\"frame\": 1, \"value\": ...}");
  fails(azimuth("[4]"), "/azimuth: must be a number, or {\"keys\": [{\"frame\": 1");
  fails(R"("camera": {"up": {"keys": [{"t": 0, "value": [0, 0, 0]}]}})",
        "/camera/up/keys/0: must not be the zero vector");
  fails(R"("lights": {"key_color": {"keys": [{"t": 0, "value": "red"}]}})",
        "/lights/key_color/keys/0/value: must be \"#rrggbb\"");
  fails(R"("camera": {"orbit": {"keys": [{"t": 0, "value": 4}]}})",
        "/camera/orbit: cannot change over the film");
  fails(R"("motion": {"path": {"bend": {"keys": [{"t": 0, "value": 1}]}}})",
        "/motion/path/bend: cannot change over the film");
  fails(R"("image": {"noise": {"keys": [{"t": 0, "value": 1}]}})",
        "/image/noise: cannot change over the film");
}

TEST_F(KeyframesInScenes, AnOrbitIsEvenAndAWholeTurnCloses) {
  auto scene = load("\"camera\": {\"orbit\": 360}");
  ASSERT_TRUE(scene.ok());
  const auto angle = [&](int frame, int count) {
    const double gone = frame - 1;
    return scene_at(*scene, {gone / (count - 1), gone + 1, 1, gone / count}).camera.orbit;
  };
  EXPECT_FLOAT_EQ(angle(1, 8), 0);
  EXPECT_FLOAT_EQ(angle(2, 8), 45);
  EXPECT_FLOAT_EQ(angle(8, 8), 315);  // and 45 more to frame 1
  scene->camera.orbit = 90;
  EXPECT_FLOAT_EQ(angle(8, 8), 90);
}

}  // namespace
}  // namespace polymorph
