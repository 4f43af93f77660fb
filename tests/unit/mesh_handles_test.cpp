#include "mesh/handles.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "mesh/mesh_check.h"

namespace polymorph {
namespace {

constexpr float kTurn = 2 * std::numbers::pi_v<float>;

/// A torus around the z axis.
void add_torus(Mesh& mesh, Vec3 center, float ring, float tube) {
  constexpr std::uint32_t kAround = 48, kThrough = 24;
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  for (std::uint32_t i = 0; i < kAround; ++i)
    for (std::uint32_t k = 0; k < kThrough; ++k) {
      const float a = kTurn * static_cast<float>(i) / kAround,
                  b = kTurn * static_cast<float>(k) / kThrough;
      const Vec3 out = {std::cos(a), std::sin(a), 0};
      const Vec3 normal = out * std::cos(b) + Vec3{0, 0, std::sin(b)};
      mesh.positions.push_back(center + out * ring + normal * tube);
      mesh.normals.push_back(normal);
    }
  const auto at = [&](std::uint32_t i, std::uint32_t k) {
    return first + i % kAround * kThrough + k % kThrough;
  };
  for (std::uint32_t i = 0; i < kAround; ++i)
    for (std::uint32_t k = 0; k < kThrough; ++k) {
      mesh.triangles.push_back({{at(i, k), at(i + 1, k), at(i + 1, k + 1)}});
      mesh.triangles.push_back({{at(i, k), at(i + 1, k + 1), at(i, k + 1)}});
    }
}

Mesh torus(float ring, float tube) {
  Mesh mesh;
  add_torus(mesh, {}, ring, tube);
  return mesh;
}

void expect_sound(const Mesh& mesh, std::size_t components, long long genus) {
  const MeshReport report = check_mesh(mesh);
  EXPECT_TRUE(report.is_manifold());
  EXPECT_EQ(report.components, components);
  EXPECT_EQ(report.genus, genus);
  EXPECT_EQ(compute_genus(mesh), genus);
  ASSERT_EQ(mesh.normals.size(), mesh.positions.size());
  for (const Vec3 n : mesh.normals) EXPECT_NEAR(length(n), 1, 1e-4);
}

TEST(Handles, AThinRingIsCutThrough) {
  Mesh mesh = torus(1, 0.1f);
  expect_sound(mesh, 1, 1);
  const double before = volume_of(mesh);
  EXPECT_EQ(cut_handles(mesh, 0, 1), 1u);
  expect_sound(mesh, 1, 0);
  EXPECT_LT(volume_of(mesh), before);
  EXPECT_GT(volume_of(mesh), 0.85 * before);
}

TEST(Handles, ANarrowHoleIsFilled) {
  Mesh mesh = torus(0.45f, 0.4f);
  const double before = volume_of(mesh);
  EXPECT_EQ(cut_handles(mesh, 0, 1), 1u);
  expect_sound(mesh, 1, 0);
  EXPECT_GT(volume_of(mesh), before);
  EXPECT_LT(volume_of(mesh), 1.1 * before);
}

TEST(Handles, NothingHappensToThoseThatMayBeOrAreThick) {
  const Mesh before = torus(1, 0.1f);
  Mesh mesh = before;
  EXPECT_EQ(cut_handles(mesh, 1, 10), 0u);
  EXPECT_EQ(cut_handles(mesh, 0, 0.95f * kTurn * 0.1f), 0u) << "shorter than the way around";
  EXPECT_EQ(mesh.positions, before.positions);
}

TEST(Handles, TheThinnestOfSeveralGoesFirst) {
  Mesh mesh = torus(1, 0.2f);
  add_torus(mesh, {5, 0, 0}, 1, 0.1f);
  expect_sound(mesh, 2, 2);
  EXPECT_EQ(cut_handles(mesh, 1, 2), 1u);
  expect_sound(mesh, 2, 1);
  // The thick one is as it was.
  const Mesh thick = torus(1, 0.2f);
  for (std::size_t v = 0; v < thick.positions.size(); ++v)
    EXPECT_EQ(mesh.positions[v], thick.positions[v]);
  EXPECT_EQ(cut_handles(mesh, 0, 2), 1u);
  expect_sound(mesh, 2, 0);
}

TEST(Handles, ALoopAroundALimbIsNoHandle) {
  // A ring that was cut is a limb: loops around it are short, and cutting them would take its end.
  Mesh mesh = torus(1, 0.05f);
  ASSERT_EQ(cut_handles(mesh, 0, 1), 1u);
  const Mesh limb = mesh;
  add_torus(mesh, {5, 0, 0}, 1, 0.2f);
  EXPECT_EQ(cut_handles(mesh, 0, 2), 1u);
  expect_sound(mesh, 2, 0);
  for (std::size_t v = 0; v < limb.positions.size(); ++v)
    EXPECT_EQ(mesh.positions[v], limb.positions[v]);
}

}  // namespace
}  // namespace polymorph
