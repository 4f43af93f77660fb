// Helpers of the model and spheres tests: a folder that goes away, and small solids.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

#include "model/model.h"

namespace polymorph {

class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "polymorph-test-XXXXXX").string();
    if (!::mkdtemp(name.data())) throw std::runtime_error("cannot make a temporary folder");
    path_ = name;
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::permissions(path_, std::filesystem::perms::owner_all, ignored);
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path write(const std::string& name, std::string_view bytes) const {
    const std::filesystem::path file = path_ / name;
    std::filesystem::create_directories(file.parent_path());
    std::ofstream(file, std::ios::binary)
        .write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    return file;
  }

 private:
  std::filesystem::path path_;
};

/// Adds the box [low, high], 12 triangles, outward or (inverted) inward.
inline void add_box(Model& model, Vec3 low, Vec3 high, bool inverted = false) {
  const auto base = static_cast<std::uint32_t>(model.points.size());
  for (int i = 0; i < 8; ++i)
    model.points.push_back(
        {i & 1 ? high.x : low.x, i & 2 ? high.y : low.y, i & 4 ? high.z : low.z});
  static constexpr std::array<std::array<std::uint32_t, 4>, 6> kSides{
      {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}}};
  for (const auto& s : kSides)
    for (const auto& t : {std::array{s[0], s[1], s[2]}, std::array{s[0], s[2], s[3]}})
      model.triangles.push_back(inverted ? Triangle{{base + t[0], base + t[2], base + t[1]}}
                                         : Triangle{{base + t[0], base + t[1], base + t[2]}});
}

inline Model box_model(Vec3 low, Vec3 high) {
  Model model;
  model.name = "box";
  add_box(model, low, high);
  return model;
}

/// The unit cube [0, 1]^3 as OBJ text, outward quads, no normals.
inline constexpr const char* kCubeObj =
    "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nv 0 0 1\nv 1 0 1\nv 0 1 1\nv 1 1 1\n"
    "f 1 5 7 3\nf 2 4 8 6\nf 1 2 6 5\nf 3 7 8 4\nf 1 3 4 2\nf 5 6 8 7\n";

inline bool any_contains(const std::vector<std::string>& lines, std::string_view text) {
  for (const std::string& line : lines)
    if (line.find(text) != std::string::npos) return true;
  return false;
}

}  // namespace polymorph
