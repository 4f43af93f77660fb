#include "field/distance_cache.h"

#include <gtest/gtest.h>

#include "base/cache_file.h"
#include "base/file.h"
#include "base/hash.h"
#include "base/log.h"
#include "kernels/distance_field.h"
#include "model/shapes.h"
#include "testing/model.h"

namespace polymorph {
namespace {

class DistanceCacheTest : public ::testing::Test {
 protected:
  ObjectDistances made(const Model& model, bool cached, float cell = 0.05f) {
    const auto engine = make_cpu_engine();
    const DistanceMeasure measure = {.cell = cell, .thinnest = 0.04f, .min_component_share = 0.001};
    const std::filesystem::path folder = cached ? folder_.path() : std::filesystem::path{};
    auto made =
        load_or_measure_distances(model, ClosestPointQuery(model), measure, *engine, folder);
    EXPECT_TRUE(made.ok());
    return std::move(*made);
  }
  std::filesystem::path file_of(const ObjectDistances& object) {
    return cache_path(folder_.path(), object.key, kDistanceFiles);
  }
  TemporaryFolder folder_;
};

void expect_same(const ObjectDistances& a, const ObjectDistances& b) {
  EXPECT_EQ(a.key, b.key);
  EXPECT_EQ(a.face_classes, b.face_classes);
  EXPECT_EQ(a.volume, b.volume);
  EXPECT_EQ(a.smallest_component_share, b.smallest_component_share);
  EXPECT_EQ(a.grid->values, b.grid->values);
  EXPECT_EQ(a.grid->lipschitz, b.grid->lipschitz);
  EXPECT_EQ(a.grid->grid.cell, b.grid->grid.cell);
}

TEST_F(DistanceCacheTest, GivesBackWhatWasMadeToTheBit) {
  for (const char* shape : {"torus", "cube"}) {
    const Model model = *make_shape(shape);
    const ObjectDistances fresh = made(model, false), stored = made(model, true);
    ASSERT_TRUE(std::filesystem::exists(file_of(stored))) << shape;
    const auto bytes = std::filesystem::file_size(file_of(stored));
    EXPECT_LT(bytes, fresh.grid->values.size() * sizeof(float) / 2)
        << "only distances near the surface are stored";
    const ObjectDistances read = made(model, true);
    expect_same(fresh, stored);
    expect_same(fresh, read);
  }
}

TEST_F(DistanceCacheTest, OtherModelsAndCellsHaveOtherKeys) {
  const Model torus = *make_shape("torus");
  EXPECT_NE(made(torus, true).key, made(*make_shape("cube"), true).key);
  EXPECT_NE(made(torus, true).key, made(torus, true, 0.06f).key);
}

TEST_F(DistanceCacheTest, ADamagedFileIsMadeAnew) {
  const Model model = *make_shape("torus");
  const ObjectDistances fresh = made(model, true);
  std::string bytes = *read_file(file_of(fresh));
  // 60 bytes end within the header (base/cache_file.cpp).
  for (const std::size_t cut : {bytes.size() - 1, bytes.size() / 2, std::size_t{60}}) {
    ASSERT_TRUE(write_file(file_of(fresh), bytes.substr(0, cut)).ok());
    expect_same(fresh, made(model, true));
    EXPECT_EQ(*read_file(file_of(fresh)), bytes) << "and stored again";
  }
  bytes[bytes.size() / 2] ^= 1;
  ASSERT_TRUE(write_file(file_of(fresh), bytes).ok());
  expect_same(fresh, made(model, true));
}

TEST_F(DistanceCacheTest, AVesselHasItsWallsAndIsFilledWithoutDetail) {
  const Model cup = lathe({{0, 0}, {1, 0}, {1, 2}});
  const ObjectDistances object = made(cup, true);
  ASSERT_TRUE(object.is_vessel);
  EXPECT_FALSE(is_shell(object));
  EXPECT_NEAR(object.volume, 2 * M_PI, 0.1 * 2 * M_PI) << "the volume is that of the filled vessel";
  // `smooth` (remove_detail()) fills the vessel.
  const DistanceField walls(object.grid->grid, object.grid->values.data()),
      filled(object.smooth->grid, object.smooth->values.data());
  const auto at = [](const DistanceField& field, Vec3 p) {
    return field.value(Points<float>{p.x, p.y, p.z});
  };
  EXPECT_GT(at(walls, {1, 1, 0}), 0);
  EXPECT_GT(at(walls, {0, 0, 0.5f}), 0) << "the bottom";
  EXPECT_LT(at(walls, {0, 1, 0}), 0);
  EXPECT_LT(at(walls, {0, 2.1f, 0}), 0);
  EXPECT_GT(at(filled, {0, 1, 0}), 0.5f);
  EXPECT_LT(at(filled, {0, 2.1f, 0}), 0);
  // Where a quarter of the detail is gone, the walls have grown, but the middle is still empty.
  const auto mix = [&](Vec3 p) { return 0.75f * at(walls, p) + 0.25f * at(filled, p); };
  EXPECT_GT(mix({0.7f, 1, 0}), 0);
  EXPECT_LT(mix({0, 1, 0}), 0);
  const ObjectDistances stored = made(cup, true);
  EXPECT_TRUE(stored.is_vessel);
  expect_same(object, stored);
}

/// If this fails because the distances were changed on purpose, raise kDistancesVersion and put the
/// new digests here. Otherwise files of an older program would be taken for this one's.
TEST_F(DistanceCacheTest, TheVersionBelongsToTheseDistances) {
  const auto digest = [&](const Model& model) {
    const ObjectDistances object = made(model, false);
    Hasher hasher;
    hasher.add(std::span<const float>(object.grid->values)).add(object.volume);
    hasher.add(std::span<const FaceClass>(object.face_classes))
        .add(object.smallest_component_share)
        .add(object.genus);
    return hasher.hex();
  };
  EXPECT_EQ(kDistancesVersion, 13u);
  EXPECT_EQ(digest(*make_shape("torus")), "5e8d05bc56091e5b2f408b13aed6c8f8");
  EXPECT_EQ(digest(box_model({0, 0, 0}, {1, 0.5f, 0.06f})), "1b32f0bdc9eab338998c2e7f7718cf1c");
}

}  // namespace
}  // namespace polymorph
