// Steady noise: what stands still keeps its pixels from frame to frame.
#include "render/math/sampler.h"

#include <algorithm>
#include <set>

#include "testing/render.h"

namespace polymorph {
namespace {

using namespace testing;

/// A ball that stands still on a floor, and a little one that has moved in the second frame.
struct TwoBalls : BallOnFloor {
  TestMesh little = make_ball(24, 12, 0.12f), moved = little;
  TwoBalls() {
    for (Vec3& p : little.positions) p = p + Vec3{0.95f, 0.5f, 0.2f};
    for (Vec3& p : moved.positions) p = p + Vec3{0.97f, 0.52f, 0.2f};
    scene.meshes[0].moves = false;
    scene.meshes.push_back(view_of(little, 3));
  }
  RenderScene frame(int number) const {
    RenderScene result = scene;
    result.meshes[1].positions = number == 1 ? little.positions : moved.positions;
    return result;
  }
};

RenderSettings settings_of(int frame, bool steady) {
  RenderSettings settings = small_settings(8);
  settings.image.width = 64;
  settings.image.height = 48;
  settings.image.aovs = "id";
  settings.image.steady = steady;
  settings.frame = frame;
  return settings;
}

int changed(const Image& a, const Image& b, const std::set<float>& ids, int* of = nullptr) {
  int count = 0, all = 0;
  for (int y = 0; y < a.height; ++y)
    for (int x = 0; x < a.width; ++x) {
      if (!ids.count(a.at(x, y, 4)) || a.at(x, y, 4) != b.at(x, y, 4)) continue;
      ++all;
      count += !(color_at(a, x, y) == color_at(b, x, y));
    }
  if (of) *of = all;
  return count;
}

TEST(SteadyNoise, PixelsThatNothingTouchesAreTheSame) {
  const TwoBalls stage;
  // No floor: nothing that moves is seen by the big ball's light, but where the little one is near.
  RenderScene first = stage.frame(1), second = stage.frame(2);
  first.ground.enabled = second.ground.enabled = false;
  int of = 0;
  const Image a = render_or_fail(first, settings_of(1, true));
  const Image b = render_or_fail(second, settings_of(2, true));
  const int different = changed(a, b, {2}, &of);
  EXPECT_GT(of, 500);
  EXPECT_LT(different, of / 8) << "only where the light changes";
  // Away from the little ball's shadow and reflection nothing changes at all.
  for (int y = 0; y < 48; ++y)
    for (int x = 0; x < 28; ++x) EXPECT_EQ(color_at(a, x, y), color_at(b, x, y)) << x << " " << y;
  // The other way, everything that is lit by chance does.
  const int fresh = changed(render_or_fail(first, settings_of(1, false)),
                            render_or_fail(second, settings_of(2, false)), {2}, &of);
  EXPECT_GT(fresh, of * 9 / 10);
}

TEST(SteadyNoise, WhatMovesHasNewNoiseInEveryFrame) {
  const TwoBalls stage;
  RenderScene scene = stage.frame(1);
  const auto noise = [&] {
    int of = 0;
    const int count = changed(render_or_fail(scene, settings_of(1, true)),
                              render_or_fail(scene, settings_of(2, true)), {2}, &of);
    EXPECT_GT(of, 500);
    return count * 1.0 / of;
  };
  EXPECT_EQ(noise(), 0);
  scene.meshes[0].moves = true;
  EXPECT_GT(noise(), 0.9);
  scene.meshes[0].moves = scene.meshes[1].moves = false;
  EXPECT_EQ(noise(), 0);
  scene.camera_motion = CameraMotion{scene.camera, scene.camera, scene.camera};
  EXPECT_GT(noise(), 0.9) << "under a moving camera";
}

TEST(SteadyNoise, NewNoiseIsAsEvenAsTheOld) {
  // The 16 samples of 4 neighbours fill their square evenly, in whatever frame.
  for (const int frame : {1, 2, 77}) {
    const FrameSampler sampler = make_frame_sampler(3, frame, 4, true);
    EXPECT_NE(sampler.motion_xor, 0u);
    std::set<int> cells;
    for (int pixel = 0; pixel < 4; ++pixel)
      for (std::uint32_t s = 0; s < 4; ++s) {
        const SampleIndex index = sample_index(sampler, 10 + pixel % 2, 20 + pixel / 2, s, true);
        EXPECT_EQ(index.sequence, sample_index(sampler, 10, 20, 0).sequence);
        const Sample4 r = PathSampler(sampler, index).get(2);
        cells.insert(static_cast<int>(r.c * 4) + 4 * static_cast<int>(r.d * 4));
      }
    EXPECT_EQ(cells.size(), 16u);
  }
  // With as many samples as there may be, neighbours still are in one sequence.
  const FrameSampler maximal = make_frame_sampler(3, 5, 65536, true);
  EXPECT_EQ(sample_index(maximal, 17, 200, 65535, true).sequence,
            sample_index(maximal, 17, 200, 65535, false).sequence);
}

}  // namespace
}  // namespace polymorph
