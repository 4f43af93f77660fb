#include "model/transfer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <thread>

#include "model/shapes.h"
#include "testing/texture.h"

namespace polymorph {
namespace {

/// A tube around y, its texture once around: a seam where the angle starts again. Two materials:
/// below and above the middle.
Model tube(int around, int rings) {
  Model model;
  model.materials.resize(2);
  const auto angle = [&](int i) {
    return 6.2831853f * static_cast<float>(i) / static_cast<float>(around);
  };
  for (int r = 0; r <= rings; ++r)
    for (int i = 0; i < around; ++i)
      model.points.push_back({std::cos(angle(i)), static_cast<float>(r), std::sin(angle(i))});
  const auto point = [&](int i, int r) {
    return static_cast<std::uint32_t>(r * around + i % around);
  };
  const auto uv = [&](int i, int r) {
    return Vec2{static_cast<float>(i) / static_cast<float>(around),
                static_cast<float>(r) / static_cast<float>(rings)};
  };
  for (int r = 0; r < rings; ++r)
    for (int i = 0; i < around; ++i)
      for (const bool first : {true, false}) {
        const int a[3] = {i, first ? i : i + 1, i + 1};
        const int b[3] = {r, r + 1, first ? r + 1 : r};
        Triangle t;
        for (int k = 0; k < 3; ++k) {
          t.v[k] = point(a[k], b[k]);
          model.corner_uvs.push_back(uv(a[k], b[k]));
        }
        model.triangles.push_back(t);
        model.triangle_materials.push_back(2 * r < rings ? 0u : 1u);
      }
  return model;
}

/// A finer tube on tube(), turned so that its triangles cross the seam. One triangle of each quad.
struct FineTube {
  std::vector<Vec3> points;
  std::vector<Triangle> triangles;

  FineTube() {
    const int n = 100;
    for (int r = 0; r <= 30; ++r)
      for (int i = 0; i < n; ++i) {
        const float a = 6.2831853f * (static_cast<float>(i) + 0.37f) / n;
        points.push_back({std::cos(a), 8 * static_cast<float>(r) / 30, std::sin(a)});
      }
    for (int r = 0; r < 30; ++r)
      for (int i = 0; i < n; ++i) {
        const auto p = [&](int x, int y) { return static_cast<std::uint32_t>(y * n + x % n); };
        triangles.push_back({{p(i, r), p(i, r + 1), p(i + 1, r + 1)}});
      }
  }
};

TEST(Transfer, ChartsEndAtSeamsAndMaterials) {
  const Model model = tube(12, 4);
  const auto charts = find_texture_charts(model);
  std::vector<std::uint32_t> all = charts;
  std::sort(all.begin(), all.end());
  all.erase(std::unique(all.begin(), all.end()), all.end());
  EXPECT_EQ(all.size(), 2u) << "a chart a material; the seam only opens the ring";
}

TEST(Transfer, ASurfaceOnTheModelGetsTheModelsTexture) {
  const Model model = tube(48, 8);
  const auto [points, triangles] = FineTube();
  const auto out = MaterialTransfer(model, ClosestPointQuery(model), find_texture_charts(model),
                                    {points}, triangles)
                       .all();
  ASSERT_EQ(out.corner_uvs.size(), 3 * triangles.size());
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    const Vec3 a = points[triangles[t].v[0]], b = points[triangles[t].v[1]],
               c = points[triangles[t].v[2]];
    const Vec3 middle = (a + b + c) / 3.0f;
    const Vec2 uv =
        (out.corner_uvs[3 * t] + out.corner_uvs[3 * t + 1] + out.corner_uvs[3 * t + 2]) *
        (1.0f / 3);
    float turn = std::atan2(middle.z, middle.x) / 6.2831853f;
    if (turn < 0) turn += 1;
    // Once around is where it began.
    const float off = std::abs(uv.x - turn);
    EXPECT_LT(std::min(off, 1 - off), 0.02f) << t;
    EXPECT_NEAR(uv.y, middle.y / 8, 0.02f) << t;
    const float lowest = std::min({a.y, b.y, c.y}), highest = std::max({a.y, b.y, c.y});
    if (highest < 4) {
      EXPECT_EQ(out.triangle_materials[t], 0u);
    }
    if (lowest > 4) {
      EXPECT_EQ(out.triangle_materials[t], 1u);
    }
  }
}

/// A gradient around tube(), whose ends differ at the seam.
void add_gradient(Model& model) {
  Image texture = make_image(64, 1, {"R", "G", "B"});
  for (int x = 0; x < 64; ++x)
    for (int c = 0; c < 3; ++c) texture.at(x, 0, c) = static_cast<float>(x) / 63;
  model.textures = {float_texture(texture)};
  model.materials[0].texture = model.materials[1].texture = 0;
}

TEST(Transfer, ATriangleAcrossABorderShowsItWhereTheModelHasIt) {
  Model model = tube(96, 8);
  // Dark where it begins, bright where it comes round, and no repetition hides the seam.
  constexpr float kAround = 0.7f;
  for (Vec2& uv : model.corner_uvs) uv.x *= kAround;
  add_gradient(model);
  const auto on_tube = [](float turn, float y) {
    return Vec3{std::cos(6.2831853f * turn), y, std::sin(6.2831853f * turn)};
  };
  // Across the materials' border at 4, across the seam at a turn of 0, and beside both.
  const std::vector<Vec3> at = {on_tube(0.3f, 3.6f),   on_tube(0.3f, 4.4f),   on_tube(0.34f, 4.1f),
                                on_tube(-0.02f, 1.0f), on_tube(0.02f, 1.02f), on_tube(0.01f, 1.5f),
                                on_tube(0.6f, 6.0f),   on_tube(0.6f, 6.1f),   on_tube(0.61f, 6.0f)};
  const std::vector<Triangle> triangles = {{{0, 1, 2}}, {{3, 4, 5}}, {{6, 7, 8}}};
  const ClosestPointQuery closest(model);
  const auto out =
      MaterialTransfer(model, closest, find_texture_charts(model), {at}, triangles).all();
  const std::vector<ClosestPoint> known = closest.closest(at);
  const auto same =
      MaterialTransfer(model, closest, find_texture_charts(model), {at, known}, triangles).all();
  EXPECT_EQ(same.corner_uvs, out.corner_uvs);
  EXPECT_EQ(same.border_index, out.border_index);
  ASSERT_EQ(out.border_index, (std::vector<std::uint32_t>{0, 1, TransferredMaterials::kNoBorder}));
  ASSERT_EQ(out.borders.size(), 2u);
  for (std::size_t t = 0; t < 2; ++t)
    for (int i = 0; i <= 10; ++i)
      for (int k = 0; k + i <= 10; ++k) {
        const float u = static_cast<float>(i) / 10, v = static_cast<float>(k) / 10;
        const Vec3 p = at[3 * t] * (1 - u - v) + at[3 * t + 1] * u + at[3 * t + 2] * v;
        float turn = std::atan2(p.z, p.x) / 6.2831853f;
        if (turn < 0) turn += 1;
        const TexturePoint point = texture_point(model, closest, out.borders[t], u, v);
        // On the border itself it is either.
        if (std::abs(p.y - 4) > 1e-4f) {
          EXPECT_EQ(point.material, p.y < 4 ? 0u : 1u) << p.y;
        }
        const float off = std::abs(point.uv.x / kAround - turn);
        EXPECT_LT(std::min(off, 1 - off), 1e-3f) << turn;
        EXPECT_NEAR(point.uv.y, p.y / 8, 1e-4f);
      }
}

TEST(Transfer, ASeamThatNobodySeesIsNoBorder) {
  Model model = tube(96, 8);
  model.triangle_materials.assign(model.triangles.size(), 0);
  for (Vec2& uv : model.corner_uvs) uv.x *= 0.7f;
  const std::vector<Vec3> at = {{1, 1, -0.05f}, {1, 1, 0.05f}, {1, 1.1f, 0}};
  const std::vector<Triangle> triangles = {{{0, 1, 2}}};
  const auto borders = [&] {
    return MaterialTransfer(model, ClosestPointQuery(model), find_texture_charts(model), {at},
                            triangles)
        .all()
        .borders.size();
  };
  Image texture = make_image(2, 1, {"R", "G", "B"});
  std::fill(texture.pixels.begin(), texture.pixels.end(), 0.5f);
  model.textures = {float_texture(texture)};
  model.materials[0].texture = 0;
  EXPECT_EQ(borders(), 0u);
  texture.at(1, 0, 1) = 0.9f;
  model.textures = {float_texture(texture)};
  EXPECT_EQ(borders(), 1u);
}

TEST(Transfer, TrianglesLookedUpOneByOneAreThoseOfAll) {
  for (const bool textured : {true, false}) {
    Model model = tube(96, 8);
    if (textured)
      add_gradient(model);
    else
      model.corner_uvs.clear();
    const FineTube surface;
    const ClosestPointQuery closest(model);
    const std::vector<std::uint32_t> charts = find_texture_charts(model);
    const TransferredMaterials all =
        MaterialTransfer(model, closest, charts, {surface.points}, surface.triangles).all();
    ASSERT_GT(all.borders.size(), 50u);
    const auto expected = [&](std::uint32_t t, float u, float v) -> TexturePoint {
      if (const std::uint32_t border = all.border_index[t];
          border != TransferredMaterials::kNoBorder)
        return texture_point(model, closest, all.borders[border], u, v);
      TexturePoint point{all.triangle_materials[t], {}};
      if (!textured) return point;
      const Vec2* uv = &all.corner_uvs[3 * std::size_t{t}];
      point.uv = uv[0] * (1 - u - v) + uv[1] * u + uv[2] * v;
      return point;
    };
    const MaterialTransfer transfer(model, closest, charts, {surface.points}, surface.triangles);
    // Several threads come to the triangles in other orders, and meet.
    constexpr std::uint32_t kSteps[] = {1, 7, 1009, 1, 2999};  // coprime to the number
    std::array<int, std::size(kSteps)> differing{};
    std::vector<std::thread> threads;
    for (std::size_t i = 0; i < std::size(kSteps); ++i)
      threads.emplace_back([&, i] {
        const auto count = static_cast<std::uint32_t>(surface.triangles.size());
        for (std::uint32_t k = 0, t = 0; k < count; ++k, t = (t + kSteps[i]) % count)
          for (const float u : {0.0f, 0.3f, 0.7f}) {
            const TexturePoint found = transfer.at(t, u, 0.2f), wanted = expected(t, u, 0.2f);
            differing[i] += found.material != wanted.material || !(found.uv == wanted.uv) ? 1 : 0;
          }
      });
    for (std::thread& thread : threads) thread.join();
    for (const int count : differing) EXPECT_EQ(count, 0);
  }
}

TEST(Transfer, WithoutATextureOnlyMaterialsGoAlong) {
  Model model = tube(12, 4);
  model.corner_uvs.clear();
  const std::vector<Vec3> at = {{1, 3, 0}, {0.9f, 3.2f, 0.1f}, {1, 3.4f, -0.1f}};
  const std::vector<Triangle> triangles = {{{0, 1, 2}}};
  const auto out =
      MaterialTransfer(model, ClosestPointQuery(model), find_texture_charts(model), {at}, triangles)
          .all();
  EXPECT_TRUE(out.corner_uvs.empty());
  EXPECT_EQ(out.triangle_materials, std::vector<std::uint32_t>{1});
  EXPECT_TRUE(out.border_index.empty());
  model.triangle_materials.assign(model.triangles.size(), 1);
  const ClosestPointQuery closest(model);
  const MaterialTransfer transfer(model, closest, find_texture_charts(model), {at}, triangles);
  EXPECT_TRUE(transfer.is_uniform());
  EXPECT_EQ(transfer.at(0, 0.1f, 0.1f).material, 1u);
  EXPECT_EQ(transfer.all().triangle_materials, std::vector<std::uint32_t>{1});
}

}  // namespace
}  // namespace polymorph
