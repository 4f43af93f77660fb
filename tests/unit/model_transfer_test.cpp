#include "model/query/transfer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "model/mesh/shapes.h"

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

TEST(Transfer, ChartsEndAtSeamsAndMaterials) {
  const Model model = tube(12, 4);
  const auto charts = texture_charts(model);
  std::vector<std::uint32_t> all = charts;
  std::sort(all.begin(), all.end());
  all.erase(std::unique(all.begin(), all.end()), all.end());
  EXPECT_EQ(all.size(), 2u) << "a chart a material; the seam only opens the ring";
}

TEST(Transfer, ASurfaceOnTheModelGetsTheModelsTexture) {
  const Model model = tube(48, 8);
  // Another, finer tube on it, turned so that its triangles cross the seam.
  const int n = 100;
  std::vector<Vec3> points;
  std::vector<Triangle> triangles;
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
  const auto out =
      transfer_materials(model, ClosestPointQuery(model), texture_charts(model), points, triangles);
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

TEST(Transfer, WithoutATextureOnlyMaterialsGoAlong) {
  Model model = tube(12, 4);
  model.corner_uvs.clear();
  const std::vector<Vec3> at = {{1, 3, 0}, {0.9f, 3.2f, 0.1f}, {1, 3.4f, -0.1f}};
  const std::vector<Triangle> triangles = {{{0, 1, 2}}};
  const auto out =
      transfer_materials(model, ClosestPointQuery(model), texture_charts(model), at, triangles);
  EXPECT_TRUE(out.corner_uvs.empty());
  EXPECT_EQ(out.triangle_materials, std::vector<std::uint32_t>{1});
}

}  // namespace
}  // namespace polymorph
