#include "model/load/ply_velocities.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>

#include "base/file.h"
#include "testing/temporary_folder.h"

namespace polymorph {
namespace {

class PlyVelocities : public FolderTest {
 protected:
  std::vector<PointVelocity> read(const std::string& bytes) {
    EXPECT_TRUE(write_file(folder / "a.ply", bytes).ok());
    return load_ply_velocities(folder / "a.ply");
  }
  static std::string header(const std::string& format, const std::string& more = "") {
    return "ply\nformat " + format + " 1.0\ncomment vx is a velocity\nelement vertex 2\n" +
           "property float x\nproperty float y\nproperty float z\nproperty uchar red\n" +
           "property double vz\nproperty float vx\nproperty float vy\n" + more +
           "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
  }
  static void check(const std::vector<PointVelocity>& points) {
    ASSERT_EQ(points.size(), 2u);
    EXPECT_EQ(points[0].point, (Vec3{1, 2, 3}));
    EXPECT_EQ(points[0].velocity, (Vec3{4, 5, 6}));
    EXPECT_EQ(points[1].point, (Vec3{-1, 0.5f, 7}));
    EXPECT_EQ(points[1].velocity, (Vec3{0, -2, 0.25f}));
  }
  /// The vertices above in bytes, those of each number turned round for `big`.
  static std::string body(bool big) {
    std::string bytes;
    const auto add = [&](auto value) {
      char raw[sizeof value];
      std::memcpy(raw, &value, sizeof value);
      if (big) std::reverse(raw, raw + sizeof value);
      bytes.append(raw, sizeof value);
    };
    const float rows[2][6] = {{1, 2, 3, 4, 5, 6}, {-1, 0.5f, 7, 0, -2, 0.25f}};
    for (const auto& row : rows) {
      for (int i = 0; i < 3; ++i) add(row[i]);
      bytes += '\x7f';
      add(static_cast<double>(row[5]));
      add(row[3]);
      add(row[4]);
    }
    return bytes;
  }
};

TEST_F(PlyVelocities, AreReadFromAllEncodings) {
  check(read(header("ascii") + "1 2 3 127 6 4 5\n-1 .5 7 127 .25 0 -2\n3 0 1 0\n"));
  check(read(header("binary_little_endian") + body(false)));
  check(read(header("binary_big_endian") + body(true)));
}

TEST_F(PlyVelocities, AreNoneWhereTheFileHasNoneOrIsBroken) {
  EXPECT_TRUE(read("").empty());
  EXPECT_TRUE(read("v 0 0 0\n").empty());
  EXPECT_TRUE(read("ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
                   "property float z\nend_header\n1 2 3\n")
                  .empty());
  EXPECT_TRUE(read(header("ascii") + "1 2 3 127 6 4\n").empty());
  EXPECT_TRUE(read(header("binary_little_endian") + body(false).substr(1)).empty());
  EXPECT_TRUE(read(header("ascii", "property list uchar int neighbours\n")).empty());
  EXPECT_TRUE(load_ply_velocities(folder / "none.ply").empty());
}

}  // namespace
}  // namespace polymorph
